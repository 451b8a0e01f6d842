//! Contact of curved bodies.

use super::dual::Scalar;
use super::{Constants, Definition, Domain, Motion, Parameter, State, parameter};

/// f = k (|d| - gap)^(3/2) towards rest, on the sides in contact (Hertz 1882; Johnson 1985, eq. 4.23: a sphere on a half
/// space has k = 4/3 E* sqrt(R)).
pub(super) struct Hertz;

impl Definition for Hertz {
    const NAME: &'static str = "hertz_contact";
    const PARAMETERS: &'static [Parameter] = &[
        parameter("k", "N/m^1.5", Domain::NonNegative),
        parameter("gap", "m", Domain::NonNegative),
        parameter("sides", "-", Domain::Sides),
    ];

    #[inline(always)]
    fn step<T: Scalar>(c: &Constants<T>, _dt: f64, x: Motion<T>, s: &State<T>) -> (T, State<T>) {
        let sides = c[2].value();
        let turn = x.d.value().signum();
        let deep = x.d.value().abs() > c[1].value() && (sides == 2.0 || sides == turn);
        if !deep {
            return (T::constant(0.0), *s);
        }
        let depth = x.d.abs() - c[1];
        (c[0] * depth.abs_pow(T::constant(1.5)) * turn, *s)
    }

    fn stored(c: &Constants<f64>, x: Motion<f64>, _s: &State<f64>) -> Option<f64> {
        let touching = c[2] == 2.0 || c[2] == x.d.signum();
        let depth = if touching { (x.d.abs() - c[1]).max(0.0) } else { 0.0 };
        Some(0.4 * c[0] * depth.powf(2.5))
    }

    fn stiffness_bound<T: Scalar>(_p: &[T]) -> T {
        T::constant(f64::INFINITY)
    }
}
