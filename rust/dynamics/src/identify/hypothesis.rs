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
    /// Linear laws; those at one coordinate add up. Unknowns are the logarithms of their parameters.
    Laws(Vec<Attached>),
    /// A dynamic stiffness that is known on the lines of one record, for each coordinate, and laws that add to it.
    Given(Vec<Vec<Complex64>>, Vec<Attached>),
}

/// A linear law, with the same parameters at every coordinate where it acts.
#[derive(Debug, Clone)]
pub struct Attached {
    /// The law.
    pub kind: Kind,
    /// Numbers of its coordinates.
    pub at: Vec<usize>,
    /// Values of its parameters where they are known, which are no unknowns then.
    pub known: Option<Vec<f64>>,
}

impl Attached {
    /// A law whose parameters are unknown, at the coordinates `at`.
    #[must_use]
    pub fn unknown(kind: Kind, at: Vec<usize>) -> Self {
        Self { kind, at, known: None }
    }

    /// Number of its unknowns.
    fn n_unknown(&self) -> usize {
        if self.known.is_some() { 0 } else { self.kind.parameters().len() }
    }
}

impl What {
    /// A sum of laws, the same at each of `n_w` coordinates.
    pub fn everywhere(kinds: &[Kind], n_w: usize) -> Self {
        Self::Laws(kinds.iter().map(|&kind| Attached::unknown(kind, (0..n_w).collect())).collect())
    }
}

/// An inner state of a law.
pub(crate) struct InnerPole<'a> {
    /// Its pole, 1/s; of a pair one.
    pub pole: Complex64,
    pub pair: bool,
    /// Coordinates at which the law acts.
    pub at: &'a [usize],
}

/// What the laws of a hypothesis are on the lines; coordinates with the same laws are of one group.
pub(crate) struct Stiffness {
    /// Group of every coordinate.
    pub group: Vec<usize>,
    /// kappa of every group.
    pub kappa: Vec<Vec<Complex64>>,
    /// Parts of kappa that act on the velocity and on the acceleration of a coordinate instead of its displacement:
    /// kappa = elastic + s velocity + s^2 inertia.
    pub velocity: Vec<Vec<Complex64>>,
    pub inertia: Vec<Vec<Complex64>>,
    /// Derivatives of kappa with respect to the logarithm of every law parameter, where its law acts.
    pub slopes: Vec<Vec<Complex64>>,
    /// Coordinates at which every law parameter acts.
    pub reach: Vec<Vec<usize>>,
    /// The parts of the derivatives that act on the velocity, or on the acceleration where `inertial` says so.
    pub moving_slopes: Vec<Vec<Complex64>>,
    pub inertial: Vec<bool>,
}

impl Stiffness {
    fn none(group: Vec<usize>, n_groups: usize, n_law: usize, n_lines: usize) -> Self {
        let zeros = |n: usize| vec![vec![Complex64::default(); n_lines]; n];
        Self {
            group,
            kappa: zeros(n_groups),
            velocity: zeros(n_groups),
            inertia: zeros(n_groups),
            slopes: zeros(n_law),
            reach: Vec::new(),
            moving_slopes: zeros(n_law),
            inertial: vec![false; n_law],
        }
    }
}

/// Where and what.
#[derive(Debug, Clone)]
pub struct Hypothesis {
    /// Direction vectors in the basis (n_w, r); no rows for [`What::Nothing`].
    pub w: Dense,
    /// What acts there.
    pub what: What,
    /// Number of the last coordinates at which forces free on every line act too, whatever else acts there.
    pub free: usize,
    /// Residual compliance of the coordinates that the basis does not hold, m/N (n_w).
    pub compliance: Vec<f64>,
    /// Stiffness of the coordinates that the reduced model holds already, so that its modes, and with them their damping,
    /// are of the structure with it: laws add what they are beyond it (n_w, or none).
    pub held: Vec<f64>,
    /// Prior means of the logarithms of the law parameters.
    pub law_mean: Vec<f64>,
    /// Their prior standard deviations.
    pub law_sd: Vec<f64>,
}

impl Hypothesis {
    /// Number of law unknowns.
    pub fn n_law(&self) -> usize {
        match &self.what {
            What::Laws(all) | What::Given(_, all) => all.iter().map(Attached::n_unknown).sum(),
            _ => 0,
        }
    }

    /// Number of the last coordinates whose forces are free on every line.
    pub fn n_free(&self) -> usize {
        if matches!(self.what, What::FreeForce) { self.w.nrows() } else { self.free }
    }

    /// Checks the sizes against each other.
    ///
    /// # Errors
    /// [`IdentifyError::Shape`].
    pub fn check(&self, r: usize) -> Result<(), IdentifyError> {
        expect("coordinates with free forces", self.free.min(self.w.nrows()), self.free)?;
        if self.w.nrows() > 0 {
            expect("direction vectors", self.w.ncols(), r)?;
        }
        expect("residual compliances", self.compliance.len(), self.w.nrows())?;
        if !self.held.is_empty() {
            expect("stiffnesses that the model holds", self.held.len(), self.w.nrows())?;
        }
        if let What::Laws(all) | What::Given(_, all) = &self.what {
            let needed = all.iter().flat_map(|a| &a.at).max().map_or(0, |i| i + 1);
            expect("coordinates of the laws", self.w.nrows().max(needed), self.w.nrows())?;
        }
        if let What::Given(kappa, _) = &self.what {
            expect("stiffness of the coordinates", kappa.len(), self.w.nrows())?;
        }
        expect("prior means of the law", self.law_mean.len(), self.n_law())?;
        expect("prior standard deviations of the law", self.law_sd.len(), self.n_law())
    }

