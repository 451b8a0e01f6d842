//! A growing M-orthonormal basis.

use femend_linalg::{Dense, SymmetricCsc, gemm, gemm_tn};

/// M-orthonormal columns V (n, k).
#[derive(Debug)]
pub(crate) struct Basis {
    pub v: Dense,
}

/// What is left of a block after the basis has been taken out of it.
pub(crate) struct Split {
    /// M-orthonormal columns (n, q), q <= columns of the block.
    pub q: Dense,
    /// Coefficients with q r = what was left (q, p).
    pub r: Dense,
}

impl Basis {
    pub fn new(n: usize) -> Self {
        Self { v: Dense::zeros(n, 0) }
    }

    pub fn len(&self) -> usize {
        self.v.ncols()
    }

    /// M-orthonormalises `w` against the basis and in itself. Directions whose M norm falls below `drop` times their
    /// norm before are left out; so are directions in the null space of M. Columns are scaled one by one, so blocks of
    /// mixed size and unit are safe.
    pub fn split(&self, m: &SymmetricCsc, w: &Dense, drop: f64) -> Split {
        let mw = m.times(w);
        let inside = gemm_tn(&self.v, &mw);
        self.split_known(m, w, &mw, &inside, drop)
    }

    /// [`Basis::split`] with M w and Vᵀ M w at hand.
    pub fn split_known(&self, m: &SymmetricCsc, w: &Dense, mw: &Dense, inside: &Dense, drop: f64) -> Split {
        let p = w.ncols();
        let before = norms_known(w, mw);
        let mut w = w.clone();
        if self.len() > 0 {
            gemm(&mut w, 1.0, -1.0, &self.v, inside);
        }
        self.remove(m, &mut w);
        let (mut q, mut r, mut safe) = orthonormal(m, &w, &before, drop);
        // a nearly dependent block lets cancellation back in
        for _ in 0..2 {
            if q.ncols() == 0 || safe {
                break;
            }
            self.remove(m, &mut q);
            let ones = vec![1.0; q.ncols()];
            let (again, change, now_safe) = orthonormal(m, &q, &ones, 1e-4);
            let mut product = Dense::zeros(again.ncols(), p);
            gemm(&mut product, 0.0, 1.0, &change, &r);
            (q, r, safe) = (again, product, now_safe);
        }
        Split { q, r }
    }

    /// w -= V Vᵀ M w.
    pub fn remove(&self, m: &SymmetricCsc, w: &mut Dense) {
        if self.len() > 0 && w.ncols() > 0 {
            let c = gemm_tn(&self.v, &m.times(w));
            gemm(w, 1.0, -1.0, &self.v, &c);
        }
    }
}

/// M norms of columns.
pub(crate) fn norms(m: &SymmetricCsc, w: &Dense) -> Vec<f64> {
    norms_known(w, &m.times(w))
}

fn norms_known(w: &Dense, mw: &Dense) -> Vec<f64> {
    (0..w.ncols())
        .map(|j| w.col(j).iter().zip(mw.col(j)).map(|(a, b)| a * b).sum::<f64>().max(0.0).sqrt())
        .collect()
}

/// M-orthonormal basis of the span of `w` by the eigenvectors of its scaled Gram matrix; W = Q R to rounding. The flag tells
/// that no direction was so small, beside its column before or beside the block, that digits were lost.
fn orthonormal(m: &SymmetricCsc, w: &Dense, before: &[f64], drop: f64) -> (Dense, Dense, bool) {
    let (n, p) = (w.nrows(), w.ncols());
    let mw = m.times(w);
    let mut gram = gemm_tn(w, &mw);
    let size: Vec<f64> = (0..p).map(|j| gram[(j, j)].max(0.0).sqrt()).collect();
    let keep: Vec<usize> = (0..p).filter(|&j| size[j] > drop * before[j] && size[j] > 0.0).collect();
    let k = keep.len();
    if k == 0 {
        return (Dense::zeros(n, 0), Dense::zeros(0, p), true);
    }
    let mut scaled = Dense::zeros(k, k);
    for (a, &i) in keep.iter().enumerate() {
        for (b, &j) in keep.iter().enumerate() {
            scaled[(a, b)] = 0.5 * (gram[(i, j)] + gram[(j, i)]) / (size[i] * size[j]);
        }
    }
    let Ok(eigen) = scaled.symmetric_eigen() else { return (Dense::zeros(n, 0), Dense::zeros(0, p), true) };
    let good: Vec<usize> = (0..k).filter(|&e| eigen.values[e] > 1e-13 * k as f64).collect();
    let mut to_q = Dense::zeros(p, good.len());
    for (g, &e) in good.iter().enumerate() {
        let root = eigen.values[e].sqrt();
        for (a, &i) in keep.iter().enumerate() {
            to_q[(i, g)] = eigen.vectors[(a, e)] / (root * size[i]);
        }
    }
    let mut q = Dense::zeros(n, good.len());
    gemm(&mut q, 0.0, 1.0, w, &to_q);
    // R = Qᵀ M W, from the Gram matrix at hand
    for j in 0..p {
        for i in 0..j {
            let mean = 0.5 * (gram[(i, j)] + gram[(j, i)]);
            gram[(i, j)] = mean;
            gram[(j, i)] = mean;
        }
    }
    let safe =
        keep.iter().all(|&j| size[j] > 1e-4 * before[j]) && good.iter().all(|&e| eigen.values[e] > 1e-3);
    (q, gemm_tn(&to_q, &gram), safe)
}
