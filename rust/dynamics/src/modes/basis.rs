//! A growing M-orthonormal basis.

use femend_linalg::{Dense, gemm, gemm_tn};

use super::product::Compact;

/// A column left smaller than this beside what it was before the projection is projected again: what the basis lacks in
/// orthogonality grows by that ratio from block to block.
const AGAIN: f64 = 0.5;

/// M-orthonormal columns V (n, k).
#[derive(Debug)]
pub(crate) struct Basis {
    pub v: Dense,
}

/// What is left of a block after the basis has been taken out of it.
pub(crate) struct Split {
    /// M-orthonormal columns (n, q), q <= columns of the block.
    pub q: Dense,
    /// M q.
    pub mq: Dense,
    /// Coefficients with q r = what was left (q, p).
    pub r: Dense,
}

impl Basis {
    /// An empty basis with room for so many columns.
    pub fn with_room(n: usize, columns: usize) -> Self {
        Self { v: Dense::from_vec(n, 0, Vec::with_capacity(n * columns)) }
    }

    pub fn len(&self) -> usize {
        self.v.ncols()
    }

    /// M-orthonormalises `w` against the basis and in itself. Directions whose M norm falls below `drop` times their
    /// norm before are left out; so are directions in the null space of M. Columns are scaled one by one, so blocks of
    /// mixed size and unit are safe.
    pub fn split(&self, m: &Compact, w: &Dense, drop: f64) -> Split {
        let mw = m.times(w);
        let inside = gemm_tn(&self.v, &mw);
        self.split_known(m, w.clone(), norms_known(w, &mw), &inside, vec![0.0; w.ncols()], drop)
    }

    /// [`Basis::split`] with the M norms of w and Vᵀ M w at hand, where parts with the squared norms `taken` have been
    /// taken out of w before.
    pub fn split_known(
        &self,
        m: &Compact,
        mut w: Dense,
        norms: Vec<f64>,
        inside: &Dense,
        taken: Vec<f64>,
        drop: f64,
    ) -> Split {
        let before: Vec<f64> = norms.iter().zip(taken).map(|(n, t)| (n * n + t).sqrt()).collect();
        if self.len() > 0 {
            gemm(&mut w, 1.0, -1.0, &self.v, inside);
        }
        let mut mw = m.times(&w);
        // one projection leaves rounding of the part taken out; twice is enough (Giraud, Langou, Rozloznik 2005)
        let cancelled = |(after, before): (f64, &f64)| after < AGAIN * before;
        if norms_known(&w, &mw).into_iter().zip(&norms).any(cancelled) {
            self.remove(m, &mut w, &mut mw);
        }
        let mut split = self.settled(m, orthonormal(&w, &mw, &before, drop), None);
        self.add_small(m, &w, &mw, &mut split, drop);
        split
    }

    /// Columns made orthonormal again to the basis (and `beside` it), where that lost digits: a nearly dependent block lets
    /// cancellation back in.
    fn settled(&self, m: &Compact, (mut split, mut safe): (Split, bool), beside: Option<&Split>) -> Split {
        for _ in 0..2 {
            if split.q.ncols() == 0 || safe {
                break;
            }
            let Split { mut q, mut mq, r } = split;
            self.remove(m, &mut q, &mut mq);
            if let Some(other) = beside {
                let inside = gemm_tn(&other.mq, &q);
                gemm(&mut q, 1.0, -1.0, &other.q, &inside);
                mq = m.times(&q);
            }
            let ones = vec![1.0; q.ncols()];
            (split, safe) = orthonormal(&q, &mq, &ones, 1e-4);
            let mut product = Dense::zeros(split.q.ncols(), r.ncols());
            gemm(&mut product, 0.0, 1.0, &split.r, &r);
            split.r = product;
        }
        split
    }

    /// Directions of `w` that its Gram matrix, which holds their squares, cannot tell from rounding: what the block lacks
    /// of them shows when the others are taken out of it.
    fn add_small(&self, m: &Compact, w: &Dense, mw: &Dense, split: &mut Split, drop: f64) {
        if split.q.ncols() == w.ncols() {
            return;
        }
        let before = norms_known(w, mw);
        let (mut rest, mut m_rest) = (w.clone(), mw.clone());
        for _ in 0..2 {
            let inside = gemm_tn(&split.q, &m_rest);
            gemm(&mut rest, 1.0, -1.0, &split.q, &inside);
            m_rest = m.times(&rest);
            self.remove(m, &mut rest, &mut m_rest);
        }
        let more = self.settled(m, orthonormal(&rest, &m_rest, &before, drop), Some(split));
        if more.q.ncols() > 0 {
            let rows = gemm_tn(&more.mq, w);
            let (old, new) = (split.r.nrows(), rows.nrows());
            let mut r = Dense::zeros(old + new, w.ncols());
            for j in 0..w.ncols() {
                r.col_mut(j)[..old].copy_from_slice(split.r.col(j));
                r.col_mut(j)[old..].copy_from_slice(rows.col(j));
            }
            split.q.append(&more.q);
            split.mq.append(&more.mq);
            split.r = r;
        }
    }

