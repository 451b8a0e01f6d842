//! Small dense matrices and 3-vectors of element arithmetic.

use crate::mesh::Rotation;
use crate::scalar::Scalar;

/// Dense row-major matrix.
#[derive(Debug, Clone, PartialEq)]
pub struct Mat<S> {
    /// Rows.
    pub rows: usize,
    /// Columns.
    pub cols: usize,
    /// Entries, row by row.
    pub data: Vec<S>,
}

impl<S> std::ops::Index<(usize, usize)> for Mat<S> {
    type Output = S;
    fn index(&self, (i, j): (usize, usize)) -> &S {
        &self.data[i * self.cols + j]
    }
}

impl<S> std::ops::IndexMut<(usize, usize)> for Mat<S> {
    fn index_mut(&mut self, (i, j): (usize, usize)) -> &mut S {
        &mut self.data[i * self.cols + j]
    }
}

impl<S: Scalar> Mat<S> {
    /// Zeros.
    #[must_use]
    pub fn zeros(rows: usize, cols: usize) -> Self {
        Self { rows, cols, data: vec![S::zero(); rows * cols] }
    }

    /// Same matrix in another number type.
    #[must_use]
    pub fn lift(a: &Mat<f64>) -> Self {
        Self { rows: a.rows, cols: a.cols, data: a.data.iter().map(|&x| S::c(x)).collect() }
    }

    /// Adds `w * other`.
    pub fn add_scaled(&mut self, w: S, other: &Self) {
        for (a, b) in self.data.iter_mut().zip(&other.data) {
            *a += w * *b;
        }
    }

    /// The matrix times a number.
    #[must_use]
    pub fn scaled(&self, w: S) -> Self {
        Self { rows: self.rows, cols: self.cols, data: self.data.iter().map(|&x| w * x).collect() }
    }

    /// The entries of `rows` in rows and columns alike.
    #[must_use]
    pub fn principal(&self, rows: &[usize]) -> Self {
        let mut out = Self::zeros(rows.len(), rows.len());
        for (i, &a) in rows.iter().enumerate() {
            for (j, &b) in rows.iter().enumerate() {
                out[(i, j)] = self[(a, b)];
            }
        }
        out
    }

    /// Congruence `tᵀ A t` with a constant `t` (rows of A x new size); zeros of `t` are skipped.
    #[must_use]
    pub fn congruence(&self, t: &Mat<f64>) -> Self {
        let (n, r) = (self.rows, t.cols);
        // entries of t other than zero, row by row: most maps have three of 24 in a row
        let mut entries: Vec<(usize, f64)> = Vec::with_capacity(4 * n);
        let mut start = Vec::with_capacity(n + 1);
        start.push(0);
        for row in t.data.chunks(r.max(1)).take(n) {
            entries.extend(row.iter().copied().enumerate().filter(|(_, w)| *w != 0.0));
            start.push(entries.len());
        }
        let mut at = Self::zeros(n, r);
        for i in 0..n {
            let out = &mut at.data[i * r..(i + 1) * r];
            for k in 0..n {
                let a = self[(i, k)];
                if a.is_zero() {
                    continue;
                }
                for &(j, w) in &entries[start[k]..start[k + 1]] {
                    out[j] += a * w;
                }
            }
        }
        let mut out = Self::zeros(r, r);
        for k in 0..n {
            for &(i, w) in &entries[start[k]..start[k + 1]] {
                for (o, x) in out.data[i * r..(i + 1) * r].iter_mut().zip(&at.data[k * r..(k + 1) * r]) {
                    *o += *x * w;
                }
            }
        }
        out
    }

    /// Adds `w * (aᵀ b)` of two rows, symmetrically: `w (aᵀb + bᵀa) / 2`; with `a = b` it is `w aᵀa`.
    pub fn add_outer(&mut self, w: S, a: &[S], b: &[S]) {
        let h = w * 0.5;
        // along the rows without indices: most of the time of a beam's consistent mass goes by here
        for (row, (&ai, &bi)) in self.data.chunks_exact_mut(self.cols).zip(a.iter().zip(b)) {
            for (out, (&aj, &bj)) in row.iter_mut().zip(a.iter().zip(b)) {
                *out += h * (ai * bj + bi * aj);
            }
        }
    }
}

/// Inverse of a symmetric positive definite matrix by LDLᵀ without pivoting.
///
/// `None` when a pivot falls below `1e-13` of its diagonal: the matrix is not positive definite.
#[must_use]
pub fn inverse_spd<S: Scalar>(a: &Mat<S>) -> Option<Mat<S>> {
    let n = a.rows;
    let mut l = Mat::<S>::zeros(n, n);
    let mut d = vec![S::zero(); n];
    for j in 0..n {
        let mut pivot = a[(j, j)];
        for k in 0..j {
            pivot = pivot - l[(j, k)] * l[(j, k)] * d[k];
        }
        let ok = pivot.value() > 1e-13 * a[(j, j)].value() && pivot.value().is_finite();
        if !ok {
            return None;
        }
        d[j] = pivot;
        for i in j + 1..n {
            let mut s = a[(i, j)];
            for k in 0..j {
                s = s - l[(i, k)] * l[(j, k)] * d[k];
            }
            l[(i, j)] = s / pivot;
        }
    }
    let mut inv = Mat::zeros(n, n);
    for c in 0..n {
        let mut x = vec![S::zero(); n];
        x[c] = S::c(1.0);
        for i in 0..n {
            for k in 0..i {
                x[i] = x[i] - l[(i, k)] * x[k];
            }
        }
        for i in 0..n {
            x[i] = x[i] / d[i];
        }
        for i in (0..n).rev() {
            for k in i + 1..n {
                x[i] = x[i] - l[(k, i)] * x[k];
            }
        }
        for i in 0..n {
            inv[(i, c)] = x[i];
        }
    }
    Some(inv)
}

