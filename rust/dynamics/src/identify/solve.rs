//! Levenberg-Marquardt on a hypothesis.

use super::arrays::Workspace;
use super::hypothesis::Hypothesis;
use super::model::Model;
use super::normal::{Evaluation, Point};
use super::prepared::Prepared;
use super::system::System;
use super::{IdentifyError, RecordLines, check, expect};
use femend_linalg::Dense;
use rayon::prelude::*;
use std::sync::{Mutex, MutexGuard};

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
    /// Evaluation there, with the Gauss-Newton matrix where it is wanted or was known.
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
    let prepared: Vec<Prepared<'_>> = records.iter().map(Prepared::new).collect();
    let model = Model { modal: system.modal(p)?, slopes: None };
    let start = (model, p.to_vec(), x.to_vec());
    minimise(system, &prepared, hypothesis, start, settings, &mut Workspace::default())
}

/// The minimisation itself, from a start where the model is solved.
fn minimise(
    system: &System,
    records: &[Prepared<'_>],
    hypothesis: &Hypothesis,
    start: (Model, Vec<f64>, Vec<f64>),
    settings: Settings,
    ws: &mut Workspace,
) -> Result<Solution, IdentifyError> {
    let mut here = Point::new(system, records, hypothesis, start, ws)?;
    if settings.derivatives || settings.iterations > 0 {
        here.derive(system, hypothesis, ws);
    }
    let mut lambda = 1e-4;
    let (mut iterations, mut converged) = (0, false);
    while iterations < settings.iterations && !converged {
        let mut better = None;
        for _ in 0..7 {
            let Some(d) = step(&here.at, lambda, settings.longest) else {
                lambda = (lambda * 10.0).max(1e-4);
                continue;
            };
            // A trial point where the model or the law does not exist is a step too far, not an error.
            let trial =
                moved(&here, &d, system).and_then(|to| Point::new(system, records, hypothesis, to, ws));
            match trial {
                Ok(trial) if trial.at.cost < here.at.cost => {
                    better = Some(trial);
                    break;
                }
                Ok(trial) => trial.give_back(ws),
                Err(_) => {}
            }
            lambda = (lambda * 10.0).max(1e-4);
        }
        let Some(mut better) = better else { break };
        lambda = (lambda / 10.0).max(1e-9);
        let cost = better.at.cost;
        converged = here.at.cost - cost < settings.tolerance * (1.0 + 1e-3 * cost);
        iterations += 1;
        let goes_on = iterations < settings.iterations && !converged;
        if settings.derivatives || goes_on {
            better.derive(system, hypothesis, ws);
        }
        here = better;
    }
    let Point { p, x, at, .. } = here.finished(ws);
    Ok(Solution { p, x, at, iterations, converged })
}

/// The unknowns a step further, with the model there.
fn moved(here: &Point<'_>, d: &[f64], system: &System) -> Result<(Model, Vec<f64>, Vec<f64>), IdentifyError> {
    let p: Vec<f64> = here.p.iter().zip(d).map(|(a, b)| a + b).collect();
    let x: Vec<f64> = here.x.iter().zip(&d[p.len()..]).map(|(a, b)| a + b).collect();
    Ok((Model { modal: system.modal(&p)?, slopes: None }, p, x))
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

/// A model and unknowns that jobs start from, and the modes there.
type Start<'a> = (&'a System, &'a [f64], Result<Model, IdentifyError>);

/// Solves the model of every job's start, once where jobs share it; with it, which start is whose.
fn starts<'a>(jobs: &'a [Job<'a>]) -> (Vec<Start<'a>>, Vec<usize>) {
    let mut distinct: Vec<(&System, &[f64], bool)> = Vec::new();
    let mut whose = Vec::with_capacity(jobs.len());
    for job in jobs {
        let same =
            |(system, p, _): &(&System, &[f64], bool)| std::ptr::eq(*system, job.system) && *p == job.p;
        let found = distinct.iter().position(same);
        if let Some(at) = found {
            distinct[at].2 = true;
        } else {
            distinct.push((job.system, &job.p, false));
        }
        whose.push(found.unwrap_or(distinct.len() - 1));
    }
    let solved = |(system, p, shared): (&'a System, &'a [f64], bool)| {
        let model = expect("start values", p.len(), system.n_unknowns())
            .and_then(|()| system.check())
            .and_then(|()| Ok(system.modal(p)?))
            .map(|modal| {
                let slopes = shared.then(|| system.slopes(p, &modal));
                Model { modal, slopes }
            });
        (system, p, model)
    };
    (distinct.into_par_iter().map(solved).collect(), whose)
}

/// Minimises many hypotheses over the same records, in parallel; results in the order of the jobs.
pub fn solve_batch(
    jobs: &[Job<'_>],
    records: &[RecordLines],
    settings: Settings,
) -> Vec<Result<Solution, IdentifyError>> {
    let (starts, whose) = starts(jobs);
    let checked = |job: &Job<'_>| check(job.system, records, job.hypothesis, &job.p, &job.x);
    if let Some(Err(error)) = records.iter().map(|r| r.check(r.out_rows.ncols())).find(Result::is_err) {
        return jobs.iter().map(|_| Err(error.clone())).collect();
    }
    let prepared: Vec<Prepared<'_>> = records.iter().map(Prepared::new).collect();
    let spaces = Mutex::new(Vec::new());
    jobs.par_iter()
        .zip(whose)
        .map(|(job, start)| {
            checked(job)?;
            let model = starts[start].2.clone()?;
            let start = (model, job.p.clone(), job.x.clone());
            let spare = |mut spares: MutexGuard<'_, Vec<Workspace>>| spares.pop();
            let mut ws = spaces.lock().ok().and_then(spare).unwrap_or_default();
            let found = minimise(job.system, &prepared, job.hypothesis, start, settings, &mut ws);
            if let Ok(mut spares) = spaces.lock() {
                spares.push(ws);
            }
            found
        })
        .collect()
}
