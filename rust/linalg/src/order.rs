//! Fill-reducing orderings on the graph of nodes.
//!
//! DOFs with identical adjacency (the DOFs of one node) are merged before ordering, which keeps their columns together in
//! one supernode and makes the ordering about ten times cheaper. `Auto` runs approximate minimum degree and nested
//! dissection and keeps the cheaper by its exact number of operations: dissection wins on solids, minimum degree on shells.

use std::collections::HashMap;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::amd;

use crate::{LinalgError, Pattern};

/// Graphs below this many nodes are ordered by minimum degree alone in `Auto`: dissection has nothing to gain.
const DISSECTION_FROM: usize = 400;

/// Which ordering to use.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Ordering {
    /// The cheaper of minimum degree and nested dissection by exact operation count.
    #[default]
    Auto,
    /// Approximate minimum degree (Amestoy, Davis, Duff 1996).
    Amd,
    /// Multilevel nested dissection (Karypis, Kumar 1998).
    NestedDissection,
    /// The order of the input.
    Natural,
}

impl std::str::FromStr for Ordering {
    type Err = LinalgError;
    fn from_str(text: &str) -> Result<Self, LinalgError> {
        match text {
            "auto" => Ok(Self::Auto),
            "amd" => Ok(Self::Amd),
            "nd" => Ok(Self::NestedDissection),
            "natural" => Ok(Self::Natural),
            _ => Err(LinalgError::Library(format!(
                "ordering '{text}' is unknown; use auto, amd, nd or natural"
            ))),
        }
    }
}

/// A permutation of DOFs with the cost of a Cholesky factorisation under it.
#[derive(Debug, Clone)]
pub struct Permutation {
    /// New to old.
    pub forward: Vec<u32>,
    /// Old to new.
    pub inverse: Vec<u32>,
    /// Multiplications and additions of the factorisation: sum of squared column counts.
    pub flops: f64,
    /// Entries of the factor without relaxation.
    pub nnz: f64,
    /// The ordering that was taken (never `Auto`).
    pub ordering: Ordering,
}

/// The graph of nodes: DOFs grouped by identical closed adjacency.
struct Nodes {
    dofs: Vec<Vec<u32>>,
    ptr: Vec<u32>,
    adj: Vec<u32>,
}

impl Nodes {
    fn new(pattern: &Pattern) -> Self {
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
        let mut seen = vec![u32::MAX; dofs.len()];
        let (mut ptr, mut adj) = (vec![0u32], Vec::new());
        for (g, members) in dofs.iter().enumerate() {
            seen[g] = g as u32;
            let first = adj.len();
            for &i in pattern.column(members[0] as usize) {
                let h = group[i as usize];
                if seen[h as usize] != g as u32 {
                    seen[h as usize] = g as u32;
                    adj.push(h);
                }
            }
            adj[first..].sort_unstable();
            ptr.push(adj.len() as u32);
        }
        Self { dofs, ptr, adj }
    }

    fn len(&self) -> usize {
        self.dofs.len()
    }

    fn neighbours(&self, g: usize) -> &[u32] {
        &self.adj[self.ptr[g] as usize..self.ptr[g + 1] as usize]
    }

    /// Exact operations and entries of the factor under an order of nodes, by walking row subtrees of the
    /// elimination tree (Liu 1990) with nodes weighted by their DOFs.
    fn cost(&self, order: &[u32]) -> (f64, f64) {
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
        let (mut flops, mut nnz) = (0.0, 0.0);
        for i in 0..n {
            for d in 0..self.dofs[order[i] as usize].len() {
                let count = below[i] + (d + 1) as f64;
                flops += count * count;
                nnz += count;
            }
        }
        (flops, nnz)
    }

    fn amd(&self) -> Result<Vec<u32>, LinalgError> {
        let n = self.len();
        let nnz = self.adj.len();
        let (mut forward, mut inverse) = (vec![0u32; n], vec![0u32; n]);
        let graph = SymbolicSparseColMatRef::new_checked(n, n, &self.ptr, None, &self.adj);
        let need = amd::order_maybe_unsorted_scratch::<u32>(n, nnz);
        let mut memory = MemBuffer::try_new(need).map_err(|_| LinalgError::Memory { bytes: 4 * nnz })?;
        let stack = MemStack::new(&mut memory);
        amd::order_maybe_unsorted(&mut forward, &mut inverse, graph, amd::Control::default(), stack)
            .map_err(|e| LinalgError::Library(format!("minimum-degree ordering failed: {e:?}")))?;
        Ok(forward)
    }

