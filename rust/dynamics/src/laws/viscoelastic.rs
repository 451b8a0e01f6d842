//! Zener (standard linear) solid: stiffness that relaxes.

use super::dual::Scalar;
use super::{
    Constants, Definition, Domain, DynamicStiffness, MAX_CONSTANTS, Motion, Parameter, State, parameter,
};
use num_complex::Complex64;

/// f = k0 d + q, q' + q/tau = k1 v: static stiffness k0, and k0 + k1 far above 1/tau.
/// Exact for a displacement that is linear over the step. State: (q, d).
pub(super) struct Viscoelastic;

impl Definition for Viscoelastic {
    const NAME: &'static str = "viscoelastic";
    const PARAMETERS: &'static [Parameter] = &[
        parameter("k0", "N/m", Domain::Real),
        parameter("k1", "N/m", Domain::NonNegative),
        parameter("tau", "s", Domain::Positive),
    ];
    const N_STATE: usize = 2;
    const LINEAR: bool = true;

    fn constants<T: Scalar>(p: &[T], dt: f64) -> Constants<T> {
        let mut c = [T::constant(0.0); MAX_CONSTANTS];
        let h = T::constant(dt) / p[2];
        c[0] = p[0];
        c[1] = p[1];
        c[2] = (-h).exp();
        c[3] = p[1] * relaxed(h);
        c
    }

    #[inline(always)]
    fn step<T: Scalar>(c: &Constants<T>, _dt: f64, x: Motion<T>, s: &State<T>) -> (T, State<T>) {
        let q = c[2] * s[0] + c[3] * (x.d - s[1]);
        let mut new = *s;
        new[0] = q;
        new[1] = x.d;
        (c[0] * x.d + q, new)
    }

    fn stored(c: &Constants<f64>, x: Motion<f64>, s: &State<f64>) -> Option<f64> {
        let branch = if c[1] > 0.0 { 0.5 * s[0] * s[0] / c[1] } else { 0.0 };
        Some(0.5 * c[0] * x.d * x.d + branch)
    }

    fn stiffness_bound<T: Scalar>(p: &[T]) -> T {
        p[0] + p[1]
    }

    fn dynamic_stiffness(p: &[f64], s: Complex64) -> Option<DynamicStiffness> {
        let open = 1.0 + p[2] * s;
        let ratio = p[2] * s / open;
        Some((p[0] + p[1] * ratio, vec![1.0.into(), ratio, p[1] * s / (open * open)]))
    }
}

/// (1 - exp(-h)) / h, by its series where the difference would cancel.
pub(super) fn relaxed<T: Scalar>(h: T) -> T {
    if h.value() < 1e-3 {
        return T::constant(1.0) - h / 2.0 + h * h / 6.0 - h * h * h / 24.0 + h * h * h * h / 120.0;
    }
    (T::constant(1.0) - (-h).exp()) / h
}
