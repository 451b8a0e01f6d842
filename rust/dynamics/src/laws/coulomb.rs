//! Dry friction, elastic until slip (Jenkins element).

use super::dual::Scalar;
use super::{Constants, Definition, Domain, Motion, Parameter, State, parameter};

/// A spring kt in series with a slider of slip force f; Coulomb friction is its stiff limit. State: (slider position).
pub(super) struct Coulomb;

impl Definition for Coulomb {
    const NAME: &'static str = "coulomb_friction";
    const PARAMETERS: &'static [Parameter] =
        &[parameter("f", "N", Domain::NonNegative), parameter("kt", "N/m", Domain::Positive)];
    const N_STATE: usize = 1;

    #[inline(always)]
    fn step<T: Scalar>(c: &Constants<T>, _dt: f64, x: Motion<T>, s: &State<T>) -> (T, State<T>) {
        let (slip, kt) = (c[0], c[1]);
        let trial = kt * (x.d - s[0]);
        if trial.value().abs() <= slip.value() {
            return (trial, *s);
        }
        let force = slip * trial.value().signum();
        let mut new = *s;
        new[0] = x.d - force / kt;
        (force, new)
    }

    fn stored(c: &Constants<f64>, x: Motion<f64>, s: &State<f64>) -> Option<f64> {
        Some(0.5 * c[1] * (x.d - s[0]).powi(2))
    }

    fn stiffness_bound<T: Scalar>(p: &[T]) -> T {
        if p[0].value() > 0.0 { p[1] } else { T::constant(0.0) }
    }
}
