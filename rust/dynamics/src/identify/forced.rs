//! What forces at one place would do to a recording: their best amplitudes, and what these leave, follow without a search.

use super::arrays::{Split, Workspace, update, update2};
use super::hypothesis::{Hypothesis, What};
use super::normal::Step;
use super::prepared::Prepared;
use super::system::System;
use super::{IdentifyError, RecordLines, check, expect};
use femend_linalg::{Dense, gemm_tn, gram};
use num_complex::Complex64;

/// Products, over all weighted lines of a record, of its residual and of the answers to `n` forces, as an (n+1, n+1) matrix
/// with the residual first; the free decays are eliminated, which are held as loosely as the recorded forces alone
/// tell. With e its first diagonal entry, b the rest of its first row and A what remains, amplitudes A^-1 b leave
/// e - b A^-1 b of the cost.
///
/// `row` is the forces' place in the basis (r), `spectra` are theirs on the lines, line after line (K x n).
///
/// # Errors
/// [`IdentifyError`] for arrays that do not fit, and a reduced model or decays that cannot be solved.
pub fn force_products(
    system: &System,
    record: &RecordLines,
    row: &[f64],
    spectra: &[Complex64],
    p: &[f64],
) -> Result<Dense, IdentifyError> {
    let hypothesis = nothing(system.r);
    check(system, std::slice::from_ref(record), &hypothesis, p, &[])?;
    expect("basis row of the forces", row.len(), system.r)?;
    let n = spectra.len().checked_div(record.n_lines()).unwrap_or(0);
    expect("spectra of the forces", spectra.len(), record.n_lines() * n)?;
    let modal = system.modal(p)?;
    let (at, ws) = (Prepared::new(record), &mut Workspace::default());
    let x = system.beside_own(p, &[]);
    let step = Step::new(&at, system, &modal, &hypothesis.beside(&system.dashpots), &x, ws)?;
    let mut columns = step.base.clone();
    columns.append(&answers(
        &step,
        &gemm_tn(&modal.q, &Dense::from_vec(system.r, 1, row.to_vec())),
        n,
        spectra,
    ));
    let mut products = without_decays(&gram(&columns), &step, n)?;
    products.data_mut().iter_mut().for_each(|v| *v *= record.share);
    Ok(products)
}

/// The model alone.
fn nothing(r: usize) -> Hypothesis {
    let (compliance, law_mean, law_sd) = (Vec::new(), Vec::new(), Vec::new());
    Hypothesis {
        what: What::Nothing,
        free: 0,
        compliance,
        held: Vec::new(),
        law_mean,
        law_sd,
        w: Dense::zeros(0, r),
    }
}

/// Weighted accelerations under each of `n` forces with the mode shapes `psi` (r, 1) at their place, a column each.
fn answers(step: &Step<'_>, psi: &Dense, n: usize, spectra: &[Complex64]) -> Dense {
    let (at, response) = (step.at, &step.response);
    let (n_lines, n_out) = (at.n_lines(), at.n_out());
    let mut shapes = response.shapes.clone();
    for s in 0..n_out + response.n_w {
        shapes.col_mut(s).iter_mut().zip(psi.col(0)).for_each(|(v, psi)| *v *= psi);
    }
    let mut moved = Split::zeros(n_lines, n_out + response.n_w);
    response.g.times_into(&shapes, &mut moved);
    let mut per_unit = moved.columns(0, n_out);
    per_unit.times_line(&at.s2);
    if response.closed.is_some() {
        // the model's own dashpots answer to what the force does at their coordinates
        let mut back = moved.columns(n_out, response.n_w);
        (0..response.n_w).for_each(|i| update(back.col_mut(i), moved.col(n_out + i), |_, d| -d));
        response.feed_back(&back, &mut per_unit);
    }
    let mut all = Dense::zeros(at.n_rows(), n);
    let (mut force, mut y) = (Split::zeros(n_lines, 1), Split::zeros(n_lines, n_out));
    for j in 0..n {
        (0..n_lines).for_each(|k| force.set(0, k, spectra[k * n + j]));
        for s in 0..n_out {
            update2(y.col_mut(s), per_unit.col(s), force.col(0), |_, h, f| h * f);
        }
        at.fill(all.col_mut(j), &y);
    }
    all
}

/// Products of the last 1 + `n` columns of which `gram` is, with the best of the decays before them taken out of each.
fn without_decays(gram: &Dense, step: &Step<'_>, n: usize) -> Result<Dense, IdentifyError> {
    let n_t = step.decays.len();
    let mut left = Dense::zeros(n + 1, n + 1);
    for j in 0..=n {
        left.col_mut(j).copy_from_slice(&gram.col(n_t + j)[n_t..]);
    }
    if n_t == 0 {
        return Ok(left);
    }
    let factor = step.factored()?;
    let mut with = Dense::zeros(n_t, n + 1);
    for j in 0..=n {
        with.col_mut(j).copy_from_slice(&gram.col(n_t + j)[..n_t]);
    }
    factor.solve_lower_in_place(false, &mut with);
    let taken = gemm_tn(&with, &with);
    left.data_mut().iter_mut().zip(taken.data()).for_each(|(v, t)| *v -= t);
    Ok(left)
}
