//! Complex modes of the full problem: the space grows until every residual is small, and then is probed.

use std::sync::Arc;

use femend_linalg::{Symbolic, SymmetricCsc};
use num_complex::Complex64;

use super::begin::{Rest, begin, check};
use super::correction::correct;
use super::found::{ComplexModes, told};
use super::krylov::Growth;
use super::options::{ComplexOptions, SMALL};
use super::probe::probe;
use super::projected::Projected;
use super::select::{Wanted, select};
use super::side::{Full, Side};
use super::space::Space;
use super::terms::{Parts, Power, Term};
use crate::DynamicsError;
use crate::modes::{Compact, ModeOptions, ModesInfo, count_below, modes_and_factor};

/// Rounds of enlargement at most.
const ROUNDS: usize = 60;
/// A part (real or imaginary) of a correction smaller than this beside the whole is left for the next round.
const PART: f64 = 1e-2;
/// Part of λ² beyond the highest wanted pole at which the modes at rest are counted.
const MARGIN: f64 = 1e-3;
/// Relative change of |λ| up to which a pole is the same as before the probe.
const SAME: f64 = 1e-6;

/// A model whose complex modes are wanted at any number of speeds. What one speed adds to the space serves the others.
pub struct ComplexProblem {
    pub(super) space: Space,
    /// As [`Full`] has it.
    magnitude: Compact,
    pub(super) options: ComplexOptions,
    /// √-σ.
    pub(super) s0: f64,
    seed: u64,
    probed: bool,
    /// Undamped modes at rest below the highest in the start space, by inertia.
    pub counted: Option<usize>,
    /// Rigid-body modes of K and M.
    pub n_rigid: usize,
    /// Dense eigenproblems solved.
    pub rounds: usize,
    /// The model at rest, until its modes have been counted.
    rest: Option<Rest>,
}

