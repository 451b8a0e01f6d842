//! Products of a sparse symmetric matrix with blocks, free of the zeros that its pattern holds for other matrices.

use femend_linalg::{Dense, Pattern, SymmetricCsc, row_times};
use rayon::prelude::*;

/// Columns multiplied at once: one AVX-512 register.
const WIDTH: usize = 8;
/// Rows per parallel task; fixed, so that sums do not depend on the number of threads.
const ROWS: usize = 2048;

type Row = [f64; WIDTH];

/// The non-zero entries of a symmetric matrix. A mass matrix of solids on the pattern of K is two thirds zeros.
#[derive(Debug)]
pub(crate) struct Compact {
    start: Vec<usize>,
    index: Vec<u32>,
    values: Vec<f64>,
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
        Self { start: (0..=n).collect(), index: (0..n as u32).collect(), values: values.to_vec() }
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
        let (mut rows, mut sums) = (vec![[0.0; WIDTH]; n], vec![[0.0; WIDTH]; n]);
        for first in (0..x.ncols()).step_by(WIDTH) {
            let width = WIDTH.min(x.ncols() - first);
            rows.par_chunks_mut(ROWS).enumerate().for_each(|(chunk, part)| {
                for c in 0..width {
                    let column = &x.col(first + c)[chunk * ROWS..][..part.len()];
                    part.iter_mut().zip(column).for_each(|(row, &v)| row[c] = v);
                }
            });
            sums.par_chunks_mut(ROWS).enumerate().for_each(|(chunk, part)| {
                pulp::Arch::new().dispatch(|| self.add_rows(chunk * ROWS, &rows, part));
            });
            y.cols_mut(first, width).par_chunks_mut(n.max(1)).enumerate().for_each(|(c, column)| {
                column.iter_mut().zip(&sums).for_each(|(v, row)| *v = row[c]);
            });
        }
        y
    }

    /// Rows from `first` on.
    #[inline(always)]
    fn add_rows(&self, first: usize, x: &[Row], out: &mut [Row]) {
        for (r, out) in out.iter_mut().enumerate() {
            let range = self.start[first + r]..self.start[first + r + 1];
            *out = row_times(&self.index[range.clone()], &self.values[range], x);
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
