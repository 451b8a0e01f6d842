//! Local laws: the force a joint exerts against the motion of its own coordinate.
//!
//! The structure obeys `M q'' + C q' + K q = f_ext - w f_law(d, v, a; state, p)` with `d = w^T u`, so a law's force is
//! positive where it resists positive motion. *Where* (w), *what* (the law) and *how much* (p) stay separate: a law knows
//! only its coordinate. Each law is one file and one [`Definition`], written over [`Scalar`]; tangents and parameter
//! derivatives follow by forward differentiation. Internal states are advanced to the end of the step (implicit).

pub mod dual;

mod absorber;
mod bilinear;
mod bouc_wen;
mod box_spectrum;
mod clearance;
mod coulomb;
mod cubic;
mod cubic_damping;
mod dashpot;
mod displacement_damping;
mod fractional;
mod free_form;
mod hertz;
mod iwan;
mod joint;
mod kind;
mod law;
mod linear;
mod mass;
mod maxwell;
pub mod own;
pub mod pair;
mod play_friction;
mod preloaded;
mod quadratic_damping;
mod quadratic_stiffness;
mod released;
mod saturating;
mod sliding_friction;
mod spring;
mod springpot;
mod structural;
pub mod tape;
#[cfg(test)]
mod tests;
mod viscoelastic;

pub use joint::{Joint, Linearised};
pub use kind::Kind;
pub use law::{Law, PreparedLaw};
pub use own::OwnKind;

use dual::Scalar;
use num_complex::Complex64;

/// Largest number of parameters of a law.
pub const MAX_PARAMETERS: usize = 16;
/// Largest number of internal state variables of a law.
pub const MAX_STATE: usize = 11;
/// Room for what a law derives once from its parameters and the step.
pub const MAX_CONSTANTS: usize = 42;
/// Seeds of a full linearisation (motion, own state, parameters) of the largest law.
const MANY: usize = 20;

/// What a law derives once from its parameters and the step length.
pub type Constants<T> = [T; MAX_CONSTANTS];
/// Internal variables of a law; unused places are zero. All zero = at rest, never loaded.
pub type State<T> = [T; MAX_STATE];

/// Motion of the law's coordinate at the end of a step: displacement (m), velocity (m/s), acceleration (m/s^2).
#[derive(Clone, Copy, Debug, Default)]
pub struct Motion<T> {
    /// Displacement, m (rad for a rotation).
    pub d: T,
    /// Velocity, m/s.
    pub v: T,
    /// Acceleration, m/s^2.
    pub a: T,
}

/// Values a parameter may take.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Domain {
    /// Any finite number.
    Real,
    /// Zero or more.
    NonNegative,
    /// More than zero.
    Positive,
    /// One or more.
    AtLeastOne,
    /// Zero to one.
    Fraction,
    /// A choice: +1, -1 or 2.
    Sides,
    /// A choice: +1 or -1.
    Side,
}

impl Domain {
    fn contains(self, value: f64) -> bool {
        value.is_finite()
            && match self {
                Domain::Real => true,
                Domain::NonNegative => value >= 0.0,
                Domain::Positive => value > 0.0,
                Domain::AtLeastOne => value >= 1.0,
                Domain::Fraction => (0.0..=1.0).contains(&value),
                Domain::Sides => [1.0, -1.0, 2.0].contains(&value),
                Domain::Side => [1.0, -1.0].contains(&value),
            }
    }

    fn text(self) -> &'static str {
        match self {
            Domain::Real => "a finite number",
            Domain::NonNegative => "a finite number >= 0",
            Domain::Positive => "a finite number > 0",
            Domain::AtLeastOne => "a finite number >= 1",
            Domain::Fraction => "a number from 0 to 1",
            Domain::Sides => "+1 (contact at +gap), -1 (contact at -gap) or 2 (both)",
            Domain::Side => "+1 (contact for positive d) or -1 (for negative d)",
        }
    }
}

/// A parameter of a law: its name, its SI unit for a translation, the values it may take.
#[derive(Clone, Copy, Debug)]
pub struct Parameter {
    /// Name as in study files.
    pub name: &'static str,
    /// SI unit where the coordinate is a translation.
    pub unit: &'static str,
    /// Values allowed.
    pub domain: Domain,
}

