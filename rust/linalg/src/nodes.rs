//! The graph of nodes: DOFs with identical adjacency merged, with the orderings that run on it.

use std::collections::HashMap;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::amd;

use crate::{LinalgError, Pattern};

/// DOFs that a node may have when they are joined by likeness.
const NODE_DOFS: usize = 6;

/// Share of common neighbours from which two consecutive DOFs belong to one node. Neighbouring nodes of a regular mesh of
/// solids share 0.5, on its faces 0.67.
const ALIKE: f64 = 0.75;

/// The graph of nodes: DOFs grouped by identical closed adjacency.
pub(crate) struct Nodes {
    /// DOFs of each node, rising.
    pub(crate) dofs: Vec<Vec<u32>>,
    ptr: Vec<u32>,
    adj: Vec<u32>,
}

impl Nodes {
    pub(crate) fn new(pattern: &Pattern) -> Self {
        let n = pattern.n();
        let mut group = vec![u32::MAX; n];
        let mut dofs: Vec<Vec<u32>> = Vec::new();
        let mut by_hash: HashMap<u64, Vec<u32>> = HashMap::new();
        for j in 0..n {
            let found = by_hash.entry(hash(pattern, j)).or_default();
            let same =
                found.iter().copied().find(|&g| closed_equal(pattern, dofs[g as usize][0] as usize, j));
            let g = same.unwrap_or_else(|| {
                found.push(dofs.len() as u32);
                dofs.push(Vec::new());
                dofs.len() as u32 - 1
            });
            dofs[g as usize].push(j as u32);
            group[j] = g;
        }
        join_alike(pattern, &mut dofs, &mut group);
        let mut seen = vec![u32::MAX; dofs.len()];
        let (mut ptr, mut adj) = (vec![0u32], Vec::new());
        for (g, members) in dofs.iter().enumerate() {
            seen[g] = g as u32;
            let first = adj.len();
            for &member in members {
                for &i in pattern.column(member as usize) {
                    let h = group[i as usize];
                    if seen[h as usize] != g as u32 {
                        seen[h as usize] = g as u32;
                        adj.push(h);
                    }
                }
            }
            adj[first..].sort_unstable();
            ptr.push(adj.len() as u32);
        }
        Self { dofs, ptr, adj }
    }

    pub(crate) fn len(&self) -> usize {
        self.dofs.len()
    }

    pub(crate) fn neighbours(&self, g: usize) -> &[u32] {
        &self.adj[self.ptr[g] as usize..self.ptr[g + 1] as usize]
    }

    /// Elimination tree under an order (parents by position, `u32::MAX` for roots) and the DOFs below each position's own
    /// in its column of the factor, by walking row subtrees (Liu 1990).
    pub(crate) fn elimination(&self, order: &[u32]) -> (Vec<u32>, Vec<f64>) {
        let n = self.len();
        let mut at = vec![0u32; n];
        order.iter().enumerate().for_each(|(new, &old)| at[old as usize] = new as u32);
        let (mut parent, mut mark) = (vec![u32::MAX; n], vec![u32::MAX; n]);
        let mut below = vec![0.0f64; n];
        for i in 0..n {
            mark[i] = i as u32;
            let old = order[i] as usize;
            let weight = self.dofs[old].len() as f64;
            for &h in self.neighbours(old) {
                let mut k = at[h as usize] as usize;
                while k < i && mark[k] != i as u32 {
                    mark[k] = i as u32;
                    below[k] += weight;
                    if parent[k] == u32::MAX {
                        parent[k] = i as u32;
                    }
                    k = parent[k] as usize;
                }
            }
        }
        (parent, below)
    }

    /// Exact operations (squared column counts) and entries of the factor under an order of nodes.
    pub(crate) fn cost(&self, order: &[u32]) -> (f64, f64) {
        let (_, below) = self.elimination(order);
        let (mut flops, mut nnz) = (0.0, 0.0);
        for (i, &old) in order.iter().enumerate() {
            for d in 0..self.dofs[old as usize].len() {
                let count = below[i] + (d + 1) as f64;
                flops += count * count;
                nnz += count;
            }
        }
        (flops, nnz)
    }

    pub(crate) fn amd(&self) -> Result<Vec<u32>, LinalgError> {
        minimum_degree(&self.ptr, &self.adj)
    }

