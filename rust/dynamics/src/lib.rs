//! Modes (real and complex), FRFs, sensitivities, local laws and the response of a model with a law attached.

mod complex;
mod error;
pub mod free_force;
mod frf;
pub mod harmonic;
pub mod identify;
pub mod laws;
mod modes;
pub mod oscillator;
pub mod pair_costs;
mod reduction;
mod sensitivity;
pub mod simulate;

pub use complex::{ComplexModes, ComplexOptions, ComplexProblem, PoleKind, Power, Term};
pub use error::DynamicsError;
pub use frf::{
    DirectModel, FrfKind, FrfScores, LineModel, ModalModel, ReducedFrf, ReducedOptions, residual_vectors,
};
pub use modes::{ModeOptions, Modes, ModesInfo, ModesMemory, modes};
pub use reduction::{RitzBasis, RitzOptions, ritz_basis};
pub use sensitivity::{
    DirectDerivative, EigenSensitivities, ModalDerivatives, ParameterDerivatives, clusters,
    eigen_sensitivities, frf_direct_sensitivities, project, shape_sensitivities,
};
