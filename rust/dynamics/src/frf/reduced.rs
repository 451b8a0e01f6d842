//! Reduced direct solution: a few lines are solved directly, all others in the space of those solutions and of their
//! slopes along the frequency axis (rational Krylov; Grimme 1997, Beattie and Gugercin 2009).
//!
//! Z(s) = Σ c_t(s) A_t holds whatever the damping is, frequency-dependent stiffness included. Lines are added where the
//! true residual of the reduced solution is largest, and each new one measures the true error there before it joins, and
//! so how large errors are beside residuals. That ends the search where the residuals of all lines leave room enough.

use femend_linalg::{Dense, solve_complex_dense};
use num_complex::Complex64;
use rayon::prelude::*;

use super::FrfKind;
use super::galerkin::Galerkin;
use super::lines::{LineModel, LineSolver};
use crate::DynamicsError;

/// Lines solved directly before the first check.
const FIRST: usize = 5;
/// Lines checked for each line solved, while lines are still being added.
const CHECKED: usize = 8;
/// An error is taken to be as many times larger, beside its residual, than the largest that was measured.
const MARGIN: f64 = 10.0;

/// Accuracy and effort.
#[derive(Debug, Clone, Copy)]
pub struct ReducedOptions {
    /// Largest error of an FRF beside the largest magnitude on its line.
    pub tolerance: f64,
    /// Direct solutions at most.
    pub max_solutions: usize,
}

impl Default for ReducedOptions {
    fn default() -> Self {
        Self { tolerance: 1e-6, max_solutions: 60 }
    }
}

/// FRFs with the account of how they came about.
#[derive(Debug, Clone)]
pub struct ReducedFrf {
    /// (n_lines, n_out, n_in), last axis fastest.
    pub values: Vec<Complex64>,
    /// Whether the tolerance was reached.
    pub converged: bool,
    /// True error measured at the last line that was solved directly, before it joined, beside the largest magnitude.
    pub error: f64,
    /// Largest relative residual ‖B - Z X‖ / ‖B‖ over all lines, in units of the diagonal of the first matrix.
    pub residual: f64,
    /// Lines solved directly, in the order in which they were added.
    pub solved: Vec<usize>,
    /// Size of the basis.
    pub basis: usize,
}

/// State of the expansion.
struct Reduction<'a> {
    model: &'a LineModel<'a>,
    b_out: &'a Dense,
    space: Galerkin<'a>,
    solver: LineSolver,
    solved: Vec<usize>,
    /// Exact FRFs of solved lines.
    exact: Vec<Vec<Complex64>>,
}

impl LineModel<'_> {
    /// FRFs B_outᵀ Z⁻¹ B_in, times s^kind, by reduced direct solution; `b_out` (n, n_out), `b_in` (n, n_in).
    ///
    /// # Errors
    /// [`DynamicsError::Argument`] for shapes that do not fit, [`DynamicsError::Linalg`] where Z is singular on a line
    /// that is solved directly.
    pub fn frf_reduced(
        &self,
        b_out: &Dense,
        b_in: &Dense,
        s: &[Complex64],
        kind: FrfKind,
        options: ReducedOptions,
    ) -> Result<ReducedFrf, DynamicsError> {
        self.check(s.len(), b_out, b_in)?;
        let n_lines = s.len();
        let space = Galerkin::new(self, b_out, b_in);
        let solver = LineSolver::new(self)?;
        let mut state =
            Reduction { model: self, b_out, space, solver, solved: Vec::new(), exact: Vec::new() };
        let (mut error, mut residual, mut converged) = (0.0, 0.0, n_lines == 0);
        // the largest error beside its residual so far
        let mut ratio = 0.0f64;
        let first = FIRST.min(n_lines);
        for i in 0..first {
            state.expand(if first == 1 { 0 } else { i * (n_lines - 1) / (first - 1) }, b_in)?;
        }
        while !converged {
            let mut found = state.residuals(CHECKED)?;
            let small = |found: &[(f64, usize)]| found.iter().all(|f| f.0 <= 1e-14);
            // nothing left to add, or an answer good everywhere: all lines are looked at
            let whole = small(&found) || error <= options.tolerance && state.solved.len() > first;
            if whole {
                found = state.residuals(usize::MAX)?;
                residual = found.iter().map(|f| f.0).fold(0.0, f64::max);
            }
            let next = apart(&found, &state.solved);
            let settled = whole && ratio > 0.0 && MARGIN * ratio * residual <= options.tolerance;
            if next.is_empty() || small(&found) || settled {
                converged = true;
                break;
            }
            if state.solved.len() + next.len() > options.max_solutions {
                residual = found.iter().map(|f| f.0).fold(0.0, f64::max);
                break;
            }
            let before = state.reduced(&next)?;
            error = 0.0;
            for (line, reduced) in next.iter().zip(&before) {
                state.expand(*line, b_in)?;
                let exact = state.exact.last().map_or(&[][..], Vec::as_slice);
                let left = distance(reduced, exact);
                let before = found.iter().find(|f| f.1 == *line).map_or(0.0, |f| f.0);
                ratio = ratio.max(left / before.max(f64::EPSILON));
                error = f64::max(error, left);
            }
            // the lines with the largest residual of all were right before they joined
            converged = whole && error <= options.tolerance;
        }
        let values = state.values(s, kind, b_out.ncols() * b_in.ncols())?;
        let basis = state.space.len();
        Ok(ReducedFrf { values, converged, error, residual, solved: state.solved, basis })
    }
}

