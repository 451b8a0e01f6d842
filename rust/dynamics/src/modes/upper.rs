//! The count of modes at the upper end, by inertia.

use std::sync::Arc;

use femend_linalg::{Factor, Kind, LinalgError, Symbolic, SymmetricCsc};

use super::ModesInfo;
use crate::DynamicsError;

/// Relative gap in λ below which two modes are not separated by an inertia count.
const GAP: f64 = 1e-6;

/// Share of the shift of a free model below which its rigid-body modes lie, apart by rounding alone: the first elastic
/// one is at twice the shift.
const RIGID: f64 = 0.1;

/// Where to count: the end of the band, or the first clear gap from the last wanted mode on. Modes near 0 beside a
/// negative shift `sigma` are one cluster, which the end must not cut: K itself is singular there.
pub(super) fn upper_end(
    lambda: &[f64],
    wanted: usize,
    by_number: bool,
    band: Option<f64>,
    sigma: f64,
) -> f64 {
    let rigid = |l: f64| l < RIGID * -sigma;
    let gap = |j: usize| lambda[j + 1] - lambda[j] > GAP * lambda[j + 1].abs() && !rigid(lambda[j + 1]);
    let from_gap = || {
        let last = (wanted - 1..lambda.len().saturating_sub(1)).find(|&j| gap(j)).unwrap_or(lambda.len() - 1);
        match lambda.get(last + 1) {
            Some(next) => lambda[last] + 0.5 * (next - lambda[last]).min(0.02 * next.abs()),
            None if rigid(lambda[last]) => -sigma,
            None => lambda[last] * (1.0 + 1e-3),
        }
    };
    match band {
        Some(b) if !by_number || lambda.get(wanted).is_none_or(|&next| next > b) => b,
        _ => from_gap(),
    }
}

/// Modes below `upper` by inertia. The end is moved off modes on which it falls, and returned as used.
pub(crate) fn count_below(
    symbolic: &Arc<Symbolic>,
    k: &SymmetricCsc,
    m: &SymmetricCsc,
    upper: f64,
    lambda: &[f64],
    info: &mut ModesInfo,
) -> Result<(usize, f64), DynamicsError> {
    let mut upper = upper;
    for attempt in 1..=6 {
        while lambda.iter().any(|l| (l - upper).abs() < 0.1 * GAP * upper.abs()) {
            upper *= 1.0 + GAP;
        }
        info.factorisations += 1;
        match Factor::new(symbolic.clone(), k.plus(-upper, m).values(), Kind::Indefinite, None) {
            Ok(factor) => {
                let counted = factor.inertia().negative;
                info.counted = Some(counted);
                return Ok((counted, upper));
            }
            Err(LinalgError::Singular { .. } | LinalgError::Probe { .. }) if attempt < 6 => {
                upper *= 1.0 + 3.0 * GAP * f64::from(attempt);
            }
            Err(other) => return Err(other.into()),
        }
    }
    unreachable!("the last attempt returns")
}
