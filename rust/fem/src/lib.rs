//! From a deck to sparse K, M, C: cards, elements, constraints, assembly, parameters.

mod affine;
pub mod assembly;
pub mod constraint;
pub mod deck;
pub mod dof;
pub mod element;
pub mod error;
pub mod mesh;
pub mod model;
pub mod morph;
pub mod parameter;
pub mod pattern;
pub mod project;
pub mod resolve;
pub mod rotor;
pub mod scalar;
pub mod small;
pub mod stress;
mod system;

pub use system::Part;
