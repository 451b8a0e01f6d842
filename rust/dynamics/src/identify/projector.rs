//! Free forces taken out of weighted columns, line by line.

use super::arrays::{Pair, PairMut, Split, update, update2, wide};
use super::prepared::Prepared;
use super::response::Response;
use num_complex::Complex64;

/// Part of a force column, relative to its size, below which it depends on the columns before it.
const DEPENDENT: f64 = 1e-7;

/// Orthonormal basis of the weighted force columns on every line, and their triangular factor.
pub(crate) struct Projector {
    /// Column j n_out + s.
    basis: Split,
    /// Column j n_w + i for the entry (i, j).
    triangle: Split,
    n_w: usize,
}

/// sum += conj(v) x on every line.
fn add_dot(sum: PairMut<'_>, v: Pair<'_>, x: Pair<'_>) {
    update2(sum, v, x, |sum, v, x| sum + v.conj() * x);
}

fn add_power(sum: &mut [f64], v: Pair<'_>) {
    wide(|| sum.iter_mut().zip(v.0.iter().zip(v.1)).for_each(|(p, (a, b))| *p += a * a + b * b));
}

impl Projector {
    pub fn new(at: &Prepared<'_>, response: &Response) -> Self {
        let (n, n_out, n_w) = (at.n_lines(), at.n_out(), response.n_w);
        let mut basis = response.h.clone();
        let mut triangle = Split::zeros(n, n_w * n_w);
        for j in 0..n_w {
            let (mut size, mut left) = (vec![0.0; n], vec![0.0; n]);
            for s in 0..n_out {
                let (w, (re, im)) = (at.weight.col(s), basis.col_mut(j * n_out + s));
                wide(|| re.iter_mut().zip(w).for_each(|(v, w)| *v *= w));
                wide(|| im.iter_mut().zip(w).for_each(|(v, w)| *v *= w));
                add_power(&mut size, basis.col(j * n_out + s));
            }
            for i in 0..j {
                let mut dot = Split::zeros(n, 1);
                for s in 0..n_out {
                    add_dot(dot.col_mut(0), basis.col(i * n_out + s), basis.col(j * n_out + s));
                }
                for s in 0..n_out {
                    let mut taken = Split::zeros(n, 1);
                    update2(taken.col_mut(0), basis.col(i * n_out + s), dot.col(0), |_, u, dot| u * dot);
                    update(basis.col_mut(j * n_out + s), taken.col(0), |v, t| v - t);
                }
                update(triangle.col_mut(j * n_w + i), dot.col(0), |_, dot| dot);
            }
            (0..n_out).for_each(|s| add_power(&mut left, basis.col(j * n_out + s)));
            // A column that depends on the earlier ones adds nothing to the span and carries no force of its own.
            for (k, (left, size)) in left.iter_mut().zip(&size).enumerate() {
                let length = left.sqrt();
                let kept = length > DEPENDENT * size.sqrt() && length > 0.0;
                triangle.set(j * n_w + j, k, if kept { length.into() } else { Complex64::default() });
                *left = if kept { 1.0 / length } else { 0.0 };
            }
            for s in 0..n_out {
                let (re, im) = basis.col_mut(j * n_out + s);
                re.iter_mut().zip(&left).for_each(|(v, f)| *v *= f);
                im.iter_mut().zip(&left).for_each(|(v, f)| *v *= f);
            }
        }
        Self { basis, triangle, n_w }
    }

    /// Removes from a weighted column on every line its part in the span of the basis; `along` (n_w columns) becomes
    /// that part's coordinates.
    pub fn project(&self, column: &mut [f64], along: &mut Split) {
        let n = self.basis.n_lines();
        let n_out = column.len() / (2 * n).max(1);
        for j in 0..self.n_w {
            let (re, im) = along.col_mut(j);
            re.fill(0.0);
            im.fill(0.0);
            for (s, x) in column.chunks_exact((2 * n).max(1)).enumerate() {
                add_dot(along.col_mut(j), self.basis.col(j * n_out + s), x.split_at(n));
            }
            for (s, x) in column.chunks_exact_mut((2 * n).max(1)).enumerate() {
                update2(x.split_at_mut(n), self.basis.col(j * n_out + s), along.col(j), |x, v, a| x - v * a);
            }
        }
    }

    /// Least-squares forces (n_w columns) of a residual with coordinates `f` in the basis.
    pub fn forces(&self, mut f: Split) -> Split {
        for k in 0..f.n_lines() {
            for i in (0..self.n_w).rev() {
                let mut v = f.get(i, k);
                for j in i + 1..self.n_w {
                    v -= self.triangle.get(j * self.n_w + i, k) * f.get(j, k);
                }
                let pivot = self.triangle.get(i * self.n_w + i, k);
                f.set(i, k, if pivot.norm() > 0.0 { v / pivot } else { Complex64::default() });
            }
        }
        f
    }
}
