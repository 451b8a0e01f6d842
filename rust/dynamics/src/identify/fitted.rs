//! Predictions of a hypothesis on the recorded lines.

use super::arrays::{Split, Workspace, update};
use super::hypothesis::Hypothesis;
use super::normal::Step;
use super::prepared::Prepared;
use super::system::System;
use super::{IdentifyError, RecordLines, check};
use num_complex::Complex64;

/// What is predicted and left over on the lines of one record, line after line.
#[derive(Debug, Clone)]
pub struct Fitted {
    /// Predicted accelerations, free decays included, K x n_out.
    pub y: Vec<Complex64>,
    /// Displacements of the coordinates, K x n_w.
    pub d: Vec<Complex64>,
    /// Forces on the structure at the coordinates, K x n_w.
    pub force: Vec<Complex64>,
}

fn line_after_line(a: &Split) -> Vec<Complex64> {
    (0..a.n_lines()).flat_map(|k| (0..a.n_columns()).map(move |j| a.get(j, k))).collect()
}

fn of_record(step: &Step<'_>) -> Fitted {
    let (at, response) = (step.at, &step.response);
    let mut force = step.force();
    let mut y = response.y.columns(0, at.n_out());
    let mut column = Split::zeros(at.n_lines(), at.n_out());
    for (t, a) in step.amplitudes.iter().enumerate() {
        step.decays.column(at, response, t, &mut column);
        (0..at.n_out()).for_each(|s| update(y.col_mut(s), column.col(s), |y, v| y + v * *a));
    }
    // Displacements of the coordinates answer to a free force through the whole model; free decays move them too.
    let mut d = if step.projector.is_some() {
        response.push(&force, &mut y);
        let q = response.with_force(&force, Split::zeros(at.n_lines(), response.q.n_columns()));
        let mut all = Split::zeros(at.n_lines(), response.shapes.ncols());
        q.times_into(&response.shapes, &mut all);
        all.columns(at.n_out(), response.n_w)
    } else {
        response.d.clone()
    };
    step.decays.add_motion(at, response, &step.amplitudes, &mut d);
    if let Some(closed) = &response.closed {
        for i in 0..response.n_w {
            update(force.col_mut(i), d.col(i), |_, d| d);
            update(force.col_mut(i), closed.kappa.col(0), |d, kappa| -kappa * d);
        }
    }
    Fitted { y: line_after_line(&y), d: line_after_line(&d), force: line_after_line(&force) }
}

/// Predictions, coordinates and forces of a hypothesis on the lines of every record.
///
/// # Errors
/// [`IdentifyError`] for arrays that do not fit, a reduced model that cannot be solved or a law that refuses its
/// parameters.
pub fn fitted(
    system: &System,
    records: &[RecordLines],
    hypothesis: &Hypothesis,
    p: &[f64],
    x: &[f64],
) -> Result<Vec<Fitted>, IdentifyError> {
    check(system, records, hypothesis, p, x)?;
    let modal = system.modal(p)?;
    let ws = &mut Workspace::default();
    records
        .iter()
        .map(|record| {
            let at = Prepared::new(record);
            let step = Step::new(&at, system, &modal, hypothesis, x, ws)?;
            Ok(of_record(&step))
        })
        .collect()
}
