//! The finite-element model as plain data: what a deck says, with coordinate systems already evaluated.
//!
//! Everything geometric is in the basic system; only a node's displacement frame ([`Node::frame`]) stays local,
//! because constraints, springs and results are expressed in it. Entities refer to each other by id, and every
//! entity keeps its id for messages. Nothing here is checked: building a model from it checks.

mod beams;
mod constraints;
mod direct;
mod masses;
mod materials;
mod nodes;
mod shells;
mod solids;
mod springs;

pub use beams::{
    Beam, BeamKind, BeamProperty, BeamSection, Orientation, Rod, RodProperty, RodSection, RodSource,
};
pub use constraints::{Mpc, Rbar, Rbe2, Rbe3, Rbe3Group, Spc};
pub use direct::{DirectKind, DirectMatrix};
pub use masses::{Mass, MassKind};
pub use materials::{Material, PlaneLaw, PlaneMaterial, SolidMaterial};
pub use nodes::{Components, Id, Node, NodeComponent, Rotation, SCALAR_COMPONENT};
pub use shells::{Laminate, LaminateParts, MaterialAxis, Ply, Shell, ShellProperty};
pub use solids::{Solid, SolidKind, SolidProperty};
pub use springs::{
    Bush, BushFrame, BushProperty, Damper, DamperProperty, DamperSource, Spring, SpringProperty, SpringSource,
};

/// Values of PARAM cards that change K, M or C.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// PARAM,COUPMASS > 0: consistent mass; else lumped.
    pub coupled_mass: bool,
    /// PARAM,WTMASS: factor on all mass.
    pub wtmass: f64,
    /// PARAM,G: overall structural damping coefficient.
    pub g: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self { coupled_mass: false, wtmass: 1.0, g: 0.0 }
    }
}

/// A finite-element model as plain data.
#[derive(Debug, Clone, PartialEq, Default)]
#[allow(missing_docs)]
pub struct Mesh {
    pub nodes: Vec<Node>,
    /// Ids of the nodes that are scalar points, ascending.
    pub scalar_points: Vec<Id>,
    pub materials: Vec<Material>,
    pub plane_materials: Vec<PlaneMaterial>,
    pub solid_materials: Vec<SolidMaterial>,
    pub beam_properties: Vec<BeamProperty>,
    pub rod_properties: Vec<RodProperty>,
    pub shell_properties: Vec<ShellProperty>,
    pub laminates: Vec<Laminate>,
    pub solid_properties: Vec<SolidProperty>,
    pub bush_properties: Vec<BushProperty>,
    pub spring_properties: Vec<SpringProperty>,
    pub damper_properties: Vec<DamperProperty>,
    pub beams: Vec<Beam>,
    pub rods: Vec<Rod>,
    pub springs: Vec<Spring>,
    pub dampers: Vec<Damper>,
    pub bushes: Vec<Bush>,
    pub masses: Vec<Mass>,
    pub quads: Vec<Shell<4>>,
    pub trias: Vec<Shell<3>>,
    pub solids: Vec<Solid>,
    pub rbe2: Vec<Rbe2>,
    pub rbar: Vec<Rbar>,
    pub rbe3: Vec<Rbe3>,
    pub direct: Vec<DirectMatrix>,
    pub mpc: Vec<Mpc>,
    pub spc: Vec<Spc>,
    pub options: Options,
}
