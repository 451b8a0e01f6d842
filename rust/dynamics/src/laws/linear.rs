//! Linear companion of another law: what the nominal model gets wrong at the joint itself.
//!
//! The local stiffness of the nominal model cannot be told from a law's linear part; without this companion it biases
//! gaps and exponents.

use super::dual::Scalar;
use super::{Constants, Definition, Domain, DynamicStiffness, Motion, Parameter, State, parameter};
use num_complex::Complex64;

/// f = k d + c v + m a, any sign.
pub(super) struct Linear;

impl Definition for Linear {
    const NAME: &'static str = "linear";
    const PARAMETERS: &'static [Parameter] = &[
        parameter("k", "N/m", Domain::Real),
        parameter("c", "N s/m", Domain::Real),
        parameter("m", "kg", Domain::Real),
    ];
    const LINEAR: bool = true;
    const INERTIAL: bool = true;

    #[inline(always)]
    fn step<T: Scalar>(c: &Constants<T>, _dt: f64, x: Motion<T>, s: &State<T>) -> (T, State<T>) {
        (c[0] * x.d + c[1] * x.v + c[2] * x.a, *s)
    }

    fn stored(c: &Constants<f64>, x: Motion<f64>, _s: &State<f64>) -> Option<f64> {
        Some(0.5 * (c[0] * x.d * x.d + c[2] * x.v * x.v))
    }

    fn stiffness_bound<T: Scalar>(p: &[T]) -> T {
        p[0]
    }

    fn dynamic_stiffness(p: &[f64], s: Complex64) -> Option<DynamicStiffness> {
        Some((p[0] + p[1] * s + p[2] * s * s, vec![1.0.into(), s, s * s]))
    }
}
