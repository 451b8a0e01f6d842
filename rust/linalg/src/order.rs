//! Fill-reducing orderings on the graph of nodes.
//!
//! DOFs with identical adjacency (the DOFs of one node) are merged before ordering, which keeps their columns together in
//! one supernode and makes the ordering about ten times cheaper. `Auto` runs approximate minimum degree and nested
//! dissection, which hands parts to minimum degree wherever that is cheaper, and keeps the cheaper by its exact number of
//! operations.

use rayon::prelude::*;

use crate::dissect::nested_dissection;
use crate::nodes::Nodes;
use crate::numbering::numberings;
use crate::{LinalgError, Pattern};

/// Graphs below this many nodes are ordered by minimum degree alone in `Auto`: dissection has nothing to gain.
const DISSECTION_FROM: usize = 400;

/// Operations of a factorisation per link of the graph from which dissection is tried from further seeds. A run costs about
/// as much as 4e4 to 9e4 operations per link and a further one takes 2 to 3 % off, so that it pays after some four
/// factorisations.
const SEEDS_FROM: f64 = 8e5;

/// Minimum degree is run from further numberings where it takes at most this many times the operations of dissection: that
/// is as far as numberings differ.
const NUMBERINGS_TO: f64 = 1.25;

/// Which ordering to use.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Ordering {
    /// The cheaper of minimum degree, from several numberings, and nested dissection by exact operation count.
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

/// An order of nodes with its cost.
pub(crate) struct NodeOrder {
    pub(crate) order: Vec<u32>,
    flops: f64,
    nnz: f64,
    ordering: Ordering,
}

impl NodeOrder {
    fn new(nodes: &Nodes, order: Vec<u32>, ordering: Ordering) -> Self {
        let (flops, nnz) = nodes.cost(&order);
        Self { order, flops, nnz, ordering }
    }

    /// The cheaper of two.
    fn or(self, other: Self) -> Self {
        if other.flops < self.flops { other } else { self }
    }

    /// The permutation of DOFs under an order of nodes with the same cost as this one.
    pub(crate) fn expand(&self, nodes: &Nodes, order: &[u32]) -> Permutation {
        let forward: Vec<u32> = order.iter().flat_map(|&g| nodes.dofs[g as usize].iter().copied()).collect();
        let mut inverse = vec![0u32; forward.len()];
        forward.iter().enumerate().for_each(|(new, &old)| inverse[old as usize] = new as u32);
        Permutation { forward, inverse, flops: self.flops, nnz: self.nnz, ordering: self.ordering }
    }
}

/// Nested dissection; where the factorisation is dear, the cheapest from several seeds.
fn dissect(nodes: &Nodes) -> NodeOrder {
    let graph = nodes.graph();
    let cost = |order: &[u32]| nodes.costs(order).into_iter().map(|c| c.0).collect();
    let from =
        |seed| NodeOrder::new(nodes, nested_dissection(&graph, seed, cost), Ordering::NestedDissection);
    let first = from(1);
    if first.flops < SEEDS_FROM * graph.n_links() as f64 {
        return first;
    }
    let (second, third) = rayon::join(|| from(2), || from(3));
    first.or(second).or(third)
}

/// The cheapest of minimum degree from several numberings and what is at hand.
fn renumbered(nodes: &Nodes, best: NodeOrder) -> Result<NodeOrder, LinalgError> {
    let from = |sequence: Vec<u32>| {
        nodes.amd_from(&sequence).map(|order| NodeOrder::new(nodes, order, Ordering::Amd))
    };
    let found: Vec<NodeOrder> = numberings(nodes).into_par_iter().map(from).collect::<Result<_, _>>()?;
    Ok(found.into_iter().fold(best, NodeOrder::or))
}

/// Orders the graph of nodes.
pub(crate) fn choose(nodes: &Nodes, ordering: Ordering) -> Result<NodeOrder, LinalgError> {
    let amd = || nodes.amd().map(|o| NodeOrder::new(nodes, o, Ordering::Amd));
    let nd = || dissect(nodes);
    match ordering {
        Ordering::Natural => Ok(NodeOrder::new(nodes, (0..nodes.len() as u32).collect(), Ordering::Natural)),
        Ordering::Amd => amd(),
        Ordering::NestedDissection => Ok(nd()),
        Ordering::Auto if nodes.len() < DISSECTION_FROM => amd(),
        Ordering::Auto => {
            let (a, b) = rayon::join(amd, nd);
            let a = a?;
            let near = a.flops < NUMBERINGS_TO * b.flops;
            let best = a.or(b);
            if near { renumbered(nodes, best) } else { Ok(best) }
        }
    }
}

/// Orders a pattern for elimination.
///
/// # Errors
/// [`LinalgError::Library`] or [`LinalgError::Memory`] when an ordering fails.
pub fn order(pattern: &Pattern, ordering: Ordering) -> Result<Permutation, LinalgError> {
    let nodes = Nodes::new(pattern);
    let chosen = choose(&nodes, ordering)?;
    Ok(chosen.expand(&nodes, &chosen.order))
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