/// Eliminates the internal coordinates `m..` of a symmetric matrix: `K_rr - K_ri K_ii⁻¹ K_ir`.
///
/// `None` when `K_ii` is not positive definite.
#[must_use]
pub fn condense_tail<S: Scalar>(k: &Mat<S>, m: usize) -> Option<Mat<S>> {
    let n = k.rows;
    let mut a = k.clone();
    for p in (m..n).rev() {
        let pivot = a[(p, p)];
        let ok = pivot.value() > 1e-13 * k[(p, p)].value();
        if !ok {
            return None;
        }
        for i in 0..p {
            let w = a[(i, p)] / pivot;
            if w.is_zero() {
                continue;
            }
            for j in 0..p {
                let s = a[(p, j)];
                a[(i, j)] = a[(i, j)] - w * s;
            }
        }
    }
    let mut out = Mat::zeros(m, m);
    for i in 0..m {
        for j in 0..m {
            // the two halves differ by rounding alone
            out[(i, j)] = (a[(i, j)] + a[(j, i)]) * 0.5;
        }
    }
    Some(out)
}

/// `a - b`.
#[must_use]
pub fn sub3(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// `a + b`.
#[must_use]
pub fn add3(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// `w a`.
#[must_use]
pub fn scale3(w: f64, a: [f64; 3]) -> [f64; 3] {
    [w * a[0], w * a[1], w * a[2]]
}

/// Dot product.
#[must_use]
pub fn dot3(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Cross product.
#[must_use]
pub fn cross3(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Length.
#[must_use]
pub fn norm3(a: [f64; 3]) -> f64 {
    dot3(a, a).sqrt()
}

/// Local axes from x and a vector in the local x-y plane; `None` when the two are parallel (sine below 1e-6) or zero.
#[must_use]
pub fn frame_from(x: [f64; 3], v: [f64; 3]) -> Option<Rotation> {
    let (lx, lv) = (norm3(x), norm3(v));
    let ex = scale3(1.0 / lx, x);
    let z = cross3(ex, v);
    let lz = norm3(z);
    if !(lx > 0.0 && lv > 0.0 && lz > 1e-6 * lv) {
        return None;
    }
    let ez = scale3(1.0 / lz, z);
    Some([ex, cross3(ez, ex), ez])
}

/// Rigid-body matrix (6 x 6) that moves translations and rotations from a point to another one at `r` from it:
/// `u' = u + theta x r`, `theta' = theta`.
#[must_use]
pub fn rigid(r: [f64; 3]) -> Mat<f64> {
    let mut h = Mat::zeros(6, 6);
    for i in 0..6 {
        h[(i, i)] = 1.0;
    }
    h[(0, 4)] = r[2];
    h[(0, 5)] = -r[1];
    h[(1, 3)] = -r[2];
    h[(1, 5)] = r[0];
    h[(2, 3)] = r[1];
    h[(2, 4)] = -r[0];
    h
}

/// Constant matrix product.
#[must_use]
pub fn matmul(a: &Mat<f64>, b: &Mat<f64>) -> Mat<f64> {
    let mut out = Mat::zeros(a.rows, b.cols);
    for i in 0..a.rows {
        for k in 0..a.cols {
            let w = a[(i, k)];
            if w != 0.0 {
                for j in 0..b.cols {
                    out[(i, j)] += w * b[(k, j)];
                }
            }
        }
    }
    out
}

/// Block-diagonal matrix of `n` copies of a 3 x 3 rotation: rows local, columns basic.
#[must_use]
pub fn rotations(r: &Rotation, n: usize) -> Mat<f64> {
    let mut out = Mat::zeros(3 * n, 3 * n);
    for b in 0..n {
        for i in 0..3 {
            for j in 0..3 {
                out[(3 * b + i, 3 * b + j)] = r[i][j];
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverse_times_matrix_is_identity_and_indefinite_is_refused() {
        let a = Mat { rows: 3, cols: 3, data: vec![4.0, 1.0, 0.5, 1.0, 3.0, -0.2, 0.5, -0.2, 2.0] };
        let i = matmul(&inverse_spd(&a).unwrap(), &a);
        for r in 0..3 {
            for c in 0..3 {
                assert!((i[(r, c)] - f64::from(u8::from(r == c))).abs() < 1e-14);
            }
        }
        let b = Mat { rows: 2, cols: 2, data: vec![1.0, 2.0, 2.0, 1.0] };
        assert!(inverse_spd(&b).is_none());
    }

    #[test]
    fn condensation_equals_schur_complement() {
        let k = Mat { rows: 3, cols: 3, data: vec![4.0, 1.0, 0.5, 1.0, 3.0, -0.2, 0.5, -0.2, 2.0] };
        let s = condense_tail(&k, 2).unwrap();
        assert!((s[(0, 0)] - (4.0 - 0.125)).abs() < 1e-15);
        assert!((s[(0, 1)] - (1.0 + 0.05)).abs() < 1e-15);
        assert!((s[(1, 1)] - (3.0 - 0.02)).abs() < 1e-15);
    }

    #[test]
    fn rigid_motion_is_theta_cross_r() {
        let r = [0.3, -0.7, 1.1];
        let t = [0.2, 0.5, -0.4];
        let h = rigid(r);
        let c = cross3(t, r);
        for i in 0..3 {
            let u: f64 = (0..3).map(|j| h[(i, 3 + j)] * t[j]).sum();
            assert!((u - c[i]).abs() < 1e-15);
        }
    }
}
