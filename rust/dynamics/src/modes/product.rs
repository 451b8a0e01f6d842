//! Products of a sparse symmetric matrix with blocks, free of the zeros that its pattern holds for other matrices.

use std::sync::Mutex;

use femend_linalg::{Dense, Eight, Pattern, SymmetricCsc, row_times};
use pulp::{Simd, WithSimd};
use rayon::prelude::*;

/// Columns multiplied at once: one AVX-512 register.
const WIDTH: usize = 8;
/// Rows per parallel task; fixed, so that sums do not depend on the number of threads.
const ROWS: usize = 2048;

/// The non-zero entries of a symmetric matrix. A mass matrix of solids on the pattern of K is two thirds zeros.
#[derive(Debug)]
pub(crate) struct Compact {
    start: Vec<usize>,
    index: Vec<u32>,
    values: Vec<f64>,
    /// Rows of the block last multiplied: memory that is used again, since new pages cost as much as the product.
    rows: Mutex<Vec<Eight>>,
}

impl Compact {
    pub fn new(a: &SymmetricCsc) -> Self {
        Self::of_values(a.pattern(), a.values())
    }

    /// Of values on a pattern, where row j stands as column j does.
    pub fn of_values(pattern: &Pattern, values: &[f64]) -> Self {
        let count = values.iter().filter(|v| **v != 0.0).count();
        let mut out = Self {
            start: Vec::with_capacity(pattern.n() + 1),
            index: Vec::with_capacity(count),
            values: Vec::with_capacity(count),
            rows: Mutex::default(),
        };
        out.start.push(0);
        for j in 0..pattern.n() {
            for k in pattern.range(j) {
                if values[k] != 0.0 {
                    out.index.push(pattern.row_idx()[k]);
                    out.values.push(values[k]);
                }
            }
            out.start.push(out.index.len());
        }
        out
    }

    /// A diagonal matrix.
    pub fn diagonal(values: &[f64]) -> Self {
        let n = values.len();
        let (start, index) = ((0..=n).collect(), (0..n as u32).collect());
        Self { start, index, values: values.to_vec(), rows: Mutex::default() }
    }

    pub fn n(&self) -> usize {
        self.start.len() - 1
    }

    /// Y = A X for a block X (n, k).
    ///
    /// # Panics
    /// When X has another number of rows.
    pub fn times(&self, x: &Dense) -> Dense {
        let n = self.n();
        assert_eq!(x.nrows(), n);
        let mut y = Dense::zeros(n, x.ncols());
        // a product beside another one finds nothing and takes its own
        let mut rows = self.rows.lock().map_or_else(|_| Vec::new(), |mut kept| std::mem::take(&mut *kept));
        rows.resize(n, Eight::EMPTY);
        for first in (0..x.ncols()).step_by(WIDTH) {
            let width = WIDTH.min(x.ncols() - first);
            rows.par_chunks_mut(ROWS).enumerate().for_each(|(chunk, part)| {
                for c in 0..width {
                    let column = &x.col(first + c)[chunk * ROWS..][..part.len()];
                    part.iter_mut().zip(column).for_each(|(row, &v)| row.0[c] = v);
                }
            });
            let mut columns: Vec<_> =
                y.cols_mut(first, width).chunks_mut(n.max(1)).map(|c| c.chunks_mut(ROWS)).collect();
            let parts: Vec<Vec<&mut [f64]>> = (0..n.div_ceil(ROWS))
                .map(|_| columns.iter_mut().filter_map(Iterator::next).collect())
                .collect();
            parts.into_par_iter().enumerate().for_each(|(chunk, mut out)| {
                pulp::Arch::new().dispatch(Rows { a: self, x: &rows, first: chunk * ROWS, out: &mut out });
            });
        }
        if let Ok(mut kept) = self.rows.lock() {
            *kept = rows;
        }
        y
    }
}

/// Rows from `first` on, to a slice of each column.
struct Rows<'a, 'b> {
    a: &'a Compact,
    x: &'a [Eight],
    first: usize,
    out: &'a mut [&'b mut [f64]],
}

impl WithSimd for Rows<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { a, x, first, out } = self;
        for r in 0..out.first().map_or(0, |column| column.len()) {
            let range = a.start[first + r]..a.start[first + r + 1];
            let sum = row_times(simd, &a.index[range.clone()], &a.values[range], x);
            out.iter_mut().zip(sum.0).for_each(|(column, v)| column[r] = v);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;

    #[test]
    fn product_equals_that_on_the_whole_pattern() {
        let n = 5003;
        let pattern =
            Arc::new(Pattern::from_entries(n, (7..n).flat_map(|i| [(i, i - 1), (i, i - 7)])).unwrap());
        let mut values = vec![0.0; pattern.nnz()];
        for j in 0..n {
            for k in pattern.range(j) {
                let i = pattern.row_idx()[k] as usize;
                values[k] = if (i + j).is_multiple_of(3) { 0.0 } else { ((i + j) as f64).sin() };
            }
        }
        let a = SymmetricCsc::new(pattern, values, "A").unwrap();
        for columns in [1, 8, 13] {
            let x = Dense::from_vec(n, columns, (0..n * columns).map(|i| (0.37 * i as f64).cos()).collect());
            let (plain, compact) = (a.times(&x), Compact::new(&a).times(&x));
            assert!(plain.data().iter().zip(compact.data()).all(|(p, q)| (p - q).abs() < 1e-13));
        }
    }
}
