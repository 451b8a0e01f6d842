//! Cubic stiffness, hardening or softening.

use super::dual::Scalar;
use super::{Constants, Definition, Domain, Motion, Parameter, State, parameter};

/// f = k3 d^3.
pub(super) struct Cubic;

impl Definition for Cubic {
    const NAME: &'static str = "cubic_stiffness";
    const PARAMETERS: &'static [Parameter] = &[parameter("k3", "N/m^3", Domain::Real)];

    #[inline(always)]
    fn step<T: Scalar>(c: &Constants<T>, _dt: f64, x: Motion<T>, s: &State<T>) -> (T, State<T>) {
        (c[0] * x.d * x.d * x.d, *s)
    }

    fn stored(c: &Constants<f64>, x: Motion<f64>, _s: &State<f64>) -> Option<f64> {
        Some(0.25 * c[0] * x.d.powi(4))
    }

    fn stiffness_bound<T: Scalar>(_p: &[T]) -> T {
        T::constant(f64::INFINITY)
    }
}
