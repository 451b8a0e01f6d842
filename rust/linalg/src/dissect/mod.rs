//! Nested dissection: separators of separators' sides, down to parts that minimum degree orders.

mod bisect;
mod coarsen;
mod degree;
mod graph;
mod grow;
mod plan;
mod queue;
mod random;
mod refine;
mod split;
mod tree;

pub(crate) use graph::Graph;

/// Neighbours from which a vertex may count as dense (as in Amestoy, Davis, Duff 1996).
const DENSE: usize = 16;

/// Dense vertices have this many times the square root of the number of vertices as neighbours.
const DENSE_FACTOR: f64 = 10.0;

/// An order by nested dissection. `cost` counts the operations of each vertex under an order of all vertices.
///
/// Dense vertices come last: they would join all parts, and every elimination would have to update them.
pub(crate) fn nested_dissection(graph: &Graph, seed: u64, cost: impl Fn(&[u32]) -> Vec<f64>) -> Vec<u32> {
    let limit = DENSE.max((DENSE_FACTOR * (graph.len() as f64).sqrt()) as usize);
    let (sparse, dense): (Vec<u32>, Vec<u32>) =
        (0..graph.len() as u32).partition(|&v| graph.neighbours(v).len() <= limit);
    let whole = |order: &[u32]| -> Vec<u32> {
        order.iter().map(|&v| sparse[v as usize]).chain(dense.iter().copied()).collect()
    };
    let inner = graph.induced(&sparse, &mut vec![u32::MAX; graph.len()]);
    let names: Vec<u32> = (0..inner.len() as u32).collect();
    let tree = tree::dissect(&inner, &names, seed);
    let count = |order: &[u32]| {
        let all = cost(&whole(order));
        sparse.iter().map(|&v| all[v as usize]).collect()
    };
    let candidates = plan::candidates(&inner, &tree, count);
    whole(&plan::cheapest(&tree, &candidates))
}
