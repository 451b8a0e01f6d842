//! The shift at which K - σM is factorised.

use std::sync::Arc;

use femend_linalg::{Dense, Factor, Kind, LinalgError, Symbolic, SymmetricCsc};

use super::rounding::free_all_the_same;
use crate::DynamicsError;

/// First shift of a free model beside the smallest k_jj / m_jj, which bounds the lowest eigenvalue from above.
const FREE: f64 = 1e-9;
/// Further shifts, one after the other, where the first is lost in the round-off of K: soft modal coordinates of a reduced
/// part bound the lowest eigenvalue far below what its stiff interface can show.
const RAISED: [f64; 2] = [1e-6, 1e-3];

/// K - σM with its factor.
pub(crate) struct Shifted {
    pub sigma: f64,
    pub factor: Factor,
}

/// Σ scale of the eigenvalues: min over DOFs with mass of k_jj / m_jj, a Rayleigh quotient of a unit vector.
pub(crate) fn rayleigh_bound(k: &SymmetricCsc, m: &SymmetricCsc) -> Option<f64> {
    let (kd, md) = (k.diagonal(), m.diagonal());
    kd.iter().zip(&md).filter(|&(&k, &m)| m > 0.0 && k > 0.0).map(|(&k, &m)| k / m).min_by(f64::total_cmp)
}

/// Factorises K - σM for σ below every mode.
///
/// # Errors
/// [`DynamicsError::Mechanism`] or [`DynamicsError::NegativeStiffness`] when no such σ exists or it lies too high.
pub(crate) fn below(
    symbolic: &Arc<Symbolic>,
    k: &SymmetricCsc,
    m: &SymmetricCsc,
    sigma: f64,
) -> Result<Shifted, DynamicsError> {
    let shifted = k.plus(-sigma, m);
    match Factor::new(symbolic.clone(), shifted.values(), Kind::Cholesky, None) {
        Ok(factor) => Ok(Shifted { sigma, factor }),
        Err(LinalgError::NotPositiveDefinite | LinalgError::Singular { .. }) => {
            Err(explain(symbolic, &shifted, sigma))
        }
        Err(other) => Err(other.into()),
    }
}

/// Why a shifted stiffness is not positive definite.
fn explain(symbolic: &Arc<Symbolic>, shifted: &SymmetricCsc, sigma: f64) -> DynamicsError {
    match Factor::new(symbolic.clone(), shifted.values(), Kind::Indefinite, None) {
        Ok(factor) => DynamicsError::NegativeStiffness { count: factor.inertia().negative, sigma },
        Err(LinalgError::Singular { pivots }) if sigma < 0.0 => {
            let mut dofs: Vec<usize> = pivots.iter().map(|p| p.dof).collect();
            dofs.sort_unstable();
            DynamicsError::Mechanism { dofs }
        }
        Err(other) => other.into(),
    }
}

/// σ = 0 where K is positive definite beyond rounding, else a small negative shift. The flag tells whether the model is
/// free.
pub(crate) fn automatic(
    symbolic: &Arc<Symbolic>,
    k: &SymmetricCsc,
    m: &SymmetricCsc,
    band: Option<f64>,
) -> Result<(Shifted, bool), DynamicsError> {
    match Factor::new(symbolic.clone(), k.values(), Kind::Cholesky, None) {
        Ok(factor) if !free_all_the_same(k, m, &factor) => {
            return Ok((Shifted { sigma: 0.0, factor }, false));
        }
        Ok(_) => {}
        Err(LinalgError::NotPositiveDefinite | LinalgError::Singular { .. } | LinalgError::Probe { .. }) => {}
        Err(other) => return Err(other.into()),
    }
    let Some(bound) = rayleigh_bound(k, m) else {
        return Err(explain(symbolic, k, 0.0));
    };
    // a band in rad²/s² is the scale itself; else start low, the caller raises it when it knows the first elastic mode
    let size = band.map_or(FREE * bound, |b| (0.01 * b).min(bound));
    let first = below(symbolic, k, m, -size);
    if !matches!(first, Err(DynamicsError::Mechanism { .. })) {
        return Ok((first?, true));
    }
    for share in RAISED.into_iter().filter(|share| share * bound > size) {
        if let Ok(shifted) = below(symbolic, k, m, -share * bound) {
            return Ok((shifted, true));
        }
    }
    Ok((first?, true))
}

/// A shift for static solutions beside known modes `phi` (n, r): zero, or for a free model minus the least non-rigid
/// Rayleigh quotient among them, so that the iteration back to zero is short.
pub(crate) fn static_shift(
    symbolic: &Arc<Symbolic>,
    k: &SymmetricCsc,
    m: &SymmetricCsc,
    phi: &Dense,
) -> Result<Shifted, DynamicsError> {
    let (low, free) = automatic(symbolic, k, m, None)?;
    if !free {
        return Ok(low);
    }
    let (kp, mp) = (k.times(phi), m.times(phi));
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let elastic = (0..phi.ncols())
        .map(|j| dot(phi.col(j), kp.col(j)) / dot(phi.col(j), mp.col(j)))
        .filter(|&l| l > -10.0 * low.sigma)
        .min_by(f64::total_cmp);
    match elastic {
        Some(lambda) => below(symbolic, k, m, -0.5 * lambda),
        None => Ok(low),
    }
}
