//! What can be wrong with a model, with the numbers and the entity's id.

use crate::mesh::{Id, NodeComponent};
use thiserror::Error;

/// A model that was read but cannot be used.
#[derive(Debug, Clone, PartialEq, Error)]
#[allow(missing_docs)]
pub enum FemError {
    #[error(
        "{what} {id} refers to node {node}, which the model does not have; define the node or correct the reference"
    )]
    UnknownNode { what: String, id: Id, node: Id },
    #[error(
        "{what} {id} refers to {kind} {target}, which the model does not have; define it or correct the reference"
    )]
    UnknownReference { what: String, id: Id, kind: &'static str, target: Id },
    #[error("{what} {id} is defined {count} times; ids must be unique")]
    Duplicate { what: &'static str, id: Id, count: usize },
    #[error("material {id}: {why}")]
    Material { id: Id, why: String },
    #[error(
        "{what} {id} has zero length: its ends are {length:.3e} apart; separate the nodes or use a spring or RBE2"
    )]
    ZeroLength { what: String, id: Id, length: f64 },
    #[error("{what} {id}: its orientation vector is zero or parallel to its axis; give one that is not")]
    Orientation { what: String, id: Id },
    #[error("{what} {id}: {why}")]
    Element { what: String, id: Id, why: String },
    #[error(
        "{what} {id}: Jacobian determinant is {det:.3e} at node {corner}; it must be positive: check the node order and shape"
    )]
    Jacobian { what: String, id: Id, det: f64, corner: usize },
    #[error("{what} {id} turns inside out: {why}")]
    InsideOut { what: String, id: Id, why: String },
    #[error(
        "DOF {}:{} is {state} once the nodes move, and not where they stand: the model has no fixed set of DOFs; hold it \
         (SPC), or give it stiffness", dof.node, dof.component
    )]
    Resistance { dof: NodeComponent, state: &'static str },
    #[error("the model was not made for moving nodes {0}; name all nodes that may move when it is built")]
    NotMade(String),
    #[error("{what} {id}: thickness {t} is not positive; give T on the property or the element")]
    Thickness { what: String, id: Id, t: f64 },
    #[error("element {id} ({what}) is not available: {missing}")]
    Unsupported { what: String, id: Id, missing: &'static str },
    #[error("DOF {}:{} is dependent twice, in {first} and in {second}; a DOF can depend on others once only", dof.node, dof.component)]
    DoublyDependent { dof: NodeComponent, first: String, second: String },
    #[error("DOF {}:{} is dependent in {first} and held by SPC set {set}; hold an independent DOF instead", dof.node, dof.component)]
    DependentHeld { dof: NodeComponent, first: String, set: Id },
    #[error("constraints run in a circle through DOF {}:{} ({through}); make one of them independent", dof.node, dof.component)]
    Circular { dof: NodeComponent, through: String },
    #[error("{what} {id}: {why}")]
    Constraint { what: &'static str, id: Id, why: String },
    #[error("parameter {name}: {why}")]
    Parameter { name: String, why: String },
    #[error("{count} parameter factors were given, the model has {expected} parameters")]
    FactorCount { count: usize, expected: usize },
    #[error("parameter {name}: factor {factor} is not a positive finite number")]
    Factor { name: String, factor: f64 },
    #[error("the model has no free DOF: {why}")]
    Empty { why: String },
    #[error("the matrices have no pattern: {0}")]
    Pattern(String),
    #[error("spin axis ({}, {}, {}) has no direction; give a finite vector other than zero", axis[0], axis[1], axis[2])]
    Spin { axis: [f64; 3] },
    #[error("element {id} is not in the model")]
    UnknownElement { id: Id },
    #[error("{what} has {got} rows, expected {expected}")]
    Shape { what: &'static str, got: usize, expected: usize },
}
