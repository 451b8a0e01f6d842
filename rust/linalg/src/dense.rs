//! Dense blocks, column-major, and the few kernels the sparse methods need.

use faer::linalg::matmul::matmul;
use faer::linalg::solvers::Solve;
use faer::{Accum, MatMut, MatRef, Par, Side};
use num_complex::Complex64;
use rayon::prelude::*;

use crate::lanes::LANES;
use crate::{LinalgError, skinny};

/// Rows per parallel task; fixed, so that sums do not depend on the number of threads.
const ROWS: usize = 4096;

/// A dense real matrix, column after column.
#[derive(Debug, Clone, PartialEq)]
pub struct Dense {
    nrows: usize,
    ncols: usize,
    data: Vec<f64>,
}

impl Dense {
    /// All zero.
    pub fn zeros(nrows: usize, ncols: usize) -> Self {
        Self { nrows, ncols, data: vec![0.0; nrows * ncols] }
    }

    /// Takes over column-major data.
    ///
    /// # Panics
    /// When the length is not nrows * ncols.
    pub fn from_vec(nrows: usize, ncols: usize, data: Vec<f64>) -> Self {
        assert_eq!(data.len(), nrows * ncols);
        Self { nrows, ncols, data }
    }

    /// Number of rows.
    pub fn nrows(&self) -> usize {
        self.nrows
    }

    /// Number of columns.
    pub fn ncols(&self) -> usize {
        self.ncols
    }

    /// Column-major data.
    pub fn data(&self) -> &[f64] {
        &self.data
    }

    /// Column-major data, to write.
    pub fn data_mut(&mut self) -> &mut [f64] {
        &mut self.data
    }

    /// Gives the column-major data back.
    pub fn into_vec(self) -> Vec<f64> {
        self.data
    }

    /// Column `j`.
    pub fn col(&self, j: usize) -> &[f64] {
        &self.data[j * self.nrows..(j + 1) * self.nrows]
    }

    /// Column `j`, to write.
    pub fn col_mut(&mut self, j: usize) -> &mut [f64] {
        &mut self.data[j * self.nrows..(j + 1) * self.nrows]
    }

    /// `k` columns from `j` on, as one slice.
    pub fn cols_mut(&mut self, j: usize, k: usize) -> &mut [f64] {
        &mut self.data[j * self.nrows..(j + k) * self.nrows]
    }

    /// A copy of some columns.
    pub fn select(&self, columns: &[usize]) -> Self {
        let data = columns.iter().flat_map(|&j| self.col(j).iter().copied()).collect();
        Self { nrows: self.nrows, ncols: columns.len(), data }
    }

    /// Appends the columns of `other`.
    ///
    /// # Panics
    /// When the row counts differ.
    pub fn append(&mut self, other: &Self) {
        assert_eq!(self.nrows, other.nrows);
        self.data.extend_from_slice(&other.data);
        self.ncols += other.ncols;
    }

    /// Takes columns away from the end until `ncols` are left.
    pub fn truncate(&mut self, ncols: usize) {
        self.ncols = self.ncols.min(ncols);
        self.data.truncate(self.nrows * self.ncols);
    }

    /// A <- A Y in the memory of A, for a square Y.
    ///
    /// # Panics
    /// When the shapes do not fit.
    pub fn turn(&mut self, y: &Self) {
        assert!(self.ncols == y.nrows && y.nrows == y.ncols);
        if self.data.is_empty() {
            return;
        }
        self.view_mut().par_row_chunks_mut(ROWS).for_each(|mut part| {
            let mut turned = Self::zeros(part.nrows(), y.ncols);
            matmul(turned.view_mut(), Accum::Replace, part.as_ref(), y.view(), 1.0, Par::Seq);
            part.copy_from(turned.view());
        });
    }

    /// Transposed copy.
    pub fn transposed(&self) -> Self {
        let mut t = Self::zeros(self.ncols, self.nrows);
        for j in 0..self.ncols {
            for i in 0..self.nrows {
                t[(j, i)] = self[(i, j)];
            }
        }
        t
    }

