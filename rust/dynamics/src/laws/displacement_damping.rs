//! Damping that grows with displacement.

use super::dual::Scalar;
use super::{Constants, Definition, Domain, Motion, Parameter, State, parameter};

/// f = c (1 + beta d^2) v, the damping of van der Pol's equation (1926) without its negative part: geometric damping of dashpots that turn with the motion, squeeze films, wire rope.
pub(super) struct DisplacementDamping;

impl Definition for DisplacementDamping {
    const NAME: &'static str = "displacement_damping";
    const PARAMETERS: &'static [Parameter] =
        &[parameter("c", "N s/m", Domain::NonNegative), parameter("beta", "1/m^2", Domain::NonNegative)];

    #[inline(always)]
    fn step<T: Scalar>(c: &Constants<T>, _dt: f64, x: Motion<T>, s: &State<T>) -> (T, State<T>) {
        (c[0] * (c[1] * x.d * x.d + 1.0) * x.v, *s)
    }

    fn stored(_c: &Constants<f64>, _x: Motion<f64>, _s: &State<f64>) -> Option<f64> {
        Some(0.0)
    }

    fn stiffness_bound<T: Scalar>(_p: &[T]) -> T {
        T::constant(0.0)
    }
}
