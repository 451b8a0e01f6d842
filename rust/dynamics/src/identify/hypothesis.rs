//! What may be attached to the reduced model, and where.

use super::{IdentifyError, expect};
use crate::laws::{Kind, Law};
use femend_linalg::Dense;
use num_complex::Complex64;

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
