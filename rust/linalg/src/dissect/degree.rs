//! Approximate minimum degree (Amestoy, Davis, Duff 1996) with weighted vertices and stages.

use super::graph::Graph;

const NONE: u32 = u32::MAX;

/// Eliminates vertices stage by stage, inside a stage by least approximate degree, and returns their order.
///
/// The degrees of a stage count its neighbours of later stages too, so that the leaves of a dissection are ordered in
/// sight of the separators around them, and each separator as the elimination before it has left it.
pub(crate) fn minimum_degree(graph: &Graph, stage: &[u32]) -> Vec<u32> {
    let mut sequence: Vec<u32> = (0..graph.len() as u32).collect();
    sequence.sort_by_key(|&v| stage[v as usize]);
    let mut quotient = Quotient::new(graph, stage);
    for members in sequence.chunk_by(|&a, &b| stage[a as usize] == stage[b as usize]) {
        quotient.eliminate(members);
    }
    quotient.order
}

/// What a vertex of the quotient graph is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Variable,
    Element,
    /// Eliminated with another vertex, or an element inside another one.
    Absorbed,
}

/// The quotient graph: variables still to be eliminated and elements, the cliques that eliminated ones left.
struct Quotient<'a> {
    stage: &'a [u32],
    state: Vec<State>,
    /// DOFs of a variable with all that merged into it.
    weight: Vec<i64>,
    /// Variables beside a variable, or in an element.
    variables: Vec<Vec<u32>>,
    /// Elements that a variable is in.
    elements: Vec<Vec<u32>>,
    degree: Vec<i64>,
    /// Vertices that go with this one, as a list from each.
    merged: Vec<Vec<u32>>,
    /// Weight of an element outside the pivot's, valid where `seen` is the round.
    outside: Vec<i64>,
    seen: Vec<u32>,
    /// Membership in the pivot's element, by round.
    inside: Vec<u32>,
    round: u32,
    left: i64,
    buckets: Buckets,
    order: Vec<u32>,
}

impl<'a> Quotient<'a> {
    fn new(graph: &Graph, stage: &'a [u32]) -> Self {
        let n = graph.len();
        let weight: Vec<i64> = (0..n as u32).map(|v| graph.weight(v)).collect();
        let degree: Vec<i64> =
            (0..n as u32).map(|v| graph.neighbours(v).iter().map(|&u| graph.weight(u)).sum()).collect();
        Self {
            stage,
            state: vec![State::Variable; n],
            variables: (0..n as u32).map(|v| graph.neighbours(v).to_vec()).collect(),
            elements: vec![vec![]; n],
            merged: vec![vec![]; n],
            outside: vec![0; n],
            seen: vec![0; n],
            inside: vec![0; n],
            round: 0,
            left: graph.total(),
            buckets: Buckets::new(n, graph.total() as usize),
            order: Vec::with_capacity(n),
            weight,
            degree,
        }
    }

    fn eliminate(&mut self, members: &[u32]) {
        self.buckets.least = 0;
        for &v in members.iter().rev() {
            if self.state[v as usize] == State::Variable {
                self.buckets.insert(v, self.degree[v as usize]);
            }
        }
        while let Some(pivot) = self.buckets.pop() {
            self.pivot(pivot);
        }
    }

    /// A vertex and all that merged into it join the order.
    fn emit(&mut self, v: u32) {
        let mut stack = vec![v];
        while let Some(v) = stack.pop() {
            self.order.push(v);
            stack.append(&mut self.merged[v as usize]);
        }
    }

    fn pivot(&mut self, p: u32) {
        let stage = self.stage[p as usize];
        self.round += 1;
        let mut front = self.gather(p);
        self.left -= self.weight[p as usize];
        self.emit(p);
        self.state[p as usize] = State::Element;
        let mut size: i64 = front.iter().map(|&i| self.weight[i as usize]).sum();
        for &i in &front {
            for &e in &self.elements[i as usize] {
                let e = e as usize;
                if self.state[e] != State::Element {
                    continue;
                }
                if self.seen[e] != self.round {
                    self.seen[e] = self.round;
                    self.outside[e] = self.degree[e];
                }
                self.outside[e] -= self.weight[i as usize];
            }
        }
        let mut hashes: Vec<(u64, u32)> = Vec::with_capacity(front.len());
        for &i in &front {
            let (near, hash) = self.update(i, p);
            if near == 0 && self.stage[i as usize] == stage {
                // nothing beyond the pivot's element: it goes with the pivot
                self.buckets.remove(i);
                self.left -= self.weight[i as usize];
                size -= self.weight[i as usize];
                self.state[i as usize] = State::Absorbed;
                self.emit(i);
                continue;
            }
            self.degree[i as usize] = self.degree[i as usize].min(near);
            hashes.push((hash, i));
        }
        // degrees above lack the pivot's element, whose size is known only now
        self.merge(&mut hashes);
        front.retain(|&i| self.state[i as usize] == State::Variable);
        for &i in &front {
            let k = i as usize;
            let within = size - self.weight[k];
            self.degree[k] = (self.degree[k] + within).min(self.left - self.weight[k]);
            if self.buckets.contains(i) || self.stage[k] == stage {
                self.buckets.remove(i);
                self.buckets.insert(i, self.degree[k]);
            }
        }
        if front.is_empty() {
            self.state[p as usize] = State::Absorbed;
        }
        self.degree[p as usize] = size;
        self.variables[p as usize] = front;
        self.elements[p as usize] = vec![];
    }

