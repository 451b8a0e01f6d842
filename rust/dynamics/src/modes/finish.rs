//! From converged pairs to what is handed out: signs, exact zeros of rigid-body modes, residuals.

use std::f64::consts::TAU;

use femend_linalg::SymmetricCsc;

use super::small::Pairs;
use super::{Modes, ModesInfo};
use crate::DynamicsError;

/// Signs, rigid-body modes, residuals.
pub(super) fn finish(
    k: &SymmetricCsc,
    sigma: f64,
    mut found: Pairs,
    mut info: ModesInfo,
) -> Result<Modes, DynamicsError> {
    let rows: Vec<f64> =
        (0..k.n()).map(|j| k.pattern().range(j).map(|e| k.values()[e].abs()).sum()).collect();
    for j in 0..found.lambda.len() {
        let phi = found.phi.col(j);
        // rounding of φᵀ K φ is a few units in the last place of |φ|ᵀ |K| |φ|, which row sums bound
        let units = 64.0 * f64::EPSILON;
        let bound: f64 = phi.iter().zip(&rows).map(|(v, r)| v * v * r).sum();
        if found.lambda[j].abs() <= units * bound && found.lambda[j].abs() <= units * rounding(k, phi) {
            found.lambda[j] = 0.0;
            info.n_rigid += 1;
        }
        let largest = phi.iter().copied().max_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or(0.0);
        if largest < 0.0 {
            for block in [&mut found.phi, &mut found.k_phi, &mut found.m_phi] {
                block.col_mut(j).iter_mut().for_each(|v| *v = -*v);
            }
        }
    }
    let residual = found.residuals(sigma);
    let freq_hz = found.lambda.iter().map(|l| l.max(0.0).sqrt() / TAU).collect();
    info.sigma = sigma;
    Ok(Modes { lambda: found.lambda, freq_hz, phi: found.phi, residual, info })
}

/// |φ|ᵀ |K| |φ|.
fn rounding(k: &SymmetricCsc, phi: &[f64]) -> f64 {
    let row = |j: usize| -> f64 {
        let entry = |e: usize| (k.values()[e] * phi[k.pattern().row_idx()[e] as usize]).abs();
        k.pattern().range(j).map(entry).sum()
    };
    phi.iter().enumerate().map(|(j, v)| v.abs() * row(j)).sum()
}
