//! L D Lᵀ of the columns of a front with 1x1 and 2x2 pivots (Bunch and Kaufman 1977), real or complex symmetric.
//!
//! Pivots are sought inside diagonal blocks of [`INNER`] columns. Each block is eliminated at once in the columns of the
//! same outer block, each outer block in the rest of the front.

use faer::MatMut;
use faer::prelude::Reborrow;

use crate::front::{OUTER, solve_below, subtract_product};
use crate::scalar::Scalar;

/// Columns of a diagonal block inside which pivots are sought.
const INNER: usize = 64;

/// (1 + √17) / 8: least growth of entries over both pivot sizes (Bunch and Kaufman 1977, eq. 4.1).
const ALPHA: f64 = 0.640_388_203_202_208_4;

/// Diagonal blocks of D: `subdiag[j]` is not zero where columns j and j + 1 form a 2x2 pivot.
pub(crate) struct Pivots<'a, T> {
    pub(crate) subdiag: &'a mut [T],
    /// Column of the supernode that stands at each place.
    pub(crate) perm: &'a mut [u32],
}

/// Eliminates the columns of a front; L replaces the panel below the diagonal, D its diagonal.
pub(crate) fn ldlt<T: Scalar>(
    panel: &mut [T],
    width: usize,
    height: usize,
    update: &mut [T],
    pivots: &mut Pivots<'_, T>,
    work: &mut Vec<T>,
) {
    let below = height - width;
    pivots.perm.iter_mut().enumerate().for_each(|(k, p)| *p = k as u32);
    pivots.subdiag.fill(T::ZERO);
    let room = height * OUTER.min(width);
    if work.len() < room {
        work.resize(room, T::ZERO);
    }
    for first in (0..width).step_by(OUTER) {
        let end = (first + OUTER).min(width);
        let rows = height - first;
        let scaled = &mut work[..rows * (end - first)];
        for k in (first..end).step_by(INNER) {
            let w = INNER.min(end - k);
            eliminate_block(panel, height, k, w, pivots);
            scale_below(panel, height, k, w, pivots.subdiag, &mut scaled[(k - first) * rows..], first);
            let front = MatMut::from_column_major_slice_mut(panel, height, width);
            let (left, right) = front.split_at_col_mut(k + w);
            let lower = left.rb().submatrix(k + w, k, height - k - w, w);
            let w_all = MatMut::from_column_major_slice_mut(&mut scaled[..], rows, end - first);
            let b = w_all.rb().submatrix(k + w - first, k - first, end - k - w, w);
            subtract_product(right.submatrix_mut(k + w, 0, height - k - w, end - k - w), lower, b);
        }
        let front = MatMut::from_column_major_slice_mut(panel, height, width);
        let (left, right) = front.split_at_col_mut(end);
        let lower = left.rb().submatrix(end, first, height - end, end - first);
        let w_all = MatMut::from_column_major_slice_mut(&mut scaled[..], rows, end - first);
        let b = w_all.rb().submatrix(end - first, 0, height - end, end - first);
        let rest = right.submatrix_mut(end, 0, height - end, width - end);
        subtract_product(rest, lower, b.subrows(0, width - end));
        let square = MatMut::from_column_major_slice_mut(update, below, below);
        subtract_product(square, lower.subrows(width - end, below), b.subrows(width - end, below));
    }
}

/// Pivots one diagonal block, moves the columns below and the rows to its left accordingly, solves the columns below.
fn eliminate_block<T: Scalar>(
    panel: &mut [T],
    height: usize,
    k: usize,
    w: usize,
    pivots: &mut Pivots<'_, T>,
) {
    let mut block = vec![T::ZERO; w * w];
    for j in 0..w {
        block[j * w + j..(j + 1) * w]
            .copy_from_slice(&panel[(k + j) * height + k + j..(k + j) * height + k + w]);
    }
    let mut order: Vec<usize> = (0..w).collect();
    bunch_kaufman(&mut block, w, &mut order, &mut pivots.subdiag[k..k + w]);
    for j in 0..w {
        panel[(k + j) * height + k + j..(k + j) * height + k + w]
            .copy_from_slice(&block[j * w + j..(j + 1) * w]);
    }
    if order.iter().enumerate().any(|(i, &o)| i != o) {
        let mut moved = vec![T::ZERO; w];
        for column in panel[..k * height].chunks_exact_mut(height) {
            order.iter().zip(&mut moved).for_each(|(&o, m)| *m = column[k + o]);
            column[k..k + w].copy_from_slice(&moved);
        }
        let rows = height - k - w;
        let mut copy = vec![T::ZERO; rows * w];
        for (j, copy) in copy.chunks_exact_mut(rows.max(1)).enumerate() {
            copy.copy_from_slice(&panel[(k + order[j]) * height + k + w..(k + order[j] + 1) * height]);
        }
        for (j, copy) in copy.chunks_exact(rows.max(1)).enumerate() {
            panel[(k + j) * height + k + w..(k + j + 1) * height].copy_from_slice(copy);
        }
        let old: Vec<u32> = pivots.perm[k..k + w].to_vec();
        order.iter().zip(&mut pivots.perm[k..k + w]).for_each(|(&o, p)| *p = old[o]);
    }
    let columns = MatMut::from_column_major_slice_mut(&mut panel[k * height..(k + w) * height], height, w);
    let (diagonal, lower) = columns.submatrix_mut(k, 0, height - k, w).split_at_row_mut(w);
    solve_below(diagonal.rb(), lower, true);
}

