//! The tree of separators.

use super::bisect::bisect;
use super::graph::Graph;
use super::random::Random;
use super::split::SEPARATOR;

/// Parts of at most this many vertices are not divided.
const LEAF: usize = 100;

/// A side lighter than this part of the whole, beside the separator, is not worth the cut.
const LEAST_SIDE: f64 = 0.05;

/// A part of the graph: a separator and what it divides, or a leaf.
#[derive(Debug)]
pub(crate) struct Branch {
    /// Vertices of the separator, or all of a leaf.
    pub(crate) own: Vec<u32>,
    pub(crate) children: Vec<Branch>,
    /// Vertices of the whole part.
    pub(crate) size: usize,
}

impl Branch {
    fn leaf(own: Vec<u32>) -> Self {
        Self { size: own.len(), own, children: vec![] }
    }
    fn new(own: Vec<u32>, children: Vec<Branch>) -> Self {
        let size = own.len() + children.iter().map(|c| c.size).sum::<usize>();
        Self { own, children, size }
    }
}

/// Divides a graph again and again. `names` are the vertices' numbers in the result.
pub(crate) fn dissect(graph: &Graph, names: &[u32], seed: u64) -> Branch {
    if graph.len() <= LEAF {
        return Branch::leaf(names.to_vec());
    }
    let mut random = Random::new(seed);
    let (left, right) = (random.next(), random.next());
    let parts = graph.components();
    if parts.len() > 1 {
        return apart(graph, names, parts, seed);
    }
    let split = bisect(graph, &mut random);
    let [a, b, s] = split.weights;
    if (a.min(b) as f64) < LEAST_SIDE * (a + b + s) as f64 {
        return Branch::leaf(names.to_vec());
    }
    let side = |part: u8, seed: u64| {
        let members = split.members(part);
        let sub = graph.induced(&members, &mut vec![u32::MAX; graph.len()]);
        let names: Vec<u32> = members.iter().map(|&v| names[v as usize]).collect();
        dissect(&sub, &names, seed)
    };
    let (one, two) = rayon::join(|| side(0, left), || side(1, right));
    let own = split.members(SEPARATOR).into_iter().map(|v| names[v as usize]).collect();
    Branch::new(own, vec![one, two])
}

/// Parts of a graph that is not connected: the small ones together in one leaf.
fn apart(graph: &Graph, names: &[u32], parts: Vec<Vec<u32>>, seed: u64) -> Branch {
    let mut local = vec![u32::MAX; graph.len()];
    let (mut small, mut children) = (Vec::new(), Vec::new());
    for members in parts {
        let own: Vec<u32> = members.iter().map(|&v| names[v as usize]).collect();
        if members.len() <= LEAF {
            small.extend(own);
        } else {
            children.push(dissect(&graph.induced(&members, &mut local), &own, seed));
        }
    }
    if !small.is_empty() {
        children.push(Branch::leaf(small));
    }
    Branch::new(vec![], children)
}
