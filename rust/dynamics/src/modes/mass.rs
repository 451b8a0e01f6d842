//! Is the mass one from which modes follow?

use femend_linalg::SymmetricCsc;

use crate::DynamicsError;

/// A diagonal term is negative below this share of the largest one: less is rounding of massless DOFs.
const NONE: f64 = 1e-14;
/// Relative rounding of a minor of two rows: an eccentric mass without inertia has it zero, and a direct matrix may be
/// written with five digits.
const MINOR: f64 = 1e-3;

/// M positive semi-definite has no negative diagonal term and no pair of rows with `m_ij² > m_ii m_jj`. That shows masses
/// below nothing at single nodes, which the M inner product of the iteration would leave out without a word.
///
/// # Errors
/// [`DynamicsError::NegativeMass`] with the rows.
pub(super) fn not_negative(m: &SymmetricCsc) -> Result<(), DynamicsError> {
    let diagonal = m.diagonal();
    let largest = diagonal.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
    let mut dofs: Vec<usize> = (0..m.n()).filter(|&j| diagonal[j] < -NONE * largest).collect();
    if dofs.is_empty() {
        for j in 0..m.n() {
            let shown = m.pattern().range(j).any(|e| {
                let i = m.pattern().row_idx()[e] as usize;
                let (product, value) = (diagonal[i] * diagonal[j], m.values()[e]);
                let lost = NONE * largest * diagonal[i].max(diagonal[j]);
                i != j && value * value > product.max(0.0) * (1.0 + MINOR) + lost
            });
            if shown {
                dofs.push(j);
            }
        }
    }
    if dofs.is_empty() { Ok(()) } else { Err(DynamicsError::NegativeMass { dofs }) }
}
