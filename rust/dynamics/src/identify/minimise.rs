//! Levenberg-Marquardt on a hypothesis.
//!
//! The Gauss-Newton matrix costs most of a step, the gradient alone little ([`Adjoint`](super::adjoint)). Near the noise,
//! as long as a step gains a part of what the matrix said, the next one takes it over, mended by what the gradient's change
//! tells (the update of Broyden, Fletcher, Goldfarb and Shanno; Nocedal and Wright, Numerical Optimization, 2006, eq. 6.19).
//! Along a bent valley that gets on where fresh matrices do not: these know nothing of how the valley bends.
//!
//! Far from the noise the free decays take up what the model does not explain, and the exact gradient moves poles so that
//! they take up more: a wrong minimum. There the decays are held as they are while a step is found (the Jacobian of
//! Kaufman, BIT 15, 1975), and every step has a matrix of its own.

use super::IdentifyError;
use super::arrays::Workspace;
use super::hypothesis::Hypothesis;
use super::model::Model;
use super::normal::{Evaluation, Gradient, Matrix, Point};
use super::prepared::Prepared;
use super::system::System;
use femend_linalg::{Dense, gemm};

/// How long and how far the minimisation goes.
#[derive(Debug, Clone, Copy)]
pub struct Settings {
    /// Largest number of accepted steps.
    pub iterations: usize,
    /// Ends when a step lowers the cost by less than this plus a thousandth of it times the cost.
    pub tolerance: f64,
    /// Longest step of any unknown (ln units).
    pub longest: f64,
    /// Whether gradient and Gauss-Newton matrix are wanted at the minimum; they cost as much as a step.
    pub derivatives: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self { iterations: 20, tolerance: 1e-2, longest: 0.5, derivatives: true }
    }
}

/// Minimum of a hypothesis.
#[derive(Debug, Clone)]
pub struct Solution {
    /// Unknowns of the model.
    pub p: Vec<f64>,
    /// Logarithms of the law's parameters.
    pub x: Vec<f64>,
    /// Evaluation there; gradient and matrix are whole where they are wanted, else what the search had.
    pub at: Evaluation,
    /// Accepted steps.
    pub iterations: usize,
    /// Whether the last step was below the tolerance; otherwise the steps ran out or none lowered the cost.
    pub converged: bool,
}

/// Ratios of a step's fall of the cost to the foretold one between which the matrix may be kept.
const AS_TOLD: (f64, f64) = (0.1, 4.0);
/// Steps that one Gauss-Newton matrix may serve beyond its own.
const MOST_KEPT: usize = 30;
/// Trials of a step, with a Gauss-Newton matrix and with one that was taken over.
const TRIALS: (usize, usize) = (7, 2);
/// Damping that a descent begins with, and least after a step that did not lower the cost.
const DAMPING: f64 = 1e-4;

/// Step -(H + lambda diag H)^-1 g; none when the matrix is not positive definite.
fn step(at: &Evaluation, lambda: f64, longest: f64) -> Option<Vec<f64>> {
    let n = at.gradient.len();
    let mut a = at.hessian.clone();
    for i in 0..n {
        a[(i, i)] *= 1.0 + lambda;
    }
    let mut d = a.solve_definite(&at.gradient).ok()?;
    d.iter_mut().for_each(|v| *v = (-*v).clamp(-longest, longest));
    d.iter().all(|v| v.is_finite()).then_some(d)
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn times(h: &Dense, d: &[f64]) -> Vec<f64> {
    let mut hd = Dense::zeros(d.len(), 1);
    gemm(&mut hd, 0.0, 1.0, h, &Dense::from_vec(d.len(), 1, d.to_vec()));
    hd.into_vec()
}

/// Fall of the cost that gradient and matrix foretell for a step.
fn foretold(at: &Evaluation, d: &[f64]) -> f64 {
    -2.0 * dot(&at.gradient, d) - dot(d, &times(&at.hessian, d))
}

/// The matrix after a step `d` along which half the gradient changed by `y`; as it was where the cost does not curve
/// upwards along it.
fn mended(mut h: Dense, d: &[f64], y: &[f64]) -> Dense {
    let hd = times(&h, d);
    let (along, before) = (dot(d, y), dot(d, &hd));
    if !(along > 0.1 * before && before > 0.0 && along.is_finite()) {
        return h;
    }
    for j in 0..d.len() {
        for i in 0..d.len() {
            h[(i, j)] += y[i] * y[j] / along - hd[i] * hd[j] / before;
        }
    }
    h
}

/// What a minimisation is of.
#[derive(Clone, Copy)]
pub(super) struct Task<'a> {
    pub system: &'a System,
    pub records: &'a [Prepared<'a>],
    pub hypothesis: &'a Hypothesis,
    pub settings: Settings,
}

/// A minimisation under way.
pub(super) struct Descent<'a> {
    task: Task<'a>,
    here: Point<'a>,
    lambda: f64,
    /// Steps since the last Gauss-Newton matrix.
    kept: usize,
    iterations: usize,
    converged: bool,
    /// Whether no step lowers the cost.
    stuck: bool,
}

impl<'a> Task<'a> {
    fn point(&self, to: (Model, Vec<f64>, Vec<f64>), ws: &mut Workspace) -> Result<Point<'a>, IdentifyError> {
        Point::new(self.system, self.records, self.hypothesis, to, ws)
    }

    /// The same point with gradient and Gauss-Newton matrix, where its derivatives are another matrix's.
    fn derived_again(
        &self,
        point: Point<'a>,
        matrix: Matrix,
        ws: &mut Workspace,
    ) -> Result<Point<'a>, IdentifyError> {
        let mut point = point.again(self.system, self.records, self.hypothesis, ws)?;
        point.derive(self.system, self.hypothesis, matrix, ws);
        Ok(point)
    }

    fn enough(&self, cost: f64) -> f64 {
        self.settings.tolerance * (1.0 + 1e-3 * cost)
    }
}

