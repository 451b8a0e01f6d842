//! Frequency response functions by modal superposition, by direct solution, and by a reduced direct solution.
//!
//! H(s) = Σ_r φ_out,r φ_in,r / (ω_r² + 2 ζ_r ω_r s + s²) + R, time convention exp(+iωt), s = iω on the frequency axis.

use num_complex::Complex64;

use crate::DynamicsError;

mod direct;
mod galerkin;
mod lines;
mod modal;
mod reduced;
mod residual;
mod scores;
pub(crate) mod tile;

pub use direct::DirectModel;
pub use lines::LineModel;
pub use modal::ModalModel;
pub use reduced::{ReducedFrf, ReducedOptions};
pub use residual::residual_vectors;
pub use scores::FrfScores;

/// Displacement, velocity or acceleration per force.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FrfKind {
    /// Displacement per force.
    Receptance,
    /// Velocity per force.
    Mobility,
    /// Acceleration per force.
    Accelerance,
}

impl FrfKind {
    /// s^0, s^1 or s^2.
    pub(crate) fn factor(self, s: Complex64) -> Complex64 {
        match self {
            Self::Receptance => Complex64::ONE,
            Self::Mobility => s,
            Self::Accelerance => s * s,
        }
    }
}

impl std::str::FromStr for FrfKind {
    type Err = DynamicsError;
    fn from_str(text: &str) -> Result<Self, DynamicsError> {
        match text {
            "receptance" => Ok(Self::Receptance),
            "mobility" => Ok(Self::Mobility),
            "accelerance" => Ok(Self::Accelerance),
            _ => Err(DynamicsError::Argument(format!(
                "FRF kind '{text}' is unknown; use receptance, mobility or accelerance"
            ))),
        }
    }
}
