//! A law by name with its parameters, and a law prepared for a step length.

use super::dual::{Dual, Scalar};
use super::{
    Constants, Definition, DynamicStiffness, LawError, MAX_CONSTANTS, MAX_PARAMETERS, MAX_STATE, Motion,
    Parameter, State, absorber, bilinear, bouc_wen, clearance, coulomb, cubic, dashpot, linear, mass,
    quadratic_damping, quadratic_stiffness, spring, structural, viscoelastic,
};
use num_complex::Complex64;

/// Seeds of a full linearisation: motion, state, parameters.
pub(super) const N_SEEDS: usize = 3 + MAX_STATE + MAX_PARAMETERS;

macro_rules! laws {
    ($($variant:ident => $definition:ty),+ $(,)?) => {
        /// The laws of the library.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[allow(missing_docs)]
        pub enum Kind { $($variant),+ }

        impl Kind {
            /// Every law, in the order of the documentation.
            pub const ALL: &'static [Kind] = &[$(Kind::$variant),+];
        }

        /// Calls a generic item of the definition that belongs to a kind.
        macro_rules! with_definition {
            ($kind:expr, $d:ident => $body:expr) => {
                match $kind { $(Kind::$variant => { type $d = $definition; $body })+ }
            };
        }
    };
}

laws! {
    Spring => spring::Spring,
    Mass => mass::Mass,
    Dashpot => dashpot::Dashpot,
    Viscoelastic => viscoelastic::Viscoelastic,
    Absorber => absorber::Absorber,
    Structural => structural::Structural,
    Linear => linear::Linear,
    Cubic => cubic::Cubic,
    QuadraticStiffness => quadratic_stiffness::QuadraticStiffness,
    Clearance => clearance::Clearance,
    Bilinear => bilinear::Bilinear,
    Coulomb => coulomb::Coulomb,
    BoucWen => bouc_wen::BoucWen,
    QuadraticDamping => quadratic_damping::QuadraticDamping,
}

impl Kind {
    /// Name as in study files.
    pub fn name(self) -> &'static str {
        with_definition!(self, D => <D as Definition>::NAME)
    }

    /// Parameters in their order.
    pub fn parameters(self) -> &'static [Parameter] {
        with_definition!(self, D => <D as Definition>::PARAMETERS)
    }

    /// Whether the force is a linear functional of the motion.
    pub fn is_linear(self) -> bool {
        with_definition!(self, D => <D as Definition>::LINEAR)
    }

    /// Whether the force depends on the acceleration.
    pub fn is_inertial(self) -> bool {
        with_definition!(self, D => <D as Definition>::INERTIAL)
    }

    /// Number of internal state variables.
    pub fn n_state(self) -> usize {
        with_definition!(self, D => <D as Definition>::N_STATE)
    }

    /// The law of that name; `joint_stiffness` is the spring between the two sides of a joint.
    ///
    /// # Errors
    /// [`LawError::UnknownLaw`] with the nearest name.
    pub fn from_name(name: &str) -> Result<Self, LawError> {
        if name == "joint_stiffness" {
            return Ok(Kind::Spring);
        }
        if let Some(kind) = Self::ALL.iter().find(|kind| kind.name() == name) {
            return Ok(*kind);
        }
        let names: Vec<_> = Self::ALL.iter().map(|kind| kind.name()).collect();
        let nearest = names.iter().min_by_key(|known| edits(known, name)).copied().unwrap_or_default();
        Err(LawError::UnknownLaw { name: name.to_owned(), nearest, known: names.join(", ") })
    }

    fn known(self) -> String {
        self.parameters().iter().map(|p| p.name).collect::<Vec<_>>().join(", ")
    }
}

/// Levenshtein distance.
fn edits(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let substituted = diagonal + usize::from(x != *y);
            diagonal = row[j + 1];
            row[j + 1] = substituted.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[b.len()]
}

/// A law with parameter values.
#[derive(Clone, Debug)]
pub struct Law {
    kind: Kind,
    p: Vec<f64>,
}

