//! What the iteration is to reach, and the steps until it has.

use super::lanczos::{Lanczos, Ritz};
use crate::DynamicsError;

/// Ritz residual, relative, at which a mode counts as converged (its eigenvalue error is the square).
const TOLERANCE: f64 = 1e-9;
/// Residual at which the first value beyond the wanted ones is known well enough to place the upper end.
pub(super) const BEYOND: f64 = 1e-3;

/// Residual from which a step or two reach the tolerance.
const NEAR: f64 = 1e-6;

/// What the iteration is to reach.
pub(super) struct Goal {
    pub n_modes: Option<usize>,
    pub band: Option<f64>,
    pub sigma: f64,
    /// A number of modes that are known to lie below a value of λ.
    pub below: Option<(usize, f64)>,
}

impl Goal {
    /// Ritz values wanted among the finite ones.
    fn wanted(&self, ritz: &Ritz, finite: usize) -> usize {
        let up_to =
            |end: f64| ritz.theta[..finite].iter().take_while(|&&t| self.sigma + 1.0 / t <= end).count();
        match (self.n_modes, self.band) {
            (Some(n), None) => n,
            (Some(n), Some(end)) => n.min(up_to(end)),
            (None, end) => up_to(end.unwrap_or(0.0)),
        }
    }

    fn reached(&self, ritz: &Ritz, wanted: usize) -> bool {
        let known = self.below.is_none_or(|(count, end)| {
            let converged = |j: &usize| ritz.error[*j] < TOLERANCE && self.sigma + 1.0 / ritz.theta[*j] < end;
            (0..ritz.theta.len()).filter(converged).count() >= count
        });
        known
            && ritz.theta.len() > wanted
            && ritz.error[..wanted].iter().all(|&e| e < TOLERANCE)
            && ritz.error[wanted] < BEYOND
    }
}

/// Steps until the goal is reached; returns how many Ritz values are wanted.
pub(super) fn converge(process: &mut Lanczos<'_>, goal: &Goal) -> Result<(Ritz, usize), DynamicsError> {
    // no mode of a large set has converged before the basis is half as large again
    let mut next_check = process.len() + goal.n_modes.map_or(0, |n| n.min(16).max(n + n / 4));
    let mut steps = 0;
    loop {
        // modes known to be missing: the start was blind to them, so fresh directions widen the block until it holds
        // as many as coincide
        if goal.below.is_some() && steps % 4 == 0 {
            process.inject();
        }
        steps += 1;
        process.make_room()?;
        let more = process.step();
        if more && process.len() < next_check {
            continue;
        }
        let ritz = process.ritz()?;
        let finite = finite(&ritz);
        let wanted = goal.wanted(&ritz, finite);
        if !more {
            return if wanted > finite { Err(too_few(wanted, finite)) } else { Ok((ritz, wanted)) };
        }
        if goal.reached(&ritz, wanted) {
            return Ok((ritz, wanted));
        }
        let expected = wanted.max(goal.below.map_or(0, |(count, _)| count));
        if process.len() > 10 * expected + 800 {
            let errors = &ritz.error[..wanted.min(ritz.error.len())];
            let converged = errors.iter().filter(|&&e| e < TOLERANCE).count();
            let residual = errors.iter().copied().fold(0.0, f64::max);
            return Err(DynamicsError::NotConverged {
                converged,
                wanted: expected,
                vectors: process.len(),
                residual,
            });
        }
        // the dense eigenvalue problem is solved about ten times while the basis doubles, and at every step at the end
        let left = ritz.error[..wanted.min(ritz.error.len())].iter().copied().fold(0.0, f64::max);
        next_check = process.len() + if left < NEAR { 1 } else { process.len() / 12 };
    }
}

/// Ritz values that are not zero to rounding: those would be massless directions.
fn finite(ritz: &Ritz) -> usize {
    let limit = ritz.theta.len() as f64 * f64::EPSILON * ritz.theta.first().copied().unwrap_or(0.0);
    ritz.theta.iter().take_while(|&&t| t > limit).count()
}

pub(super) fn too_few(wanted: usize, found: usize) -> DynamicsError {
    DynamicsError::Argument(format!(
        "n_modes = {wanted}, but the model has only {found} modes of finite frequency (the rank of M)"
    ))
}
