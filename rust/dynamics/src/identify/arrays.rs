//! Complex arrays over (line, column) with their parts apart, and the loops over lines that an evaluation is made of.

use femend_linalg::{Dense, gemm, gemm_tn};
use num_complex::Complex64;

/// Real and imaginary parts of one column.
pub(crate) type Pair<'a> = (&'a [f64], &'a [f64]);
/// The same, to write.
pub(crate) type PairMut<'a> = (&'a mut [f64], &'a mut [f64]);

/// A complex array over (line, column). A column holds the real parts of all lines, then their imaginary parts, so that
/// loops over lines are contiguous and a product with a real matrix is one real product.
#[derive(Debug, Clone)]
pub(crate) struct Split {
    data: Dense,
}

impl Split {
    pub fn zeros(n_lines: usize, n_columns: usize) -> Self {
        Self { data: Dense::zeros(2 * n_lines, n_columns) }
    }

    /// Array with the given value of each (line, column).
    pub fn new(n_lines: usize, n_columns: usize, value: impl Fn(usize, usize) -> Complex64) -> Self {
        let mut a = Self::zeros(n_lines, n_columns);
        for j in 0..n_columns {
            (0..n_lines).for_each(|k| a.set(j, k, value(k, j)));
        }
        a
    }

    /// Takes over an array of twice as many rows as there are lines.
    pub fn over(data: Dense) -> Self {
        Self { data }
    }

    /// Gives the array back.
    pub fn into_dense(self) -> Dense {
        self.data
    }

    pub fn n_lines(&self) -> usize {
        self.data.nrows() / 2
    }

    pub fn n_columns(&self) -> usize {
        self.data.ncols()
    }

    pub fn col(&self, j: usize) -> Pair<'_> {
        self.data.col(j).split_at(self.n_lines())
    }

    pub fn col_mut(&mut self, j: usize) -> PairMut<'_> {
        let n = self.n_lines();
        self.data.col_mut(j).split_at_mut(n)
    }

    /// Value of column `j` on line `k`.
    pub fn get(&self, j: usize, k: usize) -> Complex64 {
        let (re, im) = self.col(j);
        Complex64::new(re[k], im[k])
    }

    pub fn set(&mut self, j: usize, k: usize, v: Complex64) {
        let (re, im) = self.col_mut(j);
        (re[k], im[k]) = (v.re, v.im);
    }

    /// This array times a real matrix, into an array that exists; what it held is of no account, were it not finite.
    pub fn times_into(&self, b: &Dense, y: &mut Self) {
        gemm(&mut y.data, 0.0, 1.0, &self.data, b);
    }

    /// Re Σ a b̄ over all lines, for every column a of this array and every b of the other.
    pub fn inner(&self, other: &Self) -> Dense {
        gemm_tn(&self.data, &other.data)
    }

    /// A copy of `n` columns from `j` on.
    pub fn columns(&self, j: usize, n: usize) -> Self {
        let rows = self.data.nrows();
        Self { data: Dense::from_vec(rows, n, self.data.data()[rows * j..rows * (j + n)].to_vec()) }
    }

    /// Appends the columns of `other`, of as many lines.
    pub fn append(&mut self, other: &Self) {
        self.data.append(&other.data);
    }

    /// Multiplies every column by `factor`, an array of one column.
    pub fn times_line(&mut self, factor: &Self) {
        for j in 0..self.n_columns() {
            update(self.col_mut(j), factor.col(0), |y, f| y * f);
        }
    }
}

/// A loop compiled for each width of vector instructions. What a loop calls must be inlined into it: closures around whole
/// loops are not always.
pub(crate) trait Loop {
    type Output;
    fn run(self) -> Self::Output;
}

/// Runs a loop in the widest vector instructions the machine has.
pub(crate) fn wide<L: Loop>(l: L) -> L::Output {
    struct Wide<L>(L);
    impl<L: Loop> pulp::WithSimd for Wide<L> {
        type Output = L::Output;
        #[inline(always)]
        fn with_simd<S: pulp::Simd>(self, _: S) -> L::Output {
            self.0.run()
        }
    }
    pulp::Arch::new().dispatch(Wide(l))
}