impl<'a> Descent<'a> {
    /// At a start where the model is solved.
    ///
    /// # Errors
    /// [`IdentifyError`] when a law refuses its parameters.
    pub fn new(
        task: Task<'a>,
        start: (Model, Vec<f64>, Vec<f64>),
        ws: &mut Workspace,
    ) -> Result<Self, IdentifyError> {
        let mut here = task.point(start, ws)?;
        if task.settings.iterations > 0 {
            here.derive(task.system, task.hypothesis, Matrix::Search, ws);
        }
        here.forget_slopes();
        Ok(Self { task, here, lambda: DAMPING, kept: 0, iterations: 0, converged: false, stuck: false })
    }

    /// Cost where it stands.
    pub fn cost(&self) -> f64 {
        self.here.at.cost
    }

    /// Goes on until so many steps are taken in all, or no further one is worth its while.
    ///
    /// # Errors
    /// [`IdentifyError`] when a point that was there is not any more.
    pub fn advance(mut self, until: usize, ws: &mut Workspace) -> Result<Self, IdentifyError> {
        let last = self.task.settings.iterations;
        while self.iterations < until.min(last) && !self.converged && !self.stuck {
            let Some((d, mut better)) = self.lower(ws) else {
                self.stuck = self.kept == 0;
                if self.stuck {
                    // at a minimum within rounding no step lowers the cost
                    self.converged = self.at_rest(&self.here);
                } else {
                    self.here = self.task.derived_again(self.here, Matrix::Search, ws)?;
                    self.kept = 0;
                    // what the matrix that was taken over failed at says nothing of this one
                    self.lambda = DAMPING;
                }
                continue;
            };
            self.lambda = (self.lambda / 10.0).max(1e-9);
            self.iterations += 1;
            let small = self.here.at.cost - better.at.cost < self.task.enough(better.at.cost);
            self.converged = small && self.kept == 0;
            let before = std::mem::replace(&mut self.here.at, Evaluation::nothing());
            if !self.converged && self.iterations < last {
                self.follow(before, &d, &mut better, ws);
                self.converged = small && self.kept > 0 && self.at_rest(&better);
            }
            self.here = better;
        }
        self.here.forget_slopes();
        Ok(self)
    }

    /// What was found.
    ///
    /// # Errors
    /// As [`Descent::advance`].
    pub fn finish(self, ws: &mut Workspace) -> Result<Solution, IdentifyError> {
        let Self { task, mut here, iterations, converged, .. } = self;
        if task.settings.derivatives {
            here = task.derived_again(here, Matrix::Whole, ws)?;
        }
        let Point { p, mut x, at, .. } = here.finished(ws);
        x.drain(..task.system.n_own());
        Ok(Solution { p, x, at, iterations, converged })
    }

    /// The first step that lowers the cost, with the point there; none where a few do not.
    fn lower(&mut self, ws: &mut Workspace) -> Option<(Vec<f64>, Point<'a>)> {
        for _ in 0..if self.kept == 0 { TRIALS.0 } else { TRIALS.1 } {
            let Some(d) = step(&self.here.at, self.lambda, self.task.settings.longest) else {
                self.lambda = (self.lambda * 10.0).max(DAMPING);
                continue;
            };
            // A trial point where the model or the law does not exist is a step too far, not an error.
            match moved(&self.here, &d, self.task.system).and_then(|to| self.task.point(to, ws)) {
                Ok(trial) if trial.at.cost < self.here.at.cost => return Some((d, trial)),
                Ok(trial) => trial.give_back(ws),
                Err(_) => {}
            }
            self.lambda = (self.lambda * 10.0).max(DAMPING);
        }
        None
    }

    /// Derivatives after the step `d` from `before`: of the gradient alone where the step came out as foretold.
    fn follow(&mut self, before: Evaluation, d: &[f64], point: &mut Point<'a>, ws: &mut Workspace) {
        let (system, hypothesis) = (self.task.system, self.task.hypothesis);
        let ratio = (before.cost - point.at.cost) / foretold(&before, d);
        let near = before.near() && point.at.near();
        if !near || !(AS_TOLD.0..AS_TOLD.1).contains(&ratio) || self.kept >= MOST_KEPT {
            self.kept = 0;
            return point.derive(system, hypothesis, Matrix::Search, ws);
        }
        point.derive_once(system, hypothesis, (Gradient::Exact, before.hessian), ws);
        let y: Vec<f64> = point.at.gradient.iter().zip(&before.gradient).map(|(a, b)| a - b).collect();
        let matrix = std::mem::replace(&mut point.at.hessian, Dense::zeros(0, 0));
        point.at.hessian = mended(matrix, d, &y);
        self.kept += 1;
    }

    /// Whether a matrix that was taken over foretells no step worth its while.
    fn at_rest(&self, point: &Point<'a>) -> bool {
        let next = step(&point.at, 0.0, self.task.settings.longest);
        next.is_some_and(|d| foretold(&point.at, &d) < self.task.enough(point.at.cost))
    }
}

/// The unknowns a step further, with the model there.
fn moved(here: &Point<'_>, d: &[f64], system: &System) -> Result<(Model, Vec<f64>, Vec<f64>), IdentifyError> {
    let p: Vec<f64> = here.p.iter().zip(d).map(|(a, b)| a + b).collect();
    let x: Vec<f64> = here.x[system.n_own()..].iter().zip(&d[p.len()..]).map(|(a, b)| a + b).collect();
    let x = system.beside_own(&p, &x);
    Ok((Model { modal: system.modal(&p)?, slopes: None }, p, x))
}
