//! Symmetric sparse matrices: one shared pattern, values of their own.

use std::sync::Arc;

use faer::MatMut;
use pulp::{Simd, WithSimd};
use rayon::prelude::*;

use crate::lanes::{LANES, Lanes};
use crate::{Dense, Eight, LinalgError, Pattern};

/// Rows per parallel task; fixed, so that sums do not depend on the number of threads.
const ROWS: usize = 2048;

/// A symmetric matrix: shared [`Pattern`] (both triangles) and values in the same order.
#[derive(Debug, Clone)]
pub struct SymmetricCsc {
    pattern: Arc<Pattern>,
    values: Vec<f64>,
}

impl SymmetricCsc {
    /// Takes over values on a pattern.
    ///
    /// # Errors
    /// [`LinalgError::Shape`], [`LinalgError::NotFinite`], or [`LinalgError::NotSymmetric`] where a mirror pair differs by
    /// more than 1e-8 of the larger diagonal scale.
    pub fn new(pattern: Arc<Pattern>, values: Vec<f64>, what: &'static str) -> Result<Self, LinalgError> {
        if values.len() != pattern.nnz() {
            return Err(LinalgError::Shape { what, found: values.len(), expected: pattern.nnz() });
        }
        let matrix = Self { pattern, values };
        matrix.check(what)?;
        Ok(matrix)
    }

    fn check(&self, what: &'static str) -> Result<(), LinalgError> {
        let p = &self.pattern;
        let mut next: Vec<u32> = p.col_ptr()[..p.n()].to_vec();
        for j in 0..p.n() {
            for k in p.range(j) {
                let (i, a) = (p.row_idx()[k] as usize, self.values[k]);
                if !a.is_finite() {
                    return Err(LinalgError::NotFinite { what, row: i, column: j, value: a });
                }
                let b = self.values[next[i] as usize];
                next[i] += 1;
                if a == b {
                    continue;
                }
                let scale = |d: usize| p.position(d, d).map_or(0.0, |k| self.values[k].abs());
                if (a - b).abs() > 1e-8 * (scale(i) * scale(j)).sqrt().max(a.abs()).max(b.abs()) {
                    return Err(LinalgError::NotSymmetric { row: i, column: j, a, b });
                }
            }
        }
        Ok(())
    }

    /// The pattern.
    pub fn pattern(&self) -> &Arc<Pattern> {
        &self.pattern
    }

    /// Values in pattern order.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Number of rows.
    pub fn n(&self) -> usize {
        self.pattern.n()
    }

    /// Diagonal, n.
    pub fn diagonal(&self) -> Vec<f64> {
        self.pattern.diagonal(&self.values)
    }

    /// `self + factor * other` on the common pattern.
    ///
    /// # Panics
    /// When the patterns differ: the callers share one.
    pub fn plus(&self, factor: f64, other: &Self) -> Self {
        assert!(Arc::ptr_eq(&self.pattern, &other.pattern) || self.pattern == other.pattern);
        let values = self.values.iter().zip(&other.values).map(|(a, b)| a + factor * b).collect();
        Self { pattern: self.pattern.clone(), values }
    }

    /// Y = A X for a block X (n, k).
    pub fn times(&self, x: &Dense) -> Dense {
        times_values(&self.pattern, &self.values, x)
    }
}

/// A sparse row times eight columns, held row by row in `x`; two chains of sums hide the latency of the additions. To be
/// called from `with_simd`: a closure for `pulp::Arch::dispatch` is not inlined and runs without the processor's vectors.
#[inline(always)]
pub fn row_times<S: Simd>(simd: S, index: &[u32], values: &[f64], x: &[Eight]) -> Eight {
    let mut out = Eight::EMPTY;
    for lane in (0..LANES).step_by(S::F64_LANES) {
        let add = |sum: S::f64s, i: u32, a: f64| {
            simd.mul_add_e_f64s(simd.splat_f64s(a), f64::load::<S>(&x[i as usize], lane), sum)
        };
        let (mut even, mut odd) = (simd.splat_f64s(0.0), simd.splat_f64s(0.0));
        let (pairs, last) = index.as_chunks::<2>();
        let (values, alone) = values.as_chunks::<2>();
        for (i, a) in pairs.iter().zip(values) {
            even = add(even, i[0], a[0]);
            odd = add(odd, i[1], a[1]);
        }
        if let ([i], [a]) = (last, alone) {
            even = add(even, *i, *a);
        }
        f64::store::<S>(&mut out, lane, simd.add_f64s(even, odd));
    }
    out
}

