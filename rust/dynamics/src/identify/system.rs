//! The reduced model with its unknowns, and a hypothesis about what is attached to it.

use super::{IdentifyError, expect, expect_square};
use crate::laws::{Kind, Law};
use femend_linalg::{Dense, LinalgError, gemm, gemm_tn};
use num_complex::Complex64;

/// A part of K and M that scales with a product of powers of the user's parameters.
#[derive(Debug, Clone)]
pub struct Term {
    /// (parameter, exponent): the part is multiplied by exp(sum exponent * theta).
    pub exponents: Vec<(usize, f64)>,
    /// Part of the stiffness (r, r), if any.
    pub k: Option<Dense>,
    /// Part of the mass (r, r), if any.
    pub m: Option<Dense>,
}

/// Reduced model: K and M in a basis of r vectors, unknowns with their priors.
///
/// Unknowns, in this order: ln factor of each user parameter (n_par), ln frequency factor of each tuned mode (n_tuned),
/// ln damping ratio of each tuned mode (n_tuned), ln damping ratio of all other modes (1).
#[derive(Debug, Clone)]
pub struct System {
    /// Basis size.
    pub r: usize,
    /// Part of K that no parameter moves (r, r).
    pub k_fixed: Dense,
    /// Part of M that no parameter moves (r, r).
    pub m_fixed: Dense,
    /// Parts that parameters move.
    pub terms: Vec<Term>,
    /// Number of user parameters.
    pub n_par: usize,
    /// Number of modes with a frequency factor and a damping ratio of their own.
    pub n_tuned: usize,
    /// Prior means (n_unknowns).
    pub mean: Vec<f64>,
    /// Prior standard deviations (n_unknowns).
    pub sd: Vec<f64>,
}

/// Modes of the reduced model at given unknowns.
#[derive(Debug, Clone)]
pub struct Modal {
    /// Natural frequencies with their factors applied, rad/s (r).
    pub omega: Vec<f64>,
    /// Damping ratios (r).
    pub zeta: Vec<f64>,
    /// Modes in the basis (r, r).
    pub q: Dense,
    /// dK/dθ_i in modal coordinates.
    pub dk: Vec<Dense>,
    /// dM/dθ_i in modal coordinates, where the parameter moves mass.
    pub dm: Vec<Option<Dense>>,
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
    /// Number of unknowns.
    pub fn n_unknowns(&self) -> usize {
        self.n_par + 2 * self.n_tuned + 1
    }

    /// Checks the sizes against each other.
    ///
    /// # Errors
    /// [`IdentifyError::Shape`].
    pub fn check(&self) -> Result<(), IdentifyError> {
        expect_square("fixed stiffness", &self.k_fixed, self.r)?;
        expect_square("fixed mass", &self.m_fixed, self.r)?;
        for term in &self.terms {
            for part in [&term.k, &term.m].into_iter().flatten() {
                expect_square("a parameter's part of K or M", part, self.r)?;
            }
            if let Some((i, _)) = term.exponents.iter().find(|(i, _)| *i >= self.n_par) {
                return Err(IdentifyError::Shape { what: "parameters", found: self.n_par, expected: i + 1 });
            }
        }
        expect("prior means", self.mean.len(), self.n_unknowns())?;
        expect("prior standard deviations", self.sd.len(), self.n_unknowns())?;
        if self.n_tuned > self.r {
            return Err(IdentifyError::Shape { what: "basis", found: self.r, expected: self.n_tuned });
        }
        Ok(())
    }

    /// Modes at the unknowns `p`.
    ///
    /// # Errors
    /// [`LinalgError`] when M(θ) is not positive definite or an unknown is not finite.
    pub fn modal(&self, p: &[f64]) -> Result<Modal, LinalgError> {
        if let Some((row, &value)) = p.iter().enumerate().find(|(_, v)| !v.is_finite()) {
            return Err(LinalgError::NotFinite { what: "vector of unknowns", row, column: 0, value });
        }
        let (mut k, mut m) = (self.k_fixed.clone(), self.m_fixed.clone());
        let factors: Vec<f64> = self
            .terms
            .iter()
            .map(|t| t.exponents.iter().map(|(i, a)| a * p[*i]).sum::<f64>().exp())
            .collect();
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
        let (dk, dm) = self.derivatives(&factors, &q);
        Ok(Modal { omega, zeta, q, dk, dm })
    }

