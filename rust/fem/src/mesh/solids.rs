//! Solids with their properties.

use super::nodes::{Id, Rotation};

/// PSOLID.
#[derive(Debug, Clone, PartialEq)]
pub struct SolidProperty {
    /// Property id.
    pub id: Id,
    /// Material id.
    pub material: Id,
    /// Axes of an anisotropic material in basic coordinates; `None` = basic.
    pub frame: Option<Rotation>,
}

/// Shape of a solid; node order as on the Nastran card.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum SolidKind {
    /// CTETRA with 4 nodes.
    Tetra4,
    /// CTETRA with 10 nodes.
    Tetra10,
    /// CPENTA with 6 nodes.
    Penta6,
    /// CPENTA with 15 nodes.
    Penta15,
    /// CHEXA with 8 nodes.
    Hexa8,
    /// CHEXA with 20 nodes.
    Hexa20,
    /// CPYRAM with 5 nodes.
    Pyramid5,
    /// CPYRAM with 13 nodes.
    Pyramid13,
}

impl SolidKind {
    /// Number of nodes.
    #[must_use]
    pub fn n_nodes(self) -> usize {
        match self {
            Self::Tetra4 => 4,
            Self::Tetra10 => 10,
            Self::Penta6 => 6,
            Self::Penta15 => 15,
            Self::Hexa8 => 8,
            Self::Hexa20 => 20,
            Self::Pyramid5 => 5,
            Self::Pyramid13 => 13,
        }
    }
}

/// CHEXA, CPENTA, CTETRA, CPYRAM.
#[derive(Debug, Clone, PartialEq)]
pub struct Solid {
    /// Element id.
    pub id: Id,
    /// Property id.
    pub property: Id,
    /// Shape.
    pub kind: SolidKind,
    /// Nodes, `kind.n_nodes()` of them.
    pub nodes: Vec<Id>,
}
