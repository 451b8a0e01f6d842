//! Elastic spring that saturates.

use super::dual::Scalar;
use super::{Constants, Definition, Domain, Motion, Parameter, State, parameter};

/// f = k d / (1 + |d| / d0): slope k at rest, force k d0 far out (the hyperbola of Kondner 1963, taken elastic).
pub(super) struct Saturating;

impl Definition for Saturating {
    const NAME: &'static str = "saturating_stiffness";
    const PARAMETERS: &'static [Parameter] =
        &[parameter("k", "N/m", Domain::Real), parameter("d0", "m", Domain::Positive)];

    #[inline(always)]
    fn step<T: Scalar>(c: &Constants<T>, _dt: f64, x: Motion<T>, s: &State<T>) -> (T, State<T>) {
        (c[0] * x.d / (x.d.abs() / c[1] + 1.0), *s)
    }

    fn stored(c: &Constants<f64>, x: Motion<f64>, _s: &State<f64>) -> Option<f64> {
        let ratio = x.d.abs() / c[1];
        Some(c[0] * c[1] * c[1] * (ratio - ratio.ln_1p()))
    }

    fn stiffness_bound<T: Scalar>(p: &[T]) -> T {
        p[0]
    }
}
