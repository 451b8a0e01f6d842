//! Complex modes of the full problem: the space grows until every residual is small, and then is probed.

use std::sync::Arc;

use femend_linalg::{Dense, Symbolic, SymmetricCsc};
use num_complex::Complex64;

use super::probe::probe;
use super::projected::Projected;
use super::select::{Wanted, select};
use super::space::Space;
use super::terms::{Parts, Power, Products, Term, stacked};
use crate::DynamicsError;
use crate::modes::{Compact, ModeOptions, modes_and_factor};

/// Models up to this size are solved in their whole space.
const SMALL: usize = 60;
/// Rounds of enlargement at most.
const ROUNDS: usize = 60;
/// Multiples of the rounding error of D(λ) ψ that a residual may have left.
const ROUNDING: f64 = 16.0;
/// A part (real or imaginary) of a correction smaller than this beside the whole is left for the next round.
const PART: f64 = 1e-2;
/// Residual from which the rounding error is looked at.
const NEAR: f64 = 1e-5;
/// Relative change of |λ| up to which a pole is the same as before the probe.
const SAME: f64 = 1e-6;

/// What to compute.
#[derive(Debug, Clone)]
pub struct ComplexOptions {
    /// The lowest modes by |λ|; with `f_max` at most so many.
    pub n_modes: Option<usize>,
    /// All modes with |λ| up to this frequency in Hz.
    pub f_max: Option<f64>,
    /// Residual to reach, ‖D(λ)ψ‖ / (‖λ²Mψ‖ + ‖λCψ‖ + ‖(K + iD - σM)ψ‖), right and left.
    pub tolerance: f64,
}

/// What a pole is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PoleKind {
    /// λ = 0.
    Rigid,
    /// Im λ > 0; with its conjugate.
    Oscillatory,
    /// Real.
    Overdamped,
    /// Im λ < 0 with structural damping: not physical there, but a pole of the same rational function.
    Mirrored,
}

/// Complex modes at one speed.
#[derive(Debug, Clone)]
pub struct ComplexModes {
    /// Poles in rad/s: rigid, oscillatory by |λ|, overdamped, mirrored.
    pub lambda: Vec<Complex64>,
    /// What each is.
    pub kind: Vec<PoleKind>,
    /// Right vectors (n, m) column after column, ψᴴMψ = 1, largest component real and positive.
    pub right: Vec<Complex64>,
    /// Left vectors, yᵀ D(λ) = 0, scaled alike.
    pub left: Vec<Complex64>,
    /// a = yᵀ (2λM + C + W G) ψ.
    pub modal_a: Vec<Complex64>,
    /// Residuals of the full problem, right and left.
    pub residual: [Vec<f64>; 2],
    /// (2|λ| ‖ψ‖ ‖y‖ + |yᵀCψ|) / |a| with norms by the mass: 1 where a mode is like a real one, 1/√(1 - ζ²) of one
    /// mass on a spring, large near a defective pole, infinite for rigid-body modes.
    pub condition: Vec<f64>,
    /// Poles that the probe added before they had converged too.
    pub n_late: usize,
}

/// A model whose complex modes are wanted at any number of speeds. What one speed adds to the space serves the others.
pub struct ComplexProblem {
    pub(super) space: Space,
    /// |K|, whose product with |ψ| bounds the rounding error of K ψ.
    magnitude: Compact,
    options: ComplexOptions,
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
}

