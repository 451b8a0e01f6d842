//! Estimation on spectral lines: a reduced model, recordings as lines, and hypotheses about what is attached to it.
//!
//! The model is M(θ) q'' + C q' + K(θ) q = f in a Ritz basis; its unknowns θ are the logarithms of the user's parameters,
//! a frequency factor and a damping ratio for every mode in the band. The recorded accelerations of one record obey on
//! every line s = σ + iω of the exponentially windowed record
//!
//! ```text
//! Y(s) = s² Φ_s G(s) (Φ_uᵀ U(s) + Wᵀ F(s)) + T(s) c,      G = diag 1/(ω_r² + s² + 2 ζ_r ω_r s)
//! ```
//!
//! where T holds the free decays that a finite record cuts off (two unknowns c a mode) and F is the force of what the
//! model left out: free on every line (then it is projected out: variable projection, Golub and Pereyra 1973, with
//! Kaufman's Jacobian), or the force of a linear law closed around the coordinate D = W q.

mod adjoint;
mod arrays;
mod attached;
mod dashpots;
mod decaying;
mod decays;
mod fitted;
mod forced;
mod hypothesis;
mod lines;
mod minimise;
mod model;
mod normal;
mod own_dashpots;
mod prepared;
mod projector;
mod race;
mod response;
mod sensitivities;
mod shapes;
mod solve;
mod system;

pub use dashpots::Dashpots;
pub use decaying::{closing_sigma, n_decaying};
pub use fitted::{Fitted, fitted, model_columns};
pub use forced::force_products;
pub use hypothesis::{Attached, Hypothesis, What};
pub use lines::{PickedUp, RecordLines};
pub use minimise::{Settings, Solution};
pub use model::Modal;
pub use normal::Evaluation;
pub use race::Race;
pub use solve::{Job, solve, solve_batch};
pub use system::{System, Term};

use femend_linalg::Dense;

/// What can go wrong before an estimate starts.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum IdentifyError {
    /// Arrays whose sizes do not fit together.
    #[error("{what} has {found} entries, {expected} expected")]
    Shape {
        /// The array, by name.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The length that fits.
        expected: usize,
    },
    /// Dense algebra failed.
    #[error(transparent)]
    Algebra(#[from] femend_linalg::LinalgError),
    /// A law that has no dynamic stiffness or a parameter outside its domain.
    #[error(transparent)]
    Law(#[from] crate::laws::LawError),
}

pub(crate) fn expect(what: &'static str, found: usize, expected: usize) -> Result<(), IdentifyError> {
    if found == expected { Ok(()) } else { Err(IdentifyError::Shape { what, found, expected }) }
}

/// A square part of the reduced model; a product of sizes alone would let a column pass for a matrix.
pub(crate) fn expect_square(what: &'static str, found: &Dense, r: usize) -> Result<(), IdentifyError> {
    expect(what, found.nrows(), r)?;
    expect(what, found.ncols(), r)
}

/// Checks everything an evaluation takes against each other.
pub(crate) fn check(
    system: &System,
    records: &[RecordLines],
    hypothesis: &Hypothesis,
    p: &[f64],
    x: &[f64],
) -> Result<(), IdentifyError> {
    system.check()?;
    hypothesis.check(system.r)?;
    expect("start values", p.len(), system.n_unknowns())?;
    expect("start values of the law", x.len(), hypothesis.n_law())?;
    records.iter().try_for_each(|r| r.check(system.r))
}