    /// w -= V Vᵀ M w, and M w after it.
    fn remove(&self, m: &Compact, w: &mut Dense, mw: &mut Dense) {
        if self.len() > 0 && w.ncols() > 0 {
            let c = gemm_tn(&self.v, mw);
            gemm(w, 1.0, -1.0, &self.v, &c);
            *mw = m.times(w);
        }
    }
}

/// M norms of columns.
pub(crate) fn norms(m: &Compact, w: &Dense) -> Vec<f64> {
    norms_known(w, &m.times(w))
}

pub(crate) fn norms_known(w: &Dense, mw: &Dense) -> Vec<f64> {
    (0..w.ncols())
        .map(|j| w.col(j).iter().zip(mw.col(j)).map(|(a, b)| a * b).sum::<f64>().max(0.0).sqrt())
        .collect()
}

/// M-orthonormal basis of the span of `w` by the eigenvectors of its scaled Gram matrix; W = Q R to rounding. The flag tells
/// that no direction was so small, beside its column before or beside the block, that digits were lost.
fn orthonormal(w: &Dense, mw: &Dense, before: &[f64], drop: f64) -> (Split, bool) {
    let (n, p) = (w.nrows(), w.ncols());
    let none = || (Split { q: Dense::zeros(n, 0), mq: Dense::zeros(n, 0), r: Dense::zeros(0, p) }, true);
    let mut gram = gemm_tn(w, mw);
    let size: Vec<f64> = (0..p).map(|j| gram[(j, j)].max(0.0).sqrt()).collect();
    let keep: Vec<usize> = (0..p).filter(|&j| size[j] > drop * before[j] && size[j] > 0.0).collect();
    let k = keep.len();
    if k == 0 {
        return none();
    }
    let mut scaled = Dense::zeros(k, k);
    for (a, &i) in keep.iter().enumerate() {
        for (b, &j) in keep.iter().enumerate() {
            scaled[(a, b)] = 0.5 * (gram[(i, j)] + gram[(j, i)]) / (size[i] * size[j]);
        }
    }
    let Ok(eigen) = scaled.symmetric_eigen() else { return none() };
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
    let mut mq = Dense::zeros(n, good.len());
    gemm(&mut mq, 0.0, 1.0, mw, &to_q);
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
    (Split { q, mq, r: gemm_tn(&to_q, &gram) }, safe)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers between -0.5 and 0.5, the same in every run.
    fn numbers(seed: &mut u64) -> f64 {
        *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    }

    /// What is left of a block that starts from modes of a model close by: a few large directions, and others that are
    /// small beside them and nearly the same among themselves.
    #[test]
    fn small_directions_that_are_nearly_dependent_stay_orthonormal() {
        let (n, mut seed) = (200, 7);
        let weight: Vec<f64> = (0..n).map(|_| 1.0 + numbers(&mut seed)).collect();
        let m = Compact::diagonal(&weight);
        let mut draw = |columns: usize| {
            Dense::from_vec(n, columns, (0..n * columns).map(|_| numbers(&mut seed)).collect())
        };
        let (large, small, smaller, mix) = (draw(3), draw(4), draw(10), draw(1));
        let mut w = Dense::zeros(n, 10);
        gemm(&mut w, 0.0, 1.0, &large, &Dense::from_vec(3, 10, mix.data()[..30].to_vec()));
        gemm(&mut w, 1.0, 1e-7, &small, &Dense::from_vec(4, 10, mix.data()[30..70].to_vec()));
        w.data_mut().iter_mut().zip(smaller.data()).for_each(|(a, b)| *a += 1e-12 * b);
        let Split { q, mq, r } = Basis::with_room(n, 20).split(&m, &w, 1e-10);
        let gram = gemm_tn(&q, &mq);
        for i in 0..q.ncols() {
            for j in 0..q.ncols() {
                let unit = if i == j { 1.0 } else { 0.0 };
                assert!((gram[(i, j)] - unit).abs() < 1e-10, "{i} {j}: {:e}", gram[(i, j)] - unit);
            }
        }
        assert!(q.ncols() >= 7, "{} directions", q.ncols());
        let mut rest = w.clone();
        gemm(&mut rest, 1.0, -1.0, &q, &r);
        assert!(norms(&m, &rest).iter().all(|v| *v < 1e-9));
    }
}
