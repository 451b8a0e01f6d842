//! Contact held closed by a static preload.

use super::dual::Scalar;
use super::{Constants, Definition, Domain, Motion, Parameter, State, parameter};

/// f = k d while the contact is closed, d side > -preload/k, and -side preload once it is open.
///
/// The force is that beside the static preload, which the structure at rest carries already: a gap of -preload/k in
/// Hertz-Signorini contact. With `preload` zero it is a bilinear stiffness with nothing on one side.
pub(super) struct Preloaded;

impl Definition for Preloaded {
    const NAME: &'static str = "preloaded_contact";
    const PARAMETERS: &'static [Parameter] = &[
        parameter("k", "N/m", Domain::NonNegative),
        parameter("preload", "N", Domain::NonNegative),
        parameter("side", "-", Domain::Side),
    ];

    #[inline(always)]
    fn step<T: Scalar>(c: &Constants<T>, _dt: f64, x: Motion<T>, s: &State<T>) -> (T, State<T>) {
        let (closed, side) = (c[0] * x.d, c[2].value());
        let open = closed.value() * side < -c[1].value();
        (if open { -c[1] * side } else { closed }, *s)
    }

    fn stored(c: &Constants<f64>, x: Motion<f64>, _s: &State<f64>) -> Option<f64> {
        let closed = c[0] * x.d * c[2];
        if closed >= -c[1] {
            return Some(0.5 * c[0] * x.d * x.d);
        }
        // from where it opens, the constant force goes on doing work
        let opening = c[1] / c[0];
        Some(0.5 * c[1] * opening + c[1] * (x.d.abs() - opening))
    }

    fn stiffness_bound<T: Scalar>(p: &[T]) -> T {
        p[0]
    }
}
