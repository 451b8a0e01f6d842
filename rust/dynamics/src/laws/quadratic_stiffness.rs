//! Quadratic stiffness: an even force, as of a preloaded or curved member.

use super::dual::Scalar;
use super::{Constants, Definition, Domain, Motion, Parameter, State, parameter};

/// f = k2 d^2.
pub(super) struct QuadraticStiffness;

impl Definition for QuadraticStiffness {
    const NAME: &'static str = "quadratic_stiffness";
    const PARAMETERS: &'static [Parameter] = &[parameter("k2", "N/m^2", Domain::Real)];

    #[inline(always)]
    fn step<T: Scalar>(c: &Constants<T>, _dt: f64, x: Motion<T>, s: &State<T>) -> (T, State<T>) {
        (c[0] * x.d * x.d, *s)
    }

    fn stored(c: &Constants<f64>, x: Motion<f64>, _s: &State<f64>) -> Option<f64> {
        Some(c[0] * x.d.powi(3) / 3.0)
    }

    fn stiffness_bound<T: Scalar>(_p: &[T]) -> T {
        T::constant(f64::INFINITY)
    }
}
