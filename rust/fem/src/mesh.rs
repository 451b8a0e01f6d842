//! The finite-element model as plain data: what a deck says, with coordinate systems already evaluated.
//!
//! Everything geometric is in the basic system; only a node's displacement frame ([`Node::frame`]) stays local,
//! because constraints, springs and results are expressed in it. Entities refer to each other by id, and every
//! entity keeps its id for messages. Nothing here is checked: building a model from it checks.

/// Id of a node, element, property or material, as in the deck.
pub type Id = u32;

/// Direction cosines of a local frame: row i is local axis i in basic coordinates, so `local = R * basic`.
pub type Rotation = [[f64; 3]; 3];

/// A set of displacement components, bit `c - 1` for component `c` in 1..=6 (X Y Z RX RY RZ).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Components(pub u8);

impl Components {
    /// All six components.
    pub const ALL: Self = Self(0b11_1111);

    /// The set holding the components in `list`; anything outside 1..=6 is ignored.
    #[must_use]
    pub fn from_list(list: &[u8]) -> Self {
        Self(list.iter().filter(|c| (1..=6).contains(*c)).fold(0, |set, c| set | 1 << (c - 1)))
    }

    /// Is component `c` (1..=6) in the set?
    #[must_use]
    pub fn contains(self, c: u8) -> bool {
        (1..=6).contains(&c) && self.0 & (1 << (c - 1)) != 0
    }

    /// The components of the set, ascending, 1..=6.
    pub fn iter(self) -> impl Iterator<Item = u8> {
        (1..=6).filter(move |&c| self.contains(c))
    }

    /// Is the set empty?
    #[must_use]
    pub fn is_empty(self) -> bool {
        self.0 & Self::ALL.0 == 0
    }
}

/// One displacement component (1..=6, in the node's displacement frame) of one node.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct NodeComponent {
    /// Node id.
    pub node: Id,
    /// Component 1..=6.
    pub component: u8,
}

/// Component that carries the one DOF of a scalar point (SPOINT); its other five are held.
///
/// A rotation, because whoever looks for motion in space (sensors, forces, supports, mass along an axis) looks at
/// translations, and those of a scalar point stand still.
pub const SCALAR_COMPONENT: u8 = 4;

/// GRID: position and displacement frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Node {
    /// Node id.
    pub id: Id,
    /// Position, basic coordinates, length.
    pub xyz: [f64; 3],
    /// Displacement (CD) frame *at this node* (a cylindrical or spherical CD already evaluated); `None` = basic.
    pub frame: Option<Rotation>,
}

/// MAT1: isotropic material, as written on the card (blank = `None`).
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// Material id.
    pub id: Id,
    /// Young's modulus, force/length².
    pub e: Option<f64>,
    /// Shear modulus, force/length². Blank with E and nu given: G = E / (2 (1 + nu)), and G follows E.
    pub g: Option<f64>,
    /// Poisson's ratio. Blank with E and G given: nu = E / (2 G) - 1.
    pub nu: Option<f64>,
    /// Mass density.
    pub rho: f64,
    /// Structural damping coefficient (loss factor) GE.
    pub ge: f64,
}

/// In-plane law of an anisotropic shell material.
#[derive(Debug, Clone, PartialEq)]
pub enum PlaneLaw {
    /// MAT8: orthotropic in material axes.
    Orthotropic {
        /// Young's modulus along material axis 1.
        e1: f64,
        /// Young's modulus along material axis 2.
        e2: f64,
        /// Poisson's ratio: strain along 2 for stress along 1.
        nu12: f64,
        /// Shear modulus in the plane.
        g12: f64,
        /// Transverse shear moduli 1-z and 2-z; 0 = rigid.
        gz: [f64; 2],
    },
    /// MAT2: symmetric (3, 3) stiffness of plane stress in material axes; its upper left (2, 2) part when the material
    /// is that of transverse shear (MID3).
    Anisotropic([[f64; 3]; 3]),
}

/// MAT2, MAT8: anisotropic material of shells.
#[derive(Debug, Clone, PartialEq)]
pub struct PlaneMaterial {
    /// Material id.
    pub id: Id,
    /// Elasticity.
    pub law: PlaneLaw,
    /// Mass density.
    pub rho: f64,
    /// Structural damping coefficient (loss factor) GE.
    pub ge: f64,
}

/// MAT9: anisotropic material of solids.
#[derive(Debug, Clone, PartialEq)]
pub struct SolidMaterial {
    /// Material id.
    pub id: Id,
    /// Symmetric stiffness over (xx, yy, zz, xy, yz, zx) with engineering shear strains, material axes.
    pub stiffness: [[f64; 6]; 6],
    /// Mass density.
    pub rho: f64,
    /// Structural damping coefficient (loss factor) GE.
    pub ge: f64,
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

/// PDAMP.
#[derive(Debug, Clone, PartialEq)]
pub struct DamperProperty {
    /// Property id.
    pub id: Id,
    /// Viscous damping coefficient.
    pub c: f64,
}

/// How the local y axis (plane 1) of a beam, or the frame of a bush, is given.
#[derive(Debug, Clone, PartialEq)]
pub enum Orientation {
    /// A vector in basic coordinates (the card's vector is in end A's displacement frame: already rotated).
    Vector([f64; 3]),
    /// From end A towards this node.
    Node(Id),
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

/// RBE2: `components` of each dependent node follow the rigid motion of the independent node.
#[derive(Debug, Clone, PartialEq)]
pub struct Rbe2 {
    /// Element id.
    pub id: Id,
    /// Independent node, all six components.
    pub independent: Id,
    /// Dependent components, in each dependent node's displacement frame.
    pub components: Components,
    /// Dependent nodes.
    pub dependent: Vec<Id>,
}

/// RBAR: two nodes of one rigid body; six independent components at both together give its motion.
#[derive(Debug, Clone, PartialEq)]
pub struct Rbar {
    /// Element id.
    pub id: Id,
    /// Ends.
    pub nodes: [Id; 2],
    /// Independent components of each end, in its displacement frame.
    pub independent: [Components; 2],
    /// Dependent components of each end.
    pub dependent: [Components; 2],
}

/// Nodes of one weight group of an RBE3.
#[derive(Debug, Clone, PartialEq)]
pub struct Rbe3Group {
    /// Weight.
    pub weight: f64,
    /// Components of the nodes, in their displacement frames.
    pub components: Components,
    /// Nodes.
    pub nodes: Vec<Id>,
}

/// RBE3: the reference node follows the weighted mean motion of the others.
#[derive(Debug, Clone, PartialEq)]
pub struct Rbe3 {
    /// Element id.
    pub id: Id,
    /// Reference (dependent) node.
    pub reference: Id,
    /// Dependent components of the reference node.
    pub components: Components,
    /// Independent nodes with weights.
    pub groups: Vec<Rbe3Group>,
    /// UM: components made dependent instead of the reference node's; empty = the reference node's.
    pub um: Vec<NodeComponent>,
}

/// MPC: `sum coefficient * u = 0`; the first term is the dependent one.
#[derive(Debug, Clone, PartialEq)]
pub struct Mpc {
    /// Set id.
    pub id: Id,
    /// Terms.
    pub terms: Vec<(NodeComponent, f64)>,
}

/// SPC, SPC1, GRID permanent constraints: components held at zero.
#[derive(Debug, Clone, PartialEq)]
pub struct Spc {
    /// Set id (0 for the permanent constraints of GRID).
    pub id: Id,
    /// Node.
    pub node: Id,
    /// Components, in the node's displacement frame.
    pub components: Components,
}

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
