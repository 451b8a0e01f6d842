//! Minima of hypotheses, one by one and many in parallel.

use super::arrays::Workspace;
use super::hypothesis::Hypothesis;
use super::minimise::{Descent, Settings, Solution, Task};
use super::model::Model;
use super::normal::modes_that_count;
use super::prepared::Prepared;
use super::race::Race;
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
    let start = (model, p.to_vec(), system.beside_own(p, x));
    let hypothesis = hypothesis.beside(&system.dashpots);
    let task = Task { system, records: &prepared, hypothesis: &hypothesis, settings };
    let ws = &mut Workspace::default();
    Descent::new(task, start, ws)?.advance(settings.iterations, ws)?.finish(ws)
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

/// Minimises many hypotheses over the same records, in parallel; results in the order of the jobs. Those that a race gives
/// up come back where they stood then.
///
/// # Errors
/// Each by itself as [`solve`].
pub fn solve_batch(
    jobs: &[Job<'_>],
    records: &[RecordLines],
    settings: Settings,
    race: &Race,
) -> Vec<Result<Solution, IdentifyError>> {
    let (starts, whose) = starts(jobs, records, settings);
    let fit = || {
        records.iter().try_for_each(|r| r.check(r.out_rows.ncols()))?;
        if race.groups.is_empty() {
            Ok(())
        } else {
            expect("groups of the race", race.groups.len(), jobs.len())
        }
    };
    if let Err(error) = fit() {
        return jobs.iter().map(|_| Err(error.clone())).collect();
    }
    let prepared: Vec<Prepared<'_>> = records.iter().map(Prepared::new).collect();
    let closed: Vec<_> = jobs.iter().map(|job| job.hypothesis.beside(&job.system.dashpots)).collect();
    let spaces = Spaces::default();
    let last = settings.iterations;
    let mut heats = race.heats.iter().copied().filter(|(steps, _)| *steps < last).peekable();
    let fits = |job: &Job<'_>| check(job.system, records, job.hypothesis, &job.p, &job.x);
    let ready = jobs
        .iter()
        .zip(&whose)
        .map(|(job, start)| fits(job).and_then(|()| starts[*start].2.as_ref().map_err(Clone::clone)));
    let all = jobs.par_iter().zip(&closed).zip(ready.collect::<Vec<_>>());
    if heats.peek().is_none() {
        return all
            .map(|((job, own), model)| {
                let whole = |ws: &mut _| {
                    begun((job, own), model?, &prepared, settings, ws)?.advance(last, ws)?.finish(ws)
                };
                spaces.with(whole)
            })
            .collect();
    }
    let mut under_way: Vec<_> = all
        .map(|((job, own), model)| spaces.with(|ws| begun((job, own), model?, &prepared, settings, ws)))
        .collect();
    let mut go_on = vec![true; jobs.len()];
    for (steps, ratio) in heats.chain([(last, f64::INFINITY)]) {
        under_way = under_way
            .into_par_iter()
            .zip(&go_on)
            .map(|(one, goes_on)| match one {
                Ok(one) if *goes_on => spaces.with(|ws| one.advance(steps, ws)),
                one => one,
            })
            .collect();
        let costs: Vec<_> = under_way.iter().map(|one| one.as_ref().ok().map(Descent::cost)).collect();
        go_on.iter_mut().zip(race.going_on(&costs, ratio)).for_each(|(go, near)| *go &= near);
    }
    under_way.into_par_iter().map(|one| spaces.with(|ws| one?.finish(ws))).collect()
}

/// The minimisation of a job, of its hypothesis on the model as it is, from a start where the model is solved.
fn begun<'a>(
    (job, hypothesis): (&Job<'a>, &'a Hypothesis),
    model: &Model,
    records: &'a [Prepared<'a>],
    settings: Settings,
    ws: &mut Workspace,
) -> Result<Descent<'a>, IdentifyError> {
    let task = Task { system: job.system, records, hypothesis, settings };
    let x = job.system.beside_own(&job.p, &job.x);
    Descent::new(task, (model.clone(), job.p.clone(), x), ws)
}

/// Workspaces that are lent to whoever works.
#[derive(Default)]
struct Spaces(Mutex<Vec<Workspace>>);

impl Spaces {
    fn with<T>(&self, work: impl FnOnce(&mut Workspace) -> T) -> T {
        let spare = |mut spares: MutexGuard<'_, Vec<Workspace>>| spares.pop();
        let mut ws = self.0.lock().ok().and_then(spare).unwrap_or_default();
        let done = work(&mut ws);
        if let Ok(mut spares) = self.0.lock() {
            spares.push(ws);
        }
        done
    }
}
