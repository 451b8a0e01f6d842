//! Projection on a basis: `K_r = Vᵀ K V` and the like, and recovery of all DOFs from the a-set.

use crate::error::FemError;
use crate::model::{Model, System};
use femend_linalg::Pattern;
use nalgebra::DMatrix;
use rayon::prelude::*;

/// Number of row ranges; fixed, so that sums do not depend on the number of threads.
const RANGES: usize = 16;

/// Rows whose products with the basis are formed before they are projected; sized to stay in cache.
const BLOCK: usize = 128;

/// Reduced matrices, each r x r row-major and symmetric.
#[derive(Debug, Clone, Default)]
pub struct Reduced {
    /// `Vᵀ K V`.
    pub k: Vec<f64>,
    /// `Vᵀ M V`.
    pub m: Vec<f64>,
    /// `Vᵀ C V`.
    pub c: Vec<f64>,
    /// `Vᵀ H V`, structural damping.
    pub h: Vec<f64>,
}

/// `Vᵀ A V` for a symmetric matrix on the pattern; `v` is (n, r) row-major.
#[must_use]
pub fn project_values(pattern: &Pattern, values: &[f64], v: &[f64], r: usize) -> Vec<f64> {
    let n = pattern.n();
    let parts: Vec<DMatrix<f64>> = (0..RANGES)
        .into_par_iter()
        .map(|part| {
            let mut sum = DMatrix::<f64>::zeros(r, r);
            let (first, last) = (part * n / RANGES, (part + 1) * n / RANGES);
            let mut y = vec![0.0; BLOCK * r];
            let mut picked: Vec<f64> = Vec::with_capacity(BLOCK * r);
            let mut rows = 0;
            for i in first..last {
                let range = pattern.range(i);
                if values[range.clone()].iter().any(|x| *x != 0.0) {
                    multiply_row(pattern.column(i), &values[range], v, &mut y[rows * r..(rows + 1) * r]);
                    picked.extend_from_slice(&v[i * r..(i + 1) * r]);
                    rows += 1;
                }
                if rows == BLOCK || (i + 1 == last && rows > 0) {
                    // row-major (rows, r) is column-major (r, rows)
                    let vb = DMatrix::from_column_slice(r, rows, &picked);
                    let yb = DMatrix::from_column_slice(r, rows, &y[..rows * r]);
                    sum.gemm(1.0, &vb, &yb.transpose(), 1.0);
                    picked.clear();
                    rows = 0;
                }
            }
            sum
        })
        .collect();
    let mut sum = DMatrix::<f64>::zeros(r, r);
    for part in &parts {
        sum += part;
    }
    let symmetric = (&sum + sum.transpose()) * 0.5;
    symmetric.as_slice().to_vec()
}

fn multiply_row(columns: &[u32], values: &[f64], v: &[f64], out: &mut [f64]) {
    let r = out.len();
    out.fill(0.0);
    for (&j, &w) in columns.iter().zip(values) {
        if w == 0.0 {
            continue;
        }
        let row = &v[j as usize * r..(j as usize + 1) * r];
        for (o, x) in out.iter_mut().zip(row) {
            *o += w * x;
        }
    }
}

fn all_zero(values: &[f64]) -> bool {
    values.iter().all(|v| *v == 0.0)
}

/// Projects all four matrices.
#[must_use]
pub fn project_system(pattern: &Pattern, system: &System, v: &[f64], r: usize) -> Reduced {
    let one = |values: &[f64]| {
        if all_zero(values) { vec![0.0; r * r] } else { project_values(pattern, values, v, r) }
    };
    Reduced { k: one(&system.k), m: one(&system.m), c: one(&system.c), h: one(&system.h) }
}

impl Model {
    /// Reduced matrices at the given factors, and their derivatives with respect to every factor.
    ///
    /// `v` is (n_a, r) row-major.
    ///
    /// # Errors
    /// [`FemError::Shape`] when `v` is not (n_a, r); as [`Model::assemble`].
    pub fn project(&self, factors: &[f64], v: &[f64], r: usize) -> Result<(Reduced, Vec<Reduced>), FemError> {
        if v.len() != self.n_a() * r {
            return Err(FemError::Shape { what: "the basis", got: v.len() / r.max(1), expected: self.n_a() });
        }
        let system = project_system(self.pattern(), &self.assemble(factors)?, v, r);
        let derivatives = (0..self.parameters.len())
            .map(|i| Ok(project_system(self.pattern(), &self.derivative(i, factors)?, v, r)))
            .collect::<Result<Vec<_>, FemError>>()?;
        Ok((system, derivatives))
    }

    /// `u_g = T u_a` for the columns of `v` (n_a, r), row-major; the result is (n_g, r).
    ///
    /// # Errors
    /// [`FemError::Shape`] when `v` is not (n_a, r).
    pub fn recover(&self, v: &[f64], r: usize) -> Result<Vec<f64>, FemError> {
        if v.len() != self.n_a() * r {
            return Err(FemError::Shape { what: "the array", got: v.len() / r.max(1), expected: self.n_a() });
        }
        let mut out = vec![0.0; self.t_rows.len() * r];
        for (row, target) in self.t_rows.iter().zip(out.chunks_mut(r.max(1))) {
            for &(a, w) in row {
                for (o, x) in target.iter_mut().zip(&v[a as usize * r..(a as usize + 1) * r]) {
                    *o += w * x;
                }
            }
        }
        Ok(out)
    }
}
