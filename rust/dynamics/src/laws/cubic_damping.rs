//! Cubic damping.

use super::dual::Scalar;
use super::{Constants, Definition, Domain, Motion, Parameter, State, parameter};

/// f = c v^3 (Nayfeh and Mook 1979).
pub(super) struct CubicDamping;

impl Definition for CubicDamping {
    const NAME: &'static str = "cubic_damping";
    const PARAMETERS: &'static [Parameter] = &[parameter("c", "N s^3/m^3", Domain::NonNegative)];

    #[inline(always)]
    fn step<T: Scalar>(c: &Constants<T>, _dt: f64, x: Motion<T>, s: &State<T>) -> (T, State<T>) {
        (c[0] * x.v * x.v * x.v, *s)
    }

    fn stored(_c: &Constants<f64>, _x: Motion<f64>, _s: &State<f64>) -> Option<f64> {
        Some(0.0)
    }

    fn stiffness_bound<T: Scalar>(_p: &[T]) -> T {
        T::constant(0.0)
    }
}