    pub(crate) fn view(&self) -> MatRef<'_, f64> {
        MatRef::from_column_major_slice(&self.data, self.nrows, self.ncols)
    }

    pub(crate) fn view_mut(&mut self) -> MatMut<'_, f64> {
        MatMut::from_column_major_slice_mut(&mut self.data, self.nrows, self.ncols)
    }

    /// Lower Cholesky factor L with L Lᵀ = self (symmetric, lower triangle read).
    ///
    /// # Errors
    /// [`LinalgError::NotPositiveDefinite`].
    pub fn cholesky(&self) -> Result<Self, LinalgError> {
        let f = self.view().llt(Side::Lower).map_err(|_| LinalgError::NotPositiveDefinite)?;
        let mut l = Self::zeros(self.nrows, self.nrows);
        l.view_mut().copy_from(f.L());
        Ok(l)
    }

    /// Solves L X = B (or Lᵀ X = B) in place for lower triangular `self`.
    pub fn solve_lower_in_place(&self, transpose: bool, b: &mut Self) {
        use faer::linalg::triangular_solve as ts;
        if transpose {
            ts::solve_upper_triangular_in_place(self.view().transpose(), b.view_mut(), Par::Seq);
        } else {
            ts::solve_lower_triangular_in_place(self.view(), b.view_mut(), Par::Seq);
        }
    }

    /// x = A⁻¹ b of a symmetric positive definite A (lower triangle read).
    ///
    /// # Errors
    /// As [`Dense::cholesky`].
    pub fn solve_definite(&self, b: &[f64]) -> Result<Vec<f64>, LinalgError> {
        let lower = self.cholesky()?;
        let mut x = Self::from_vec(b.len(), 1, b.to_vec());
        lower.solve_lower_in_place(false, &mut x);
        lower.solve_lower_in_place(true, &mut x);
        Ok(x.into_vec())
    }

    /// Eigenvalues (rising) and orthonormal eigenvectors of a symmetric matrix (lower triangle read).
    ///
    /// The matrix is brought to entries of about one first: faer's divide and conquer, which takes over at 128 rows,
    /// does not follow the size of the matrix, and left residuals of 1e-8 of the largest eigenvalue where that was 1e-8.
    ///
    /// # Errors
    /// [`LinalgError::Library`] when the iteration does not converge, which needs non-finite input.
    pub fn symmetric_eigen(&self) -> Result<SymmetricEigen, LinalgError> {
        faer::set_global_parallelism(Par::Seq);
        let largest = self.data.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        // a power of two, so that no digit is lost
        let scale =
            if largest.is_normal() { largest.log2().floor().clamp(-1000.0, 1000.0).exp2() } else { 1.0 };
        let mut own = self.clone();
        own.data.iter_mut().for_each(|v| *v /= scale);
        let evd = own
            .view()
            .self_adjoint_eigen(Side::Lower)
            .map_err(|_| LinalgError::Library("dense eigenvalue iteration did not converge".into()))?;
        let mut vectors = Self::zeros(self.nrows, self.nrows);
        vectors.view_mut().copy_from(evd.U());
        let values = (0..self.nrows).map(|i| evd.S()[i] * scale).collect();
        Ok(SymmetricEigen { values, vectors })
    }
}

/// Eigenvalues in rising order with their vectors as columns.
#[derive(Debug, Clone)]
pub struct SymmetricEigen {
    /// Eigenvalues, n.
    pub values: Vec<f64>,
    /// Vectors (n, n).
    pub vectors: Dense,
}

impl std::ops::Index<(usize, usize)> for Dense {
    type Output = f64;
    fn index(&self, (i, j): (usize, usize)) -> &f64 {
        &self.data[j * self.nrows + i]
    }
}

impl std::ops::IndexMut<(usize, usize)> for Dense {
    fn index_mut(&mut self, (i, j): (usize, usize)) -> &mut f64 {
        &mut self.data[j * self.nrows + i]
    }
}

/// Is a product of `a` with so many columns one that only reads `a`? Small ones are not worth turning rows for.
fn tall(a: MatRef<'_, f64>, columns: usize) -> bool {
    columns <= LANES && columns > LANES / 2 && a.nrows() >= 8 * LANES
}

/// C = beta C + alpha A B, rows of C in parallel; with beta = 0 what C held is of no account, were it not finite.
///
/// # Panics
/// When the shapes do not fit.
pub fn gemm(c: &mut Dense, beta: f64, alpha: f64, a: &Dense, b: &Dense) {
    assert!(a.ncols == b.nrows && c.nrows == a.nrows && c.ncols == b.ncols);
    if c.data.is_empty() {
        return;
    }
    if a.ncols == 0 && beta == 0.0 {
        return c.data.fill(0.0);
    }
    if beta != 0.0 && beta != 1.0 {
        c.data.iter_mut().for_each(|v| *v *= beta);
    }
    let (a, b) = (a.view(), b.view());
    let product = |chunk: usize, mut c: MatMut<'_, f64>| {
        let a = a.subrows(chunk * ROWS, c.nrows());
        if tall(a, b.ncols()) {
            if beta == 0.0 {
                c.fill(0.0);
            }
            skinny::add_product(c, alpha, a, b);
        } else {
            let accum = if beta == 0.0 { Accum::Replace } else { Accum::Add };
            matmul(c, accum, a, b, alpha, Par::Seq);
        }
    };
    if c.nrows <= ROWS {
        return product(0, c.view_mut());
    }
    c.view_mut().par_row_chunks_mut(ROWS).enumerate().for_each(|(chunk, c)| product(chunk, c));
}

