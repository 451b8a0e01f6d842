//! Hysteretic (structural) damping, frequency domain only.

use super::dual::Scalar;
use super::{Constants, Definition, Domain, DynamicStiffness, Motion, Parameter, State, parameter};
use num_complex::Complex64;

/// kappa = k (1 + i eta sgn(Im s)); not causal, so there is no force history.
pub(super) struct Structural;

impl Definition for Structural {
    const NAME: &'static str = "structural_damping";
    const PARAMETERS: &'static [Parameter] =
        &[parameter("k", "N/m", Domain::Real), parameter("eta", "-", Domain::Real)];
    const LINEAR: bool = true;

    // never reached: Law::prepare refuses a frequency-only law
    fn step<T: Scalar>(_c: &Constants<T>, _dt: f64, _x: Motion<T>, s: &State<T>) -> (T, State<T>) {
        (T::constant(f64::NAN), *s)
    }

    fn stored(_c: &Constants<f64>, _x: Motion<f64>, _s: &State<f64>) -> Option<f64> {
        None
    }

    fn stiffness_bound<T: Scalar>(p: &[T]) -> T {
        p[0]
    }

    fn dynamic_stiffness(p: &[f64], s: Complex64) -> Option<DynamicStiffness> {
        let turn = if s.im == 0.0 { 0.0 } else { s.im.signum() };
        let factor = Complex64::new(1.0, p[1] * turn);
        Some((p[0] * factor, vec![factor, Complex64::new(0.0, p[0] * turn)]))
    }
}
