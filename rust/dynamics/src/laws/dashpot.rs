//! Viscous damper.

use super::dual::Scalar;
use super::{Constants, Definition, Domain, DynamicStiffness, Motion, Parameter, State, parameter};
use num_complex::Complex64;

/// f = c v.
pub(super) struct Dashpot;

impl Definition for Dashpot {
    const NAME: &'static str = "viscous_damper";
    const PARAMETERS: &'static [Parameter] = &[parameter("c", "N s/m", Domain::Real)];
    const LINEAR: bool = true;

    #[inline(always)]
    fn step<T: Scalar>(c: &Constants<T>, _dt: f64, x: Motion<T>, s: &State<T>) -> (T, State<T>) {
        (c[0] * x.v, *s)
    }

    fn stored(_c: &Constants<f64>, _x: Motion<f64>, _s: &State<f64>) -> Option<f64> {
        Some(0.0)
    }

    fn stiffness_bound<T: Scalar>(_p: &[T]) -> T {
        T::constant(0.0)
    }

    fn dynamic_stiffness(p: &[f64], s: Complex64) -> Option<DynamicStiffness> {
        Some((p[0] * s, vec![s]))
    }
}
