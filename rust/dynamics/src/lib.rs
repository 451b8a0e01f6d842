//! Modes, FRFs, sensitivities, local laws and the response of a model with a law attached.

mod error;
mod frf;
pub mod laws;
mod modes;
pub mod oscillator;
pub mod simulate;

pub use error::DynamicsError;
pub use frf::{DirectModel, FrfKind, ModalModel, residual_vectors};
pub use modes::{ModeOptions, Modes, ModesInfo, modes};
