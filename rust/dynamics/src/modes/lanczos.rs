//! Block Lanczos on A = (K - σM)⁻¹ M, self-adjoint and positive semi-definite in the M inner product for σ below the
//! lowest mode.

use femend_linalg::{Dense, Factor, LinalgError, gemm, gemm_tn};

use super::basis::{Basis, norms_known};
use super::need;
use super::product::Compact;
use crate::DynamicsError;

/// Directions of a new block smaller than this beside what they were before orthogonalisation are rounding.
const DROP: f64 = 1e-10;

/// The Krylov process. It holds an M-orthonormal basis V, the projection T = Vᵀ M A V of all but the last block, and the
/// block that comes next.
pub(crate) struct Lanczos<'a> {
    m: &'a Compact,
    factor: &'a Factor,
    basis: Basis,
    /// Column blocks of T, one per expanded basis column, each as long as the basis was then.
    projected: Vec<Vec<f64>>,
    /// Next block (n, q), M times it, and R with A V_last = V T + next R.
    next: Dense,
    m_next: Dense,
    residual: Dense,
    /// The last block in the basis and M times it.
    last: [Dense; 2],
    block: usize,
    /// Columns of the basis for which memory has been asked for.
    room: usize,
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
    /// Starts from `start` (n, p), or from a fixed pseudo-random block of `block` columns; `room` is the expected size
    /// of the basis.
    pub fn new(m: &'a Compact, factor: &'a Factor, block: usize, start: Option<&Dense>, room: usize) -> Self {
        let n = m.n();
        let mut process = Self {
            m,
            factor,
            basis: Basis::with_room(n, room),
            projected: Vec::new(),
            next: Dense::zeros(n, 0),
            m_next: Dense::zeros(n, 0),
            residual: Dense::zeros(0, 0),
            last: [Dense::zeros(n, 0), Dense::zeros(n, 0)],
            block,
            room,
            seed: 0x1234_5678_9abc_def1,
            solves: 0,
        };
        let mut first = match start {
            Some(start) => process.mixed(start),
            None => process.random(block),
        };
        process.apply(&mut first);
        let split = process.basis.split(m, &first, DROP);
        process.residual = Dense::zeros(split.q.ncols(), 0);
        (process.next, process.m_next) = (split.q, split.mq);
        process
    }

    /// A block that holds parts of all given shapes, and two columns for what they are blind to. More columns would
    /// make the Krylov space shallower for its size.
    fn mixed(&mut self, start: &Dense) -> Dense {
        let mut first = start.clone();
        if start.ncols() > self.block {
            let mut mix = Dense::zeros(start.ncols(), self.block);
            mix.data_mut().iter_mut().for_each(|v| *v = self.draw());
            first = Dense::zeros(start.nrows(), self.block);
            gemm(&mut first, 0.0, 1.0, start, &mix);
        }
        first.append(&self.random(2));
        first
    }

    fn draw(&mut self) -> f64 {
        self.seed = self.seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    }

    /// Fixed sequence, so that two runs give the same digits.
    fn random(&mut self, columns: usize) -> Dense {
        let mut x = Dense::zeros(self.m.n(), columns);
        x.data_mut().iter_mut().for_each(|v| *v = self.draw());
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

    /// Asks for more memory before a step takes the basis beyond what it was expected to have.
    ///
    /// # Errors
    /// [`DynamicsError::Memory`].
    pub fn make_room(&mut self) -> Result<(), DynamicsError> {
        if self.len() + self.next.ncols() > self.room {
            let more = (self.room / 4).max(8 * self.block);
            need::vectors_fit(self.m.n(), self.len(), more)?;
            self.room += more;
        }
        Ok(())
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
        let none = || Dense::zeros(self.m.n(), 0);
        let (q, mq) =
            (std::mem::replace(&mut self.next, none()), std::mem::replace(&mut self.m_next, none()));
        let mut w = mq.clone();
        self.solves += w.ncols();
        self.factor.solve_in_place(&mut w);
        // the two blocks that hold nearly all of it first, then what rounding has left in the whole basis
        let [last, m_last] = std::mem::replace(&mut self.last, [none(), none()]);
        let (near, nearer) = (gemm_tn(&m_last, &w), gemm_tn(&mq, &w));
        gemm(&mut w, 1.0, -1.0, &last, &near);
        gemm(&mut w, 1.0, -1.0, &q, &nearer);
        self.basis.v.append(&q);
        let mw = self.m.times(&w);
        let rest = gemm_tn(&self.basis.v, &mw);
        let mut taken = vec![0.0; w.ncols()];
        let first = self.basis.len() - q.ncols() - last.ncols();
        for j in 0..rest.ncols() {
            let mut column = rest.col(j).to_vec();
            for (t, c) in column[first..].iter_mut().zip(near.col(j).iter().chain(nearer.col(j))) {
                *t += c;
                taken[j] += c * c;
            }
            self.projected.push(column);
        }
        let norms = norms_known(&w, &mw);
        let split = self.basis.split_known(self.m, w, norms, &rest, taken, DROP);
        (self.next, self.m_next, self.residual) = (split.q, split.mq, split.r);
        self.last = [q, mq];
        true
    }

    /// Adds fresh directions to the next block: for modes that the start block was blind to.
    pub fn inject(&mut self) {
        let mut fresh = self.random(self.block);
        self.apply(&mut fresh);
        // beside the next block too, which joins the basis for that
        let len = self.basis.len();
        self.basis.v.append(&self.next);
        let split = self.basis.split(self.m, &fresh, 1e-8);
        self.basis.v.truncate(len);
        let columns = self.residual.ncols();
        let mut residual = Dense::zeros(self.next.ncols() + split.q.ncols(), columns);
        for j in 0..columns {
            residual.col_mut(j)[..self.next.ncols()].copy_from_slice(self.residual.col(j));
        }
        self.residual = residual;
        self.next.append(&split.q);
        self.m_next.append(&split.mq);
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

    /// A times the Ritz vectors of the first `count` values (n, count). A V y = θ V y + next R y_last is at hand without
    /// a solve; it takes out what the null space of M has let in and sharpens each vector (Nour-Omid, Parlett, Ericsson
    /// and Jensen 1987).
    pub fn vectors(&self, ritz: &Ritz, count: usize) -> Dense {
        let columns: Vec<usize> = (0..count).collect();
        let mut y = ritz.y.select(&columns);
        let mut x = Dense::zeros(self.m.n(), count);
        let (k, p) = (y.nrows(), self.residual.ncols());
        if p > 0 && self.next.ncols() > 0 {
            let mut tail = Dense::zeros(p, count);
            for j in 0..count {
                tail.col_mut(j).copy_from_slice(&y.col(j)[k - p..]);
            }
            let mut part = Dense::zeros(self.next.ncols(), count);
            gemm(&mut part, 0.0, 1.0, &self.residual, &tail);
            gemm(&mut x, 0.0, 1.0, &self.next, &part);
        }
        for (j, theta) in ritz.theta[..count].iter().enumerate() {
            y.col_mut(j).iter_mut().for_each(|v| *v *= theta);
        }
        gemm(&mut x, 1.0, 1.0, &self.basis.v, &y);
        x
    }
}