    /// Variables of the element that the pivot becomes; the elements it was in are absorbed.
    fn gather(&mut self, p: u32) -> Vec<u32> {
        let round = self.round;
        self.inside[p as usize] = round;
        let mut front = Vec::new();
        let mut lists = std::mem::take(&mut self.elements[p as usize]);
        lists.push(p);
        for e in lists {
            if e != p && self.state[e as usize] != State::Element {
                continue;
            }
            for v in std::mem::take(&mut self.variables[e as usize]) {
                if self.state[v as usize] == State::Variable && self.inside[v as usize] != round {
                    self.inside[v as usize] = round;
                    front.push(v);
                }
            }
            if e != p {
                self.state[e as usize] = State::Absorbed;
            }
        }
        front
    }

    /// Cleans the lists of a variable of the pivot's element; its weight of neighbours outside that element and a hash.
    fn update(&mut self, i: u32, p: u32) -> (i64, u64) {
        let (state, outside, round) = (&mut self.state, &self.outside, self.round);
        let (mut near, mut hash) = (0, u64::from(p));
        let mut elements = std::mem::take(&mut self.elements[i as usize]);
        elements.retain(|&e| {
            if state[e as usize] != State::Element {
                return false;
            }
            if outside[e as usize] == 0 {
                // all of it lies in the pivot's element
                state[e as usize] = State::Absorbed;
                return false;
            }
            near += outside[e as usize];
            hash = hash.wrapping_add(u64::from(e));
            true
        });
        let (inside, weight) = (&self.inside, &self.weight);
        self.variables[i as usize].retain(|&v| {
            if state[v as usize] != State::Variable || inside[v as usize] == round {
                return false;
            }
            near += weight[v as usize];
            hash = hash.wrapping_add(u64::from(v));
            true
        });
        elements.push(p);
        self.elements[i as usize] = elements;
        (near, hash)
    }

    /// Joins variables of equal adjacency and stage.
    fn merge(&mut self, hashes: &mut [(u64, u32)]) {
        hashes.sort_by_key(|&(hash, _)| hash);
        for alike in hashes.chunk_by(|a, b| a.0 == b.0) {
            for (k, &(_, i)) in alike.iter().enumerate() {
                if self.state[i as usize] != State::Variable {
                    continue;
                }
                for &(_, j) in &alike[k + 1..] {
                    if self.state[j as usize] == State::Variable && self.equal(i, j) {
                        self.buckets.remove(j);
                        self.state[j as usize] = State::Absorbed;
                        self.weight[i as usize] += self.weight[j as usize];
                        self.merged[i as usize].push(j);
                        self.variables[j as usize] = vec![];
                        self.elements[j as usize] = vec![];
                    }
                }
            }
        }
    }

    fn equal(&mut self, i: u32, j: u32) -> bool {
        let (i, j) = (i as usize, j as usize);
        let same = |a: &[u32], b: &[u32]| {
            a.len() == b.len() && {
                let (mut a, mut b) = (a.to_vec(), b.to_vec());
                a.sort_unstable();
                b.sort_unstable();
                a == b
            }
        };
        self.stage[i] == self.stage[j]
            && same(&self.elements[i], &self.elements[j])
            && same(&self.variables[i], &self.variables[j])
    }
}

/// Variables by degree; of equal degrees the one inserted last comes first.
struct Buckets {
    head: Vec<u32>,
    next: Vec<u32>,
    previous: Vec<u32>,
    /// Bucket of each variable or [`NONE`].
    of: Vec<u32>,
    least: usize,
}

impl Buckets {
    fn new(n: usize, largest: usize) -> Self {
        Self {
            head: vec![NONE; largest + 1],
            next: vec![NONE; n],
            previous: vec![NONE; n],
            of: vec![NONE; n],
            least: 0,
        }
    }

    fn contains(&self, v: u32) -> bool {
        self.of[v as usize] != NONE
    }

    fn insert(&mut self, v: u32, degree: i64) {
        let d = degree.clamp(0, self.head.len() as i64 - 1) as usize;
        let first = self.head[d];
        (self.next[v as usize], self.previous[v as usize]) = (first, NONE);
        if first != NONE {
            self.previous[first as usize] = v;
        }
        self.head[d] = v;
        self.of[v as usize] = d as u32;
        self.least = self.least.min(d);
    }

    fn remove(&mut self, v: u32) {
        let d = self.of[v as usize];
        if d == NONE {
            return;
        }
        let (next, previous) = (self.next[v as usize], self.previous[v as usize]);
        match previous {
            NONE => self.head[d as usize] = next,
            p => self.next[p as usize] = next,
        }
        if next != NONE {
            self.previous[next as usize] = previous;
        }
        self.of[v as usize] = NONE;
    }

    /// The variable of least degree.
    fn pop(&mut self) -> Option<u32> {
        while self.least < self.head.len() {
            let v = self.head[self.least];
            if v != NONE {
                self.remove(v);
                return Some(v);
            }
            self.least += 1;
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::super::graph::grid;
    use super::*;

    #[test]
    fn a_path_fills_in_nothing() {
        let graph = grid([1, 1, 200]);
        let order = minimum_degree(&graph, &[0; 200]);
        let mut at = vec![0; 200];
        order.iter().enumerate().for_each(|(k, &v)| at[v as usize] = k);
        // without fill each vertex has at most one neighbour left when its turn comes
        let left = |v: u32| graph.neighbours(v).iter().filter(|&&u| at[u as usize] > at[v as usize]).count();
        assert!((0..200).all(|v| left(v) <= 1));
    }

    #[test]
    fn stages_follow_each_other() {
        let graph = grid([6, 6, 6]);
        let stage: Vec<u32> = (0..216).map(|v| v * 7 % 5).collect();
        let order = minimum_degree(&graph, &stage);
        assert!(order.is_sorted_by_key(|&v| stage[v as usize]));
        let mut sorted = order;
        sorted.sort_unstable();
        assert!(sorted.into_iter().eq(0..216));
    }
}
