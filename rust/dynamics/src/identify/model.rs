//! Modes of the reduced model at given unknowns, and their derivatives.

use super::system::System;
use femend_linalg::{Dense, LinalgError, gemm, gemm_tn};

/// Modes of the reduced model at given unknowns.
#[derive(Debug, Clone)]
pub struct Modal {
    /// Natural frequencies with their factors applied, rad/s (r).
    pub omega: Vec<f64>,
    /// Damping ratios (r).
    pub zeta: Vec<f64>,
    /// Modes in the basis (r, r).
    pub q: Dense,
}

/// Parameters whose derivatives are multiplied at once: with more, the products leave the cache.
const GROUP: usize = 4;

/// Derivatives for some parameters in modal coordinates, side by side.
#[derive(Debug, Clone)]
pub(crate) struct Group {
    pub parameters: Vec<usize>,
    /// Whether these parameters move mass.
    pub inertial: bool,
    /// dK/dθ of each (r, r); over dM/dθ (2 r, r) where they move mass.
    pub d: Dense,
    /// Derivative of every mode's damping 2 ζ ω for each (r); that between modes, of the order ζ of their stiffness, is
    /// left out.
    pub damping: Vec<Vec<f64>>,
}

/// Derivatives of the reduced model at given unknowns.
#[derive(Debug, Clone)]
pub(crate) struct Slopes {
    pub groups: Vec<Group>,
}

impl Slopes {
    fn push(&mut self, parameter: usize, dk: &Dense, dm: Option<&Dense>, damping: Vec<f64>) {
        let block = dm.map_or_else(|| dk.clone(), |dm| over(dk, dm));
        let fits = |g: &&mut Group| g.inertial == dm.is_some() && g.parameters.len() < GROUP;
        if let Some(group) = self.groups.iter_mut().find(fits) {
            group.parameters.push(parameter);
            group.d.append(&block);
            group.damping.push(damping);
        } else {
            let inertial = dm.is_some();
            self.groups.push(Group {
                parameters: vec![parameter],
                inertial,
                d: block,
                damping: vec![damping],
            });
        }
    }
}

/// `a` over `b`.
fn over(a: &Dense, b: &Dense) -> Dense {
    let mut both = Dense::zeros(a.nrows() + b.nrows(), a.ncols());
    for j in 0..a.ncols() {
        let (upper, lower) = both.col_mut(j).split_at_mut(a.nrows());
        upper.copy_from_slice(a.col(j));
        lower.copy_from_slice(b.col(j));
    }
    both
}

/// Modes whose squared frequencies differ by less than this share of their sum are too close for their shapes' change.
const APART: f64 = 0.05;

/// Modes with the factors on their frequencies: factors and damping ratios stay with a mode as it changes.
struct Tuned<'a> {
    modal: &'a Modal,
    factor: Vec<f64>,
}

impl Tuned<'_> {
    /// Turns the derivative `dk` (r, r) of a model's stiffness between its modes into that of the stiffness with the
    /// factors, and returns that of the modes' damping.
    ///
    /// The shapes change by dφ_j = Σ_i φ_i R_ij, R_ij = (dK_ij - λ_j dM_ij) / (λ_j - λ_i), R_jj = -dM_jj / 2 (Fox and
    /// Kapoor 1968), and the tuned stiffnesses k_j = f_j² λ_j go with them: dK'_ij = -(R_ij k_i + R_ji k_j).
    fn follow(&self, dk: &mut Dense, dm: Option<&Dense>) -> Vec<f64> {
        let r = self.factor.len();
        let k: Vec<f64> = self.modal.omega.iter().map(|w| w * w).collect();
        let lambda: Vec<f64> = k.iter().zip(&self.factor).map(|(k, f)| k / (f * f)).collect();
        let mut damping = vec![0.0; r];
        for j in 0..r {
            for i in (0..r).filter(|i| *i != j) {
                let (apart, own, mass) = (lambda[j] - lambda[i], dk[(i, j)], dm.map_or(0.0, |dm| dm[(i, j)]));
                dk[(i, j)] = if apart.abs() > APART * (lambda[i] + lambda[j]) {
                    (own * (k[j] - k[i]) + mass * (lambda[j] * k[i] - lambda[i] * k[j])) / apart
                } else {
                    self.factor[i] * self.factor[j] * own
                };
            }
            let mass = dm.map_or(0.0, |dm| dm[(j, j)]);
            let change = dk[(j, j)] - lambda[j] * mass;
            dk[(j, j)] = self.factor[j].powi(2) * change + k[j] * mass;
            let relative = if lambda[j] > 0.0 { 0.5 * change / lambda[j] } else { 0.0 };
            damping[j] = 2.0 * self.modal.zeta[j] * self.modal.omega[j] * (relative + mass);
        }
        damping
    }
}

