//! Where dissection ends: for each part of the tree, its separators or minimum degree, whichever takes fewer operations.
//!
//! Operations add up over parts: what the columns of a part cost depends on the order inside it and on what lies around
//! it, not on how the other parts are ordered. So a few complete orders, that stop at parts of different size, are
//! counted exactly, and each part is taken from the order that is cheapest there.

use super::degree::minimum_degree;
use super::graph::Graph;
use super::tree::Branch;

/// Vertices of the smallest parts that are tried undivided, beside the leaves.
const WHOLE: usize = 800;

/// Growth of the parts from try to try.
const WHOLE_GROWTH: usize = 4;

/// No larger parts are tried once an order takes this many times the operations of the best: parts of it that are cheaper
/// than elsewhere have become unlikely.
const HOPELESS: f64 = 1.25;

/// A complete order in which parts of at most `whole` vertices are not divided.
pub(crate) struct Candidate {
    whole: usize,
    /// Position of each vertex.
    at: Vec<u32>,
    /// Operations of the columns of each vertex.
    cost: Vec<f64>,
}

/// Orders that stop dissection earlier and earlier, until it is clear that more of minimum degree is dearer. `cost` counts
/// the operations of each vertex under an order.
pub(crate) fn candidates(graph: &Graph, tree: &Branch, cost: impl Fn(&[u32]) -> Vec<f64>) -> Vec<Candidate> {
    let mut found: Vec<Candidate> = Vec::new();
    let (mut least, mut whole) = (f64::INFINITY, 0);
    loop {
        let candidate = Candidate::new(graph, tree, whole, &cost);
        let total: f64 = candidate.cost.iter().sum();
        found.push(candidate);
        least = least.min(total);
        if whole >= tree.size || total > HOPELESS * least {
            return found;
        }
        whole = (WHOLE_GROWTH * whole).max(WHOLE);
    }
}

impl Candidate {
    fn new(graph: &Graph, tree: &Branch, whole: usize, cost: impl Fn(&[u32]) -> Vec<f64>) -> Self {
        let order = minimum_degree(graph, &stages(graph.len(), tree, whole));
        let mut at = vec![0; order.len()];
        order.iter().enumerate().for_each(|(k, &v)| at[v as usize] = k as u32);
        Self { whole, at, cost: cost(&order) }
    }
}

/// Stage of each vertex: one a part, separators after what they divide.
fn stages(n: usize, tree: &Branch, whole: usize) -> Vec<u32> {
    fn fill(branch: &Branch, stage: u32, of: &mut [u32]) {
        branch.own.iter().for_each(|&v| of[v as usize] = stage);
        branch.children.iter().for_each(|c| fill(c, stage, of));
    }
    fn number(branch: &Branch, whole: usize, next: &mut u32, of: &mut [u32]) {
        if branch.size <= whole {
            fill(branch, *next, of);
        } else {
            branch.children.iter().for_each(|c| number(c, whole, next, of));
            branch.own.iter().for_each(|&v| of[v as usize] = *next);
        }
        *next += 1;
    }
    let (mut of, mut next) = (vec![0; n], 0);
    number(tree, whole, &mut next, &mut of);
    of
}

/// Vertices that follow one candidate's order.
struct Piece<'a> {
    branch: &'a Branch,
    /// With its children, not the separator alone.
    all: bool,
    candidate: usize,
}

/// Cost of a part under each candidate and the cheapest way to order it.
struct Choice<'a> {
    sums: Vec<f64>,
    cost: f64,
    pieces: Vec<Piece<'a>>,
}

/// The cheapest order that the candidates hold.
pub(crate) fn cheapest(tree: &Branch, candidates: &[Candidate]) -> Vec<u32> {
    fn collect(branch: &Branch, all: bool, into: &mut Vec<u32>) {
        into.extend(&branch.own);
        if all {
            branch.children.iter().for_each(|c| collect(c, true, into));
        }
    }
    let mut order = Vec::with_capacity(tree.size);
    for piece in choose(tree, usize::MAX, candidates).pieces {
        let first = order.len();
        collect(piece.branch, piece.all, &mut order);
        order[first..].sort_unstable_by_key(|&v| candidates[piece.candidate].at[v as usize]);
    }
    order
}

/// The choice for a part inside one of `around` vertices.
fn choose<'a>(branch: &'a Branch, around: usize, candidates: &[Candidate]) -> Choice<'a> {
    // a candidate that does not divide the part around mixes this one with others
    let least = |sums: &[f64], size: usize| {
        let apart = (0..sums.len()).filter(|&k| candidates[k].whole < size);
        apart.min_by(|&a, &b| sums[a].total_cmp(&sums[b]))
    };
    let own: Vec<f64> =
        candidates.iter().map(|c| branch.own.iter().map(|&v| c.cost[v as usize]).sum()).collect();
    let mut choice = Choice { sums: own.clone(), cost: f64::INFINITY, pieces: vec![] };
    if !branch.children.is_empty()
        && let Some(candidate) = least(&own, branch.size)
    {
        choice.cost = own[candidate];
        for child in &branch.children {
            let part = choose(child, branch.size, candidates);
            choice.cost += part.cost;
            choice.pieces.extend(part.pieces);
            choice.sums.iter_mut().zip(part.sums).for_each(|(s, p)| *s += p);
        }
        choice.pieces.push(Piece { branch, all: false, candidate });
    }
    if let Some(candidate) = least(&choice.sums, around)
        && choice.sums[candidate] < choice.cost
    {
        choice.cost = choice.sums[candidate];
        choice.pieces = vec![Piece { branch, all: true, candidate }];
    }
    choice
}

#[cfg(test)]
mod tests {
    use super::super::graph::grid;
    use super::super::tree::dissect;
    use super::*;
    use crate::Pattern;
    use crate::nodes::Nodes;

    #[test]
    fn what_is_put_together_costs_what_was_counted() {
        let graph = grid([1, 60, 60]);
        let entries =
            (0..3600).flat_map(|v| graph.neighbours(v).iter().map(move |&u| (v as usize, u as usize)));
        let nodes = Nodes::new(&Pattern::from_entries(3600, entries).unwrap());
        assert_eq!(nodes.len(), graph.len());
        let names: Vec<u32> = (0..3600).collect();
        let tree = dissect(&graph, &names, 1);
        let cost = |order: &[u32]| nodes.costs(order).into_iter().map(|c| c.0).collect();
        let found = candidates(&graph, &tree, cost);
        assert!(found.len() > 1);
        let counted = choose(&tree, usize::MAX, &found).cost;
        let order = cheapest(&tree, &found);
        assert!((nodes.cost(&order).0 - counted).abs() < 1e-9 * counted);
        assert!(found.iter().all(|c| counted <= c.cost.iter().sum::<f64>() * (1.0 + 1e-12)));
    }
}