impl ComplexProblem {
    /// What vectors of the space are held against.
    pub(super) fn full(&self) -> Full<'_> {
        Full { space: &self.space, magnitude: &self.magnitude, tolerance: self.options.tolerance }
    }

    /// The space, with the real modes of K and M in it where these are free. Further terms hold damping, gyroscopic moments
    /// and all that goes with the speed; K at `speed` is what is factorised, where it is positive definite.
    ///
    /// # Errors
    /// As [`crate::modes()`]; [`DynamicsError::Argument`] for values that do not fit the pattern.
    pub fn new(
        symbolic: &Arc<Symbolic>,
        k: &SymmetricCsc,
        m: &SymmetricCsc,
        terms: &[Term],
        speed: f64,
        options: &ComplexOptions,
    ) -> Result<Self, DynamicsError> {
        check(symbolic.pattern().nnz(), terms, options)?;
        let pattern = symbolic.pattern();
        let own = |power, a: &SymmetricCsc| Term { power, speed_power: 0, values: a.values().to_vec() };
        let mut parts =
            vec![Parts::new(pattern, &own(Power::Stiffness, k)), Parts::new(pattern, &own(Power::Mass, m))];
        parts.extend(
            terms.iter().filter(|t| t.values.iter().any(|v| *v != 0.0)).map(|t| Parts::new(pattern, t)),
        );
        let begun = begin(symbolic, k, m, terms, speed, options)?;
        let base = begun.base.plus(-begun.shifted.sigma, m);
        let magnitudes: Vec<f64> = base.values().iter().map(|v| v.abs()).collect();
        let sigma = begun.shifted.sigma;
        let room = options.n_modes.map_or(128, |n| 10 * n + 64).min(k.n());
        let mut space = Space::new(parts, &base, sigma, begun.shifted.factor, room);
        if k.n() <= SMALL {
            space.fill(&base)?;
        } else if let Some(real) = &begun.real {
            space.add(&real.phi);
        }
        let known = begun.real.as_ref().map(|real| &real.info);
        Ok(Self {
            space,
            magnitude: Compact::of_values(pattern, &magnitudes),
            options: options.clone(),
            s0: (-sigma).max(0.0).sqrt(),
            seed: 0x2545_f491_4f6c_dd1d,
            probed: k.n() <= SMALL,
            counted: known.and_then(|info| info.counted),
            n_rigid: known.map_or(0, |info| info.n_rigid),
            rounds: 0,
            rest: begun.real.is_none().then(|| Rest {
                symbolic: symbolic.clone(),
                k: k.clone(),
                m: m.clone(),
            }),
        })
    }

    /// Size of the space.
    pub fn vectors(&self) -> usize {
        self.space.len()
    }

    /// Right-hand sides solved.
    pub fn solves(&self) -> usize {
        self.space.solves
    }

    /// Shift in rad²/s².
    pub fn sigma(&self) -> f64 {
        self.space.sigma
    }

    /// Complex modes at a speed in rad/s.
    ///
    /// # Errors
    /// [`DynamicsError::ComplexNotConverged`], [`DynamicsError::TooFewModes`] where there are fewer than asked for.
    pub fn modes(&mut self, speed: f64) -> Result<ComplexModes, DynamicsError> {
        if !speed.is_finite() {
            return Err(DynamicsError::Argument(format!("speed = {speed} rad/s; it must be finite")));
        }
        let whole = self.space.len() == self.space.n();
        let mut growth = if whole { Growth::default() } else { self.first_growth(speed) };
        let (mut known, mut n_late) = (None, 0);
        for round in 0..ROUNDS {
            let Some(Found { wanted, right, left }) = self.converged(speed, round, whole, &mut growth)?
            else {
                continue;
            };
            let poles: Vec<f64> = wanted.iter().map(|w| w.pair.lambda.norm()).collect();
            let reach = poles.iter().copied().fold(0.0, f64::max);
            if let Some(before) = known.replace(poles) {
                n_late += late(&before, known.as_ref().unwrap_or(&before));
            }
            if !whole && !self.complete(reach)? {
                continue;
            }
            if self.probed || whole {
                return Ok(told(wanted, right, left, n_late));
            }
            probe(&mut self.space, speed, 3, &mut self.seed);
            self.probed = true;
        }
        unreachable!("the last round returns")
    }

    /// The process that makes the space grow, begun where nothing has been solved yet.
    fn first_growth(&mut self, speed: f64) -> Growth {
        let mut growth = Growth::default();
        if self.rounds == 0 {
            let first = if speed == 0.0 && self.rest.is_none() { 1.0 } else { speed };
            match &self.rest {
                Some(_) => {
                    growth.begin(&mut self.space, first, self.options.n_modes, &mut self.seed);
                    // a random block that Arnoldi's process has gone on from is a probe
                    self.probed = true;
                }
                None => probe(&mut self.space, first, 1, &mut self.seed),
            }
        }
        growth
    }

    /// The wanted poles of the projected problem with the residuals of both sides in the full one. `None` where some are too
    /// large yet: the space has been enlarged for them. Nothing can be added to one that is `whole`.
    fn converged(
        &mut self,
        speed: f64,
        round: usize,
        whole: bool,
        growth: &mut Growth,
    ) -> Result<Option<Found>, DynamicsError> {
        let (tolerance, left_tolerance) = (self.options.tolerance, self.options.left_tolerance);
        let projected = Projected::new(&mut self.space, speed);
        let spectrum = projected.eigen(self.s0)?;
        self.rounds += 1;
        let wanted = match select(&spectrum.pairs, &projected, self.s0, &self.options) {
            // a space that is too small yet
            Err(_) if growth.further(&mut self.space, speed, 0, f64::INFINITY, tolerance) => return Ok(None),
            other => other?,
        };
        let vectors: Vec<&[Complex64]> = wanted.iter().map(|w| &w.pair.right[..]).collect();
        let right = Side::of(&self.full(), speed, &wanted, &vectors, false);
        let open = right.open(tolerance);
        if !open.is_empty() && !whole {
            if !growth.further(&mut self.space, speed, 0, right.worst(&open), tolerance) {
                self.enlarge(speed, &wanted, &right, &open, round)?;
            }
            return Ok(None);
        }
        // left vectors once the right ones are there: they hold most of what these need
        let left = spectrum.left(&wanted.iter().map(|w| &w.pair).collect::<Vec<_>>())?;
        let vectors: Vec<&[Complex64]> = left.iter().map(|y| &y[..]).collect();
        let left = Side::of(&self.full(), speed, &wanted, &vectors, true);
        let open = left.open(left_tolerance);
        if !open.is_empty() && !whole && !self.space.symmetric() {
            if !growth.further(&mut self.space, speed, 1, left.worst(&open), left_tolerance) {
                self.enlarge(speed, &wanted, &left, &open, round)?;
            }
            return Ok(None);
        }
        Ok(Some(Found { wanted, right, left }))
    }

    /// Does the space hold as many undamped modes of the model at rest up to `reach` in rad/s as inertia counts? Where it does
    /// not, their shapes are taken into it.
    fn complete(&mut self, reach: f64) -> Result<bool, DynamicsError> {
        let Some(rest) = self.rest.take() else { return Ok(true) };
        let projected = Projected::new(&mut self.space, 0.0);
        let lambda = projected.at_rest()?;
        let mut info = ModesInfo::default();
        let upper = reach * reach * (1.0 + MARGIN);
        let (counted, upper) = count_below(&rest.symbolic, &rest.k, &rest.m, upper, &lambda, &mut info)?;
        self.counted = Some(counted);
        if lambda.iter().filter(|&&l| l < upper).count() >= counted {
            return Ok(true);
        }
        let all = ModeOptions { n_modes: Some(counted), ..Default::default() };
        let (real, _) = modes_and_factor(&rest.symbolic, &rest.k, &rest.m, &all)?;
        self.space.add(&real.phi);
        Ok(false)
    }

    /// Adds what the correction equation makes of residuals that are too large.
    fn enlarge(
        &mut self,
        speed: f64,
        wanted: &[Wanted],
        side: &Side,
        open: &[usize],
        round: usize,
    ) -> Result<(), DynamicsError> {
        if self.space.len() > 12 * wanted.len() + 400 || round + 1 == ROUNDS {
            return Err(DynamicsError::ComplexNotConverged {
                converged: wanted.len() - open.len(),
                wanted: wanted.len(),
                vectors: self.space.len(),
                residual: side.residual.iter().copied().fold(0.0, f64::max),
                speed,
            });
        }
        let lambda: Vec<Complex64> = open.iter().map(|&j| wanted[j].pair.lambda).collect();
        let residuals: Vec<Complex64> = open.iter().flat_map(|&j| side.vectors[j].iter().copied()).collect();
        let block = correct(&mut self.space, speed, &lambda, &residuals, side.transposed);
        let size = |c: usize| block.col(c).iter().map(|v| v * v).sum::<f64>().sqrt();
        let k = open.len();
        let large = |&c: &usize| size(c) > PART * size(c % k).hypot(size(c % k + k));
        let keep: Vec<usize> = (0..2 * k).filter(large).collect();
        self.space.add(&block.select(&keep));
        Ok(())
    }
}

/// Poles of a round whose residuals are small on both sides.
struct Found {
    wanted: Vec<Wanted>,
    right: Side,
    left: Side,
}

/// Poles of the second list that the first does not have.
fn late(before: &[f64], after: &[f64]) -> usize {
    let mut left: Vec<f64> = before.to_vec();
    let mut count = 0;
    for a in after {
        match left.iter().position(|b| (a - b).abs() <= SAME * a.abs()) {
            Some(at) => {
                left.swap_remove(at);
            }
            None => count += 1,
        }
    }
    count
}
