//! Minima of hypotheses, one by one and many in parallel.

use super::arrays::Workspace;
use super::hypothesis::Hypothesis;
use super::minimise::{Settings, Solution, minimise};
use super::model::Model;
use super::normal::modes_that_count;
use super::prepared::Prepared;
use super::system::System;
use super::{IdentifyError, RecordLines, check, expect};
use rayon::prelude::*;
use std::sync::{Mutex, MutexGuard};

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
fn starts<'a>(
    jobs: &'a [Job<'a>],
    records: &[RecordLines],
    settings: Settings,
) -> (Vec<Start<'a>>, Vec<usize>) {
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
                let search = || modes_that_count(system, &modal, records.iter());
                let n_modes = if settings.iterations > 0 { search() } else { system.r };
                let slopes = shared.then(|| system.slopes(p, &modal, n_modes));
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
    let (starts, whose) = starts(jobs, records, settings);
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