    fn dissection(&self) -> Result<Vec<u32>, LinalgError> {
        let ptr: Vec<i32> = self.ptr.iter().map(|&v| v as i32).collect();
        let adj: Vec<i32> = self.adj.iter().map(|&v| v as i32).collect();
        let fail = |text: String| LinalgError::Library(format!("nested dissection failed: {text}"));
        let graph = feral_metis::CscPattern::new(self.len(), &ptr, &adj)
            .ok_or_else(|| fail("graph too large".into()))?;
        let order = feral_metis::metis_order(&graph).map_err(|e| fail(format!("{e:?}")))?;
        Ok(order.into_iter().map(|v| v as u32).collect())
    }

    fn expand(&self, order: &[u32], ordering: Ordering) -> Permutation {
        let (flops, nnz) = self.cost(order);
        let forward: Vec<u32> = order.iter().flat_map(|&g| self.dofs[g as usize].iter().copied()).collect();
        let mut inverse = vec![0u32; forward.len()];
        forward.iter().enumerate().for_each(|(new, &old)| inverse[old as usize] = new as u32);
        Permutation { forward, inverse, flops, nnz, ordering }
    }
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

/// Orders a pattern for elimination.
///
/// # Errors
/// [`LinalgError::Library`] or [`LinalgError::Memory`] when an ordering fails.
pub fn order(pattern: &Pattern, ordering: Ordering) -> Result<Permutation, LinalgError> {
    let nodes = Nodes::new(pattern);
    let amd = || nodes.amd().map(|o| nodes.expand(&o, Ordering::Amd));
    let nd = || nodes.dissection().map(|o| nodes.expand(&o, Ordering::NestedDissection));
    match ordering {
        Ordering::Natural => {
            let natural: Vec<u32> = (0..nodes.len() as u32).collect();
            Ok(nodes.expand(&natural, Ordering::Natural))
        }
        Ordering::Amd => amd(),
        Ordering::NestedDissection => nd(),
        Ordering::Auto if nodes.len() < DISSECTION_FROM => amd(),
        Ordering::Auto => {
            let (a, b) = rayon::join(amd, nd);
            let (a, b) = (a?, b?);
            Ok(if b.flops < a.flops { b } else { a })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Grid of nodes with `w` fully coupled DOFs each.
    fn grid(m: usize, w: usize) -> Pattern {
        let mut entries = Vec::new();
        let at = |x: usize, y: usize| x * m + y;
        for x in 0..m {
            for y in 0..m {
                for (u, v) in [(x + 1, y), (x, y + 1), (x, y)] {
                    if u < m && v < m {
                        for a in 0..w {
                            entries.extend((0..w).map(|b| (w * at(x, y) + a, w * at(u, v) + b)));
                        }
                    }
                }
            }
        }
        Pattern::from_entries(m * m * w, entries).unwrap()
    }

    #[test]
    fn nodes_are_found_and_orders_are_permutations() {
        let p = grid(24, 3);
        assert_eq!(Nodes::new(&p).len(), 24 * 24);
        for kind in [Ordering::Auto, Ordering::Amd, Ordering::NestedDissection, Ordering::Natural] {
            let o = order(&p, kind).unwrap();
            let mut sorted = o.forward.clone();
            sorted.sort_unstable();
            assert!(sorted.iter().enumerate().all(|(i, &v)| i == v as usize), "{kind:?}");
            assert!(o.forward.iter().enumerate().all(|(i, &v)| o.inverse[v as usize] == i as u32));
        }
        let (auto, natural) = (order(&p, Ordering::Auto).unwrap(), order(&p, Ordering::Natural).unwrap());
        assert!(auto.flops < 0.5 * natural.flops);
    }

    #[test]
    fn cost_of_a_band_is_exact() {
        // tridiagonal, natural order: counts 2, 2, ..., 2, 1
        let p = Pattern::from_entries(6, (1..6).map(|i| (i, i - 1))).unwrap();
        let o = order(&p, Ordering::Natural).unwrap();
        assert_eq!((o.flops, o.nnz), (21.0, 11.0));
    }
}
