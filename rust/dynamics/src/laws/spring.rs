//! Linear spring: support, joint or member stiffness.

use super::dual::Scalar;
use super::{Constants, Definition, Domain, DynamicStiffness, Motion, Parameter, State, parameter};
use num_complex::Complex64;

/// f = k d.
pub(super) struct Spring;

impl Definition for Spring {
    const NAME: &'static str = "support_stiffness";
    const PARAMETERS: &'static [Parameter] = &[parameter("k", "N/m", Domain::Real)];
    const LINEAR: bool = true;

    #[inline(always)]
    fn step<T: Scalar>(c: &Constants<T>, _dt: f64, x: Motion<T>, s: &State<T>) -> (T, State<T>) {
        (c[0] * x.d, *s)
    }

    fn stored(c: &Constants<f64>, x: Motion<f64>, _s: &State<f64>) -> Option<f64> {
        Some(0.5 * c[0] * x.d * x.d)
    }

    fn stiffness_bound<T: Scalar>(p: &[T]) -> T {
        p[0]
    }

    fn dynamic_stiffness(p: &[f64], _s: Complex64) -> Option<DynamicStiffness> {
        Some((p[0].into(), vec![1.0.into()]))
    }
}
