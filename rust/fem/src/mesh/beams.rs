//! Beams and rods with their sections and properties.

use super::nodes::{Components, Id};

/// How the local y axis (plane 1) of a beam, or the frame of a bush, is given.
#[derive(Debug, Clone, PartialEq)]
pub enum Orientation {
    /// A vector in basic coordinates (the card's vector is in end A's displacement frame: already rotated).
    Vector([f64; 3]),
    /// From end A towards this node.
    Node(Id),
}

/// Cross-section of a beam at one end.
#[derive(Debug, Clone, PartialEq)]
pub struct BeamSection {
    /// Area, length².
    pub a: f64,
    /// I1 = Izz: bending in the plane of local x and y, length⁴.
    pub i1: f64,
    /// I2 = Iyy: bending in the plane of local x and z, length⁴.
    pub i2: f64,
    /// Product of inertia, length⁴.
    pub i12: f64,
    /// Torsion constant, length⁴.
    pub j: f64,
    /// Non-structural mass per length.
    pub nsm: f64,
    /// Neutral axis relative to the shear centre in local (y, z), length (PBEAM N1, N2); zero for PBAR.
    pub neutral_axis: [f64; 2],
    /// Centre of the non-structural mass relative to the shear centre in local (y, z), length (PBEAM M1, M2).
    pub nsm_offset: [f64; 2],
}

/// PBAR, PBARL, PBEAM, PBEAML.
#[derive(Debug, Clone, PartialEq)]
pub struct BeamProperty {
    /// Property id.
    pub id: Id,
    /// Material id.
    pub material: Id,
    /// Section at end A (or everywhere).
    pub a: BeamSection,
    /// Section at end B when it differs.
    pub b: Option<BeamSection>,
    /// Shear factor K1 (plane 1, local x-y); 0 = rigid in shear.
    pub k1: f64,
    /// Shear factor K2 (plane 2, local x-z); 0 = rigid in shear.
    pub k2: f64,
}

/// Card a beam came from; the element theory is the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BeamKind {
    /// CBAR.
    Bar,
    /// CBEAM.
    Beam,
}

/// CBAR, CBEAM.
#[derive(Debug, Clone, PartialEq)]
pub struct Beam {
    /// Element id.
    pub id: Id,
    /// Card.
    pub kind: BeamKind,
    /// Property id.
    pub property: Id,
    /// Ends A and B.
    pub nodes: [Id; 2],
    /// Orientation of plane 1.
    pub orientation: Orientation,
    /// Offset from node to beam end, each end, basic coordinates.
    pub offsets: [[f64; 3]; 2],
    /// Pin flags of each end, in the beam's local axes.
    pub pins: [Components; 2],
}

/// PROD, or the section that CONROD carries.
#[derive(Debug, Clone, PartialEq)]
pub struct RodSection {
    /// Material id.
    pub material: Id,
    /// Area, length².
    pub a: f64,
    /// Torsion constant, length⁴.
    pub j: f64,
    /// Non-structural mass per length.
    pub nsm: f64,
}

/// PROD.
#[derive(Debug, Clone, PartialEq)]
pub struct RodProperty {
    /// Property id.
    pub id: Id,
    /// The section.
    pub section: RodSection,
}

/// Section of a rod element.
#[derive(Debug, Clone, PartialEq)]
pub enum RodSource {
    /// CROD: id of a [`RodProperty`].
    Property(Id),
    /// CONROD.
    Inline(RodSection),
}

/// CROD, CONROD.
#[derive(Debug, Clone, PartialEq)]
pub struct Rod {
    /// Element id.
    pub id: Id,
    /// Section.
    pub source: RodSource,
    /// Ends.
    pub nodes: [Id; 2],
}