    /// Stiffness of the attached laws with the logarithms `x` of their parameters.
    ///
    /// # Errors
    /// [`IdentifyError::Law`].
    pub(crate) fn stiffness(&self, x: &[f64], lines: &[Complex64]) -> Result<Stiffness, IdentifyError> {
        let laws = self.laws(x)?;
        let (group, first) = self.groups();
        let mut out = Stiffness::none(group, first.len(), x.len(), lines.len());
        if let What::Given(kappa, _) = &self.what {
            out.kappa.clone_from(kappa);
        }
        for (at, law) in laws {
            let (values, unknown) = (law.values(), out.reach.len());
            out.reach.resize(unknown + at.n_unknown(), at.at.clone());
            let groups: Vec<usize> = (0..first.len()).filter(|g| at.at.contains(&first[*g])).collect();
            let inertial = matches!(at.kind, Kind::Mass | Kind::Absorber);
            let at_rest = match at.kind {
                Kind::Spring | Kind::Structural => None,
                Kind::Mass | Kind::Absorber | Kind::Dashpot => {
                    Some((Complex64::default(), vec![Complex64::default(); values.len()]))
                }
                _ => Some(law.dynamic_stiffness(Complex64::default())?),
            };
            for (k, s) in lines.iter().enumerate() {
                let (value, d) = law.dynamic_stiffness(*s)?;
                let moving = at_rest.as_ref().map_or_else(Complex64::default, |at_rest| value - at_rest.0);
                let per = if inertial { s * s } else { *s };
                for &g in &groups {
                    out.kappa[g][k] += value;
                    let part = if inertial { &mut out.inertia } else { &mut out.velocity };
                    part[g][k] += moving / per;
                }
                for (j, slope) in d.iter().enumerate().take(at.n_unknown()) {
                    out.slopes[unknown + j][k] = slope * values[j];
                    if let Some((_, at_rest)) = &at_rest {
                        out.moving_slopes[unknown + j][k] = (slope - at_rest[j]) * values[j] / per;
                        out.inertial[unknown + j] = inertial;
                    }
                }
            }
        }
        for (kappa, i) in out.kappa.iter_mut().zip(&first) {
            let held = self.held.get(*i).copied().unwrap_or(0.0);
            kappa.iter_mut().for_each(|kappa| *kappa -= held);
        }
        Ok(out)
    }

    /// Group of every coordinate, and the first coordinate of every group: those with the same laws, beyond the same
    /// stiffness that the model holds, are one, where no stiffness of each is given.
    fn groups(&self) -> (Vec<usize>, Vec<usize>) {
        if let What::Given(kappa, _) = &self.what {
            let each: Vec<usize> = (0..kappa.len()).collect();
            return (each.clone(), each);
        }
        let What::Laws(all) = &self.what else { return (vec![0; self.w.nrows()], Vec::new()) };
        let laws_at = |i: usize| all.iter().map(move |a| a.at.contains(&i));
        let mut first: Vec<usize> = Vec::new();
        let group = (0..self.w.nrows())
            .map(|i| {
                first
                    .iter()
                    .position(|j| self.held.get(*j) == self.held.get(i) && laws_at(*j).eq(laws_at(i)))
                    .unwrap_or_else(|| {
                        first.push(i);
                        first.len() - 1
                    })
            })
            .collect();
        (group, first)
    }

    /// Poles of the laws' inner states.
    ///
    /// # Errors
    /// [`IdentifyError::Law`].
    pub(crate) fn inner_poles(&self, x: &[f64]) -> Result<Vec<InnerPole<'_>>, IdentifyError> {
        let mut poles = Vec::new();
        for (Attached { kind, at, .. }, law) in self.laws(x)? {
            let real = |pole: f64| InnerPole { pole: Complex64::new(pole, 0.0), pair: false, at };
            match (kind, law.values()) {
                (Kind::Absorber, &[m, k, c]) => {
                    let (half, square) = (0.5 * c / m, k / m - (0.5 * c / m).powi(2));
                    if square > 0.0 {
                        poles.push(InnerPole { pole: Complex64::new(-half, square.sqrt()), pair: true, at });
                    } else {
                        let root = (-square).sqrt();
                        poles.extend([real(-half - root), real(-half + root)]);
                    }
                }
                (Kind::Viscoelastic, &[_, _, tau]) => poles.push(real(-1.0 / tau)),
                _ => {}
            }
        }
        Ok(poles)
    }

    fn laws(&self, x: &[f64]) -> Result<Vec<(&Attached, Law)>, IdentifyError> {
        let (What::Laws(all) | What::Given(_, all)) = &self.what else { return Ok(Vec::new()) };
        let mut first = 0;
        all.iter()
            .map(|attached| {
                let n = attached.n_unknown();
                let unknown = || x[first..first + n].iter().map(|v| v.exp()).collect();
                let values: Vec<f64> = attached.known.clone().unwrap_or_else(unknown);
                first += n;
                Ok((attached, Law::new(attached.kind, &values)?))
            })
            .collect()
    }
}
