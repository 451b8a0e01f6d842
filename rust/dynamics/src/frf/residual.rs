//! Static response of the modes left out.

use std::sync::Arc;

use femend_linalg::{Dense, Factor, Kind as FactorKind, Symbolic, SymmetricCsc, gemm, gemm_tn};

use crate::DynamicsError;

/// Static response of the modes left out: X = K⁻¹ B - Φ Λ⁻¹ Φᵀ B without its rigid-body part (n, n_b).
///
/// For a free structure `phi` must hold all rigid-body modes; the load is then balanced by inertia (inertia relief) and
/// the equations at the shift are iterated to those at zero.
///
/// # Errors
/// [`DynamicsError::Argument`] where rigid-body modes are missing from `phi`; shift errors as for modes.
pub fn residual_vectors(
    symbolic: &Arc<Symbolic>,
    k: &SymmetricCsc,
    m: &SymmetricCsc,
    phi: &Dense,
    b: &Dense,
) -> Result<Dense, DynamicsError> {
    let shifted = crate::modes::static_shift(symbolic, k, m, phi)?;
    let (sigma, factor): (f64, Factor) = (shifted.sigma, shifted.factor);
    debug_assert_eq!(factor.kind(), FactorKind::Cholesky);
    let m_phi = m.times(phi);
    let project = |x: &mut Dense| gemm(x, 1.0, -1.0, phi, &gemm_tn(&m_phi, x));
    let mut load = b.clone();
    gemm(&mut load, 1.0, -1.0, &m_phi, &gemm_tn(phi, b));
    let mut x = factor.solve(&load);
    project(&mut x);
    if sigma == 0.0 {
        return Ok(x);
    }
    let size = |x: &Dense| x.data().iter().fold(0.0f64, |a, v| a.max(v.abs()));
    let mut term = x.clone();
    for _ in 0..200 {
        // S x = f - σ M x on the complement of phi, as a series
        term = m.times(&term);
        term.data_mut().iter_mut().for_each(|v| *v *= -sigma);
        factor.solve_in_place(&mut term);
        project(&mut term);
        x.data_mut().iter_mut().zip(term.data()).for_each(|(x, t)| *x += t);
        if size(&term) <= 1e-15 * size(&x) {
            return Ok(x);
        }
    }
    Err(DynamicsError::Argument(
        "the static response of the modes left out does not converge: phi lacks rigid-body modes of this free model; \
         pass all of them"
            .into(),
    ))
}