/// The reduced model at given unknowns, with its derivatives once they were asked for.
#[derive(Debug, Clone)]
pub(crate) struct Model {
    pub modal: Modal,
    pub slopes: Option<Slopes>,
}

fn add(to: &mut Dense, factor: f64, part: &Dense) {
    to.data_mut().iter_mut().zip(part.data()).for_each(|(a, b)| *a += factor * b);
}

fn sandwich(q: &Dense, a: &Dense) -> Dense {
    let mut aq = Dense::zeros(a.nrows(), q.ncols());
    gemm(&mut aq, 0.0, 1.0, a, q);
    gemm_tn(q, &aq)
}

impl System {
    /// Modes at the unknowns `p`.
    ///
    /// # Errors
    /// [`LinalgError`] when M(θ) is not positive definite or an unknown is not finite.
    pub fn modal(&self, p: &[f64]) -> Result<Modal, LinalgError> {
        if let Some((row, &value)) = p.iter().enumerate().find(|(_, v)| !v.is_finite()) {
            return Err(LinalgError::NotFinite { what: "vector of unknowns", row, column: 0, value });
        }
        let (mut k, mut m) = (self.k_fixed.clone(), self.m_fixed.clone());
        let factors = self.factors(p);
        for (term, &factor) in self.terms.iter().zip(&factors) {
            if let Some(part) = &term.k {
                add(&mut k, factor, part);
            }
            if let Some(part) = &term.m {
                add(&mut m, factor, part);
            }
        }
        // K x = omega^2 M x through M = L L^T.
        let l = m.cholesky()?;
        l.solve_lower_in_place(false, &mut k);
        let mut a = k.transposed();
        l.solve_lower_in_place(false, &mut a);
        let mut eigen = a.symmetric_eigen()?;
        l.solve_lower_in_place(true, &mut eigen.vectors);
        let q = eigen.vectors;
        let nt = self.n_tuned;
        let (jitter, damping) = (&p[self.n_par..self.n_par + nt], &p[self.n_par + nt..]);
        let omega = (0..self.r)
            .map(|i| eigen.values[i].max(0.0).sqrt() * if i < nt { jitter[i].exp() } else { 1.0 })
            .collect();
        let zeta = (0..self.r).map(|i| damping[i.min(nt)].exp()).collect();
        Ok(Modal { omega, zeta, q })
    }

    /// Factors of the terms at the unknowns `p`.
    fn factors(&self, p: &[f64]) -> Vec<f64> {
        self.terms.iter().map(|t| t.exponents.iter().map(|(i, a)| a * p[*i]).sum::<f64>().exp()).collect()
    }

    /// Derivatives of K, M and C at the unknowns `p` between the modes there.
    pub(crate) fn slopes(&self, p: &[f64], modal: &Modal) -> Slopes {
        let (factors, q) = (self.factors(p), &modal.q);
        let factor = |j: usize| if j < self.n_tuned { p[self.n_par + j].exp() } else { 1.0 };
        let tuned = Tuned { modal, factor: (0..self.r).map(factor).collect() };
        let mut slopes = Slopes { groups: Vec::new() };
        for i in 0..self.n_par {
            let mut k = Dense::zeros(self.r, self.r);
            let mut m: Option<Dense> = None;
            for (term, factor) in self.terms.iter().zip(&factors) {
                let slope: f64 =
                    term.exponents.iter().filter(|(j, _)| *j == i).map(|(_, a)| a * factor).sum();
                if slope == 0.0 {
                    continue;
                }
                if let Some(part) = &term.k {
                    add(&mut k, slope, part);
                }
                if let Some(part) = &term.m {
                    add(m.get_or_insert_with(|| Dense::zeros(self.r, self.r)), slope, part);
                }
            }
            let mut dk = sandwich(q, &k);
            let dm = m.map(|m| sandwich(q, &m));
            let damping = tuned.follow(&mut dk, dm.as_ref());
            slopes.push(i, &dk, dm.as_ref(), damping);
        }
        slopes
    }
}
