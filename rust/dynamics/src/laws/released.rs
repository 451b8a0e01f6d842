//! What a model loses where something it holds gives way: a spring of negative stiffness.

use super::dual::Scalar;
use super::{Constants, Definition, Domain, DynamicStiffness, Motion, Parameter, State, parameter};
use num_complex::Complex64;

/// f = -g d: a support of local stiffness S that gives way by a spring k leaves g = S^2/(k + S) less.
pub(super) struct Released;

impl Definition for Released {
    const NAME: &'static str = "released_support";
    const PARAMETERS: &'static [Parameter] = &[parameter("g", "N/m", Domain::Real)];
    const LINEAR: bool = true;

    fn step<T: Scalar>(c: &Constants<T>, _dt: f64, x: Motion<T>, s: &State<T>) -> (T, State<T>) {
        (-(c[0] * x.d), *s)
    }

    fn stored(c: &Constants<f64>, x: Motion<f64>, _s: &State<f64>) -> Option<f64> {
        Some(-0.5 * c[0] * x.d * x.d)
    }

    fn stiffness_bound<T: Scalar>(p: &[T]) -> T {
        p[0]
    }

    fn dynamic_stiffness(p: &[f64], _s: Complex64) -> Option<DynamicStiffness> {
        Some(((-p[0]).into(), vec![(-1.0).into()]))
    }
}