    pub(crate) fn dissection(&self, seed: u64) -> Result<Vec<u32>, LinalgError> {
        let ptr: Vec<i32> = self.ptr.iter().map(|&v| v as i32).collect();
        let adj: Vec<i32> = self.adj.iter().map(|&v| v as i32).collect();
        let fail = |text: String| LinalgError::Library(format!("nested dissection failed: {text}"));
        let graph = feral_metis::CscPattern::new(self.len(), &ptr, &adj)
            .ok_or_else(|| fail("graph too large".into()))?;
        let options = feral_metis::MetisOptions { seed, ..Default::default() };
        let (order, ..) =
            feral_metis::metis_order_full(&graph, &options).map_err(|e| fail(format!("{e:?}")))?;
        Ok(order.into_iter().map(|v| v as u32).collect())
    }
}

fn minimum_degree(ptr: &[u32], adj: &[u32]) -> Result<Vec<u32>, LinalgError> {
    let (n, nnz) = (ptr.len() - 1, adj.len());
    let (mut forward, mut inverse) = (vec![0u32; n], vec![0u32; n]);
    let graph = SymbolicSparseColMatRef::new_unsorted_checked(n, n, ptr, None, adj);
    let need = amd::order_maybe_unsorted_scratch::<u32>(n, nnz);
    let mut memory =
        MemBuffer::try_new(need).map_err(|_| LinalgError::Memory { bytes: 4 * nnz, free: None })?;
    let stack = MemStack::new(&mut memory);
    amd::order_maybe_unsorted(&mut forward, &mut inverse, graph, amd::Control::default(), stack)
        .map_err(|e| LinalgError::Library(format!("minimum-degree ordering failed: {e:?}")))?;
    Ok(forward)
}

/// Joins groups of consecutive DOFs that share most of their neighbours: DOFs of one node among whose stiffnesses some
/// happen to be zero and are not stored. The factor then holds those zeros.
fn join_alike(pattern: &Pattern, dofs: &mut Vec<Vec<u32>>, group: &mut [u32]) {
    for j in 1..pattern.n() {
        let (g, h) = (group[j - 1] as usize, group[j] as usize);
        if g == h || dofs[g].len() + dofs[h].len() > NODE_DOFS {
            continue;
        }
        let (a, b) = (pattern.column(dofs[g][0] as usize), pattern.column(j));
        if (a.len().min(b.len()) as f64) < ALIKE * a.len().max(b.len()) as f64 {
            continue;
        }
        let common = common(a, b);
        if common as f64 >= ALIKE * (a.len() + b.len() - common) as f64 {
            let moved = std::mem::take(&mut dofs[h]);
            moved.iter().for_each(|&d| group[d as usize] = g as u32);
            dofs[g].extend(moved);
            dofs[g].sort_unstable();
        }
    }
    let mut number = vec![0u32; dofs.len()];
    let mut count = 0;
    for (g, members) in dofs.iter().enumerate() {
        number[g] = count;
        count += u32::from(!members.is_empty());
    }
    dofs.retain(|members| !members.is_empty());
    group.iter_mut().for_each(|g| *g = number[*g as usize]);
}

/// Entries that two rising lists share.
fn common(a: &[u32], b: &[u32]) -> usize {
    let (mut i, mut j, mut count) = (0, 0, 0);
    while i < a.len() && j < b.len() {
        count += usize::from(a[i] == b[j]);
        (i, j) = (i + usize::from(a[i] <= b[j]), j + usize::from(b[j] <= a[i]));
    }
    count
}

/// Order-free hash of the closed adjacency of DOF `j`.
fn hash(pattern: &Pattern, j: usize) -> u64 {
    let mix = |v: u64| {
        let v = (v ^ (v >> 31)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        v ^ (v >> 29)
    };
    let column = pattern.column(j);
    let own = if column.binary_search(&(j as u32)).is_ok() { 0 } else { mix(j as u64 + 1) };
    column.iter().fold(own, |sum, &i| sum.wrapping_add(mix(i as u64 + 1)))
}

/// Whether DOFs a and b have the same neighbours, themselves included.
fn closed_equal(pattern: &Pattern, a: usize, b: usize) -> bool {
    let (ca, cb) = (pattern.column(a), pattern.column(b));
    let has = |c: &[u32], j: usize| c.binary_search(&(j as u32)).is_ok();
    // a stored diagonal is the rule; without it the DOF is left alone
    a == b || (has(ca, a) && has(cb, b) && ca == cb)
}
