//! Right or left vectors at all DOFs, and what they leave of the full problem.

use femend_linalg::Dense;
use num_complex::Complex64;

use super::select::Wanted;
use super::space::Space;
use super::terms::{Products, stacked};
use crate::modes::Compact;

/// Multiples of the rounding error of D(λ) ψ that a residual may have left.
const ROUNDING: f64 = 16.0;
/// Residual from which the rounding error is looked at.
const NEAR: f64 = 1e-5;

/// One side's vectors at all DOFs, D(λ) ψ and its size beside the terms.
pub(super) struct Side {
    /// Left vectors?
    pub transposed: bool,
    /// Real parts, then imaginary parts (n, 2 m).
    pub x: Dense,
    pub products: Products,
    /// D(λ) ψ.
    pub vectors: Vec<Vec<Complex64>>,
    /// Its norm relative to the terms.
    pub residual: Vec<f64>,
    /// What rounding may leave of it.
    floor: Vec<f64>,
}

impl Side {
    /// The largest residual among some.
    pub fn worst(&self, of: &[usize]) -> f64 {
        of.iter().map(|&j| self.residual[j]).fold(0.0, f64::max)
    }

    /// Columns whose residual is too large.
    pub fn open(&self, tolerance: f64) -> Vec<usize> {
        // one that is not a number stays open
        let done = |j: usize| self.residual[j] <= tolerance.max(self.floor[j]);
        (0..self.residual.len()).filter(|&j| !done(j)).collect()
    }

    /// The vectors of one side in the space, `transposed` for left ones, with their residuals.
    pub fn of(
        full: &Full,
        speed: f64,
        wanted: &[Wanted],
        vectors: &[&[Complex64]],
        transposed: bool,
    ) -> Self {
        let y: Vec<Complex64> = vectors.concat();
        let x = full.space.expand(&stacked(full.space.len(), &y));
        let products = Products::new(&full.space.terms, speed, &x, transposed);
        let (mut vectors, mut residual, mut sizes) = (Vec::new(), Vec::new(), Vec::new());
        for (j, w) in wanted.iter().enumerate() {
            let (r, size) = products.residual(j, w.pair.lambda, -full.space.sigma);
            residual.push(r.iter().map(|v| v.norm_sqr()).sum::<f64>().sqrt() / size);
            sizes.push(size);
            vectors.push(r);
        }
        // the rounding error matters where little is left
        let mut floor = vec![0.0; wanted.len()];
        if residual.iter().any(|r| *r > full.tolerance && *r < NEAR) {
            let bounds = full.rounding(&x);
            floor = bounds.iter().zip(&sizes).map(|(b, s)| b / s).collect();
        }
        Self { transposed, x, products, vectors, residual, floor }
    }
}

/// The full problem, as vectors in its space are held against it.
pub(super) struct Full<'a> {
    pub space: &'a Space,
    /// |K|, whose product with |ψ| bounds the rounding error of K ψ.
    pub magnitude: &'a Compact,
    /// Residual to reach.
    pub tolerance: f64,
}

impl Full<'_> {
    /// Rounding error of K ψ of each column.
    pub fn rounding(&self, x: &Dense) -> Vec<f64> {
        let k = x.ncols() / 2;
        let mut sizes = Dense::zeros(x.nrows(), k);
        for j in 0..k {
            let parts = x.col(j).iter().zip(x.col(j + k));
            sizes.col_mut(j).iter_mut().zip(parts).for_each(|(s, (a, b))| *s = a.hypot(*b));
        }
        let product = self.magnitude.times(&sizes);
        let norm = |j: usize| product.col(j).iter().map(|v| v * v).sum::<f64>().sqrt();
        (0..k).map(|j| ROUNDING * f64::EPSILON * norm(j)).collect()
    }
}
