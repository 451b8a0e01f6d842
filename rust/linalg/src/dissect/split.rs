//! A graph divided by a separator.

use super::graph::Graph;

/// The separator's number among the three parts.
pub(crate) const SEPARATOR: u8 = 2;

/// Largest part of the weight outside the separator that one side may hold.
pub(crate) const LARGEST_SIDE: f64 = 0.62;

/// Two sides, 0 and 1, that no edge joins, and the separator.
#[derive(Debug, Clone)]
pub(crate) struct Split {
    /// Part of each vertex.
    pub(crate) part: Vec<u8>,
    /// Weights of the sides and of the separator.
    pub(crate) weights: [i64; 3],
}

impl Split {
    pub(crate) fn new(graph: &Graph, part: Vec<u8>) -> Self {
        let mut weights = [0; 3];
        part.iter().enumerate().for_each(|(v, &p)| weights[p as usize] += graph.weight(v as u32));
        Self { part, weights }
    }

    pub(crate) fn score(&self) -> f64 {
        score(self.weights)
    }

    /// Vertices of one part, rising.
    pub(crate) fn members(&self, part: u8) -> Vec<u32> {
        (0..self.part.len() as u32).filter(|&v| self.part[v as usize] == part).collect()
    }
}

/// Cost of a split to be made small: the separator's weight and what the imbalance costs in the same measure.
///
/// Eliminating a separator of weight S takes about S³ operations, a side of weight W about W²; both sides together cost as
/// much as the separator when they are level. With x the part of the heavier side, imbalance then adds
/// 4 (x - 1/2)² S³ operations, as if S were larger by a third of that. Beyond [`LARGEST_SIDE`] the excess counts twice; the
/// smallest term decides between separators of equal weight.
pub(crate) fn score(weights: [i64; 3]) -> f64 {
    let [a, b, s] = weights.map(|w| w as f64);
    let outside = a + b;
    if outside <= 0.0 {
        return 1e3 * s.max(1.0);
    }
    let x = a.max(b) / outside;
    let excess = (x - LARGEST_SIDE).max(0.0) * outside;
    s * (1.0 + 4.0 / 3.0 * (x - 0.5) * (x - 0.5)) + 1e-3 * (x - 0.5) + 2.0 * excess
}
