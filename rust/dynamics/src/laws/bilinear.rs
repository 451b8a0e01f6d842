//! Stiffness that differs between tension and compression, without a gap.

use super::dual::Scalar;
use super::{Constants, Definition, Domain, Motion, Parameter, State, parameter};

/// f = k_plus d for d > 0, k_minus d for d < 0.
pub(super) struct Bilinear;

impl Definition for Bilinear {
    const NAME: &'static str = "bilinear_stiffness";
    const PARAMETERS: &'static [Parameter] =
        &[parameter("k_plus", "N/m", Domain::Real), parameter("k_minus", "N/m", Domain::Real)];

    #[inline(always)]
    fn step<T: Scalar>(c: &Constants<T>, _dt: f64, x: Motion<T>, s: &State<T>) -> (T, State<T>) {
        (if x.d.value() >= 0.0 { c[0] } else { c[1] } * x.d, *s)
    }

    fn stored(c: &Constants<f64>, x: Motion<f64>, _s: &State<f64>) -> Option<f64> {
        Some(0.5 * if x.d >= 0.0 { c[0] } else { c[1] } * x.d * x.d)
    }

    fn stiffness_bound<T: Scalar>(p: &[T]) -> T {
        if p[0].value() >= p[1].value() { p[0] } else { p[1] }
    }
}
