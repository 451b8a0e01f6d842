//! Products of sparse rows with blocks of columns.

use pulp::{Simd, WithSimd};
use rayon::prelude::*;

use crate::lanes::{LANES, Lanes};
use crate::{Dense, Eight};

/// Rows per parallel task; fixed, so that sums do not depend on the number of threads.
const ROWS: usize = 2048;

/// The rows of a square matrix: those of `index` and `values` from `start[j]` to `start[j + 1]` are of row j.
#[derive(Debug, Clone, Copy)]
pub struct SparseRows<'a> {
    pub start: &'a [u32],
    pub index: &'a [u32],
    pub values: &'a [f64],
}

impl SparseRows<'_> {
    /// Y = A X for a block X (n, k), read row by row so that a row of A is read once for eight columns, by way of `rows`, n
    /// or more of them.
    ///
    /// # Panics
    /// When X has another number of rows, or `rows` fewer.
    pub fn times(self, x: &Dense, rows: &mut [Eight]) -> Dense {
        let n = self.start.len() - 1;
        assert_eq!(x.nrows(), n);
        let (mut y, rows) = (Dense::zeros(n, x.ncols()), &mut rows[..n]);
        for first in (0..x.ncols()).step_by(LANES) {
            let width = LANES.min(x.ncols() - first);
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
            let rows = &*rows;
            parts.into_par_iter().enumerate().for_each(|(chunk, mut out)| {
                pulp::Arch::new().dispatch(Part { a: self, x: rows, first: chunk * ROWS, out: &mut out });
            });
        }
        y
    }

    /// Row j times eight columns; two chains of sums hide the latency of the additions.
    #[inline(always)]
    fn row_times<S: Simd>(&self, simd: S, j: usize, x: &[Eight]) -> Eight {
        let range = self.start[j] as usize..self.start[j + 1] as usize;
        let (pairs, last) = self.index[range.clone()].as_chunks::<2>();
        let (values, alone) = self.values[range].as_chunks::<2>();
        let mut out = Eight::EMPTY;
        for lane in (0..LANES).step_by(S::F64_LANES) {
            let add = |sum: S::f64s, i: u32, a: f64| {
                simd.mul_add_e_f64s(simd.splat_f64s(a), f64::load::<S>(&x[i as usize], lane), sum)
            };
            let (mut even, mut odd) = (simd.splat_f64s(0.0), simd.splat_f64s(0.0));
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
}

/// Rows from `first` on, to a slice of each column. Not a closure, which `pulp::Arch::dispatch` would not inline, so that
/// it ran without the processor's vectors.
struct Part<'a, 'b> {
    a: SparseRows<'a>,
    x: &'a [Eight],
    first: usize,
    out: &'a mut [&'b mut [f64]],
}

impl WithSimd for Part<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { a, x, first, out } = self;
        for r in 0..out.first().map_or(0, |column| column.len()) {
            let sum = a.row_times(simd, first + r, x);
            out.iter_mut().zip(sum.0).for_each(|(column, v)| column[r] = v);
        }
    }
}
