//! The graph of nodes: DOFs with identical adjacency merged, with the orderings that run on it.

use std::collections::HashMap;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::amd;

use crate::dissect::Graph;
use crate::join::{join, members};
use crate::{LinalgError, Pattern};

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
        // one DOF of each group
        let mut first: Vec<u32> = Vec::new();
        let mut by_hash: HashMap<u64, Vec<u32>> = HashMap::new();
        for j in 0..n {
            let found = by_hash.entry(hash(pattern, j)).or_default();
            let same = found.iter().copied().find(|&g| closed_equal(pattern, first[g as usize] as usize, j));
            group[j] = same.unwrap_or_else(|| {
                found.push(first.len() as u32);
                first.push(j as u32);
                first.len() as u32 - 1
            });
        }
        join(pattern, &mut group);
        let dofs = members(&group);
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
        let costs = self.costs(order);
        (costs.iter().map(|c| c.0).sum(), costs.iter().map(|c| c.1).sum())
    }

    /// Operations and entries of the columns of each node.
    pub(crate) fn costs(&self, order: &[u32]) -> Vec<(f64, f64)> {
        let (_, below) = self.elimination(order);
        let mut costs = vec![(0.0, 0.0); self.len()];
        for (i, &old) in order.iter().enumerate() {
            let (flops, nnz) = &mut costs[old as usize];
            for d in 0..self.dofs[old as usize].len() {
                let count = below[i] + (d + 1) as f64;
                *flops += count * count;
                *nnz += count;
            }
        }
        costs
    }

    pub(crate) fn amd(&self) -> Result<Vec<u32>, LinalgError> {
        minimum_degree(&self.ptr, &self.adj)
    }

    /// [`Self::amd`] on the nodes as a sequence of all of them numbers them.
    pub(crate) fn amd_from(&self, sequence: &[u32]) -> Result<Vec<u32>, LinalgError> {
        let mut number = vec![0u32; self.len()];
        sequence.iter().enumerate().for_each(|(k, &g)| number[g as usize] = k as u32);
        let (mut ptr, mut adj) = (vec![0u32], Vec::with_capacity(self.adj.len()));
        for &g in sequence {
            let first = adj.len();
            adj.extend(self.neighbours(g as usize).iter().map(|&h| number[h as usize]));
            adj[first..].sort_unstable();
            ptr.push(adj.len() as u32);
        }
        let order = minimum_degree(&ptr, &adj)?;
        Ok(order.into_iter().map(|k| sequence[k as usize]).collect())
    }

    /// The graph with the nodes' numbers of DOFs as weights.
    pub(crate) fn graph(&self) -> Graph {
        let weights = self.dofs.iter().map(|d| d.len() as u32).collect();
        Graph::new(self.ptr.clone(), self.adj.clone(), weights)
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