/// Copies the solved rows below a block to `scaled` (rows from `first` on) and multiplies the panel's by D⁻¹.
fn scale_below<T: Scalar>(
    panel: &mut [T],
    height: usize,
    k: usize,
    w: usize,
    subdiag: &[T],
    scaled: &mut [T],
    first: usize,
) {
    let rows = height - first;
    let from = k + w;
    let mut j = 0;
    while j < w {
        let (left, right) = panel.split_at_mut((k + j + 1) * height);
        let a = &mut left[(k + j) * height..];
        let d = a[k + j];
        let out = from - first;
        scaled[j * rows + out..(j + 1) * rows].copy_from_slice(&a[from..]);
        let c = subdiag[k + j];
        if c == T::ZERO {
            let inverse = if d == T::ZERO { T::ZERO } else { T::ONE / d };
            a[from..].iter_mut().for_each(|v| *v *= inverse);
            j += 1;
            continue;
        }
        let b = &mut right[..height];
        scaled[(j + 1) * rows + out..(j + 2) * rows].copy_from_slice(&b[from..]);
        let [p, q, r] = inverse_pair(d, c, b[k + j + 1]);
        for (x, y) in a[from..].iter_mut().zip(&mut b[from..]) {
            (*x, *y) = (*x * p + *y * q, *x * q + *y * r);
        }
        j += 2;
    }
}

/// Inverse of [[a, c], [c, b]] as (first diagonal, off-diagonal, second diagonal), scaled by c against overflow.
pub(crate) fn inverse_pair<T: Scalar>(a: T, c: T, b: T) -> [T; 3] {
    let (a, b) = (a / c, b / c);
    let t = T::ONE / ((a * b - T::ONE) * c);
    [b * t, -t, a * t]
}

/// Unblocked elimination of a w x w block, lower part, with `order[i]` the old place of the column now at i.
fn bunch_kaufman<T: Scalar>(a: &mut [T], w: usize, order: &mut [usize], subdiag: &mut [T]) {
    let mut k = 0;
    while k < w {
        let (step, with) = choose(a, w, k);
        swap(a, w, k + step - 1, with, order);
        if step == 1 {
            eliminate_one(a, w, k);
        } else {
            subdiag[k] = a[k * w + k + 1];
            eliminate_two(a, w, k);
        }
        k += step;
    }
}

/// Size of the next pivot and the column to exchange for its last one.
fn choose<T: Scalar>(a: &[T], w: usize, k: usize) -> (usize, usize) {
    let own = a[k * w + k].modulus();
    let (mut at, mut largest) = (k, 0.0);
    for i in k + 1..w {
        let v = a[k * w + i].modulus();
        if v > largest {
            (at, largest) = (i, v);
        }
    }
    if own >= ALPHA * largest {
        return (1, k);
    }
    let row = (k..at).map(|j| a[j * w + at].modulus());
    let column = (at + 1..w).map(|i| a[at * w + i].modulus());
    let other = row.chain(column).fold(0.0f64, f64::max);
    if own * other >= ALPHA * largest * largest {
        (1, k)
    } else if a[at * w + at].modulus() >= ALPHA * other {
        (1, at)
    } else {
        (2, at)
    }
}

/// Exchanges rows and columns p < q of a symmetric block of which the lower part is stored.
fn swap<T: Scalar>(a: &mut [T], w: usize, p: usize, q: usize, order: &mut [usize]) {
    if p == q {
        return;
    }
    order.swap(p, q);
    (0..p).for_each(|j| a.swap(j * w + p, j * w + q));
    a.swap(p * w + p, q * w + q);
    (p + 1..q).for_each(|i| a.swap(p * w + i, i * w + q));
    (q + 1..w).for_each(|i| a.swap(p * w + i, q * w + i));
}

fn eliminate_one<T: Scalar>(a: &mut [T], w: usize, k: usize) {
    let d = a[k * w + k];
    if d == T::ZERO {
        return;
    }
    let (left, right) = a.split_at_mut((k + 1) * w);
    let l = &mut left[k * w + k + 1..];
    let inverse = T::ONE / d;
    for j in 0..l.len() {
        let s = l[j] * inverse;
        let column = &mut right[j * w + k + 1 + j..(j + 1) * w];
        column.iter_mut().zip(&l[j..]).for_each(|(c, &v)| *c -= v * s);
    }
    l.iter_mut().for_each(|v| *v *= inverse);
}

/// The subdiagonal entry of the pivot is cleared: it stands in `subdiag`.
fn eliminate_two<T: Scalar>(a: &mut [T], w: usize, k: usize) {
    let [p, q, r] = inverse_pair(a[k * w + k], a[k * w + k + 1], a[(k + 1) * w + k + 1]);
    a[k * w + k + 1] = T::ZERO;
    let (left, right) = a.split_at_mut((k + 2) * w);
    let (one, two) = left[k * w..].split_at_mut(w);
    let (one, two) = (&mut one[k + 2..], &mut two[k + 2..]);
    for j in 0..one.len() {
        let (s, t) = (one[j] * p + two[j] * q, one[j] * q + two[j] * r);
        let column = &mut right[j * w + k + 2 + j..(j + 1) * w];
        for ((c, &x), &y) in column.iter_mut().zip(&one[j..]).zip(&two[j..]) {
            *c -= x * s + y * t;
        }
    }
    for (x, y) in one.iter_mut().zip(two) {
        (*x, *y) = (*x * p + *y * q, *x * q + *y * r);
    }
}
