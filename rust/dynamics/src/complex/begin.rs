//! What a space begins with: the stiffness that is factorised, and real modes where the model is free or small.

use std::sync::Arc;

use femend_linalg::{Factor, Kind as FactorKind, LinalgError, Symbolic, SymmetricCsc};

use super::options::{ComplexOptions, SMALL};
use super::terms::{Parts, Power, Term};
use crate::DynamicsError;
use crate::modes::{ModeOptions, Modes, Shifted, modes_and_factor};

/// Refuses terms and options that do not fit.
pub(super) fn check(nnz: usize, terms: &[Term], options: &ComplexOptions) -> Result<(), DynamicsError> {
    let bad = |text: String| Err(DynamicsError::Argument(text));
    if let Some(t) = terms.iter().find(|t| t.values.len() != nnz) {
        let found = t.values.len();
        return bad(format!(
            "a {:?} term has {found} values, {nnz} expected: one for each entry of the pattern of K",
            t.power
        ));
    }
    if terms.iter().any(|t| t.values.iter().any(|v| !v.is_finite())) {
        return bad("a term has values that are not finite".into());
    }
    match (options.n_modes, options.f_max) {
        (None, None) => bad("neither n_modes nor f_max is given; pass one of them".into()),
        (Some(0), _) => bad("n_modes = 0; ask for at least one mode".into()),
        (_, Some(f)) if !(f > 0.0 && f.is_finite()) => {
            bad(format!("f_max = {f} Hz; it must be positive and finite"))
        }
        _ if !(options.tolerance > 0.0 && options.left_tolerance > 0.0) => bad(format!(
            "tolerance = {}, left_tolerance = {}; both must be positive",
            options.tolerance, options.left_tolerance
        )),
        _ => Ok(()),
    }
}

/// K and M at rest.
pub(super) struct Rest {
    pub symbolic: Arc<Symbolic>,
    pub k: SymmetricCsc,
    pub m: SymmetricCsc,
}

/// What a space begins with.
pub(super) struct Begun {
    /// The stiffness that is factorised.
    pub base: SymmetricCsc,
    pub shifted: Shifted,
    /// Real modes of a free or a small model.
    pub real: Option<Modes>,
}

/// K at the speed with its factor; for a free model K - σM at rest with real modes beyond the wanted ones.
pub(super) fn begin(
    symbolic: &Arc<Symbolic>,
    k: &SymmetricCsc,
    m: &SymmetricCsc,
    terms: &[Term],
    speed: f64,
    options: &ComplexOptions,
) -> Result<Begun, DynamicsError> {
    let real = |n_modes, f_max| {
        let options = ModeOptions { n_modes, f_max, ..Default::default() };
        let (real, shifted) = modes_and_factor(symbolic, k, m, &options)?;
        Ok(Begun { base: k.clone(), shifted, real: Some(real) })
    };
    if k.n() <= SMALL {
        return real(Some(1), None);
    }
    if k.pattern() != m.pattern() {
        let (rows, other) = (k.n(), m.n());
        return Err(DynamicsError::Argument(format!(
            "K ({rows} rows) and M ({other} rows) do not share one pattern"
        )));
    }
    let mut bases = Vec::new();
    if let Some(turning) = stiffness_at(k, terms, speed) {
        bases.push(turning);
    }
    bases.push(k.clone());
    for base in bases {
        match Factor::new(symbolic.clone(), base.values(), FactorKind::Cholesky, None) {
            Ok(factor) => return Ok(Begun { base, shifted: Shifted { sigma: 0.0, factor }, real: None }),
            Err(
                LinalgError::NotPositiveDefinite | LinalgError::Singular { .. } | LinalgError::Probe { .. },
            ) => {}
            Err(other) => return Err(other.into()),
        }
    }
    let more = options.n_modes.map(|n| n + n / 2 + 8);
    match real(more, options.f_max.map(|f| 1.5 * f)) {
        // fewer modes than that: those that there are
        Err(DynamicsError::Argument(_)) if options.n_modes.is_some() => real(options.n_modes, options.f_max),
        other => other,
    }
}

/// K with the symmetric terms that the speed adds to it; `None` where it adds none.
fn stiffness_at(k: &SymmetricCsc, terms: &[Term], speed: f64) -> Option<SymmetricCsc> {
    let mut values = k.values().to_vec();
    let mut changed = false;
    for term in terms.iter().filter(|t| t.power == Power::Stiffness) {
        let weight = speed.powi(term.speed_power);
        if weight != 0.0 && Parts::new(k.pattern(), term).skew.is_none() {
            values.iter_mut().zip(&term.values).for_each(|(v, t)| *v += weight * t);
            changed = true;
        }
    }
    changed.then(|| SymmetricCsc::new(k.pattern().clone(), values, "K + W^2 S").ok()).flatten()
}