/// Y = A X for values on a symmetric pattern: column j is read as row j, X row by row so that a row of A is read once.
pub(crate) fn times_values(pattern: &Pattern, values: &[f64], x: &Dense) -> Dense {
    let (n, k) = (pattern.n(), x.ncols());
    assert_eq!(x.nrows(), n);
    let mut y = Dense::zeros(n, k);
    if n == 0 || k == 0 {
        return y;
    }
    let mut first = 0;
    while first < k {
        let width = (k - first).min(8);
        let mut rows = vec![Eight::EMPTY; n];
        rows.par_chunks_mut(ROWS).enumerate().for_each(|(chunk, part)| {
            for (r, row) in part.iter_mut().enumerate() {
                for c in 0..width {
                    row.0[c] = x.col(first + c)[chunk * ROWS + r];
                }
            }
        });
        let out = MatMut::from_column_major_slice_mut(y.cols_mut(first, width), n, width);
        out.par_row_chunks_mut(ROWS).enumerate().for_each(|(chunk, out)| {
            pulp::Arch::new().dispatch(Rows { pattern, values, x: &rows, first: chunk * ROWS, out });
        });
        first += width;
    }
    y
}

/// Rows from `first` on.
struct Rows<'a> {
    pattern: &'a Pattern,
    values: &'a [f64],
    x: &'a [Eight],
    first: usize,
    out: MatMut<'a, f64>,
}

impl WithSimd for Rows<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { pattern, values, x, first, mut out } = self;
        for r in 0..out.nrows() {
            let range = pattern.range(first + r);
            let sum = row_times(simd, &pattern.row_idx()[range.clone()], &values[range], x);
            for c in 0..out.ncols() {
                out[(r, c)] = sum.0[c];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chain(n: usize) -> SymmetricCsc {
        let p = Arc::new(Pattern::from_entries(n, (1..n).map(|i| (i, i - 1))).unwrap());
        let values = (0..n)
            .flat_map(|j| {
                p.column(j).iter().map(move |&i| if i as usize == j { 2.0 } else { -1.0 }).collect::<Vec<_>>()
            })
            .collect();
        SymmetricCsc::new(p, values, "K").unwrap()
    }

    #[test]
    fn product_with_a_linear_field_is_zero_inside() {
        let n = 5000;
        let k = chain(n);
        let mut x = Dense::zeros(n, 11);
        for c in 0..11 {
            for i in 0..n {
                x[(i, c)] = (i * (c + 1)) as f64;
            }
        }
        let y = k.times(&x);
        for c in 0..11 {
            assert!((1..n - 1).all(|i| y[(i, c)] == 0.0));
            assert_eq!(y[(n - 1, c)], (n * (c + 1)) as f64);
        }
    }

    #[test]
    fn refuses_nan_and_asymmetry() {
        let k = chain(4);
        let mut v = k.values().to_vec();
        v[1] = f64::NAN;
        assert!(matches!(
            SymmetricCsc::new(k.pattern().clone(), v, "K"),
            Err(LinalgError::NotFinite { row: 1, column: 0, .. })
        ));
        let mut v = k.values().to_vec();
        v[1] = -1.1;
        assert!(matches!(
            SymmetricCsc::new(k.pattern().clone(), v, "K"),
            Err(LinalgError::NotSymmetric { .. })
        ));
    }
}
