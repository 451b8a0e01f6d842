//! From a deck to sparse K, M, C: cards, elements, constraints, assembly, parameters.

pub mod mesh;
