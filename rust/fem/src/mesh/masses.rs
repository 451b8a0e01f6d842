//! Concentrated masses.

use super::nodes::Id;

/// Matrix of a concentrated mass.
#[derive(Debug, Clone, PartialEq)]
pub enum MassKind {
    /// CONM2: mass, offset of the centre of gravity from the node, inertia about the centre of gravity.
    Conm2 {
        /// Mass.
        m: f64,
        /// Offset, basic coordinates.
        offset: [f64; 3],
        /// Symmetric inertia tensor about the centre of gravity, basic axes, with tensor signs
        /// (off-diagonal (i, j) = minus the card's I_ij).
        inertia: [[f64; 3]; 3],
    },
    /// CONM1: symmetric 6 x 6 mass matrix at the node, basic axes.
    Conm1([[f64; 6]; 6]),
}

/// CONM1, CONM2.
#[derive(Debug, Clone, PartialEq)]
pub struct Mass {
    /// Element id.
    pub id: Id,
    /// Node.
    pub node: Id,
    /// Matrix.
    pub kind: MassKind,
}
