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

/// Step -(H + lambda diag H)^-1 g; none when the matrix is not positive definite.
fn step(at: &Evaluation, lambda: f64, longest: f64) -> Option<Vec<f64>> {
    let n = at.gradient.len();
    let mut a = at.hessian.clone();
    for i in 0..n {
        a[(i, i)] *= 1.0 + lambda;
    }
    let l = a.cholesky().ok()?;
    let mut d = Dense::from_vec(n, 1, at.gradient.iter().map(|g| -g).collect());
    l.solve_lower_in_place(false, &mut d);
    l.solve_lower_in_place(true, &mut d);
    let mut d = d.into_vec();
    d.iter_mut().for_each(|v| *v = v.clamp(-longest, longest));
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

/// A minimisation under way.
struct Descent<'a, 'b> {
    system: &'a System,
    records: &'a [Prepared<'a>],
    hypothesis: &'a Hypothesis,
    settings: Settings,
    ws: &'b mut Workspace,
    lambda: f64,
    /// Steps since the last Gauss-Newton matrix.
    kept: usize,
}

impl<'a> Descent<'a, '_> {
    /// The first step that lowers the cost, with the point there; none where a few do not.
    fn lower(&mut self, here: &Point<'a>) -> Option<(Vec<f64>, Point<'a>)> {
        for _ in 0..if self.kept == 0 { TRIALS.0 } else { TRIALS.1 } {
            let Some(d) = step(&here.at, self.lambda, self.settings.longest) else {
                self.lambda = (self.lambda * 10.0).max(1e-4);
                continue;
            };
            // A trial point where the model or the law does not exist is a step too far, not an error.
            let trial = moved(here, &d, self.system)
                .and_then(|to| Point::new(self.system, self.records, self.hypothesis, to, self.ws));
            match trial {
                Ok(trial) if trial.at.cost < here.at.cost => return Some((d, trial)),
                Ok(trial) => trial.give_back(self.ws),
                Err(_) => {}
            }
            self.lambda = (self.lambda * 10.0).max(1e-4);
        }
        None
    }

    /// Gradient and Gauss-Newton matrix.
    fn derive(&mut self, point: &mut Point<'a>) {
        point.derive(self.system, self.hypothesis, Matrix::Search, self.ws);
        self.kept = 0;
    }

    /// The same at a point whose derivatives are another matrix's.
    fn derive_again(&mut self, point: Point<'a>, matrix: Matrix) -> Result<Point<'a>, IdentifyError> {
        let mut point = point.again(self.system, self.records, self.hypothesis, self.ws)?;
        point.derive(self.system, self.hypothesis, matrix, self.ws);
        self.kept = 0;
        Ok(point)
    }

    /// Derivatives after the step `d` from `before`: of the gradient alone where the step came out as foretold.
    fn follow(&mut self, before: Evaluation, d: &[f64], point: &mut Point<'a>) {
        let ratio = (before.cost - point.at.cost) / foretold(&before, d);
        let near = before.near() && point.at.near();
        if !near || !(AS_TOLD.0..AS_TOLD.1).contains(&ratio) || self.kept >= MOST_KEPT {
            return self.derive(point);
        }
        point.derive_once(self.system, self.hypothesis, (Gradient::Exact, before.hessian), self.ws);
        let y: Vec<f64> = point.at.gradient.iter().zip(&before.gradient).map(|(a, b)| a - b).collect();
        let matrix = std::mem::replace(&mut point.at.hessian, Dense::zeros(0, 0));
        point.at.hessian = mended(matrix, d, &y);
        self.kept += 1;
    }

    /// Whether a matrix that was taken over foretells no step worth its while.
    fn at_rest(&self, point: &Point<'a>) -> bool {
        let next = step(&point.at, 0.0, self.settings.longest);
        next.is_some_and(|d| foretold(&point.at, &d) < self.enough(point.at.cost))
    }

    fn enough(&self, cost: f64) -> f64 {
        self.settings.tolerance * (1.0 + 1e-3 * cost)
    }

    fn run(&mut self, start: (Model, Vec<f64>, Vec<f64>)) -> Result<Solution, IdentifyError> {
        let settings = self.settings;
        let mut here = Point::new(self.system, self.records, self.hypothesis, start, self.ws)?;
        if settings.iterations > 0 {
            self.derive(&mut here);
        }
        let (mut iterations, mut converged) = (0, false);
        while iterations < settings.iterations && !converged {
            let Some((d, mut better)) = self.lower(&here) else {
                if self.kept == 0 {
                    break;
                }
                here = self.derive_again(here, Matrix::Search)?;
                continue;
            };
            self.lambda = (self.lambda / 10.0).max(1e-9);
            iterations += 1;
            let small = here.at.cost - better.at.cost < self.enough(better.at.cost);
            converged = small && self.kept == 0;
            if !converged && iterations < settings.iterations {
                self.follow(here.at, &d, &mut better);
                converged = small && self.kept > 0 && self.at_rest(&better);
            }
            here = better;
        }
        if settings.derivatives {
            here = self.derive_again(here, Matrix::Whole)?;
        }
        let Point { p, x, at, .. } = here.finished(self.ws);
        Ok(Solution { p, x, at, iterations, converged })
    }
}

/// Minimises the cost of a hypothesis from a start where the model is solved.
pub(super) fn minimise(
    system: &System,
    records: &[Prepared<'_>],
    hypothesis: &Hypothesis,
    start: (Model, Vec<f64>, Vec<f64>),
    settings: Settings,
    ws: &mut Workspace,
) -> Result<Solution, IdentifyError> {
    Descent { system, records, hypothesis, settings, ws, lambda: 1e-4, kept: 0 }.run(start)
}

/// The unknowns a step further, with the model there.
fn moved(here: &Point<'_>, d: &[f64], system: &System) -> Result<(Model, Vec<f64>, Vec<f64>), IdentifyError> {
    let p: Vec<f64> = here.p.iter().zip(d).map(|(a, b)| a + b).collect();
    let x: Vec<f64> = here.x.iter().zip(&d[p.len()..]).map(|(a, b)| a + b).collect();
    Ok((Model { modal: system.modal(&p)?, slopes: None }, p, x))
}
