//! Predictions of a hypothesis on the recorded lines, and how they change with the model.

use super::arrays::{Split, Workspace, update};
use super::hypothesis::{Hypothesis, What};
use super::normal::Step;
use super::prepared::Prepared;
use super::sensitivities::Sensitivities;
use super::system::System;
use super::{IdentifyError, RecordLines, check, expect};
use femend_linalg::Dense;
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

/// What is fitted, of coordinates those behind the first `n_own`, which are of the model's own dashpots.
fn of_record(step: &Step<'_>, n_own: usize) -> Fitted {
    let (at, response) = (step.at, &step.response);
    let free = step.free_force();
    let mut y = response.y.columns(0, at.n_out());
    let mut column = Split::zeros(at.n_lines(), at.n_out());
    for (t, a) in step.amplitudes.iter().enumerate() {
        step.decays.column(at, response, t, &mut column);
        (0..at.n_out()).for_each(|s| update(y.col_mut(s), column.col(s), |y, v| y + v * *a));
    }
    response.push_free(&free, &mut y);
    // Displacements of the coordinates answer to a free force through the whole model; free decays move them too.
    let (q, mut d) = response.driven(&free, Split::zeros(at.n_lines(), response.q.n_columns()));
    if response.closed.is_none() && response.n_free > 0 {
        d = response.open_motion(&q);
    }
    step.decays.add_motion(at, response, &step.amplitudes, &mut d);
    let mut force =
        response.closed.as_ref().map_or_else(|| Split::zeros(at.n_lines(), response.n_w), |c| c.force(&d));
    response.add_free(&free, &mut force);
    let asked = |a: &Split| line_after_line(&a.columns(n_own, a.n_columns() - n_own));
    Fitted { y: line_after_line(&y), d: asked(&d), force: asked(&force) }
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
    let (modal, x) = (system.modal(p)?, system.beside_own(p, x));
    let (hypothesis, ws) = (hypothesis.beside(&system.dashpots), &mut Workspace::default());
    records
        .iter()
        .map(|record| {
            let at = Prepared::new(record);
            let step = Step::new(&at, system, &modal, &hypothesis, &x, ws)?;
            Ok(of_record(&step, system.dashpots.len()))
        })
        .collect()
}

/// Derivatives (2 K n_out, n) of the weighted accelerations with respect to the unknowns of the model where its
/// coordinates `w` (n_w, r) have the dynamic stiffness `kappa` (n_w of K lines): real parts of all lines, then imaginary
/// parts, sensor after sensor.
///
/// # Errors
/// [`IdentifyError`] for arrays that do not fit or a reduced model that cannot be solved.
pub fn model_columns(
    system: &System,
    record: &RecordLines,
    w: Dense,
    kappa: Vec<Vec<Complex64>>,
    p: &[f64],
) -> Result<Dense, IdentifyError> {
    for column in &kappa {
        expect("lines of the stiffness", column.len(), record.n_lines())?;
    }
    let compliance = vec![0.0; w.nrows()];
    let what = if w.nrows() == 0 { What::Nothing } else { What::Given(kappa, Vec::new()) };
    let hypothesis = Hypothesis {
        w,
        what,
        free: 0,
        compliance,
        held: Vec::new(),
        law_mean: Vec::new(),
        law_sd: Vec::new(),
    };
    check(system, std::slice::from_ref(record), &hypothesis, p, &[])?;
    let modal = system.modal(p)?;
    let slopes = system.slopes(p, &modal, system.r);
    let (at, ws) = (Prepared::new(record), &mut Workspace::default());
    let (hypothesis, x) = (hypothesis.beside(&system.dashpots), system.beside_own(p, &[]));
    let step = Step::new(&at, system, &modal, &hypothesis, &x, ws)?;
    Ok(system.folded_columns(Sensitivities::fill(&step, system, &modal, &slopes, ws)))
}
