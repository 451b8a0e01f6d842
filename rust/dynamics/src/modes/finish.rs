//! From converged pairs to what is handed out: signs, exact zeros of rigid-body modes, residuals.

use std::f64::consts::TAU;

use femend_linalg::SymmetricCsc;

use super::rounding::Rounding;
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
    let rounding = Rounding::of(k);
    for j in 0..found.lambda.len() {
        let phi = found.phi.col(j);
        // shapes have unit modal mass
        if rounding.hides(phi, found.lambda[j]) {
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
