//! Rigid elements, interpolation elements, and single and multipoint constraints.

use super::nodes::{Components, Id, NodeComponent};

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
