//! Elimination tree, supernodes and their merging, on the graph of nodes.

use crate::nodes::Nodes;

/// No parent.
pub(crate) const ROOT: u32 = u32::MAX;

/// A supernode may grow to this many columns while at most this share of its entries are zeros kept for speed. Found on
/// solid, shell and frame models: wider limits cost operations, narrower ones leave fronts too small for the kernels.
const MERGE: [(f64, f64); 3] = [(12.0, 0.9), (32.0, 0.25), (96.0, 0.1)];

/// Share of zeros allowed in wider supernodes.
const MERGE_WIDE: f64 = 0.03;

/// Supernodes in postorder: every child stands before its parent and a subtree is one range.
#[derive(Debug)]
pub(crate) struct Tree {
    /// Nodes in order of elimination.
    pub(crate) order: Vec<u32>,
    /// Supernode s holds the positions `first[s]..first[s + 1]` of `order`.
    pub(crate) first: Vec<u32>,
    /// Parent supernode or [`ROOT`].
    pub(crate) parent: Vec<u32>,
    /// Positions of the nodes coupled below each supernode, rising.
    pub(crate) rows: Vec<Vec<u32>>,
}

/// A supernode while supernodes are merged.
#[derive(Debug, Clone)]
struct Group {
    members: Vec<u32>,
    columns: f64,
    below: f64,
    zeros: f64,
    parent: u32,
}

impl Group {
    fn entries(&self) -> f64 {
        0.5 * self.columns * (self.columns + 1.0) + self.columns * self.below
    }
}

impl Tree {
    /// The supernodes of the factor under an order of nodes; the order is changed to an equivalent postorder.
    pub(crate) fn new(nodes: &Nodes, order: &[u32]) -> Self {
        let (parent, below) = nodes.elimination(order);
        let sequence = postorder(&parent);
        let mut groups = supernodes(nodes, order, &parent, &below, &sequence);
        let mut children = vec![Vec::new(); groups.len()];
        for g in 0..groups.len() {
            merge(&mut groups, &mut children, g);
            if groups[g].parent != ROOT {
                children[groups[g].parent as usize].push(g as u32);
            }
        }
        Self::layout(nodes, order, &groups, &mut children)
    }

    /// Renumbers what merging left, children with the largest fronts first, and finds the rows of each supernode.
    fn layout(nodes: &Nodes, order: &[u32], groups: &[Group], children: &mut [Vec<u32>]) -> Self {
        let size = |g: u32| groups[g as usize].columns + groups[g as usize].below;
        let alive = (0..groups.len() as u32).filter(|&g| !groups[g as usize].members.is_empty());
        // the stack holds roots and children so that the last pushed comes first
        let mut stack: Vec<(u32, bool)> =
            alive.filter(|&g| groups[g as usize].parent == ROOT).rev().map(|g| (g, false)).collect();
        let mut tree =
            Self { order: Vec::with_capacity(order.len()), first: vec![0], parent: vec![], rows: vec![] };
        let mut label = vec![ROOT; groups.len()];
        while let Some((g, done)) = stack.pop() {
            let own = &mut children[g as usize];
            if !done {
                own.sort_by(|&a, &b| size(a).total_cmp(&size(b)).then(b.cmp(&a)));
                stack.push((g, true));
                stack.extend(own.iter().map(|&c| (c, false)));
                continue;
            }
            label[g as usize] = tree.parent.len() as u32;
            own.iter().for_each(|&c| tree.parent[label[c as usize] as usize] = label[g as usize]);
            let mut members = groups[g as usize].members.clone();
            members.sort_unstable();
            tree.order.extend(members.iter().map(|&m| order[m as usize]));
            tree.first.push(tree.order.len() as u32);
            tree.parent.push(ROOT);
        }
        tree.find_rows(nodes);
        tree
    }

