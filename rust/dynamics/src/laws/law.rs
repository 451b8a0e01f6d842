//! A law with its parameters, and a law prepared for a step length.

use super::dual::{Dual, Scalar};
use super::kind::with_definition;
use super::{
    Constants, Definition, DynamicStiffness, Kind, LawError, MANY, MAX_CONSTANTS, MAX_PARAMETERS, MAX_STATE,
    Motion, State,
};
use num_complex::Complex64;

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
        if let Some((index, need)) = with_definition!(kind, D => <D as Definition>::check(p), _ => None) {
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
        let bound = with_definition!(self.kind, D => <D as Definition>::stiffness_bound(&p),
            _ => Dual::constant(f64::INFINITY));
        (bound.re, bound.eps)
    }

    /// Complex dynamic stiffness kappa(s) = F/D (N/m) at s (rad/s) and its derivative with respect to each parameter.
    ///
    /// # Errors
    /// [`LawError::NotLinear`].
    pub fn dynamic_stiffness(&self, s: Complex64) -> Result<DynamicStiffness, LawError> {
        with_definition!(self.kind, D => <D as Definition>::dynamic_stiffness(&self.p, s), _ => None)
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
        let (state, n) = (self.kind.n_state(), self.p.len());
        let plain = self.constants::<f64>(dt, |value, _| value);
        let seeded = if 3 + state + n <= FEW {
            Seeded::Few(Box::new(self.constants(dt, |value, i| Dual::variable(value, 3 + state + i))))
        } else {
            Seeded::Many(Box::new(self.constants(dt, |value, i| Dual::variable(value, 3 + state + i))))
        };
        Ok(PreparedLaw {
            kind: self.kind,
            n_parameters: n,
            n_state: state,
            dt,
            plain,
            lifted: plain.map(Dual::constant),
            seeded,
        })
    }

    fn constants<T: Scalar>(&self, dt: f64, seed: impl Fn(f64, usize) -> T) -> Constants<T> {
        let p: Vec<T> = self.p.iter().enumerate().map(|(i, value)| seed(*value, i)).collect();
        with_definition!(self.kind, D => <D as Definition>::constants(&p, dt), _ => {
            let mut c = [T::constant(0.0); MAX_CONSTANTS];
            c[..p.len()].copy_from_slice(&p);
            c
        })
    }
}

/// Seeds of a full linearisation, in the order motion (3), the law's own state, its parameters: laws that need few
/// derivatives do not carry those of the largest one.
pub(super) const FEW: usize = 10;
#[derive(Clone, Debug)]
enum Seeded {
    Few(Box<Constants<Dual<FEW>>>),
    Many(Box<Constants<Dual<MANY>>>),
}

/// A law ready to be stepped by `dt`.
#[derive(Clone, Debug)]
pub struct PreparedLaw {
    kind: Kind,
    n_parameters: usize,
    n_state: usize,
    dt: f64,
    plain: Constants<f64>,
    lifted: Constants<Dual<3>>,
    seeded: Seeded,
}

#[inline(always)]
fn seeded<const N: usize>(x: Motion<f64>) -> Motion<Dual<N>> {
    Motion { d: Dual::variable(x.d, 0), v: Dual::variable(x.v, 1), a: Dual::variable(x.a, 2) }
}

/// The tangent of one law: a function of its own, so that small laws do not pay for the frame of large ones, and only
/// the states in use are copied.
#[inline]
fn tangent<D: Definition>(
    plain: &Constants<f64>,
    c: &Constants<Dual<3>>,
    dt: f64,
    x: Motion<f64>,
    s: &State<f64>,
    new: &mut State<f64>,
) -> (f64, [f64; 3]) {
    if let Some((f, slope, after)) = D::known_slope(plain, x.d, s) {
        new[..D::N_STATE].copy_from_slice(&after[..D::N_STATE]);
        return (f, [slope, 0.0, 0.0]);
    }
    let mut state = [Dual::constant(0.0); MAX_STATE];
    for i in 0..D::N_STATE {
        state[i] = Dual::constant(s[i]);
    }
    let (f, after) = D::step(c, dt, seeded(x), &state);
    for i in 0..D::N_STATE {
        new[i] = after[i].re;
    }
    (f.re, f.eps)
}

