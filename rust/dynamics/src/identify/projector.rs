//! Free forces taken out of weighted columns, line by line.

use super::arrays::{Loop, Pair, Split, update, update_real, wide};
use super::prepared::Prepared;
use super::response::Response;
use femend_linalg::Dense;
use num_complex::Complex64;

/// Part of a force column, relative to its size, below which it depends on the columns before it.
const DEPENDENT: f64 = 1e-7;

/// Orthonormal basis of the weighted force columns on every line, and their triangular factor.
pub(crate) struct Projector {
    /// Vectors of the basis as weighted columns.
    basis: Dense,
    /// Column j n_w + i for the entry (i, j).
    triangle: Split,
    n_w: usize,
}

/// Lines whose sums over sensors stay in registers.
const BLOCK: usize = 8;

/// a = v^H x over the sensors and x -= v a, on every line; v and x hold sensor after sensor.
struct TakeOut<'a> {
    n: usize,
    v: &'a [f64],
    x: &'a mut [f64],
    a: &'a mut [f64],
}

#[inline(always)]
fn block<const L: usize>(from: &[f64], k: usize) -> [f64; L] {
    let part = &from[k..k + L];
    std::array::from_fn(|i| part[i])
}

impl TakeOut<'_> {
    #[inline(always)]
    fn lines<const L: usize>(&mut self, k: usize) {
        let (mut re, mut im) = ([0.0; L], [0.0; L]);
        for (v, x) in self.v.chunks_exact(2 * self.n).zip(self.x.chunks_exact(2 * self.n)) {
            let (vr, vi, xr, xi): ([f64; L], [f64; L], [f64; L], [f64; L]) =
                (block(v, k), block(v, self.n + k), block(x, k), block(x, self.n + k));
            for i in 0..L {
                re[i] += vr[i] * xr[i] + vi[i] * xi[i];
                im[i] += vr[i] * xi[i] - vi[i] * xr[i];
            }
        }
        self.a[k..k + L].copy_from_slice(&re);
        self.a[self.n + k..self.n + k + L].copy_from_slice(&im);
        for (v, x) in self.v.chunks_exact(2 * self.n).zip(self.x.chunks_exact_mut(2 * self.n)) {
            let (vr, vi): ([f64; L], [f64; L]) = (block(v, k), block(v, self.n + k));
            let (xr, xi) = x.split_at_mut(self.n);
            let (xr, xi) = (&mut xr[k..k + L], &mut xi[k..k + L]);
            for i in 0..L {
                xr[i] -= vr[i] * re[i] - vi[i] * im[i];
                xi[i] -= vr[i] * im[i] + vi[i] * re[i];
            }
        }
    }
}

impl Loop for TakeOut<'_> {
    type Output = ();
    #[inline(always)]
    fn run(mut self) {
        if self.n == 0 {
            return;
        }
        let whole = self.n - self.n % BLOCK;
        let mut k = 0;
        while k < whole {
            self.lines::<BLOCK>(k);
            k += BLOCK;
        }
        while k < self.n {
            self.lines::<1>(k);
            k += 1;
        }
    }
}

fn add_power(sum: &mut [f64], (re, im): Pair<'_>) {
    sum.iter_mut().zip(re.iter().zip(im)).for_each(|(p, (a, b))| *p += a * a + b * b);
}

impl Projector {
    pub fn new(at: &Prepared<'_>, response: &Response) -> Self {
        let (n, n_w) = (at.n_lines(), response.n_free);
        let mut basis = Dense::zeros(at.n_rows(), n_w);
        let mut triangle = Split::zeros(n, n_w * n_w);
        for j in 0..n_w {
            let (mut size, mut left) = (vec![0.0; n], vec![0.0; n]);
            let mut own = vec![0.0; at.n_rows()];
            for (s, (part, w)) in at.sensors(&mut own).enumerate() {
                let (h, sign) = response.per_free_force(j, s);
                update_real(part, h, w, |_, h, w| h * (w * sign));
            }
            own.chunks_exact((2 * n).max(1)).for_each(|v| add_power(&mut size, v.split_at(n)));
            let mut dot = vec![0.0; 2 * n];
            for i in 0..j {
                wide(TakeOut { n, v: basis.col(i), x: &mut own, a: &mut dot });
                update(triangle.col_mut(j * n_w + i), dot.split_at(n), |_, dot| dot);
            }
            own.chunks_exact((2 * n).max(1)).for_each(|v| add_power(&mut left, v.split_at(n)));
            // A column that depends on the earlier ones adds nothing to the span and carries no force of its own.
            for (k, (left, size)) in left.iter_mut().zip(&size).enumerate() {
                let length = left.sqrt();
                let kept = length > DEPENDENT * size.sqrt() && length > 0.0;
                triangle.set(j * n_w + j, k, if kept { length.into() } else { Complex64::default() });
                *left = if kept { 1.0 / length } else { 0.0 };
            }
            for (to, from) in basis.col_mut(j).chunks_exact_mut(n.max(1)).zip(own.chunks_exact(n.max(1))) {
                to.iter_mut().zip(from.iter().zip(&left)).for_each(|(t, (v, f))| *t = v * f);
            }
        }
        Self { basis, triangle, n_w }
    }

    /// Removes from a weighted column on every line its part in the span of the basis; `along` (n_w blocks of lines)
    /// becomes that part's coordinates.
    pub fn project(&self, column: &mut [f64], along: &mut [f64]) {
        let n = self.triangle.n_lines();
        if n == 0 {
            return;
        }
        for (j, a) in along.chunks_exact_mut(2 * n).enumerate() {
            wide(TakeOut { n, v: self.basis.col(j), x: &mut *column, a });
        }
    }

    /// Writes the accelerations `y` to a weighted column, without what free forces could do as well, whose coordinates
    /// `along` becomes; as they are where there is no projector.
    pub fn fill(of: Option<&Self>, at: &Prepared<'_>, y: &Split, (column, along): (&mut [f64], &mut [f64])) {
        at.fill(column, y);
        if let Some(p) = of {
            p.project(column, along);
        }
    }

    /// Removes from a weighted column its part in the span of the basis and gives the forces it is of.
    pub fn taken_out(&self, column: &mut [f64]) -> Split {
        let n = self.triangle.n_lines();
        let mut along = vec![0.0; 2 * n * self.n_w];
        self.project(column, &mut along);
        let mut f = Split::zeros(n, self.n_w);
        for (i, block) in along.chunks_exact((2 * n).max(1)).enumerate() {
            update(f.col_mut(i), block.split_at(n), |_, v| v);
        }
        self.forces(f)
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