    fn find_rows(&mut self, nodes: &Nodes) {
        let n = self.order.len();
        let mut at = vec![0u32; n];
        self.order.iter().enumerate().for_each(|(new, &old)| at[old as usize] = new as u32);
        let mut mark = vec![ROOT; n];
        self.rows = vec![Vec::new(); self.parent.len()];
        let mut children = vec![Vec::new(); self.parent.len()];
        for s in 0..self.parent.len() {
            let end = self.first[s + 1];
            let mut rows = Vec::new();
            let mut take = |r: u32| {
                if r >= end && mark[r as usize] != s as u32 {
                    mark[r as usize] = s as u32;
                    rows.push(r);
                }
            };
            for position in self.first[s]..end {
                nodes
                    .neighbours(self.order[position as usize] as usize)
                    .iter()
                    .for_each(|&h| take(at[h as usize]));
            }
            for &c in &children[s] {
                let child: &Vec<u32> = &self.rows[c as usize];
                child.iter().for_each(|&r| take(r));
            }
            rows.sort_unstable();
            self.rows[s] = rows;
            if self.parent[s] != ROOT {
                children[self.parent[s] as usize].push(s as u32);
            }
        }
    }
}

/// Children before parents, each subtree in one piece.
fn postorder(parent: &[u32]) -> Vec<u32> {
    let n = parent.len();
    let (mut head, mut next) = (vec![ROOT; n + 1], vec![ROOT; n]);
    for j in (0..n).rev() {
        let p = if parent[j] == ROOT { n } else { parent[j] as usize };
        next[j] = head[p];
        head[p] = j as u32;
    }
    let mut out = Vec::with_capacity(n);
    let mut stack = vec![];
    let mut at = head[n];
    loop {
        while at != ROOT {
            stack.push(at);
            at = head[at as usize];
        }
        let Some(j) = stack.pop() else { return out };
        out.push(j);
        at = next[j as usize];
        if at == ROOT && stack.is_empty() {
            return out;
        }
    }
}

/// Maximal runs of the postorder whose columns have one structure. Members are positions of the given order.
fn supernodes(nodes: &Nodes, order: &[u32], parent: &[u32], below: &[f64], sequence: &[u32]) -> Vec<Group> {
    let weight = |j: u32| nodes.dofs[order[j as usize] as usize].len() as f64;
    let mut groups: Vec<Group> = Vec::new();
    let mut of = vec![ROOT; sequence.len()];
    for (k, &j) in sequence.iter().enumerate() {
        let continues = k > 0 && {
            let i = sequence[k - 1];
            parent[i as usize] == j && below[i as usize] == below[j as usize] + weight(j)
        };
        if !continues {
            groups.push(Group { members: vec![], columns: 0.0, below: 0.0, zeros: 0.0, parent: ROOT });
        }
        of[j as usize] = groups.len() as u32 - 1;
        let group = groups.last_mut().expect("a group was just opened");
        group.members.push(j);
        group.columns += weight(j);
        group.below = below[j as usize];
    }
    for g in &mut groups {
        let last = *g.members.last().expect("groups have members") as usize;
        g.parent = if parent[last] == ROOT { ROOT } else { of[parent[last] as usize] };
    }
    groups
}

/// Draws children into supernode `p` while the zeros this keeps stay within the limits, cheapest child first.
fn merge(groups: &mut [Group], children: &mut [Vec<u32>], p: usize) {
    let mut own = std::mem::take(&mut children[p]);
    let extra = |c: &Group, p: &Group| c.columns * (p.columns + p.below - c.below);
    own.sort_by(|&a, &b| {
        let cost = |c: u32| extra(&groups[c as usize], &groups[p]);
        cost(a).total_cmp(&cost(b)).then(a.cmp(&b))
    });
    let mut kept = Vec::new();
    for c in own {
        let (child, group) = (&groups[c as usize], &groups[p]);
        let mut merged = group.clone();
        merged.columns += child.columns;
        merged.zeros += child.zeros + extra(child, group);
        let limit = MERGE.iter().find(|m| merged.columns <= m.0).map_or(MERGE_WIDE, |m| m.1);
        if merged.zeros <= limit * merged.entries() {
            let moved = std::mem::take(&mut groups[c as usize].members);
            merged.members.extend(moved);
            groups[p] = merged;
            kept.extend(std::mem::take(&mut children[c as usize]));
        } else {
            kept.push(c);
        }
    }
    children[p] = kept;
}
