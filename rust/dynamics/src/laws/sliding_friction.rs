//! Dry friction that creeps before it slides.

use super::dual::Scalar;
use super::{Constants, Definition, Domain, Motion, Parameter, State, parameter};

/// f tanh(v / v0): the slip force f, reached over speeds of v0, below which the contact creeps as a dashpot f / v0
/// (Andersson, Söderberg and Björklund 2007).
pub(super) struct SlidingFriction;

impl Definition for SlidingFriction {
    const NAME: &'static str = "sliding_friction";
    const PARAMETERS: &'static [Parameter] =
        &[parameter("f", "N", Domain::NonNegative), parameter("v0", "m/s", Domain::Positive)];

    #[inline(always)]
    fn step<T: Scalar>(c: &Constants<T>, _dt: f64, x: Motion<T>, s: &State<T>) -> (T, State<T>) {
        let speed = x.v / c[1];
        let share = speed.value().tanh();
        (c[0] * speed.apply(share, 1.0 - share * share), *s)
    }

    fn stored(_c: &Constants<f64>, _x: Motion<f64>, _s: &State<f64>) -> Option<f64> {
        Some(0.0)
    }

    fn stiffness_bound<T: Scalar>(_p: &[T]) -> T {
        T::constant(0.0)
    }
}