    fn derivatives(&self, factors: &[f64], q: &Dense) -> (Vec<Dense>, Vec<Option<Dense>>) {
        let (mut dk, mut dm) = (Vec::new(), Vec::new());
        for i in 0..self.n_par {
            let mut k = Dense::zeros(self.r, self.r);
            let mut m: Option<Dense> = None;
            for (term, factor) in self.terms.iter().zip(factors) {
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
            dk.push(sandwich(q, &k));
            dm.push(m.map(|m| sandwich(q, &m)));
        }
        (dk, dm)
    }
}

/// What acts at the coordinates of a hypothesis.
#[derive(Debug, Clone)]
pub enum What {
    /// Nothing: the model alone.
    Nothing,
    /// A force that is free on every line.
    FreeForce,
    /// A sum of linear laws, the same on every coordinate. Unknowns are the logarithms of their parameters.
    Laws(Vec<Kind>),
}

/// Where and what.
#[derive(Debug, Clone)]
pub struct Hypothesis {
    /// Direction vectors in the basis (n_w, r); no rows for [`What::Nothing`].
    pub w: Dense,
    /// What acts there.
    pub what: What,
    /// Residual compliance of the coordinates that the basis does not hold, m/N (n_w).
    pub compliance: Vec<f64>,
    /// Prior means of the logarithms of the law parameters.
    pub law_mean: Vec<f64>,
    /// Their prior standard deviations.
    pub law_sd: Vec<f64>,
}

impl Hypothesis {
    /// Number of law unknowns.
    pub fn n_law(&self) -> usize {
        match &self.what {
            What::Laws(kinds) => kinds.iter().map(|k| k.parameters().len()).sum(),
            _ => 0,
        }
    }

    /// Checks the sizes against each other.
    ///
    /// # Errors
    /// [`IdentifyError::Shape`].
    pub fn check(&self, r: usize) -> Result<(), IdentifyError> {
        if self.w.nrows() > 0 {
            expect("direction vectors", self.w.ncols(), r)?;
        }
        expect("residual compliances", self.compliance.len(), self.w.nrows())?;
        expect("prior means of the law", self.law_mean.len(), self.n_law())?;
        expect("prior standard deviations of the law", self.law_sd.len(), self.n_law())
    }

    /// kappa(s) of the attached laws and its derivatives with respect to the logarithms `x` of their parameters.
    ///
    /// # Errors
    /// [`IdentifyError::Law`].
    pub fn kappa(
        &self,
        x: &[f64],
        lines: &[Complex64],
    ) -> Result<(Vec<Complex64>, Vec<Vec<Complex64>>), IdentifyError> {
        let mut kappa = vec![Complex64::default(); lines.len()];
        let mut slopes = vec![vec![Complex64::default(); lines.len()]; x.len()];
        let mut first = 0;
        for (_, law) in self.laws(x)? {
            let values = law.values();
            for (k, s) in lines.iter().enumerate() {
                let (value, d) = law.dynamic_stiffness(*s)?;
                kappa[k] += value;
                for (j, slope) in d.iter().enumerate() {
                    slopes[first + j][k] = slope * values[j];
                }
            }
            first += values.len();
        }
        Ok((kappa, slopes))
    }

    /// Parts of kappa(s) that act on the velocity and on the acceleration of a coordinate instead of its displacement.
    ///
    /// # Errors
    /// [`IdentifyError::Law`].
    pub fn moving_parts(
        &self,
        x: &[f64],
        lines: &[Complex64],
    ) -> Result<(Vec<Complex64>, Vec<Complex64>), IdentifyError> {
        let mut velocity = vec![Complex64::default(); lines.len()];
        let mut inertia = velocity.clone();
        for (kind, law) in self.laws(x)? {
            let at_rest = match kind {
                Kind::Spring | Kind::Structural => continue,
                Kind::Mass | Kind::Absorber | Kind::Dashpot => Complex64::default(),
                _ => law.dynamic_stiffness(Complex64::default())?.0,
            };
            for (k, s) in lines.iter().enumerate() {
                let moving = law.dynamic_stiffness(*s)?.0 - at_rest;
                match kind {
                    Kind::Mass | Kind::Absorber => inertia[k] += moving / (s * s),
                    _ => velocity[k] += moving / s,
                }
            }
        }
        Ok((velocity, inertia))
    }

    /// Poles of the laws' inner states (1/s), one of each pair, with whether it is one.
    ///
    /// # Errors
    /// [`IdentifyError::Law`].
    pub fn inner_poles(&self, x: &[f64]) -> Result<Vec<(Complex64, bool)>, IdentifyError> {
        let mut poles = Vec::new();
        for (kind, law) in self.laws(x)? {
            match (kind, law.values()) {
                (Kind::Absorber, &[m, k, c]) => {
                    let (half, square) = (0.5 * c / m, k / m - (0.5 * c / m).powi(2));
                    if square > 0.0 {
                        poles.push((Complex64::new(-half, square.sqrt()), true));
                    } else {
                        let root = (-square).sqrt();
                        poles.push((Complex64::new(-half - root, 0.0), false));
                        poles.push((Complex64::new(-half + root, 0.0), false));
                    }
                }
                (Kind::Viscoelastic, &[_, _, tau]) => poles.push((Complex64::new(-1.0 / tau, 0.0), false)),
                _ => {}
            }
        }
        Ok(poles)
    }

    fn laws(&self, x: &[f64]) -> Result<Vec<(Kind, Law)>, IdentifyError> {
        let What::Laws(kinds) = &self.what else { return Ok(Vec::new()) };
        let mut first = 0;
        kinds
            .iter()
            .map(|&kind| {
                let n = kind.parameters().len();
                let values: Vec<f64> = x[first..first + n].iter().map(|v| v.exp()).collect();
                first += n;
                Ok((kind, Law::new(kind, &values)?))
            })
            .collect()
    }
}
