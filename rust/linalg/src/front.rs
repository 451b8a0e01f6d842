//! Dense kernels of one front: the columns of a supernode are eliminated, the rest becomes the update for the parent.
//!
//! A front is held as its panel (height x width, column-major; lower part used) and its update (below x below, lower part
//! used). Products of large fronts are cut into blocks of fixed size that run in parallel; each block is one sequential
//! product, so that results do not depend on the number of threads.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{cholesky_in_place, cholesky_in_place_scratch};
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::linalg::triangular_solve as ts;
use faer::prelude::{Reborrow, ReborrowMut};
use faer::{Accum, MatMut, MatRef, Par};
use rayon::prelude::*;

use crate::scalar::Scalar;

/// Columns eliminated before the rest of the front is updated.
pub(crate) const OUTER: usize = 192;

/// Order of the blocks that a product is cut into.
const TILE: usize = 384;

/// Multiplications and additions from which the blocks of a product run in parallel.
const PARALLEL: f64 = 2e7;

/// C -= A Bᵀ in the lower trapezoid of C (rows x columns, rows >= columns).
pub(crate) fn subtract_product<T: Scalar>(c: MatMut<'_, T>, a: MatRef<'_, T>, b: MatRef<'_, T>) {
    let (rows, columns, depth) = (c.nrows(), c.ncols(), a.ncols());
    if columns == 0 || depth == 0 {
        return;
    }
    let strip = |first: usize, c: MatMut<'_, T>| {
        let width = c.ncols();
        let (_, c) = c.split_at_row_mut(first);
        let (square, below) = c.split_at_row_mut(width);
        let bt = b.subrows(first, width).transpose();
        lower_product(square, a.subrows(first, width), bt);
        if below.nrows() > 0 {
            let a = a.subrows(first + width, rows - first - width);
            faer::linalg::matmul::matmul(below, Accum::Add, a, bt, -T::ONE, Par::Seq);
        }
    };
    if rows as f64 * columns as f64 * depth as f64 >= PARALLEL && columns > TILE {
        c.par_col_chunks_mut(TILE).enumerate().for_each(|(k, c)| strip(k * TILE, c));
    } else {
        strip(0, c);
    }
}

fn lower_product<T: Scalar>(c: MatMut<'_, T>, a: MatRef<'_, T>, bt: MatRef<'_, T>) {
    use BlockStructure::{Rectangular, TriangularLower};
    triangular::matmul(c, TriangularLower, Accum::Add, a, Rectangular, bt, Rectangular, -T::ONE, Par::Seq);
}

/// X := X L⁻ᵀ for the rows below a diagonal block L.
pub(crate) fn solve_below<T: Scalar>(l: MatRef<'_, T>, x: MatMut<'_, T>, unit: bool) {
    let solve = |x: MatMut<'_, T>| {
        if unit {
            ts::solve_unit_lower_triangular_in_place(l, x.transpose_mut(), Par::Seq);
        } else {
            ts::solve_lower_triangular_in_place(l, x.transpose_mut(), Par::Seq);
        }
    };
    let work = x.nrows() as f64 * l.nrows() as f64 * l.nrows() as f64;
    if x.nrows() > TILE && work >= PARALLEL {
        x.par_row_chunks_mut(TILE).for_each(solve);
    } else if x.nrows() > 0 {
        solve(x);
    }
}

/// Room for the Cholesky factor of a diagonal block.
pub(crate) fn cholesky_scratch() -> MemBuffer {
    MemBuffer::new(cholesky_in_place_scratch::<f64>(OUTER, Par::Seq, Default::default()))
}

/// L Lᵀ of the columns of a front; the update receives -L21 L21ᵀ.
///
/// # Errors
/// The column at which a pivot is not positive.
pub(crate) fn cholesky(
    panel: &mut [f64],
    width: usize,
    height: usize,
    update: &mut [f64],
    memory: &mut MemBuffer,
) -> Result<(), usize> {
    let below = height - width;
    let mut front = MatMut::from_column_major_slice_mut(panel, height, width);
    for first in (0..width).step_by(OUTER) {
        let w = OUTER.min(width - first);
        let (left, right) = front.rb_mut().split_at_col_mut(first + w);
        let (mut diagonal, mut lower) =
            left.submatrix_mut(first, first, height - first, w).split_at_row_mut(w);
        let stack = MemStack::new(memory);
        cholesky_in_place(diagonal.rb_mut(), Default::default(), Par::Seq, stack, Default::default())
            .map_err(|e| match e {
                faer::linalg::cholesky::llt::factor::LltError::NonPositivePivot { index } => first + index,
            })?;
        solve_below(diagonal.rb(), lower.rb_mut(), false);
        let rest = right.submatrix_mut(first + w, 0, height - first - w, width - first - w);
        subtract_product(rest, lower.rb(), lower.rb().subrows(0, width - first - w));
    }
    let l = front.rb().subrows(width, below);
    subtract_product(MatMut::from_column_major_slice_mut(update, below, below), l, l);
    Ok(())
}
