//! Multilevel vertex separators (Hendrickson, Rothberg 1998; Karypis, Kumar 1998).

use super::coarsen::coarsen;
use super::graph::Graph;
use super::grow::first_split;
use super::random::Random;
use super::refine::refine;
use super::split::Split;

/// Vertices from which a graph is not coarsened any further.
const COARSEST: usize = 100;

/// Growths on the coarsest graph.
const GROWTHS: usize = 8;

/// A graph that keeps more than this part of its vertices does not coarsen.
const STALLED: f64 = 0.9;

/// Two coarse graphs are made of the first graph and again whenever it has shrunk by this factor, and the lighter separator
/// is kept: which separators a coarse graph can show is luck. The runs double each time, the vertices fall to a sixth.
const TRIAL_SHRINK: usize = 6;

/// Vertices below which a graph is run through once: small parts take half the time and a few percent of the operations.
const TRIAL_LEAST: usize = 1000;

/// Growths on a graph that does not coarsen.
const GROWTHS_STALLED: usize = 2;

/// A light separator of a graph that has a vertex.
pub(crate) fn bisect(graph: &Graph, random: &mut Random) -> Split {
    multilevel(graph, usize::MAX, random)
}

/// `tried`: vertices of the finer graph where two runs were made last.
fn multilevel(graph: &Graph, tried: usize, random: &mut Random) -> Split {
    if graph.len() <= COARSEST {
        return first_split(graph, GROWTHS, random);
    }
    // by size and not by level: runs would multiply without bound in a graph that hardly coarsens
    if graph.len() < TRIAL_LEAST || graph.len() > tried / TRIAL_SHRINK {
        return once(graph, tried, random);
    }
    let one = once(graph, graph.len(), random);
    let two = once(graph, graph.len(), random);
    if two.score() < one.score() { two } else { one }
}

/// Coarsens by one level, divides the coarser graph and refines.
fn once(graph: &Graph, tried: usize, random: &mut Random) -> Split {
    let limit = (graph.total() * 3 / (2 * COARSEST as i64)).max(1);
    let coarse = coarsen(graph, limit, random);
    if coarse.graph.len() as f64 > STALLED * graph.len() as f64 {
        return first_split(graph, GROWTHS_STALLED, random);
    }
    let above = multilevel(&coarse.graph, tried, random);
    let mut split = Split::new(graph, coarse.of.iter().map(|&c| above.part[c as usize]).collect());
    refine(graph, &mut split);
    split
}

#[cfg(test)]
mod tests {
    use super::super::graph::grid;
    use super::super::split::LARGEST_SIDE;
    use super::*;

    fn check(graph: &Graph, heaviest: i64) {
        for seed in 0..5 {
            let split = bisect(graph, &mut Random::new(seed));
            let across = |v: u32| {
                graph.neighbours(v).iter().any(|&u| split.part[u as usize] + split.part[v as usize] == 1)
            };
            assert!(
                (0..graph.len() as u32).all(|v| split.part[v as usize] != 0 || !across(v)),
                "sides touch"
            );
            assert_eq!(split.weights, Split::new(graph, split.part.clone()).weights);
            let [a, b, s] = split.weights;
            assert!(s <= heaviest, "seed {seed}: {s} beside {heaviest}");
            assert!(a.max(b) as f64 <= LARGEST_SIDE * (a + b + s) as f64 + 1.0, "seed {seed}: {a} {b}");
        }
    }

    #[test]
    fn separators_of_grids_are_hardly_heavier_than_a_layer() {
        check(&grid([16, 16, 16]), 16 * 16 * 11 / 10);
        check(&grid([12, 12, 48]), 12 * 12 * 11 / 10);
        check(&grid([1, 60, 60]), 60 * 11 / 10);
        check(&grid([1, 20, 500]), 20);
        check(&grid([1, 1, 3000]), 1);
    }
}
