//! What can go wrong in the dynamics of a model.

use femend_linalg::LinalgError;

use crate::modes::ModesMemory;

/// Errors of this crate. DOF numbers are rows of K and M, from 0.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DynamicsError {
    /// Sparse algebra failed.
    #[error(transparent)]
    Linalg(#[from] LinalgError),
    /// An argument that makes no sense.
    #[error("{0}")]
    Argument(String),
    /// DOFs with neither stiffness nor mass: K - sigma M is singular for every shift.
    #[error("K - sigma*M is singular for every shift: {} DOF(s) move without stiffness and without mass ({}); \
             constrain them or give them stiffness or mass", dofs.len(), list(dofs))]
    Mechanism {
        /// Rows of the matrix.
        dofs: Vec<usize>,
    },
    /// A stiffness with negative eigenvalues.
    #[error(
        "K - sigma*M has {count} negative eigenvalue(s) at sigma = {sigma:.6e}: the stiffness is not positive \
             semi-definite, or sigma lies above a mode; check springs with negative stiffness, or pass a lower sigma"
    )]
    NegativeStiffness {
        /// How many.
        count: usize,
        /// Shift in rad²/s².
        sigma: f64,
    },
    /// A mass with negative eigenvalues.
    #[error(
        "the mass is below nothing in a way the model can move ({}): M is not positive semi-definite, and no modes \
             follow from it; check negative masses",
        list(dofs)
    )]
    NegativeMass {
        /// Rows of the matrix that show it.
        dofs: Vec<usize>,
    },
    /// Modes that do not fit into memory.
    #[error(
        "{what} need {:.2} GB of memory beside what is in use ({:.2} GB of it for factors, {:.2} GB for vectors), {:.2} GB are \
             free; ask for fewer modes, reduce the model to fewer DOFs or use a machine with more",
        gigabytes(need.total()), gigabytes(need.factors), gigabytes(need.vectors), gigabytes(*free)
    )]
    Memory {
        /// The modes or vectors, with their number and the DOFs.
        what: String,
        /// What they take.
        need: ModesMemory,
        /// Bytes free.
        free: usize,
    },
    /// The eigenvalue iteration stopped before all modes converged.
    #[error(
        "{converged} of {wanted} modes converged with {vectors} Lanczos vectors (largest residual {residual:.1e}); \
             ask for fewer modes or pass sigma nearer to them"
    )]
    NotConverged {
        /// Modes that did.
        converged: usize,
        /// Modes asked for.
        wanted: usize,
        /// Vectors used.
        vectors: usize,
        /// Largest residual among the wanted.
        residual: f64,
    },
    /// More complex modes asked for than oscillate.
    #[error(
        "n_modes = {wanted}, but the model has only {found} oscillatory modes at this speed ({real} poles are \
             overdamped); ask for fewer, or pass f_max"
    )]
    TooFewModes {
        /// Modes asked for.
        wanted: usize,
        /// Modes that oscillate.
        found: usize,
        /// Poles that are real.
        real: usize,
    },
    /// The complex modes of a speed stopped before all had converged.
    #[error(
        "{converged} of {wanted} complex poles converged at {speed:.6} rad/s with {vectors} vectors (largest residual \
             {residual:.1e}); ask for fewer modes, or raise the tolerance if that is enough"
    )]
    ComplexNotConverged {
        /// Poles that did.
        converged: usize,
        /// Poles wanted.
        wanted: usize,
        /// Vectors used.
        vectors: usize,
        /// Largest residual among the wanted.
        residual: f64,
        /// Speed in rad/s.
        speed: f64,
    },
    /// A forced response in the space of complex modes that misses its load.
    #[error(
        "the response at {speed:.6} rad/s misses its load by {residual:.1e} with {vectors} vectors; ask for fewer inputs at \
             once, a narrower band, or solve it directly"
    )]
    ResponseNotConverged {
        /// Vectors used.
        vectors: usize,
        /// Largest residual beside the load.
        residual: f64,
        /// Speed in rad/s.
        speed: f64,
    },
    /// The inertia count and the modes found disagree.
    #[error(
        "{counted} modes lie below {freq_hz:.6} Hz by the inertia of K - sigma*M, {found} were found; \
             modes are too close together there for the working precision"
    )]
    Missing {
        /// By inertia.
        counted: usize,
        /// By the iteration.
        found: usize,
        /// Upper end in Hz.
        freq_hz: f64,
    },
}

fn gigabytes(bytes: usize) -> f64 {
    bytes as f64 * 1e-9
}

fn list(dofs: &[usize]) -> String {
    let mut text: Vec<String> = dofs.iter().take(12).map(|d| format!("DOF {d}")).collect();
    if dofs.len() > 12 {
        text.push(format!("and {} more", dofs.len() - 12));
    }
    text.join(", ")
}
