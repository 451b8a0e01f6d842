//! Added mass.

use super::dual::Scalar;
use super::{Constants, Definition, Domain, DynamicStiffness, Motion, Parameter, State, parameter};
use num_complex::Complex64;

/// f = m a.
pub(super) struct Mass;

impl Definition for Mass {
    const NAME: &'static str = "added_mass";
    const PARAMETERS: &'static [Parameter] = &[parameter("m", "kg", Domain::Real)];
    const LINEAR: bool = true;
    const INERTIAL: bool = true;

    #[inline(always)]
    fn step<T: Scalar>(c: &Constants<T>, _dt: f64, x: Motion<T>, s: &State<T>) -> (T, State<T>) {
        (c[0] * x.a, *s)
    }

    fn stored(c: &Constants<f64>, x: Motion<f64>, _s: &State<f64>) -> Option<f64> {
        Some(0.5 * c[0] * x.v * x.v)
    }

    fn stiffness_bound<T: Scalar>(_p: &[T]) -> T {
        T::constant(0.0)
    }

    fn dynamic_stiffness(p: &[f64], s: Complex64) -> Option<DynamicStiffness> {
        Some((p[0] * s * s, vec![s * s]))
    }
}