impl Law {
    /// A law of the library with its parameters in their order.
    ///
    /// # Errors
    /// [`LawError`] for a wrong number of parameters or a value outside its domain.
    pub fn new(kind: Kind, p: &[f64]) -> Result<Self, LawError> {
        let (law, parameters) = (kind.name(), kind.parameters());
        if p.len() != parameters.len() {
            let (expected, given) = (parameters.len(), p.len());
            return Err(LawError::WrongCount { law, expected, given, known: kind.known() });
        }
        for (parameter, value) in parameters.iter().zip(p) {
            if !parameter.domain.contains(*value) {
                let need = parameter.domain.text();
                return Err(LawError::BadValue { law, parameter: parameter.name, value: *value, need });
            }
        }
        if let Some((index, need)) = with_definition!(kind, D => <D as Definition>::check(p)) {
            return Err(LawError::BadValue { law, parameter: parameters[index].name, value: p[index], need });
        }
        Ok(Self { kind, p: p.to_vec() })
    }

    /// A law of the library with its parameters by name, in any order.
    ///
    /// # Errors
    /// [`LawError`] for an unknown or missing parameter or a value outside its domain.
    pub fn from_named(kind: Kind, named: &[(String, f64)]) -> Result<Self, LawError> {
        let (law, parameters) = (kind.name(), kind.parameters());
        if let Some((name, _)) = named.iter().find(|(name, _)| !parameters.iter().any(|p| p.name == name)) {
            return Err(LawError::UnknownParameter { law, parameter: name.clone(), known: kind.known() });
        }
        let mut p = Vec::with_capacity(parameters.len());
        for parameter in parameters {
            match named.iter().find(|(name, _)| name == parameter.name) {
                Some((_, value)) => p.push(*value),
                None => {
                    let (parameter, known) = (parameter.name, kind.known());
                    return Err(LawError::MissingParameter { law, parameter, known });
                }
            }
        }
        Self::new(kind, &p)
    }

    /// Which law.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// Parameter values in their order.
    pub fn values(&self) -> &[f64] {
        &self.p
    }

    /// Largest slope of the force over the displacement (N/m) and its parameter derivatives; infinite where it grows
    /// with amplitude.
    pub fn stiffness_bound(&self) -> (f64, [f64; MAX_PARAMETERS]) {
        let p: Vec<Dual<MAX_PARAMETERS>> =
            self.p.iter().enumerate().map(|(i, value)| Dual::variable(*value, i)).collect();
        let bound = with_definition!(self.kind, D => <D as Definition>::stiffness_bound(&p));
        (bound.re, bound.eps)
    }

    /// Complex dynamic stiffness kappa(s) = F/D (N/m) at s (rad/s) and its derivative with respect to each parameter.
    ///
    /// # Errors
    /// [`LawError::NotLinear`].
    pub fn dynamic_stiffness(&self, s: Complex64) -> Result<DynamicStiffness, LawError> {
        with_definition!(self.kind, D => <D as Definition>::dynamic_stiffness(&self.p, s))
            .ok_or(LawError::NotLinear { law: self.kind.name() })
    }

    /// The law with everything that depends on the step length `dt` (s) alone worked out.
    ///
    /// # Errors
    /// [`LawError::FrequencyOnly`].
    pub fn prepare(&self, dt: f64) -> Result<PreparedLaw, LawError> {
        if self.kind == Kind::Structural {
            return Err(LawError::FrequencyOnly { law: self.kind.name() });
        }
        let p: Vec<Dual<N_SEEDS>> =
            self.p.iter().enumerate().map(|(i, value)| Dual::variable(*value, 3 + MAX_STATE + i)).collect();
        let full: Constants<Dual<N_SEEDS>> =
            with_definition!(self.kind, D => <D as Definition>::constants(&p, dt));
        let plain = full.map(|c| c.re);
        let lifted = plain.map(Dual::constant);
        Ok(PreparedLaw { kind: self.kind, n_parameters: self.p.len(), dt, plain, lifted, full })
    }
}