/// y = f(y, a) on every line.
pub(crate) fn update(y: PairMut<'_>, a: Pair<'_>, f: impl Fn(Complex64, Complex64) -> Complex64) {
    struct Update<'a, F>(PairMut<'a>, Pair<'a>, F);
    impl<F: Fn(Complex64, Complex64) -> Complex64> Loop for Update<'_, F> {
        type Output = ();
        #[inline(always)]
        fn run(self) {
            let Self(y, a, f) = self;
            let n = y.0.len();
            let (yr, yi, ar, ai) = (&mut y.0[..n], &mut y.1[..n], &a.0[..n], &a.1[..n]);
            for k in 0..n {
                let v = f(Complex64::new(yr[k], yi[k]), Complex64::new(ar[k], ai[k]));
                (yr[k], yi[k]) = (v.re, v.im);
            }
        }
    }
    wide(Update(y, a, f));
}

/// y = f(y, a, b) on every line.
pub(crate) fn update2(
    y: PairMut<'_>,
    a: Pair<'_>,
    b: Pair<'_>,
    f: impl Fn(Complex64, Complex64, Complex64) -> Complex64,
) {
    struct Update<'a, F>(PairMut<'a>, Pair<'a>, Pair<'a>, F);
    impl<F: Fn(Complex64, Complex64, Complex64) -> Complex64> Loop for Update<'_, F> {
        type Output = ();
        #[inline(always)]
        fn run(self) {
            let Self(y, a, b, f) = self;
            let n = y.0.len();
            let (yr, yi) = (&mut y.0[..n], &mut y.1[..n]);
            let (ar, ai, br, bi) = (&a.0[..n], &a.1[..n], &b.0[..n], &b.1[..n]);
            for k in 0..n {
                let (a, b) = (Complex64::new(ar[k], ai[k]), Complex64::new(br[k], bi[k]));
                let v = f(Complex64::new(yr[k], yi[k]), a, b);
                (yr[k], yi[k]) = (v.re, v.im);
            }
        }
    }
    wide(Update(y, a, b, f));
}

/// y = f(y, a, w) on every line for a real w.
pub(crate) fn update_real(
    y: PairMut<'_>,
    a: Pair<'_>,
    w: &[f64],
    f: impl Fn(Complex64, Complex64, f64) -> Complex64,
) {
    struct Update<'a, F>(PairMut<'a>, Pair<'a>, &'a [f64], F);
    impl<F: Fn(Complex64, Complex64, f64) -> Complex64> Loop for Update<'_, F> {
        type Output = ();
        #[inline(always)]
        fn run(self) {
            let Self(y, a, w, f) = self;
            let n = y.0.len();
            let (yr, yi, ar, ai, w) = (&mut y.0[..n], &mut y.1[..n], &a.0[..n], &a.1[..n], &w[..n]);
            for k in 0..n {
                let v = f(Complex64::new(yr[k], yi[k]), Complex64::new(ar[k], ai[k]), w[k]);
                (yr[k], yi[k]) = (v.re, v.im);
            }
        }
    }
    wide(Update(y, a, w, f));
}

/// 1 / a without guards against overflow; a zero gives values that are not finite.
#[inline(always)]
pub(crate) fn inverse(a: Complex64) -> Complex64 {
    let scale = 1.0 / a.norm_sqr();
    Complex64::new(a.re * scale, -a.im * scale)
}

/// Arrays that are used again: one evaluation needs megabytes, which would be mapped and cleared every time.
#[derive(Debug, Default)]
pub(crate) struct Workspace {
    free: Vec<Vec<f64>>,
}

impl Workspace {
    /// An array whose values are of no account.
    pub fn take(&mut self, rows: usize, columns: usize) -> Dense {
        let n = rows * columns;
        if n == 0 {
            return Dense::zeros(rows, columns);
        }
        // of equals the one given back last, which is still in the cache
        let fitting = (0..self.free.len())
            .rev()
            .min_by_key(|&i| (self.free[i].capacity() < n, self.free[i].capacity().abs_diff(n)));
        let mut values = fitting.map_or_else(Vec::new, |i| self.free.remove(i));
        values.resize(n, 0.0);
        Dense::from_vec(rows, columns, values)
    }

    /// [`Workspace::take`] for an array over (line, column).
    pub fn split(&mut self, n_lines: usize, n_columns: usize) -> Split {
        Split::over(self.take(2 * n_lines, n_columns))
    }

    pub fn give(&mut self, array: Dense) {
        let values = array.into_vec();
        if values.capacity() > 0 {
            self.free.push(values);
        }
    }

    /// Number of arrays that wait.
    #[cfg(test)]
    pub fn n_free(&self) -> usize {
        self.free.len()
    }
}
