//! The space of solutions: an orthonormal basis, the matrices projected on it, and true residuals.

use femend_linalg::{Dense, SymmetricCsc, gemm, gemm_tn};
use num_complex::Complex64;
use rayon::prelude::*;

use super::lines::LineModel;
use crate::modes::{Basis, Compact};

/// Directions smaller than this beside their vector add nothing but rounding.
const DROP: f64 = 1e-9;
/// Lines whose residuals are formed by one product.
const LINES: usize = 8;

/// A Galerkin space.
pub(super) struct Galerkin<'a> {
    /// Metric: the diagonal of the first matrix, so that rotations and translations weigh alike.
    metric: Compact,
    scale: Vec<f64>,
    basis: Basis,
    matrices: Vec<&'a SymmetricCsc>,
    /// A_t V (n, r) of each matrix.
    images: Vec<Dense>,
    /// Vᵀ A_t V, column after column; columns grow with the basis.
    projected: Vec<Vec<Vec<f64>>>,
    b_in: &'a Dense,
    b_out: &'a Dense,
    /// Vᵀ B.
    load: Dense,
    output: Dense,
}

impl<'a> Galerkin<'a> {
    pub fn new(model: &LineModel<'a>, b_out: &'a Dense, b_in: &'a Dense) -> Self {
        let n = model.matrices[0].n();
        let diagonal: Vec<f64> = model.matrices[0].diagonal().iter().map(|d| d.abs()).collect();
        let mean = diagonal.iter().sum::<f64>() / n.max(1) as f64;
        let scale: Vec<f64> =
            diagonal.iter().map(|&d| if d > 0.0 { d } else { mean.max(f64::MIN_POSITIVE) }).collect();
        Self {
            metric: Compact::diagonal(&scale),
            scale,
            basis: Basis::with_room(n, 0),
            matrices: model.matrices.clone(),
            images: vec![Dense::zeros(n, 0); model.matrices.len()],
            projected: vec![Vec::new(); model.matrices.len()],
            b_in,
            b_out,
            load: Dense::zeros(0, b_in.ncols()),
            output: Dense::zeros(0, b_out.ncols()),
        }
    }

    pub fn len(&self) -> usize {
        self.basis.len()
    }

    /// Adds real and imaginary parts of complex blocks.
    pub fn add(&mut self, blocks: &[&[Complex64]]) {
        let n = self.scale.len();
        for block in blocks {
            let part = |of: fn(&Complex64) -> f64| {
                Dense::from_vec(n, block.len() / n.max(1), block.iter().map(of).collect())
            };
            let mut w = part(|v| v.re);
            w.append(&part(|v| v.im));
            let fresh = self.basis.split(&self.metric, &w, DROP).q;
            self.basis.v.append(&fresh);
            for ((a, image), projected) in self.matrices.iter().zip(&mut self.images).zip(&mut self.projected)
            {
                let new = a.times(&fresh);
                let columns = gemm_tn(&self.basis.v, &new);
                image.append(&new);
                projected.extend((0..columns.ncols()).map(|j| columns.col(j).to_vec()));
            }
        }
        self.load = gemm_tn(&self.basis.v, self.b_in);
        self.output = gemm_tn(&self.basis.v, self.b_out);
    }

    /// Vᵀ Z V on a line, column after column.
    pub fn stiffness(&self, model: &LineModel<'_>, line: usize) -> Vec<Complex64> {
        let r = self.len();
        let mut z = vec![Complex64::ZERO; r * r];
        for (projected, c) in self.projected.iter().zip(&model.coefficients) {
            for (j, column) in projected.iter().enumerate() {
                for (i, &v) in column.iter().enumerate() {
                    z[j * r + i] += c[line] * v;
                    // columns of one block hold its whole square
                    if projected[i].len() <= j {
                        z[i * r + j] += c[line] * v;
                    }
                }
            }
        }
        z
    }

    /// Vᵀ B_in.
    pub fn load(&self) -> Vec<Complex64> {
        self.load.data().iter().map(|&v| v.into()).collect()
    }

    /// B_outᵀ V y (n_out, n_in), last axis fastest.
    pub fn outputs(&self, y: &[Complex64]) -> Vec<Complex64> {
        let r = self.len();
        if r == 0 {
            // forces where nothing can move leave no direction
            return vec![Complex64::ZERO; self.output.ncols() * self.b_in.ncols()];
        }
        let entry = |o: usize, y: &[Complex64]| self.output.col(o).iter().zip(y).map(|(b, y)| b * y).sum();
        (0..self.output.ncols()).flat_map(|o| y.chunks_exact(r).map(move |y| entry(o, y))).collect()
    }

    /// ‖B - Z V y‖ / ‖B‖ of lines, the largest over the inputs, in units of the metric.
    pub fn residuals(&self, model: &LineModel<'_>, lines: &[usize], y: &[Vec<Complex64>]) -> Vec<f64> {
        let groups: Vec<_> = lines.chunks(LINES).zip(y.chunks(LINES)).collect();
        groups.par_iter().flat_map_iter(|(lines, y)| self.group(model, lines, y)).collect()
    }

    fn group(&self, model: &LineModel<'_>, lines: &[usize], y: &[Vec<Complex64>]) -> Vec<f64> {
        let (r, n_in) = (self.len(), self.b_in.ncols());
        let mut force = Dense::zeros(self.scale.len(), 2 * n_in * lines.len());
        for (image, c) in self.images.iter().zip(&model.coefficients) {
            let mut table = Dense::zeros(r, force.ncols());
            for (l, (line, y)) in lines.iter().zip(y).enumerate() {
                for (k, v) in y.iter().enumerate() {
                    let (value, column) = (c[*line] * v, 2 * (l * n_in + k / r));
                    (table[(k % r, column)], table[(k % r, column + 1)]) = (value.re, value.im);
                }
            }
            gemm(&mut force, 1.0, 1.0, image, &table);
        }
        let size = |of: &dyn Fn(usize) -> f64| (0..self.scale.len()).map(of).sum::<f64>();
        let one = |l: usize| {
            (0..n_in)
                .map(|i| {
                    let b = self.b_in.col(i);
                    let (re, im) = (force.col(2 * (l * n_in + i)), force.col(2 * (l * n_in + i) + 1));
                    let left = size(&|k| ((b[k] - re[k]).powi(2) + im[k] * im[k]) / self.scale[k]);
                    let whole = size(&|k| b[k] * b[k] / self.scale[k]);
                    if whole > 0.0 { (left / whole).sqrt() } else { 0.0 }
                })
                .fold(0.0, f64::max)
        };
        (0..lines.len()).map(one).collect()
    }
}
