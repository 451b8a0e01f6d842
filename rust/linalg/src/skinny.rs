//! Products of tall matrices with at most eight columns, which read the tall one once and pack nothing.

use faer::{MatMut, MatRef};
use pulp::{Simd, WithSimd};

use crate::lanes::{Eight, LANES, Lanes, collect, spread};

/// Rows whose eight columns stay in the first-level cache while the columns of A pass.
const ROWS: usize = 512;
/// Columns of A at once.
const W: usize = 8;

/// C += alpha A B, B of at most eight columns.
pub(crate) fn add_product(c: MatMut<'_, f64>, alpha: f64, a: MatRef<'_, f64>, b: MatRef<'_, f64>) {
    let coefficients: Vec<Eight> = rows_of(b).map(|row| Eight(row.0.map(|v| alpha * v))).collect();
    pulp::Arch::new().dispatch(Product { c, a, coefficients: &coefficients });
}

/// Aᵀ B, B of at most eight columns, a row of lanes for each column of A.
pub(crate) fn transposed_product(a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Vec<Eight> {
    let mut sums = vec![Eight::EMPTY; a.ncols()];
    pulp::Arch::new().dispatch(Sums { a, b, sums: &mut sums });
    sums
}

fn rows_of(b: MatRef<'_, f64>) -> impl Iterator<Item = Eight> + '_ {
    (0..b.nrows()).map(move |r| Eight(std::array::from_fn(|c| if c < b.ncols() { b[(r, c)] } else { 0.0 })))
}

/// Rows of columns, to `rows`.
#[inline(always)]
fn turn(from: MatRef<'_, f64>, rows: &mut [Eight]) {
    for (c, column) in from.col_iter().enumerate() {
        let column = column.try_as_col_major().expect("columns are contiguous").as_slice();
        rows.iter_mut().zip(column).for_each(|(row, &v)| row.0[c] = v);
    }
}

#[inline(always)]
fn columns<const N: usize>(a: MatRef<'_, f64>, first: usize) -> [&[f64]; N] {
    std::array::from_fn(|c| a.col(first + c).try_as_col_major().expect("columns are contiguous").as_slice())
}

struct Product<'a> {
    c: MatMut<'a, f64>,
    a: MatRef<'a, f64>,
    coefficients: &'a [Eight],
}

impl WithSimd for Product<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { mut c, a, coefficients } = self;
        let (depth, mut rows) = (a.ncols(), [Eight::EMPTY; ROWS]);
        let load = |k: usize, lane: usize| <f64 as Lanes>::load::<S>(&coefficients[k], lane);
        for first in (0..a.nrows()).step_by(ROWS) {
            let count = ROWS.min(a.nrows() - first);
            let (a, rows) = (a.subrows(first, count), &mut rows[..count]);
            turn(c.as_ref().subrows(first, count), rows);
            for lane in (0..LANES).step_by(S::F64_LANES) {
                let whole = depth - depth % W;
                for k in (0..whole).step_by(W) {
                    let x: [_; W] = std::array::from_fn(|c| load(k + c, lane));
                    spread::<S, f64, W>(simd, columns(a, k), x, rows, lane);
                }
                for k in whole..depth {
                    spread::<S, f64, 1>(simd, columns(a, k), [load(k, lane)], rows, lane);
                }
            }
            for (k, column) in c.as_mut().subrows_mut(first, count).col_iter_mut().enumerate() {
                let column = column.try_as_col_major_mut().expect("columns are contiguous").as_slice_mut();
                column.iter_mut().zip(&*rows).for_each(|(v, row)| *v = row.0[k]);
            }
        }
    }
}

struct Sums<'a> {
    a: MatRef<'a, f64>,
    b: MatRef<'a, f64>,
    sums: &'a mut [Eight],
}

impl WithSimd for Sums<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { a, b, sums } = self;
        let (depth, mut rows) = (a.ncols(), [Eight::EMPTY; ROWS]);
        for first in (0..a.nrows()).step_by(ROWS) {
            let count = ROWS.min(a.nrows() - first);
            let (a, rows) = (a.subrows(first, count), &mut rows[..count]);
            turn(b.subrows(first, count), rows);
            for lane in (0..LANES).step_by(S::F64_LANES) {
                let mut add = |k: usize, part: S::f64s| {
                    let sum = simd.add_f64s(<f64 as Lanes>::load::<S>(&sums[k], lane), part);
                    <f64 as Lanes>::store::<S>(&mut sums[k], lane, sum);
                };
                let whole = depth - depth % W;
                for k in (0..whole).step_by(W) {
                    let parts = collect::<S, f64, W>(simd, columns(a, k), rows, lane);
                    parts.into_iter().enumerate().for_each(|(c, part)| add(k + c, part));
                }
                for k in whole..depth {
                    let [part] = collect::<S, f64, 1>(simd, columns(a, k), rows, lane);
                    add(k, part);
                }
            }
        }
    }
}