impl ComplexProblem {
    /// Real modes of K and M and the space they begin. Further terms hold damping, gyroscopic moments and all that goes
    /// with the speed.
    ///
    /// # Errors
    /// As [`crate::modes()`]; [`DynamicsError::Argument`] for values that do not fit the pattern.
    pub fn new(
        symbolic: &Arc<Symbolic>,
        k: &SymmetricCsc,
        m: &SymmetricCsc,
        terms: &[Term],
        options: &ComplexOptions,
    ) -> Result<Self, DynamicsError> {
        let pattern = symbolic.pattern();
        if let Some(t) = terms.iter().find(|t| t.values.len() != pattern.nnz()) {
            let (found, expected) = (t.values.len(), pattern.nnz());
            return Err(DynamicsError::Argument(format!(
                "a {:?} term has {found} values, {expected} expected: one for each entry of the pattern of K",
                t.power
            )));
        }
        if terms.iter().any(|t| t.values.iter().any(|v| !v.is_finite())) {
            return Err(DynamicsError::Argument("a term has values that are not finite".into()));
        }
        let n = k.n();
        let (real, shifted) = start(symbolic, k, m, n <= SMALL, options)?;
        let k_sigma = k.plus(-shifted.sigma, m);
        let own = |power, a: &SymmetricCsc| Term { power, speed_power: 0, values: a.values().to_vec() };
        let mut parts =
            vec![Parts::new(pattern, &own(Power::Stiffness, k)), Parts::new(pattern, &own(Power::Mass, m))];
        parts.extend(
            terms.iter().filter(|t| t.values.iter().any(|v| *v != 0.0)).map(|t| Parts::new(pattern, t)),
        );
        let magnitudes: Vec<f64> = k_sigma.values().iter().map(|v| v.abs()).collect();
        let magnitude = Compact::of_values(pattern, &magnitudes);
        let s0 = (-shifted.sigma).max(0.0).sqrt();
        let room = 4 * real.lambda.len() + 64;
        let mut space = Space::new(parts, &k_sigma, shifted.sigma, shifted.factor, room.min(n));
        if n <= SMALL {
            space.fill(&k_sigma)?;
        } else {
            space.add(&real.phi);
        }
        Ok(Self {
            space,
            magnitude,
            options: options.clone(),
            s0,
            seed: 0x2545_f491_4f6c_dd1d,
            probed: n <= SMALL,
            counted: real.info.counted,
            n_rigid: real.info.n_rigid,
            rounds: 0,
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
    /// [`DynamicsError::ComplexNotConverged`], [`DynamicsError::Argument`] where there are fewer modes than asked for.
    pub fn modes(&mut self, speed: f64) -> Result<ComplexModes, DynamicsError> {
        if !speed.is_finite() {
            return Err(DynamicsError::Argument(format!("speed = {speed} rad/s; it must be finite")));
        }
        let whole = self.space.len() == self.space.n();
        if self.rounds == 0 && !whole {
            probe(&mut self.space, if speed == 0.0 { 1.0 } else { speed }, 1, &mut self.seed);
        }
        let (mut known, mut n_late) = (None, 0);
        for round in 0..ROUNDS {
            let wanted = self.wanted(speed)?;
            let mut checked = self.checked(speed, &wanted);
            let open: Vec<usize> = (0..wanted.len()).filter(|&j| !checked.done(j, &self.options)).collect();
            if open.is_empty() || whole {
                let poles: Vec<f64> = wanted.iter().map(|w| w.pair.lambda.norm()).collect();
                if let Some(before) = known.replace(poles) {
                    n_late += late(&before, known.as_ref().unwrap_or(&before));
                }
                if self.probed || whole {
                    if checked.left.is_none() {
                        checked.left = Some(self.side(speed, &wanted, true));
                    }
                    return Ok(self.told(wanted, checked, n_late));
                }
                probe(&mut self.space, speed, 3, &mut self.seed);
                self.probed = true;
                continue;
            }
            let limit = 12 * wanted.len() + 400;
            if self.space.len() > limit || round + 1 == ROUNDS {
                return Err(self.not_converged(speed, &wanted, &checked, open.len()));
            }
            self.enlarge(&checked, &open);
        }
        unreachable!("the last round returns")
    }

    fn wanted(&mut self, speed: f64) -> Result<Vec<Wanted>, DynamicsError> {
        self.rounds += 1;
        let projected = Projected::new(&self.space, speed);
        let all = projected.eigen(self.s0)?;
        select(all, &projected, self.s0, &self.options)
    }

    fn not_converged(&self, speed: f64, wanted: &[Wanted], checked: &Checked, open: usize) -> DynamicsError {
        DynamicsError::ComplexNotConverged {
            converged: wanted.len() - open,
            wanted: wanted.len(),
            vectors: self.space.len(),
            residual: checked.sides().flat_map(|s| &s.residual).copied().fold(0.0, f64::max),
            speed,
        }
    }

    /// The vectors at all DOFs with the residuals of the full problem.
    fn checked(&self, speed: f64, wanted: &[Wanted]) -> Checked {
        let right = self.side(speed, wanted, false);
        // where all matrices are symmetric, left vectors are right ones, those of repeated poles mixed among themselves
        let left = (!self.space.symmetric()).then(|| self.side(speed, wanted, true));
        Checked { right, left }
    }

    fn side(&self, speed: f64, wanted: &[Wanted], transposed: bool) -> Side {
        let of = |w: &Wanted| if transposed { w.pair.left.clone() } else { w.pair.right.clone() };
        let y: Vec<Complex64> = wanted.iter().flat_map(of).collect();
        let x = self.space.expand(&stacked(self.space.len(), &y));
        let products = Products::new(&self.space.terms, speed, &x, transposed);
        let (mut vectors, mut residual, mut sizes) = (Vec::new(), Vec::new(), Vec::new());
        for (j, w) in wanted.iter().enumerate() {
            let (r, size) = products.residual(j, w.pair.lambda, -self.space.sigma);
            residual.push(r.iter().map(|v| v.norm_sqr()).sum::<f64>().sqrt() / size);
            sizes.push(size);
            vectors.push(r);
        }
        // the rounding error matters where little is left
        let mut floor = vec![0.0; wanted.len()];
        let near = |r: f64| r > self.options.tolerance && r < NEAR;
        if residual.iter().any(|r| near(*r)) {
            let bounds = self.rounding(&x);
            floor = bounds.iter().zip(&sizes).map(|(b, s)| b / s).collect();
        }
        Side { x, products, vectors, residual, floor }
    }

    /// Rounding error of K ψ of each column.
    pub(super) fn rounding(&self, x: &Dense) -> Vec<f64> {
        let k = x.ncols() / 2;
        let mut sizes = Dense::zeros(x.nrows(), k);
        for j in 0..k {
            let parts = x.col(j).iter().zip(x.col(j + k));
            sizes.col_mut(j).iter_mut().zip(parts).for_each(|(s, (a, b))| *s = a.hypot(*b));
        }
        let product = self.magnitude.times(&sizes);
        let norm = |j: usize| product.col(j).iter().map(|v| v * v).sum::<f64>().sqrt();
        (0..k).map(|j| ROUNDING * f64::EPSILON * norm(j)).collect()
    }

    /// K_σ⁻¹ times the residuals that are too large, real and imaginary parts.
    fn enlarge(&mut self, checked: &Checked, open: &[usize]) {
        let n = self.space.n();
        let mut block = Dense::zeros(n, 0);
        for side in checked.sides() {
            for &j in open.iter().filter(|&&j| !side.done(j, &self.options)) {
                let two = stacked(n, &side.vectors[j]);
                let size = |c: usize| two.col(c).iter().map(|v| v * v).sum::<f64>().sqrt();
                let (re, im) = (size(0), size(1));
                let keep: Vec<usize> = [(0, re), (1, im)]
                    .iter()
                    .filter(|(_, s)| *s > PART * re.hypot(im))
                    .map(|p| p.0)
                    .collect();
                block.append(&two.select(&keep));
            }
        }
        let block = self.space.solve(block);
        self.space.add(&block);
    }

    fn told(&self, wanted: Vec<Wanted>, checked: Checked, n_late: usize) -> ComplexModes {
        let (mut right, mut left) = (Vec::new(), Vec::new());
        let (mut modal_a, mut condition) = (Vec::new(), Vec::new());
        let own_side = &checked.right;
        let other_side = checked.left.as_ref().unwrap_or(own_side);
        for (j, w) in wanted.iter().enumerate() {
            let (mut psi, mut y) = (unstacked(&own_side.x, j), unstacked(&other_side.x, j));
            let masses = [(&psi, own_side), (&y, other_side)].map(|(x, side)| {
                let conj: Vec<Complex64> = x.iter().map(|v| v.conj()).collect();
                side.products.forms(j, &conj).0.re
            });
            let factors = [scale(&psi, masses[0]), scale(&y, masses[1])];
            psi.iter_mut().for_each(|v| *v *= factors[0]);
            y.iter_mut().for_each(|v| *v *= factors[1]);
            let (m, c) = own_side.products.forms(j, &y);
            let (m, c) = (m * factors[0], c * factors[0]);
            let a = 2.0 * w.pair.lambda * m + c;
            let mass: f64 = masses.iter().zip(factors).map(|(m, f)| m.max(0.0).sqrt() * f.norm()).product();
            condition.push((2.0 * w.pair.lambda.norm() * mass + c.norm()) / a.norm());
            modal_a.push(a);
            right.append(&mut psi);
            left.append(&mut y);
        }
        ComplexModes {
            lambda: wanted.iter().map(|w| w.pair.lambda).collect(),
            kind: wanted.iter().map(|w| w.kind).collect(),
            right,
            left,
            modal_a,
            residual: [checked.right.residual.clone(), other_side.residual.clone()],
            condition,
            n_late,
        }
    }
}

/// One side's vectors at all DOFs (n, 2 m), D(λ) ψ and its size beside the terms.
struct Side {
    x: Dense,
    products: Products,
    vectors: Vec<Vec<Complex64>>,
    residual: Vec<f64>,
    /// What rounding may leave of it.
    floor: Vec<f64>,
}

impl Side {
    fn done(&self, j: usize, options: &ComplexOptions) -> bool {
        self.residual[j] <= options.tolerance.max(self.floor[j])
    }
}

struct Checked {
    right: Side,
    left: Option<Side>,
}

impl Checked {
    fn sides(&self) -> impl Iterator<Item = &Side> {
        std::iter::once(&self.right).chain(&self.left)
    }

    fn done(&self, j: usize, options: &ComplexOptions) -> bool {
        self.sides().all(|side| side.done(j, options))
    }
}

/// Real modes beyond the wanted ones, and K - σM with its factor.
fn start(
    symbolic: &Arc<Symbolic>,
    k: &SymmetricCsc,
    m: &SymmetricCsc,
    small: bool,
    options: &ComplexOptions,
) -> Result<(crate::Modes, crate::modes::Shifted), DynamicsError> {
    let of = |n_modes, f_max| {
        let options = ModeOptions { n_modes, f_max, ..Default::default() };
        modes_and_factor(symbolic, k, m, &options)
    };
    if small {
        return of(Some(1), None);
    }
    let more = options.n_modes.map(|n| n + n / 2 + 8);
    match of(more, options.f_max.map(|f| 1.5 * f)) {
        // fewer modes than that: those that there are
        Err(DynamicsError::Argument(_)) if options.n_modes.is_some_and(|n| n > 0) => {
            of(options.n_modes, options.f_max)
        }
        other => other,
    }
}

fn unstacked(x: &Dense, j: usize) -> Vec<Complex64> {
    let k = x.ncols() / 2;
    x.col(j).iter().zip(x.col(j + k)).map(|(&re, &im)| Complex64::new(re, im)).collect()
}

/// Factor that makes the mass 1 and the largest component real and positive; a vector without mass gets the length 1.
fn scale(x: &[Complex64], mass: f64) -> Complex64 {
    let largest = x.iter().copied().fold(Complex64::ZERO, |a, v| {
        // of components that are equal to rounding the first
        if v.norm_sqr() > a.norm_sqr() * (1.0 + 1e-9) { v } else { a }
    });
    let length = x.iter().map(|v| v.norm_sqr()).sum::<f64>();
    let size = if mass > f64::MIN_POSITIVE { mass } else { length }.sqrt();
    if largest == Complex64::ZERO { Complex64::ONE } else { largest.conj() / largest.norm() / size }
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