pub(crate) const fn parameter(name: &'static str, unit: &'static str, domain: Domain) -> Parameter {
    Parameter { name, unit, domain }
}

/// kappa and its derivatives with respect to each parameter, at one complex s.
pub type DynamicStiffness = (Complex64, Vec<Complex64>);

/// One law. `p` holds the parameters in the order of `PARAMETERS`.
trait Definition {
    /// Name, as in study files where the law is a physics of its own.
    const NAME: &'static str;
    /// Parameters in their order.
    const PARAMETERS: &'static [Parameter];
    /// Internal state variables in use.
    const N_STATE: usize = 0;
    /// Whether the force is a linear functional of the motion.
    const LINEAR: bool = false;
    /// Whether the force depends on the acceleration.
    const INERTIAL: bool = false;

    /// Checks that involve several parameters; `None` is fine, otherwise (parameter index, what is needed).
    fn check(_p: &[f64]) -> Option<(usize, &'static str)> {
        None
    }

    /// Constants for a step of `dt` seconds; the default keeps the parameters themselves.
    fn constants<T: Scalar>(p: &[T], _dt: f64) -> Constants<T> {
        let mut c = [T::constant(0.0); MAX_CONSTANTS];
        c[..p.len()].copy_from_slice(p);
        c
    }

    /// Force at the end of a step and the state there, given the state at its start.
    fn step<T: Scalar>(c: &Constants<T>, dt: f64, x: Motion<T>, s: &State<T>) -> (T, State<T>);

    /// Force, its slope over the displacement and the state at the end of a step, for laws that know the slope without
    /// carrying derivatives through their steps and depend on the displacement alone.
    fn known_slope(_c: &Constants<f64>, _d: f64, _s: &State<f64>) -> Option<(f64, f64, State<f64>)> {
        None
    }

    /// Recoverable energy (J) at the end of a step, where the law defines one.
    fn stored(c: &Constants<f64>, x: Motion<f64>, s: &State<f64>) -> Option<f64>;

    /// Largest slope of the force over the displacement; infinite where it grows with amplitude.
    fn stiffness_bound<T: Scalar>(p: &[T]) -> T;

    /// kappa(s) = F/D and its parameter derivatives for linear laws.
    fn dynamic_stiffness(_p: &[f64], _s: Complex64) -> Option<DynamicStiffness> {
        None
    }
}

/// A law that cannot be used as given.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LawError {
    /// No law of that name.
    #[error("no law is called {name:?}; the nearest is {nearest:?}. Laws: {known}")]
    UnknownLaw {
        /// The name asked for.
        name: String,
        /// The nearest known one.
        nearest: &'static str,
        /// All names.
        known: String,
    },
    /// A parameter the law does not have.
    #[error("law {law} has no parameter {parameter:?}; it has {known}")]
    UnknownParameter {
        /// Law.
        law: &'static str,
        /// The name asked for.
        parameter: String,
        /// Its parameters.
        known: String,
    },
    /// Not every parameter is given.
    #[error("law {law} needs parameter {parameter:?}; give all of {known}")]
    MissingParameter {
        /// Law.
        law: &'static str,
        /// The parameter not given.
        parameter: &'static str,
        /// Its parameters.
        known: String,
    },
    /// Wrong length of the parameter vector.
    #[error("law {law} takes {expected} parameters ({known}), {given} were given")]
    WrongCount {
        /// Law.
        law: &'static str,
        /// Number of its parameters.
        expected: usize,
        /// Number given.
        given: usize,
        /// Its parameters.
        known: String,
    },
    /// A value outside the parameter's domain.
    #[error("law {law}: {parameter} = {value}, it must be {need}")]
    BadValue {
        /// Law.
        law: &'static str,
        /// Parameter.
        parameter: &'static str,
        /// Value given.
        value: f64,
        /// What it must be.
        need: &'static str,
    },
    /// A law without a causal time-domain form.
    #[error(
        "law {law} exists in the frequency domain only (a hysteretic loss factor is not causal); \
         simulate a viscoelastic or viscous_damper law instead"
    )]
    FrequencyOnly {
        /// Law.
        law: &'static str,
    },
    /// A law without a dynamic stiffness.
    #[error("law {law} is not linear and has no dynamic stiffness; use its force history")]
    NotLinear {
        /// Law.
        law: &'static str,
    },
}
