//! Levenberg-Marquardt on a hypothesis.

use super::normal::{Evaluation, evaluate};
use super::system::{Hypothesis, System};
use super::{IdentifyError, RecordLines, check};
use femend_linalg::Dense;
use rayon::prelude::*;

/// How long and how far the minimisation goes.
#[derive(Debug, Clone, Copy)]
pub struct Settings {
    /// Largest number of accepted steps.
    pub iterations: usize,
    /// Ends when a step lowers the cost by less than this plus a thousandth of it times the cost.
    pub tolerance: f64,
    /// Longest step of any unknown (ln units).
    pub longest: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { iterations: 20, tolerance: 1e-2, longest: 0.5 }
    }
}

/// Minimum of a hypothesis.
#[derive(Debug, Clone)]
pub struct Solution {
    /// Unknowns of the model.
    pub p: Vec<f64>,
    /// Logarithms of the law's parameters.
    pub x: Vec<f64>,
    /// Evaluation there, with the Gauss-Newton matrix.
    pub at: Evaluation,
    /// Accepted steps.
    pub iterations: usize,
    /// Whether the last step was below the tolerance; otherwise the steps ran out or none lowered the cost.
    pub converged: bool,
}

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

/// Minimises the cost of a hypothesis from `p`, `x`.
///
/// # Errors
/// [`IdentifyError`] for arrays that do not fit, or a start where the model cannot be solved.
pub fn solve(
    system: &System,
    records: &[RecordLines],
    hypothesis: &Hypothesis,
    p: &[f64],
    x: &[f64],
    settings: Settings,
) -> Result<Solution, IdentifyError> {
    check(system, records, hypothesis, p, x)?;
    let (mut p, mut x) = (p.to_vec(), x.to_vec());
    let mut at = evaluate(system, records, hypothesis, &p, &x, true)?;
    let mut lambda = 1e-4;
    let (mut iterations, mut converged) = (0, false);
    while iterations < settings.iterations && !converged {
        let mut better = None;
        for _ in 0..7 {
            let Some(d) = step(&at, lambda, settings.longest) else {
                lambda = (lambda * 10.0).max(1e-4);
                continue;
            };
            let pn: Vec<f64> = p.iter().zip(&d).map(|(a, b)| a + b).collect();
            let xn: Vec<f64> = x.iter().zip(&d[p.len()..]).map(|(a, b)| a + b).collect();
            // A trial point where the model or the law does not exist is a step too far, not an error.
            match evaluate(system, records, hypothesis, &pn, &xn, false) {
                Ok(trial) if trial.cost < at.cost => {
                    better = Some((pn, xn, trial.cost));
                    break;
                }
                _ => lambda = (lambda * 10.0).max(1e-4),
            }
        }
        let Some((pn, xn, cost)) = better else { break };
        lambda = (lambda / 10.0).max(1e-9);
        converged = at.cost - cost < settings.tolerance * (1.0 + 1e-3 * cost);
        (p, x) = (pn, xn);
        at = evaluate(system, records, hypothesis, &p, &x, true)?;
        iterations += 1;
    }
    Ok(Solution { p, x, at, iterations, converged })
}

/// A hypothesis with the model it is attached to and the start of its minimisation.
#[derive(Debug, Clone)]
pub struct Job<'a> {
    /// Reduced model.
    pub system: &'a System,
    /// Where and what.
    pub hypothesis: &'a Hypothesis,
    /// Start of the model's unknowns.
    pub p: Vec<f64>,
    /// Start of the law's unknowns.
    pub x: Vec<f64>,
}

/// Minimises many hypotheses over the same records, in parallel; results in the order of the jobs.
pub fn solve_batch(
    jobs: &[Job<'_>],
    records: &[RecordLines],
    settings: Settings,
) -> Vec<Result<Solution, IdentifyError>> {
    jobs.par_iter().map(|j| solve(j.system, records, j.hypothesis, &j.p, &j.x, settings)).collect()
}
