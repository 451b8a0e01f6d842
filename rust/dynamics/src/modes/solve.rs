//! From K and M to modes: shift, iteration, proof of completeness, residuals.

use std::f64::consts::TAU;
use std::sync::Arc;

use femend_linalg::{Dense, Symbolic, SymmetricCsc};

use super::finish::finish;
use super::goal::{BEYOND, Goal, converge, too_few};
use super::lanczos::Lanczos;
use super::mass;
use super::need;
use super::options::{ModeOptions, SMALL};
use super::product::Compact;
use super::shift::{self, Shifted};
use super::small::{self, Pairs};
use super::upper::{count_below, upper_end};
use crate::DynamicsError;

/// Residual K φ - λ M φ above which the vectors are solved for once more.
const SHARP: f64 = 1e-8;

/// Real normal modes, lowest first.
#[derive(Debug, Clone)]
pub struct Modes {
    /// Eigenvalues ω² in rad²/s²; exactly 0 for rigid-body modes.
    pub lambda: Vec<f64>,
    /// Frequencies in Hz.
    pub freq_hz: Vec<f64>,
    /// Mass-normalised shapes (n, n_modes), largest component positive.
    pub phi: Dense,
    /// ‖K φ - λ M φ‖ / (|λ - σ| ‖M φ‖) in the Euclidean norm.
    pub residual: Vec<f64>,
    /// How it went.
    pub info: ModesInfo,
}

/// How an eigensolution went.
#[derive(Debug, Clone, Default)]
pub struct ModesInfo {
    /// Final shift in rad²/s².
    pub sigma: f64,
    /// Modes with λ = 0 to the rounding of K.
    pub n_rigid: usize,
    /// Modes below the upper end by inertia; `None` where the model was solved completely or the check left out.
    pub counted: Option<usize>,
    /// Lanczos vectors.
    pub vectors: usize,
    /// Right-hand sides solved.
    pub solves: usize,
    /// Numeric factorisations.
    pub factorisations: usize,
}

/// Solves K φ = λ M φ. `symbolic` belongs to the common pattern of K and M and serves any number of calls.
///
/// # Errors
/// [`DynamicsError::Argument`], [`DynamicsError::Mechanism`], [`DynamicsError::NegativeStiffness`],
/// [`DynamicsError::NegativeMass`], [`DynamicsError::NotConverged`], [`DynamicsError::Missing`], [`DynamicsError::Linalg`], and
/// [`DynamicsError::Memory`] before anything is factorised, or before the basis outgrows what is free.
pub fn modes(
    symbolic: &Arc<Symbolic>,
    k: &SymmetricCsc,
    m: &SymmetricCsc,
    options: &ModeOptions,
) -> Result<Modes, DynamicsError> {
    Ok(modes_and_factor(symbolic, k, m, options)?.0)
}

/// [`modes`], with the K - σM that was factorised.
pub(crate) fn modes_and_factor(
    symbolic: &Arc<Symbolic>,
    k: &SymmetricCsc,
    m: &SymmetricCsc,
    options: &ModeOptions,
) -> Result<(Modes, Shifted), DynamicsError> {
    let band = check(k, m, options)?;
    mass::not_negative(m)?;
    need::fits(symbolic, options)?;
    let mut info = ModesInfo { factorisations: 1, ..Default::default() };
    let (mut shifted, free) = match options.sigma {
        Some(sigma) => (shift::below(symbolic, k, m, sigma)?, false),
        None => shift::automatic(symbolic, k, m, band)?,
    };
    if k.n() <= SMALL {
        let found = dense(k, m, options, band, &shifted, free, info)?;
        if found.info.sigma != shifted.sigma {
            shifted = shift::below(symbolic, k, m, found.info.sigma)?;
        }
        return Ok((found, shifted));
    }
    if free {
        info.factorisations += 1;
        if band.is_none() {
            shifted = raise(symbolic, k, m, shifted, &mut info)?;
        }
    }
    let found = match iterate(symbolic, k, m, options, band, &shifted, &mut info) {
        // a start that leads nowhere is no reason to fail where none would not
        Err(DynamicsError::NotConverged { .. } | DynamicsError::Missing { .. })
            if options.start.is_some() =>
        {
            let cold = ModeOptions { start: None, ..*options };
            iterate(symbolic, k, m, &cold, band, &shifted, &mut info)?
        }
        found => found?,
    };
    Ok((finish(k, shifted.sigma, found, info)?, shifted))
}

fn check(k: &SymmetricCsc, m: &SymmetricCsc, options: &ModeOptions) -> Result<Option<f64>, DynamicsError> {
    let bad = |text: String| Err(DynamicsError::Argument(text));
    if k.pattern() != m.pattern() {
        return bad(format!("K ({} rows) and M ({} rows) do not share one pattern", k.n(), m.n()));
    }
    if options.start.as_ref().is_some_and(|s| s.nrows() != k.n()) {
        return bad(format!("start shapes have another number of rows than K ({})", k.n()));
    }
    match (options.n_modes, options.f_max) {
        (None, None) => bad("neither n_modes nor f_max is given; pass one of them".into()),
        (Some(0), _) => bad("n_modes = 0; ask for at least one mode".into()),
        (_, Some(f)) if !(f > 0.0 && f.is_finite()) => {
            bad(format!("f_max = {f} Hz; it must be positive and finite"))
        }
        (_, f_max) => Ok(f_max.map(|f| (TAU * f).powi(2))),
    }
}