/// Aᵀ B with the long dimension cut into fixed chunks, partial products added in order.
///
/// # Panics
/// When the row counts differ.
pub fn gemm_tn(a: &Dense, b: &Dense) -> Dense {
    assert_eq!(a.nrows, b.nrows);
    let (p, q) = (a.ncols, b.ncols);
    if p == 0 || q == 0 || a.nrows == 0 {
        return Dense::zeros(p, q);
    }
    let parts: Vec<Dense> = (0..a.nrows.div_ceil(ROWS))
        .into_par_iter()
        .map(|chunk| {
            let first = chunk * ROWS;
            let rows = ROWS.min(a.nrows - first);
            let mut c = Dense::zeros(p, q);
            let (a, b) = (a.view().subrows(first, rows), b.view().subrows(first, rows));
            if tall(a, q) {
                for (k, sums) in skinny::transposed_product(a, b).iter().enumerate() {
                    (0..q).for_each(|j| c[(k, j)] = sums.0[j]);
                }
            } else {
                matmul(c.view_mut(), Accum::Replace, a.transpose(), b, 1.0, Par::Seq);
            }
            c
        })
        .collect();
    let mut sum = Dense::zeros(p, q);
    for part in &parts {
        sum.data.iter_mut().zip(&part.data).for_each(|(s, v)| *s += v);
    }
    sum
}

/// Aᵀ A, of which one triangle is worked out.
pub fn gram(a: &Dense) -> Dense {
    use faer::linalg::matmul::triangular::{self, BlockStructure};
    let n = a.ncols;
    let mut sum = Dense::zeros(n, n);
    if n == 0 || a.nrows == 0 {
        return sum;
    }
    triangular::matmul(
        sum.view_mut(),
        BlockStructure::TriangularLower,
        Accum::Replace,
        a.view().transpose(),
        BlockStructure::Rectangular,
        a.view(),
        BlockStructure::Rectangular,
        1.0,
        Par::Seq,
    );
    for j in 0..n {
        for i in 0..j {
            sum.data[i + n * j] = sum.data[j + n * i];
        }
    }
    sum
}

