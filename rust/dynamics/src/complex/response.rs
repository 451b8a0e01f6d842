//! Forced response of the projected problem, held to the residual of the full one.

use femend_linalg::{Dense, solve_complex_dense};
use num_complex::Complex64;

use super::projected::Projected;
use super::solve::ComplexProblem;
use super::terms::{Products, stacked};
use crate::DynamicsError;

/// Rounds of enlargement at most.
const ROUNDS: usize = 40;
/// Multiples of the rounding error that a residual may have left.
const ROUNDING: f64 = 64.0;

impl ComplexProblem {
    /// Receptances B_outᵀ D(s)⁻¹ B_in at a speed, (n_lines, n_out, n_in) with the last axis fastest; `b_out` (n, n_out),
    /// `b_in` (n, n_in). The space is enlarged until ‖B - D(s) X‖ ≤ `tolerance` ‖B‖ for every column and line.
    ///
    /// # Errors
    /// [`DynamicsError::Argument`] for other numbers of rows, [`DynamicsError::ResponseNotConverged`],
    /// [`DynamicsError::Linalg`] where D(s) is singular.
    pub fn receptance(
        &mut self,
        speed: f64,
        b_out: &Dense,
        b_in: &Dense,
        s: &[Complex64],
        tolerance: f64,
    ) -> Result<Vec<Complex64>, DynamicsError> {
        let n = self.space.n();
        if b_out.nrows() != n || b_in.nrows() != n {
            let rows = if b_in.nrows() == n { b_out.nrows() } else { b_in.nrows() };
            return Err(DynamicsError::Argument(format!("B has {rows} rows, K has {n}")));
        }
        if self.space.len() < n {
            let statics = self.space.solve(b_in.clone());
            self.space.add(&statics);
        }
        for _ in 0..ROUNDS {
            let projected = Projected::new(&mut self.space, speed);
            let (load, output) = (self.space.project(b_in), self.space.project(b_out));
            let (mut found, mut open, mut worst) = (Vec::new(), Dense::zeros(n, 0), 0.0f64);
            for &s in s {
                let y = projected.solve(s, &load)?;
                found.extend(outputs(&output, &y));
                worst = worst.max(self.missing(speed, s, b_in, &y, tolerance, &mut open));
            }
            if open.ncols() == 0 || self.space.len() == n {
                return Ok(found);
            }
            if self.space.len() + open.ncols() > 2000 {
                let vectors = self.space.len();
                return Err(DynamicsError::ResponseNotConverged { vectors, residual: worst, speed });
            }
            let block = self.space.solve(open);
            self.space.add(&block);
        }
        let vectors = self.space.len();
        Err(DynamicsError::ResponseNotConverged { vectors, residual: f64::NAN, speed })
    }

    /// Adds the residuals of a line that are too large to `open`; returns the largest.
    fn missing(
        &self,
        speed: f64,
        s: Complex64,
        b: &Dense,
        y: &[Complex64],
        tolerance: f64,
        open: &mut Dense,
    ) -> f64 {
        let x = self.space.expand(&stacked(self.space.len(), y));
        let products = Products::new(&self.space.terms, speed, &x, false);
        let floor = self.full().rounding(&x);
        let mut worst = 0.0f64;
        for j in 0..b.ncols() {
            let (mut r, _) = products.residual(j, s, 0.0);
            r.iter_mut().zip(b.col(j)).for_each(|(r, b)| *r -= *b);
            let size = b.col(j).iter().map(|v| v * v).sum::<f64>().sqrt();
            let norm = r.iter().map(|v| v.norm_sqr()).sum::<f64>().sqrt();
            worst = worst.max(norm / size);
            if norm > (tolerance * size).max(ROUNDING * floor[j]) {
                open.append(&stacked(r.len(), &r));
            }
        }
        worst
    }
}

/// Cᵀ Y (n_out, n_in), last axis fastest.
fn outputs(c: &Dense, y: &[Complex64]) -> Vec<Complex64> {
    let r = c.nrows();
    let entry = |o: usize, y: &[Complex64]| c.col(o).iter().zip(y).map(|(c, y)| c * y).sum();
    (0..c.ncols()).flat_map(|o| y.chunks_exact(r.max(1)).map(move |y| entry(o, y))).collect()
}

impl Projected {
    /// D(s)⁻¹ B for a real B (r, k).
    fn solve(&self, s: Complex64, b: &Dense) -> Result<Vec<Complex64>, DynamicsError> {
        let r = self.mass.nrows();
        let d: Vec<Complex64> = (0..r * r)
            .map(|e| {
                let structural = self.structural.as_ref().map_or(0.0, |d| d.data()[e]);
                s * s * self.mass.data()[e]
                    + s * self.damping.data()[e]
                    + Complex64::new(self.stiffness.data()[e], structural)
            })
            .collect();
        let b: Vec<Complex64> = b.data().iter().map(|&v| v.into()).collect();
        Ok(solve_complex_dense(r, &d, &b)?)
    }
}
