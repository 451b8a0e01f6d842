//! Matrices given directly.

use super::nodes::NodeComponent;

/// Matrix of the model that directly given terms are added to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DirectKind {
    /// Stiffness (K2GG, K2PP).
    K,
    /// Mass (M2GG, M2PP), not changed by PARAM,WTMASS.
    M,
    /// Viscous damping (B2GG, B2PP).
    C,
    /// Structural damping, imaginary part of the stiffness (K42GG).
    H,
}

/// DMIG: a symmetric matrix between DOFs in displacement frames, e.g. of a reduced superelement.
#[derive(Debug, Clone, PartialEq)]
pub struct DirectMatrix {
    /// Name.
    pub name: String,
    /// What it is added to.
    pub kind: DirectKind,
    /// Terms, each pair of DOFs once.
    pub terms: Vec<(NodeComponent, NodeComponent, f64)>,
}
