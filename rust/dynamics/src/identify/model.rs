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
}

/// Derivatives of the reduced model at given unknowns.
#[derive(Debug, Clone)]
pub(crate) struct Slopes {
    pub groups: Vec<Group>,
}

impl Slopes {
    fn push(&mut self, parameter: usize, dk: &Dense, dm: Option<&Dense>) {
        let block = dm.map_or_else(|| dk.clone(), |dm| over(dk, dm));
        let fits = |g: &&mut Group| g.inertial == dm.is_some() && g.parameters.len() < GROUP;
        if let Some(group) = self.groups.iter_mut().find(fits) {
            group.parameters.push(parameter);
            group.d.append(&block);
        } else {
            self.groups.push(Group { parameters: vec![parameter], inertial: dm.is_some(), d: block });
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

    /// Derivatives of K and M at the unknowns `p` between the modes `q` there.
    pub(crate) fn slopes(&self, p: &[f64], q: &Dense) -> Slopes {
        let factors = self.factors(p);
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
            slopes.push(i, &sandwich(q, &k), m.map(|m| sandwich(q, &m)).as_ref());
        }
        slopes
    }
}