/// Solves a dense complex system A X = B by LU with row pivoting; `a` is (n, n), `b` (n, k), both column-major.
///
/// # Errors
/// [`LinalgError::Library`] when the solution is not finite (singular A).
pub fn solve_complex_dense(
    n: usize,
    a: &[Complex64],
    b: &[Complex64],
) -> Result<Vec<Complex64>, LinalgError> {
    faer::set_global_parallelism(Par::Seq);
    let k = b.len() / n.max(1);
    let lu = MatRef::from_column_major_slice(a, n, n).partial_piv_lu();
    let mut x = b.to_vec();
    lu.solve_in_place(MatMut::from_column_major_slice_mut(&mut x, n, k));
    if x.iter().all(|v| v.re.is_finite() && v.im.is_finite()) {
        Ok(x)
    } else {
        Err(LinalgError::Library("dense complex system is singular".into()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(n: usize, k: usize) -> Dense {
        let mut state = 1u64;
        let data = (0..n * k)
            .map(|_| {
                state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
            })
            .collect();
        Dense::from_vec(n, k, data)
    }

    #[test]
    fn products_equal_plain_sums() {
        let (a, b) = (noise(9001, 7), noise(9001, 3));
        let g = gemm_tn(&a, &b);
        for i in 0..7 {
            for j in 0..3 {
                let plain: f64 = a.col(i).iter().zip(b.col(j)).map(|(x, y)| x * y).sum();
                assert!((g[(i, j)] - plain).abs() < 1e-11);
            }
        }
        let mut c = noise(9001, 3);
        let before = c.clone();
        gemm(&mut c, 1.0, -2.0, &a, &g);
        for r in [0, 4096, 9000] {
            let plain: f64 = before[(r, 1)] - 2.0 * (0..7).map(|i| a[(r, i)] * g[(i, 1)]).sum::<f64>();
            assert!((c[(r, 1)] - plain).abs() < 1e-11);
        }
    }

    /// In one part and in several, with few columns, with many, and with none to add.
    #[test]
    fn a_product_takes_the_place_of_what_is_not_finite() {
        for (rows, depth, columns) in [(700, 39, 6), (700, 39, 20), (9001, 7, 3), (700, 0, 6)] {
            let (a, b) = (noise(rows, depth), noise(depth, columns));
            let (mut c, mut d) = (noise(rows, columns), Dense::zeros(rows, columns));
            c.data_mut().fill(f64::NAN);
            gemm(&mut c, 0.0, -0.3, &a, &b);
            gemm(&mut d, 1.0, -0.3, &a, &b);
            assert!(c.data().iter().zip(d.data()).all(|(x, y)| (x - y).abs() < 1e-12));
        }
    }

    /// Five to eight columns, for which nothing is packed, beside the general product, in all lengths of the last blocks.
    #[test]
    fn few_columns_equal_many() {
        for (rows, depth, columns) in [(64, 1, 5), (5000, 13, 8), (9001, 24, 7), (700, 39, 6)] {
            let (a, b, wide) = (noise(rows, depth), noise(rows, columns), noise(rows, 9));
            let mut both = b.clone();
            both.append(&wide);
            let (few, many) = (gemm_tn(&a, &b), gemm_tn(&a, &both));
            assert!(few.data().iter().zip(many.data()).all(|(x, y)| (x - y).abs() < 1e-11));
            let (mut c, mut d) = (b.clone(), both.clone());
            gemm(&mut c, 1.0, -0.3, &a, &few);
            gemm(&mut d, 1.0, -0.3, &a, &many);
            assert!(c.data().iter().zip(d.data()).all(|(x, y)| (x - y).abs() < 1e-10));
        }
    }

    #[test]
    fn turning_in_place_is_a_product() {
        let (mut a, y) = (noise(9001, 6), noise(6, 6));
        let mut product = Dense::zeros(9001, 6);
        gemm(&mut product, 0.0, 1.0, &a, &y);
        a.turn(&y);
        assert!(a.data().iter().zip(product.data()).all(|(x, y)| (x - y).abs() < 1e-12));
    }

    #[test]
    fn eigen_and_cholesky_reproduce_the_matrix() {
        let a = noise(40, 40);
        let s = gemm_tn(&a, &a);
        let e = s.symmetric_eigen().unwrap();
        assert!(e.values.windows(2).all(|w| w[0] <= w[1]));
        let mut scaled = e.vectors.clone();
        for j in 0..40 {
            scaled.col_mut(j).iter_mut().for_each(|v| *v *= e.values[j]);
        }
        let mut back = s.clone();
        gemm(&mut back, -1.0, 1.0, &scaled, &e.vectors.transposed());
        assert!(back.data().iter().all(|v| v.abs() < 1e-12));
        let l = s.cholesky().unwrap();
        let mut back = s.clone();
        gemm(&mut back, -1.0, 1.0, &l, &l.transposed());
        assert!(back.data().iter().all(|v| v.abs() < 1e-12));
        assert!(Dense::from_vec(1, 1, vec![-1.0]).cholesky().is_err());
        let b = noise(40, 1);
        let mut left = b.clone();
        let x = Dense::from_vec(40, 1, s.solve_definite(b.data()).unwrap());
        gemm(&mut left, -1.0, 1.0, &s, &x);
        assert!(left.data().iter().all(|v| v.abs() < 1e-9), "{left:?}");
        assert!(Dense::from_vec(1, 1, vec![-1.0]).solve_definite(&[1.0]).is_err());
    }

    /// Values that fall like those of a flexibility matrix, at any size: what divide and conquer takes for zero must not
    /// depend on the unit.
    #[test]
    fn eigenvectors_are_as_good_in_any_unit() {
        let n = 200;
        let mut turned = noise(n, n);
        turned = gemm_tn(&turned, &turned).symmetric_eigen().unwrap().vectors;
        for size in [1e-12, 1e-8, 1.0, 1e8, 1e12] {
            let mut half = turned.clone();
            for j in 0..n {
                half.col_mut(j).iter_mut().for_each(|v| *v *= size / (1.0 + j as f64).powi(2));
            }
            let mut a = Dense::zeros(n, n);
            gemm(&mut a, 0.0, 1.0, &half, &turned.transposed());
            let e = a.symmetric_eigen().unwrap();
            let mut left = e.vectors.clone();
            for j in 0..n {
                left.col_mut(j).iter_mut().for_each(|v| *v *= e.values[j]);
            }
            gemm(&mut left, -1.0, 1.0, &a, &e.vectors);
            let worst = left.data().iter().fold(0.0f64, |m, v| m.max(v.abs()));
            assert!(worst < 1e-14 * size, "{worst} at {size}");
        }
    }
}