/// Derivatives of a force or of a state variable with respect to (d, v, a), the old state, the parameters; what follows
/// those is of no account.
pub(super) type Slopes = [f64; MANY];

/// All derivatives of one law, written where they are kept: a function of each law, so that only the states in use are
/// carried.
#[inline]
fn spread<D: Definition, const N: usize>(
    c: &Constants<Dual<N>>,
    dt: f64,
    x: Motion<f64>,
    s: &State<f64>,
    (force, states): (&mut Slopes, &mut [Slopes]),
) {
    let mut state: State<Dual<N>> = [Dual::constant(0.0); MAX_STATE];
    for i in 0..D::N_STATE {
        state[i] = Dual::variable(s[i], 3 + i);
    }
    let (f, new) = D::step(c, dt, seeded(x), &state);
    force[..N].copy_from_slice(&f.eps);
    for (to, new) in states.iter_mut().zip(&new[..D::N_STATE]) {
        to[..N].copy_from_slice(&new.eps);
    }
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
        self.step(&self.plain, x, s)
    }

    /// Force and its derivatives with respect to d, v, a at the end of the step; the state there is written to `new`,
    /// as far as the law uses it.
    #[inline]
    pub fn tangent(&self, x: Motion<f64>, s: &State<f64>, new: &mut State<f64>) -> (f64, [f64; 3]) {
        if self.kind == Kind::Linear {
            // stands beside every other law
            let [k, c, m, ..] = self.plain;
            return (k * x.d + c * x.v + m * x.a, [k, c, m]);
        }
        self.tangent_of_any(x, s, new)
    }

    fn tangent_of_any(&self, x: Motion<f64>, s: &State<f64>, new: &mut State<f64>) -> (f64, [f64; 3]) {
        with_definition!(self.kind, D => tangent::<D>(&self.plain, &self.lifted, self.dt, x, s, new), own => {
            let (f, after) = own.step(&self.lifted, self.dt, seeded(x), &s.map(Dual::constant));
            *new = after.map(|z| z.re);
            (f.re, f.eps)
        })
    }

    fn step<T: Scalar>(&self, c: &Constants<T>, x: Motion<T>, s: &State<T>) -> (T, State<T>) {
        with_definition!(self.kind, D => <D as Definition>::step(c, self.dt, x, s), own => own.step(c, self.dt, x, s))
    }

    /// Number of internal state variables.
    pub fn n_state(&self) -> usize {
        self.n_state
    }

    /// Writes the slopes of the force, and for each of the `n_state` state variables in use those of its new value.
    pub(super) fn linearise(
        &self,
        x: Motion<f64>,
        s: &State<f64>,
        force: &mut Slopes,
        states: &mut [Slopes],
    ) {
        match &self.seeded {
            Seeded::Few(c) => self.spread(c, x, s, (force, states)),
            Seeded::Many(c) => self.spread(c, x, s, (force, states)),
        }
    }

    fn spread<const N: usize>(
        &self,
        c: &Constants<Dual<N>>,
        x: Motion<f64>,
        s: &State<f64>,
        to: (&mut Slopes, &mut [Slopes]),
    ) {
        with_definition!(self.kind, D => spread::<D, N>(c, self.dt, x, s, to), own => {
            let mut state: State<Dual<N>> = [Dual::constant(0.0); MAX_STATE];
            for i in 0..self.n_state {
                state[i] = Dual::variable(s[i], 3 + i);
            }
            let (f, new) = own.step(c, self.dt, seeded(x), &state);
            to.0[..N].copy_from_slice(&f.eps);
            for (to, new) in to.1.iter_mut().zip(&new) {
                to[..N].copy_from_slice(&new.eps);
            }
        })
    }

    /// Recoverable energy (J), where the law defines one.
    pub fn stored(&self, x: Motion<f64>, s: &State<f64>) -> Option<f64> {
        with_definition!(self.kind, D => <D as Definition>::stored(&self.plain, x, s), _ => None)
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
