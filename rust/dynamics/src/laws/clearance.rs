//! Contact after a gap, on one side or both.

use super::dual::Scalar;
use super::{Constants, Definition, Domain, Motion, Parameter, State, parameter};

/// f = k (d - gap) above +gap (sides +1 or 2), k (d + gap) below -gap (sides -1 or 2), zero between.
pub(super) struct Clearance;

/// Depth of contact, signed, zero inside the gap.
fn depth<T: Scalar>(gap: T, sides: f64, d: T) -> T {
    if sides > 0.0 && d.value() > gap.value() {
        d - gap
    } else if sides != 1.0 && d.value() < -gap.value() {
        d + gap
    } else {
        T::constant(0.0)
    }
}

impl Definition for Clearance {
    const NAME: &'static str = "clearance";
    const PARAMETERS: &'static [Parameter] = &[
        parameter("k", "N/m", Domain::NonNegative),
        parameter("gap", "m", Domain::NonNegative),
        parameter("sides", "-", Domain::Sides),
    ];

    #[inline(always)]
    fn step<T: Scalar>(c: &Constants<T>, _dt: f64, x: Motion<T>, s: &State<T>) -> (T, State<T>) {
        (c[0] * depth(c[1], c[2].value(), x.d), *s)
    }

    fn stored(c: &Constants<f64>, x: Motion<f64>, _s: &State<f64>) -> Option<f64> {
        Some(0.5 * c[0] * depth(c[1], c[2], x.d).powi(2))
    }

    fn stiffness_bound<T: Scalar>(p: &[T]) -> T {
        p[0]
    }
}