/// Raises the shift of a free model to the scale of its first elastic mode, so that elastic modes keep all their digits.
fn raise(
    symbolic: &Arc<Symbolic>,
    k: &SymmetricCsc,
    m: &SymmetricCsc,
    low: Shifted,
    info: &mut ModesInfo,
) -> Result<Shifted, DynamicsError> {
    let compact = Compact::new(m);
    let mut process = Lanczos::new(&compact, &low.factor, 4, None, 32);
    loop {
        let more = process.step();
        let ritz = process.ritz()?;
        let elastic = (0..ritz.theta.len())
            .map(|j| (low.sigma + 1.0 / ritz.theta[j], ritz.error[j]))
            .find(|(lambda, _)| *lambda > -10.0 * low.sigma);
        match elastic {
            Some((lambda, error)) if error < 0.05 || !more => {
                info.solves += process.solves;
                info.factorisations += 1;
                return shift::below(symbolic, k, m, -0.5 * lambda);
            }
            _ if !more => return Ok(low),
            _ => {}
        }
    }
}

/// All finite modes of a small model, cut to what was asked.
fn dense(
    k: &SymmetricCsc,
    m: &SymmetricCsc,
    options: &ModeOptions,
    band: Option<f64>,
    shifted: &Shifted,
    free: bool,
    info: ModesInfo,
) -> Result<Modes, DynamicsError> {
    let mut sigma = shifted.sigma;
    let (mut lambda, mut phi) = small::all_modes(k, m, sigma)?;
    // the first elastic mode, once known, sets the shift
    let elastic = lambda.iter().copied().find(|&l| l > -10.0 * sigma);
    if let (true, Some(elastic)) = (free && band.is_none(), elastic) {
        sigma = -0.5 * elastic;
        (lambda, phi) = small::all_modes(k, m, sigma)?;
    }
    let found = lambda.len();
    let in_band = band.map_or(found, |b| lambda.iter().filter(|&&l| l <= b).count());
    let count = options.n_modes.map_or(in_band, |n| if band.is_some() { n.min(in_band) } else { n });
    if count > found {
        return Err(too_few(count, found));
    }
    let columns: Vec<usize> = (0..count).collect();
    lambda.truncate(count);
    finish(k, sigma, Pairs::new(k, m, lambda, phi.select(&columns)), info)
}

/// Modes in the span of `vectors`, which are solved for once more where one of the first `wanted` has a large residual.
fn sharp(
    k: &SymmetricCsc,
    m: &Compact,
    sigma: f64,
    process: &mut Lanczos<'_>,
    vectors: Dense,
    wanted: usize,
) -> Result<Pairs, DynamicsError> {
    let found = small::rayleigh_ritz(k, m, sigma, vectors)?;
    if found.residuals(sigma)[..wanted].iter().all(|r| *r <= SHARP) {
        return Ok(found);
    }
    let mut x = found.phi;
    process.apply(&mut x);
    small::rayleigh_ritz(k, m, sigma, x)
}

/// Lanczos until the wanted modes have converged and their number agrees with the inertia at the upper end.
fn iterate(
    symbolic: &Arc<Symbolic>,
    k: &SymmetricCsc,
    m: &SymmetricCsc,
    options: &ModeOptions,
    band: Option<f64>,
    shifted: &Shifted,
    info: &mut ModesInfo,
) -> Result<Pairs, DynamicsError> {
    let sigma = shifted.sigma;
    let compact = Compact::new(m);
    let (block, room) = (need::block(options.n_modes), need::room(options.n_modes));
    let mut process = Lanczos::new(&compact, &shifted.factor, block, options.start.as_ref(), room);
    let mut goal = Goal { n_modes: options.n_modes, band, sigma, below: None };
    for round in 0..4 {
        let (ritz, wanted) = converge(&mut process, &goal)?;
        if wanted == 0 {
            // an empty band is a claim like any other
            return if options.unchecked || count_below(symbolic, k, m, band.unwrap_or(0.0), &[], info)?.0 == 0
            {
                Ok(Pairs::new(k, m, Vec::new(), Dense::zeros(k.n(), 0)))
            } else {
                process.inject();
                continue;
            };
        }
        // a few beyond, so that the last wanted ones are not cut out of a cluster
        let known = goal.below.map_or(0, |(count, _)| count.saturating_sub(wanted));
        let beyond =
            (wanted..ritz.theta.len()).take_while(|&j| ritz.error[j] < BEYOND).take(known + 4).count();
        let vectors = process.vectors(&ritz, wanted + beyond);
        let found = sharp(k, &compact, sigma, &mut process, vectors, wanted)?;
        info.vectors = process.len();
        let lambda = &found.lambda;
        let agreed = options.unchecked || {
            let upper = upper_end(lambda, wanted, options.n_modes.is_some(), band, sigma);
            let (counted, upper) = count_below(symbolic, k, m, upper, lambda, info)?;
            let below = lambda.iter().filter(|&&l| l < upper).count();
            goal.below = Some((counted, upper));
            if below > counted || (below < counted && round == 3) {
                let freq_hz = upper.max(0.0).sqrt() / TAU;
                return Err(DynamicsError::Missing { counted, found: below, freq_hz });
            }
            below == counted
        };
        info.solves += process.solves;
        process.solves = 0;
        if agreed {
            return Ok(found.first(wanted));
        }
    }
    Err(DynamicsError::NotConverged {
        converged: 0,
        wanted: options.n_modes.unwrap_or(0),
        vectors: process.len(),
        residual: f64::NAN,
    })
}
