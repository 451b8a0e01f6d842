//! The real space on which the problem is projected, and the projected matrices.

use femend_linalg::{Dense, Factor, SymmetricCsc, gemm, gemm_tn};

use super::terms::Parts;
use crate::DynamicsError;
use crate::modes::{Basis, Compact};

/// Directions of a new block left smaller than this beside what they were hold nothing new.
const DROP: f64 = 1e-6;

/// Vᵀ A V of a term's two parts.
#[derive(Debug, Clone)]
pub(super) struct Square {
    pub symmetric: Option<Dense>,
    pub skew: Option<Dense>,
}

/// Columns V, orthonormal in K_σ = K - σM.
pub(super) struct Space {
    pub terms: Vec<Parts>,
    pub sigma: f64,
    pub factor: Factor,
    metric: Compact,
    basis: Basis,
    pub squares: Vec<Square>,
    /// Columns of V that are in the squares.
    projected: usize,
    /// Right-hand sides solved.
    pub solves: usize,
}

impl Space {
    pub fn new(terms: Vec<Parts>, k_sigma: &SymmetricCsc, sigma: f64, factor: Factor, room: usize) -> Self {
        let none = |part: &Option<Compact>| part.as_ref().map(|_| Dense::zeros(0, 0));
        let squares =
            terms.iter().map(|t| Square { symmetric: none(&t.symmetric), skew: none(&t.skew) }).collect();
        let metric = Compact::new(k_sigma);
        let basis = Basis::with_room(metric.n(), room);
        Self { terms, sigma, factor, metric, basis, squares, projected: 0, solves: 0 }
    }

    pub fn n(&self) -> usize {
        self.metric.n()
    }

    pub fn len(&self) -> usize {
        self.basis.len()
    }

    /// The whole space of a small model: V = L⁻ᵀ of K_σ = L Lᵀ.
    pub fn fill(&mut self, k_sigma: &SymmetricCsc) -> Result<(), DynamicsError> {
        let n = self.n();
        let mut full = Dense::zeros(n, n);
        let mut v = Dense::zeros(n, n);
        for j in 0..n {
            v[(j, j)] = 1.0;
            for k in k_sigma.pattern().range(j) {
                full[(k_sigma.pattern().row_idx()[k] as usize, j)] = k_sigma.values()[k];
            }
        }
        full.cholesky()?.solve_lower_in_place(true, &mut v);
        self.take(&v);
        Ok(())
    }

    /// Adds the directions of a real block.
    pub fn add(&mut self, w: &Dense) {
        self.add_above(w, DROP);
    }

    /// Adds directions of which at least the part `drop` is new.
    pub fn add_above(&mut self, w: &Dense, drop: f64) {
        if w.ncols() > 0 {
            let fresh = self.basis.split(&self.metric, w, drop).q;
            self.take(&fresh);
        }
    }

    /// Adds columns that are orthonormal, and to those before.
    fn take(&mut self, fresh: &Dense) {
        self.basis.v.append(fresh);
    }

    /// Projects what has been added since the last time: many columns at once, so that V is read once.
    pub fn settle(&mut self) {
        let v = &self.basis.v;
        let columns: Vec<usize> = (self.projected..v.ncols()).collect();
        if columns.is_empty() {
            return;
        }
        let fresh = v.select(&columns);
        for (term, square) in self.terms.iter().zip(&mut self.squares) {
            for (part, square, sign) in
                [(&term.symmetric, &mut square.symmetric, 1.0), (&term.skew, &mut square.skew, -1.0)]
            {
                if let (Some(a), Some(square)) = (part, square.as_mut()) {
                    *square = bordered(square, &gemm_tn(v, &a.times(&fresh)), sign);
                }
            }
        }
        self.projected = v.ncols();
    }

    /// K_σ⁻¹ X.
    pub fn solve(&mut self, mut x: Dense) -> Dense {
        self.solves += x.ncols();
        self.factor.solve_in_place(&mut x);
        x
    }

    /// K_σ X.
    pub fn metric_times(&self, x: &Dense) -> Dense {
        self.metric.times(x)
    }

    /// X -= V Vᵀ K_σ X, and the same for K_σ X at hand.
    pub fn remove(&self, x: &mut Dense, kx: &mut Dense) {
        let inside = gemm_tn(&self.basis.v, kx);
        gemm(x, 1.0, -1.0, &self.basis.v, &inside);
        *kx = self.metric.times(x);
    }

    /// V Y for Y (r, k).
    pub fn expand(&self, y: &Dense) -> Dense {
        let mut x = Dense::zeros(self.n(), y.ncols());
        gemm(&mut x, 0.0, 1.0, &self.basis.v, y);
        x
    }

    /// Vᵀ X.
    pub fn project(&self, x: &Dense) -> Dense {
        gemm_tn(&self.basis.v, x)
    }

    /// Is every matrix symmetric?
    pub fn symmetric(&self) -> bool {
        self.terms.iter().all(|t| t.skew.is_none())
    }
}

/// A square with new columns (r + q, q), and the rows that they are by symmetry or antisymmetry.
fn bordered(old: &Dense, columns: &Dense, sign: f64) -> Dense {
    let (r, q) = (old.nrows(), columns.ncols());
    let mut out = Dense::zeros(r + q, r + q);
    for j in 0..r {
        out.col_mut(j)[..r].copy_from_slice(old.col(j));
    }
    for j in 0..q {
        out.col_mut(r + j).copy_from_slice(columns.col(j));
        for i in 0..r {
            out[(r + j, i)] = sign * columns[(i, j)];
        }
    }
    for j in 0..q {
        for i in 0..j {
            let mean = 0.5 * (out[(r + i, r + j)] + sign * out[(r + j, r + i)]);
            (out[(r + i, r + j)], out[(r + j, r + i)]) = (mean, sign * mean);
        }
    }
    out
}
