//! The reduced model with its unknowns.

use super::dashpots::Dashpots;
use super::{IdentifyError, expect, expect_square};
use femend_linalg::Dense;

/// A part of K and M that scales with a product of powers of the user's parameters.
#[derive(Debug, Clone)]
pub struct Term {
    /// (parameter, exponent): the part is multiplied by exp(sum exponent * theta).
    pub exponents: Vec<(usize, f64)>,
    /// Part of the stiffness, if any: (r, r), or (n, n) where it is one between the first n vectors of the basis alone.
    pub k: Option<Dense>,
    /// Part of the mass, likewise.
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
    /// Dashpots that the model has beside the damping of its modes.
    pub dashpots: Dashpots,
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
                expect_square("a parameter's part of K or M", part, part.ncols().min(self.r))?;
            }
            if let Some((i, _)) = term.exponents.iter().find(|(i, _)| *i >= self.n_par) {
                return Err(IdentifyError::Shape { what: "parameters", found: self.n_par, expected: i + 1 });
            }
        }
        expect("prior means", self.mean.len(), self.n_unknowns())?;
        expect("prior standard deviations", self.sd.len(), self.n_unknowns())?;
        self.dashpots.check(self.r, self.n_par)?;
        if self.n_tuned > self.r {
            return Err(IdentifyError::Shape { what: "basis", found: self.r, expected: self.n_tuned });
        }
        Ok(())
    }
}
