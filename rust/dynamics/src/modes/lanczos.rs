//! Block Lanczos on A = (K - σM)⁻¹ M, self-adjoint and positive semi-definite in the M inner product for σ below the
//! lowest mode.

use femend_linalg::{Dense, Factor, LinalgError, SymmetricCsc, gemm, gemm_tn};

use super::basis::Basis;

/// Directions of a new block smaller than this beside what they were before orthogonalisation are rounding.
const DROP: f64 = 1e-10;

/// The Krylov process. It holds an M-orthonormal basis V, the projection T = Vᵀ M A V of all but the last block, and the
/// block that comes next.
pub(crate) struct Lanczos<'a> {
    m: &'a SymmetricCsc,
    factor: &'a Factor,
    basis: Basis,
    /// Column blocks of T, one per expanded basis column, each as long as the basis was then.
    projected: Vec<Vec<f64>>,
    /// Next block (n, q) and R with A V_last = V T + next R.
    next: Dense,
    residual: Dense,
    block: usize,
    seed: u64,
    /// Right-hand sides solved.
    pub solves: usize,
}

/// Ritz values of A, largest first, with the bound on the residual of each.
pub(crate) struct Ritz {
    pub theta: Vec<f64>,
    /// ‖A v - θ v‖ in the M norm, relative to θ.
    pub error: Vec<f64>,
    /// Coefficients in the basis (k, k).
    pub y: Dense,
}

impl<'a> Lanczos<'a> {
    /// Starts from `start` (n, p), or from a fixed pseudo-random block of `block` columns.
    pub fn new(m: &'a SymmetricCsc, factor: &'a Factor, block: usize, start: Option<&Dense>) -> Self {
        let n = m.n();
        let mut process = Self {
            m,
            factor,
            basis: Basis::new(n),
            projected: Vec::new(),
            next: Dense::zeros(n, 0),
            residual: Dense::zeros(0, 0),
            block,
            seed: 0x1234_5678_9abc_def1,
            solves: 0,
        };
        let mut first = start.cloned().unwrap_or_else(|| Dense::zeros(n, 0));
        first.append(&process.random(if start.is_some() { 2 } else { block }));
        process.apply(&mut first);
        let split = process.basis.split(m, &first, DROP);
        process.next = split.q;
        process.residual = Dense::zeros(process.next.ncols(), 0);
        process
    }

    /// Fixed sequence, so that two runs give the same digits.
    fn random(&mut self, columns: usize) -> Dense {
        let mut x = Dense::zeros(self.m.n(), columns);
        for v in x.data_mut() {
            self.seed =
                self.seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            *v = (self.seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
        }
        x
    }

    /// X <- A X.
    pub fn apply(&mut self, x: &mut Dense) {
        self.solves += x.ncols();
        *x = self.m.times(x);
        self.factor.solve_in_place(x);
    }

    /// Size of the basis.
    pub fn len(&self) -> usize {
        self.projected.len()
    }

    /// Takes the next block into the basis and expands it. False when the space is exhausted: the basis then spans all
    /// modes with finite frequency.
    pub fn step(&mut self) -> bool {
        if self.next.ncols() == 0 {
            self.inject();
            if self.next.ncols() == 0 {
                return false;
            }
        }
        let block = std::mem::replace(&mut self.next, Dense::zeros(self.m.n(), 0));
        self.basis.v.append(&block);
        let mut w = block;
        self.apply(&mut w);
        let mw = self.m.times(&w);
        let t = gemm_tn(&self.basis.v, &mw);
        for j in 0..t.ncols() {
            self.projected.push(t.col(j).to_vec());
        }
        let split = self.basis.split_known(self.m, &w, &mw, &t, DROP);
        self.next = split.q;
        self.residual = split.r;
        true
    }

    /// Adds fresh directions to the next block: for modes that the start block was blind to.
    pub fn inject(&mut self) {
        let mut fresh = self.random(self.block);
        self.apply(&mut fresh);
        let mut all = Basis::new(self.m.n());
        all.v.append(&self.basis.v);
        all.v.append(&self.next);
        let split = all.split(self.m, &fresh, 1e-8);
        let columns = self.residual.ncols();
        let mut residual = Dense::zeros(self.next.ncols() + split.q.ncols(), columns);
        for j in 0..columns {
            residual.col_mut(j)[..self.next.ncols()].copy_from_slice(self.residual.col(j));
        }
        self.residual = residual;
        self.next.append(&split.q);
    }

    /// Rayleigh-Ritz on the basis.
    pub fn ritz(&self) -> Result<Ritz, LinalgError> {
        let k = self.projected.len();
        let mut t = Dense::zeros(k, k);
        for (j, column) in self.projected.iter().enumerate() {
            for (i, &v) in column.iter().enumerate() {
                // the latest block that touches an entry has it with the least rounding
                t[(i, j)] = v;
                t[(j, i)] = v;
            }
        }
        let eigen = t.symmetric_eigen()?;
        let p = self.residual.ncols();
        let order: Vec<usize> = (0..k).rev().collect();
        let y = eigen.vectors.select(&order);
        let theta: Vec<f64> = order.iter().map(|&e| eigen.values[e]).collect();
        let mut tail = Dense::zeros(p, k);
        for j in 0..k {
            tail.col_mut(j).copy_from_slice(&y.col(j)[k - p..]);
        }
        let mut r = Dense::zeros(self.residual.nrows(), k);
        if p > 0 && r.nrows() > 0 {
            gemm(&mut r, 0.0, 1.0, &self.residual, &tail);
        }
        let error = (0..k)
            .map(|j| {
                r.col(j).iter().map(|v| v * v).sum::<f64>().sqrt() / theta[j].abs().max(f64::MIN_POSITIVE)
            })
            .collect();
        Ok(Ritz { theta, error, y })
    }

    /// Ritz vectors of the first `count` values (n, count), applied to A once more: this takes out what the null space
    /// of M has let in (Nour-Omid, Parlett, Ericsson, Jensen 1987) and sharpens each vector.
    pub fn vectors(&mut self, ritz: &Ritz, count: usize) -> Dense {
        let columns: Vec<usize> = (0..count).collect();
        let mut x = Dense::zeros(self.m.n(), count);
        gemm(&mut x, 0.0, 1.0, &self.basis.v, &ritz.y.select(&columns));
        self.apply(&mut x);
        x
    }
}