impl Reduction<'_> {
    /// FRFs of all lines with `pairs` of outputs and inputs, times s^kind; the exact ones of lines that were solved.
    fn values(&self, s: &[Complex64], kind: FrfKind, pairs: usize) -> Result<Vec<Complex64>, DynamicsError> {
        let lines: Vec<usize> = (0..s.len()).collect();
        let mut values = self.reduced(&lines)?.concat();
        for (line, exact) in self.solved.iter().zip(&self.exact) {
            values[line * pairs..(line + 1) * pairs].copy_from_slice(exact);
        }
        for (line, s) in values.chunks_exact_mut(pairs.max(1)).zip(s) {
            let factor = kind.factor(*s);
            line.iter_mut().for_each(|v| *v *= factor);
        }
        Ok(values)
    }

    /// Solves a line directly and takes its solution and slope into the basis.
    fn expand(&mut self, line: usize, b_in: &Dense) -> Result<(), DynamicsError> {
        let [x, slope] = self.solver.solve(self.model, line, b_in)?;
        self.exact.push(outputs(self.b_out, &x));
        self.solved.push(line);
        self.space.add(&[&x, &slope]);
        Ok(())
    }

    /// Relative residuals of lines that are not solved: all, or `each` for every line solved, evenly spread.
    fn residuals(&self, each: usize) -> Result<Vec<(f64, usize)>, DynamicsError> {
        let open: Vec<usize> = (0..self.model.n_lines()).filter(|l| !self.solved.contains(l)).collect();
        let count = each.saturating_mul(self.solved.len()).min(open.len());
        let lines: Vec<usize> = (0..count).map(|i| open[i * open.len() / count]).collect();
        let y = self.solutions(&lines)?;
        let sizes = self.space.residuals(self.model, &lines, &y);
        Ok(sizes.into_iter().zip(lines).collect())
    }

    /// Reduced coordinates (r, n_in) of lines.
    fn solutions(&self, lines: &[usize]) -> Result<Vec<Vec<Complex64>>, DynamicsError> {
        let r = self.space.len();
        lines
            .par_iter()
            .map(|&line| {
                Ok(solve_complex_dense(r, &self.space.stiffness(self.model, line), &self.space.load())?)
            })
            .collect()
    }

    /// Receptances of lines in the reduced space.
    fn reduced(&self, lines: &[usize]) -> Result<Vec<Vec<Complex64>>, DynamicsError> {
        Ok(self.solutions(lines)?.iter().map(|y| self.space.outputs(y)).collect())
    }
}

/// The line of largest residual, and that of the largest in another gap between solved lines.
fn apart(found: &[(f64, usize)], solved: &[usize]) -> Vec<usize> {
    let gap = |line: usize| solved.iter().filter(|&&s| s < line).count();
    let worst = |skip: Option<usize>| {
        let open = found.iter().filter(|f| skip != Some(gap(f.1)));
        open.max_by(|a, b| a.0.total_cmp(&b.0)).map(|f| f.1)
    };
    let first = worst(None);
    first.into_iter().chain(first.and_then(|f| worst(Some(gap(f))))).collect()
}

/// Bᵀ X (n_out, n_in), last axis fastest.
fn outputs(b_out: &Dense, x: &[Complex64]) -> Vec<Complex64> {
    let n = b_out.nrows();
    let entry = |o: usize, x: &[Complex64]| b_out.col(o).iter().zip(x).map(|(b, x)| b * x).sum();
    (0..b_out.ncols()).flat_map(|o| x.chunks_exact(n.max(1)).map(move |x| entry(o, x))).collect()
}

/// Largest difference beside the largest magnitude.
fn distance(a: &[Complex64], exact: &[Complex64]) -> f64 {
    let largest = |v: &mut dyn Iterator<Item = f64>| v.fold(0.0, f64::max);
    let size = largest(&mut exact.iter().map(|v| v.norm()));
    largest(&mut a.iter().zip(exact).map(|(a, b)| (a - b).norm())) / size.max(f64::MIN_POSITIVE)
}