/// A law ready to be stepped by `dt`.
#[derive(Clone, Debug)]
pub struct PreparedLaw {
    kind: Kind,
    n_parameters: usize,
    dt: f64,
    plain: [f64; MAX_CONSTANTS],
    lifted: [Dual<3>; MAX_CONSTANTS],
    full: [Dual<N_SEEDS>; MAX_CONSTANTS],
}

impl PreparedLaw {
    /// Which law.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// Number of parameters.
    pub fn n_parameters(&self) -> usize {
        self.n_parameters
    }

    /// Whether the force changes with the acceleration at these parameters.
    pub fn uses_acceleration(&self) -> bool {
        match self.kind {
            Kind::Linear => self.plain[2] != 0.0,
            kind => kind.is_inertial(),
        }
    }

    /// Force (N) at the end of the step and the state there.
    pub fn force(&self, x: Motion<f64>, s: &State<f64>) -> (f64, State<f64>) {
        with_definition!(self.kind, D => <D as Definition>::step(&self.plain, self.dt, x, s))
    }

    /// Force, its derivatives with respect to d, v, a at the end of the step, and the state there.
    pub fn tangent(&self, x: Motion<f64>, s: &State<f64>) -> (f64, [f64; 3], State<f64>) {
        let motion =
            Motion { d: Dual::variable(x.d, 0), v: Dual::variable(x.v, 1), a: Dual::variable(x.a, 2) };
        let state: State<Dual<3>> = s.map(Dual::constant);
        let (f, new) =
            with_definition!(self.kind, D => <D as Definition>::step(&self.lifted, self.dt, motion, &state));
        (f.re, f.eps, new.map(|z| z.re))
    }

    /// Force and new state with derivatives with respect to (d, v, a), the old state and the parameters, in this order.
    pub(super) fn full(&self, x: Motion<f64>, s: &State<f64>) -> (Dual<N_SEEDS>, State<Dual<N_SEEDS>>) {
        let motion =
            Motion { d: Dual::variable(x.d, 0), v: Dual::variable(x.v, 1), a: Dual::variable(x.a, 2) };
        let state: State<Dual<N_SEEDS>> = std::array::from_fn(|i| Dual::variable(s[i], 3 + i));
        with_definition!(self.kind, D => <D as Definition>::step(&self.full, self.dt, motion, &state))
    }

    /// Recoverable energy (J), where the law defines one.
    pub fn stored(&self, x: Motion<f64>, s: &State<f64>) -> Option<f64> {
        with_definition!(self.kind, D => <D as Definition>::stored(&self.plain, x, s))
    }

    /// Force history (N) along a given motion from rest, one value a step.
    pub fn history(&self, d: &[f64], v: &[f64], a: &[f64]) -> Vec<f64> {
        let mut state = [0.0; MAX_STATE];
        let motion = d.iter().zip(v).zip(a).map(|((d, v), a)| Motion { d: *d, v: *v, a: *a });
        motion
            .map(|x| {
                let (f, new) = self.force(x, &state);
                state = new;
                f
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unknown_names_tell_the_nearest() {
        let error = Kind::from_name("cubic_stifness").unwrap_err();
        assert!(matches!(error, LawError::UnknownLaw { nearest: "cubic_stiffness", .. }));
    }

    #[test]
    fn values_outside_their_domain_are_refused() {
        let bad = [
            (Kind::Clearance, vec![1.0, -1e-3, 1.0]),
            (Kind::Clearance, vec![1.0, 1e-3, 3.0]),
            (Kind::Viscoelastic, vec![1.0, 1.0, 0.0]),
            (Kind::BoucWen, vec![1.0, 0.1, 1.0, 1.0, 2.0]),
            (Kind::Spring, vec![f64::NAN]),
        ];
        for (kind, p) in bad {
            assert!(matches!(Law::new(kind, &p), Err(LawError::BadValue { .. })), "{kind:?} {p:?}");
        }
        assert!(matches!(Law::new(Kind::Spring, &[]), Err(LawError::WrongCount { .. })));
    }
}
