//! Springs, dashpots and bushes with their properties.

use super::beams::Orientation;
use super::nodes::{Id, NodeComponent, Rotation};

/// PELAS.
#[derive(Debug, Clone, PartialEq)]
pub struct SpringProperty {
    /// Property id.
    pub id: Id,
    /// Stiffness.
    pub k: f64,
    /// Structural damping coefficient.
    pub ge: f64,
}

/// Value of a scalar spring.
#[derive(Debug, Clone, PartialEq)]
pub enum SpringSource {
    /// CELAS1, CELAS3: id of a [`SpringProperty`].
    Property(Id),
    /// CELAS2, CELAS4.
    Inline {
        /// Stiffness.
        k: f64,
        /// Structural damping coefficient.
        ge: f64,
    },
}

/// CELAS1 to 4.
#[derive(Debug, Clone, PartialEq)]
pub struct Spring {
    /// Element id.
    pub id: Id,
    /// Value.
    pub source: SpringSource,
    /// Ends; `None` = ground.
    pub ends: [Option<NodeComponent>; 2],
}

/// PDAMP.
#[derive(Debug, Clone, PartialEq)]
pub struct DamperProperty {
    /// Property id.
    pub id: Id,
    /// Viscous damping coefficient.
    pub c: f64,
}

/// Value of a scalar dashpot.
#[derive(Debug, Clone, PartialEq)]
pub enum DamperSource {
    /// CDAMP1, CDAMP3: id of a [`DamperProperty`].
    Property(Id),
    /// CDAMP2, CDAMP4: viscous coefficient.
    Inline(f64),
}

/// CDAMP1 to 4.
#[derive(Debug, Clone, PartialEq)]
pub struct Damper {
    /// Element id.
    pub id: Id,
    /// Value.
    pub source: DamperSource,
    /// Ends; `None` = ground.
    pub ends: [Option<NodeComponent>; 2],
}

/// PBUSH.
#[derive(Debug, Clone, PartialEq)]
pub struct BushProperty {
    /// Property id.
    pub id: Id,
    /// Stiffness per component, force/length and moment/rad.
    pub k: [f64; 6],
    /// Viscous damping per component.
    pub c: [f64; 6],
    /// Structural damping coefficient per component (one GE on the card is written to all six).
    pub ge: [f64; 6],
}

/// Frame of a bush element.
#[derive(Debug, Clone, PartialEq)]
pub enum BushFrame {
    /// CID given: its direction cosines at end A.
    Fixed(Rotation),
    /// Local x from A to B, plane 1 by orientation.
    Oriented(Orientation),
    /// Local x from A to B, nothing else given (only components 1 and 4 may have stiffness).
    Axial,
}

/// CBUSH.
#[derive(Debug, Clone, PartialEq)]
pub struct Bush {
    /// Element id.
    pub id: Id,
    /// Property id.
    pub property: Id,
    /// Ends; the second `None` = grounded.
    pub nodes: [Option<Id>; 2],
    /// Frame.
    pub frame: BushFrame,
    /// Place of the spring as fraction of the way from A to B (card's S, default 0.5).
    pub location: f64,
    /// Offset of the spring from end A in basic coordinates when OCID is given; replaces `location`.
    pub offset: Option<[f64; 3]>,
}
