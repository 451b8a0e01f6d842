//! Shells with their properties and laminates.

use super::nodes::Id;

/// PSHELL.
#[derive(Debug, Clone, PartialEq)]
pub struct ShellProperty {
    /// Property id.
    pub id: Id,
    /// Membrane material MID1; `None` = no membrane stiffness and no structural mass.
    pub mid1: Option<Id>,
    /// Thickness, length; `None` = the elements give it.
    pub t: Option<f64>,
    /// Bending material MID2; `None` = no bending stiffness.
    pub mid2: Option<Id>,
    /// Bending inertia ratio 12 I / T³ (default 1).
    pub bending_ratio: f64,
    /// Transverse shear material MID3; `None` = rigid in transverse shear.
    pub mid3: Option<Id>,
    /// Shear thickness ratio TS/T (default 0.833333).
    pub shear_ratio: f64,
    /// Membrane-bending coupling material MID4.
    pub mid4: Option<Id>,
    /// Non-structural mass per area.
    pub nsm: f64,
}

/// One ply of a laminate.
#[derive(Debug, Clone, PartialEq)]
pub struct Ply {
    /// Material id.
    pub material: Id,
    /// Thickness, length.
    pub t: f64,
    /// Angle of material axis 1 from the element's material axis, rad.
    pub angle: f64,
}

/// Which stiffness of a laminate counts (PCOMP LAM).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum LaminateParts {
    /// Membrane, bending and their coupling.
    #[default]
    All,
    /// Membrane alone (LAM = MEM).
    Membrane,
    /// Bending and transverse shear alone (LAM = BEND).
    Bending,
}

/// PCOMP, PCOMPG: plies from the bottom up.
#[derive(Debug, Clone, PartialEq)]
pub struct Laminate {
    /// Property id.
    pub id: Id,
    /// Plies, bottom first, mirrored ones of LAM = SYM included.
    pub plies: Vec<Ply>,
    /// From the reference plane to the bottom of the laminate; `None` = minus half the thickness.
    pub z0: Option<f64>,
    /// Non-structural mass per area.
    pub nsm: f64,
    /// Structural damping coefficient of the whole laminate; `None` = the materials'.
    pub ge: Option<f64>,
    /// Parts of the stiffness.
    pub parts: LaminateParts,
}

/// Where material axis 1 of a shell points.
#[derive(Debug, Clone, PartialEq)]
pub enum MaterialAxis {
    /// Angle from the side between the first two corners, about the normal, rad.
    Angle(f64),
    /// Along the projection of this vector (basic coordinates) onto the element.
    Along([f64; 3]),
}

/// CQUAD4, CTRIA3.
#[derive(Debug, Clone, PartialEq)]
pub struct Shell<const N: usize> {
    /// Element id.
    pub id: Id,
    /// Property id.
    pub property: Id,
    /// Corners.
    pub nodes: [Id; N],
    /// Material axis 1 of anisotropic materials.
    pub axis: MaterialAxis,
    /// Offset of the reference plane along the element normal, length.
    pub zoffset: f64,
    /// Thickness at the corners where the card gives it.
    pub thickness: [Option<f64>; N],
}
