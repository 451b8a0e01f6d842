//! What can go wrong in sparse symmetric algebra.

use crate::factor::ZeroPivot;

/// Errors of this crate. DOF numbers are rows of the matrix, from 0.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LinalgError {
    /// A pattern whose arrays break an invariant of compressed columns.
    #[error("sparse pattern is not usable: {0}")]
    Pattern(String),
    /// Arrays of unequal size.
    #[error("{what} has {found} entries, {expected} expected")]
    Shape {
        /// The array, by name.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The length that fits the pattern.
        expected: usize,
    },
    /// A NaN or infinite value in a matrix.
    #[error("{what} holds {value} at row {row}, column {column}; every entry must be finite")]
    NotFinite {
        /// The array, by name.
        what: &'static str,
        /// Row.
        row: usize,
        /// Column.
        column: usize,
        /// The value.
        value: f64,
    },
    /// Values that are not symmetric.
    #[error("matrix is not symmetric: entry ({row}, {column}) is {a:e}, its mirror {b:e}")]
    NotSymmetric {
        /// Row.
        row: usize,
        /// Column.
        column: usize,
        /// Entry.
        a: f64,
        /// Mirror entry.
        b: f64,
    },
    /// Cholesky met a negative or zero pivot.
    #[error("matrix is not positive definite")]
    NotPositiveDefinite,
    /// The matrix has no inverse to working precision; `pivots` names the DOFs where elimination stopped.
    #[error("matrix is singular: {} zero pivot(s) relative to the diagonal, at {}; these DOFs move without resistance: \
             constrain them, give them stiffness or shift", pivots.len(), list(pivots))]
    Singular {
        /// DOFs with their pivot relative to the diagonal.
        pivots: Vec<ZeroPivot>,
    },
    /// The factor does not reproduce a known solution.
    #[error(
        "factorisation failed its probe: relative residual {residual:.2e} exceeds {tolerance:.0e}; the matrix is too \
             ill-conditioned at this shift"
    )]
    Probe {
        /// Relative residual found.
        residual: f64,
        /// Limit.
        tolerance: f64,
    },
    /// Not enough memory.
    #[error("needs {:.2} GB of memory, {}; use a machine with more, a coarser model or a reduction to fewer DOFs",
            *bytes as f64 * 1e-9, left(*free))]
    Memory {
        /// Bytes wanted.
        bytes: usize,
        /// Bytes free, where the system says.
        free: Option<usize>,
    },
    /// A library routine did not converge or refused its input.
    #[error("{0}")]
    Library(String),
}

fn left(free: Option<usize>) -> String {
    free.map_or("more than the machine gives".into(), |f| format!("{:.2} GB are free", f as f64 * 1e-9))
}

fn list(pivots: &[ZeroPivot]) -> String {
    let mut text: Vec<String> =
        pivots.iter().take(12).map(|p| format!("DOF {} ({:.1e})", p.dof, p.ratio)).collect();
    if pivots.len() > 12 {
        text.push(format!("and {} more", pivots.len() - 12));
    }
    text.join(", ")
}
