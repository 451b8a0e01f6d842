//! Modes of the reduced model at given unknowns, and their derivatives.

use super::adjoint::OfDecays;
use super::system::{System, Term};
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
    /// dK/dθ of each (n, n); over dM/dθ (2 n, n) where they move mass.
    pub d: Dense,
    /// Derivative of every mode's damping 2 ζ ω for each (n); that between modes, of the order ζ of their stiffness, is
    /// left out.
    pub damping: Vec<Vec<f64>>,
}

/// Derivatives of the reduced model at given unknowns.
#[derive(Debug, Clone)]
pub(crate) struct Slopes {
    /// Number n of the lowest modes between which they are.
    pub n_modes: usize,
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
    /// Squared frequencies with the factors, and without: k_j = f_j² λ_j.
    fn squares(&self) -> (Vec<f64>, Vec<f64>) {
        let k: Vec<f64> = self.modal.omega.iter().map(|w| w * w).collect();
        let lambda = k.iter().zip(&self.factor).map(|(k, f)| k / (f * f)).collect();
        (k, lambda)
    }

    /// Turns the derivative `dk` (n, n) of a model's stiffness between its lowest modes into that of the stiffness with the
    /// factors, and returns that of the modes' damping.
    ///
    /// The shapes change by dφ_j = Σ_i φ_i R_ij, R_ij = (dK_ij - λ_j dM_ij) / (λ_j - λ_i), R_jj = -dM_jj / 2 (Fox and
    /// Kapoor 1968), and the tuned stiffnesses k_j = f_j² λ_j go with them: dK'_ij = -(R_ij k_i + R_ji k_j).
    fn follow(&self, dk: &mut Dense, dm: Option<&Dense>) -> Vec<f64> {
        let r = dk.ncols();
        let (k, lambda) = self.squares();
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

    /// The adjoint of [`Tuned::follow`]: turns what a change of the tuned stiffness (r, r) between the modes does, and one
    /// of the mass and of every mode's s-fold damping, into what a change of the model's own stiffness and mass does.
    fn gather(&self, stiffness: &mut Dense, mass: &mut Option<Dense>, damping: &[f64], decays: &OfDecays) {
        let r = self.factor.len();
        let (k, lambda) = self.squares();
        for j in 0..r {
            for i in (0..r).filter(|i| *i != j) {
                let (apart, tuned) = (lambda[j] - lambda[i], stiffness[(i, j)]);
                if apart.abs() > APART * (lambda[i] + lambda[j]) {
                    stiffness[(i, j)] = tuned * (k[j] - k[i]) / apart;
                    if let Some(mass) = mass {
                        mass[(i, j)] += tuned * (lambda[j] * k[i] - lambda[i] * k[j]) / apart;
                    }
                } else {
                    stiffness[(i, j)] = tuned * self.factor[i] * self.factor[j];
                }
            }
            let (tuned, square) = (stiffness[(j, j)], self.factor[j].powi(2));
            let damped = 2.0 * self.modal.zeta[j] * self.modal.omega[j] * damping[j];
            let moving = lambda[j] > 0.0;
            stiffness[(j, j)] = tuned * square + if moving { 0.5 * damped / lambda[j] } else { 0.0 };
            if let Some(mass) = mass {
                mass[(j, j)] += tuned * (k[j] - square * lambda[j]) + damped * if moving { 0.5 } else { 1.0 };
            }
        }
        self.gather_decays(&lambda, stiffness, mass, decays);
    }

    /// Adds what decays do that change with their modes: dλ_j = dK_jj - λ_j dM_jj, and the shapes as in [`Tuned::follow`].
    fn gather_decays(
        &self,
        lambda: &[f64],
        stiffness: &mut Dense,
        mass: &mut Option<Dense>,
        decays: &OfDecays,
    ) {
        for j in 0..lambda.len() {
            if lambda[j] > 0.0 {
                stiffness[(j, j)] += 0.5 * decays.frequency[j] / lambda[j];
            }
            if let Some(mass) = mass {
                mass[(j, j)] -= 0.5 * (decays.frequency[j] + decays.shape[(j, j)]);
            }
            for i in (0..lambda.len()).filter(|i| *i != j) {
                let apart = lambda[j] - lambda[i];
                if apart.abs() > APART * (lambda[i] + lambda[j]) {
                    let share = decays.shape[(i, j)] / apart;
                    stiffness[(i, j)] += share;
                    if let Some(mass) = mass {
                        mass[(i, j)] -= lambda[j] * share;
                    }
                }
            }
        }
    }
}

/// The reduced model at given unknowns, with its derivatives once they were asked for.
#[derive(Debug, Clone)]
pub(crate) struct Model {
    pub modal: Modal,
    pub slopes: Option<Slopes>,
}

/// Adds a part, which may be one of the first rows and columns alone.
fn add(to: &mut Dense, factor: f64, part: &Dense) {
    for j in 0..part.ncols() {
        to.col_mut(j).iter_mut().zip(part.col(j)).for_each(|(a, b)| *a += factor * b);
    }
}

/// Sum of the products of all entries of a part, likewise, with those of a matrix.
fn product(part: &Dense, a: &Dense) -> f64 {
    let mut sum = 0.0;
    for j in 0..part.ncols() {
        part.col(j).iter().zip(a.col(j)).for_each(|(x, y)| sum += x * y);
    }
    sum
}

/// The upper `n` rows.
pub(super) fn top(a: &Dense, n: usize) -> Dense {
    Dense::from_vec(n, a.ncols(), (0..a.ncols()).flat_map(|j| a.col(j)[..n].iter().copied()).collect())
}

fn sandwich(q: &Dense, a: &Dense) -> Dense {
    let mut aq = Dense::zeros(a.nrows(), q.ncols());
    gemm(&mut aq, 0.0, 1.0, a, q);
    gemm_tn(q, &aq)
}

/// A part, which may be one of the first vectors of the basis alone, between modes `q` (r, n).
fn among(q: &Dense, part: &Dense) -> Dense {
    if part.ncols() == q.nrows() { sandwich(q, part) } else { sandwich(&top(q, part.ncols()), part) }
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

    /// Modes at the unknowns `p` with the factors on their frequencies.
    fn tuned<'a>(&self, p: &[f64], modal: &'a Modal) -> Tuned<'a> {
        let factor = |j: usize| if j < self.n_tuned { p[self.n_par + j].exp() } else { 1.0 };
        Tuned { modal, factor: (0..self.r).map(factor).collect() }
    }

    /// What the user's parameters do at the unknowns `p`, where a change of the tuned stiffness and mass between the modes
    /// (r, r) and of the modes' damping (r) does what is given, and so do the free decays; without `mass` no parameter moves
    /// any.
    pub(crate) fn gathered(
        &self,
        p: &[f64],
        modal: &Modal,
        (mut stiffness, mut mass): (Dense, Option<Dense>),
        damping: &[f64],
        decays: &OfDecays,
    ) -> Vec<f64> {
        self.tuned(p, modal).gather(&mut stiffness, &mut mass, damping, decays);
        let qt = modal.q.transposed();
        let (stiffness, mass) = (sandwich(&qt, &stiffness), mass.map(|m| sandwich(&qt, &m)));
        let mut all = vec![0.0; self.n_par];
        for (term, factor) in self.terms.iter().zip(self.factors(p)) {
            let own = term.k.as_ref().map_or(0.0, |k| product(k, &stiffness));
            let moved = term.m.as_ref().zip(mass.as_ref()).map_or(0.0, |(m, mass)| product(m, mass));
            term.exponents.iter().for_each(|(i, a)| all[*i] += a * factor * (own + moved));
        }
        all
    }

    /// What parameter `i` moves of one part of all terms, as large as the largest of these; none where it moves nothing.
    fn moved(&self, i: usize, factors: &[f64], part: fn(&Term) -> Option<&Dense>) -> Option<Dense> {
        let slope = |(term, factor): (&Term, &f64)| -> f64 {
            term.exponents.iter().filter(|(j, _)| *j == i).map(|(_, a)| a * factor).sum()
        };
        let own = || {
            let parts = self.terms.iter().zip(factors).map(move |one| (part(one.0), slope(one)));
            parts.filter_map(|(part, slope)| part.filter(|_| slope != 0.0).map(|part| (part, slope)))
        };
        let n = own().map(|(part, _)| part.ncols()).max()?;
        let mut all = Dense::zeros(n, n);
        own().for_each(|(part, slope)| add(&mut all, slope, part));
        Some(all)
    }

    /// Derivatives of K, M and C at the unknowns `p` between the lowest `n_modes` modes there.
    pub(crate) fn slopes(&self, p: &[f64], modal: &Modal, n_modes: usize) -> Slopes {
        let factors = self.factors(p);
        let q = &Dense::from_vec(self.r, n_modes, modal.q.data()[..self.r * n_modes].to_vec());
        let tuned = self.tuned(p, modal);
        let mut slopes = Slopes { n_modes, groups: Vec::new() };
        for i in 0..self.n_par {
            let moved =
                |part: fn(&Term) -> Option<&Dense>| self.moved(i, &factors, part).map(|a| among(q, &a));
            let mut dk = moved(|t| t.k.as_ref()).unwrap_or_else(|| Dense::zeros(n_modes, n_modes));
            let dm = moved(|t| t.m.as_ref());
            let damping = tuned.follow(&mut dk, dm.as_ref());
            slopes.push(i, &dk, dm.as_ref(), damping);
        }
        slopes
    }
}
