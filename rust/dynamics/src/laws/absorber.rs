//! Tuned absorber: an oscillator attached to the coordinate.

use super::dual::Scalar;
use super::{
    Constants, Definition, Domain, DynamicStiffness, MAX_CONSTANTS, MAX_STATE, Motion, Parameter, State,
    parameter,
};
use crate::oscillator::exact_step;
use num_complex::Complex64;

/// Above this omega dt the attached mass moves with its base: no step resolves its own oscillation.
const RIGID: f64 = 2.5;

/// f = k (d - x) + c (v - x'), m x'' = f. State: (x, x', d, v); exact for a base motion whose pull is linear over the step.
pub(super) struct Absorber;

fn state<T: Scalar>(own: [T; 4]) -> State<T> {
    let mut s = [T::constant(0.0); MAX_STATE];
    s[..4].copy_from_slice(&own);
    s
}

impl Definition for Absorber {
    const NAME: &'static str = "tuned_absorber";
    const PARAMETERS: &'static [Parameter] = &[
        parameter("m", "kg", Domain::Positive),
        parameter("k", "N/m", Domain::Positive),
        parameter("c", "N s/m", Domain::NonNegative),
    ];
    const N_STATE: usize = 4;
    const LINEAR: bool = true;
    const INERTIAL: bool = true;

    fn constants<T: Scalar>(p: &[T], dt: f64) -> Constants<T> {
        let (stiffness, damping) = (p[1] / p[0], p[2] / p[0]);
        let mut c = [T::constant(0.0); MAX_CONSTANTS];
        c[0] = p[0];
        c[1] = p[1];
        c[2] = p[2];
        if stiffness.value().sqrt() * dt > RIGID {
            c[11] = T::constant(1.0);
            return c;
        }
        let step = exact_step(stiffness, damping, dt);
        [c[3], c[4], c[5], c[6]] = [step.a[0][0], step.a[0][1], step.a[1][0], step.a[1][1]];
        [c[7], c[8], c[9], c[10]] = [step.b0[0], step.b0[1], step.b1[0], step.b1[1]];
        c
    }

    #[inline(always)]
    fn step<T: Scalar>(c: &Constants<T>, _dt: f64, x: Motion<T>, s: &State<T>) -> (T, State<T>) {
        if c[11].value() > 0.0 {
            return (c[0] * x.a, state([x.d, x.v, x.d, x.v]));
        }
        let (m, k, damping) = (c[0], c[1], c[2]);
        let pull0 = (k * s[2] + damping * s[3]) / m;
        let pull1 = (k * x.d + damping * x.v) / m;
        let y = c[3] * s[0] + c[4] * s[1] + c[7] * pull0 + c[9] * pull1;
        let dy = c[5] * s[0] + c[6] * s[1] + c[8] * pull0 + c[10] * pull1;
        (k * (x.d - y) + damping * (x.v - dy), state([y, dy, x.d, x.v]))
    }

    fn stored(c: &Constants<f64>, x: Motion<f64>, s: &State<f64>) -> Option<f64> {
        let stretch = x.d - s[0];
        Some(0.5 * c[1] * stretch * stretch + 0.5 * c[0] * s[1] * s[1])
    }

    fn stiffness_bound<T: Scalar>(p: &[T]) -> T {
        p[1]
    }

    fn dynamic_stiffness(p: &[f64], s: Complex64) -> Option<DynamicStiffness> {
        let (inertia, link) = (p[0] * s * s, p[1] + p[2] * s);
        let sum = inertia + link;
        let dk = (inertia / sum).powi(2);
        Some((inertia * link / sum, vec![s * s * (link / sum).powi(2), dk, s * dk]))
    }
}
