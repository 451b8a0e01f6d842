//! Generalised Maxwell (Wiechert) solid: a spring beside two or three Maxwell branches.

use super::dual::Scalar;
use super::viscoelastic::relaxed;
use super::{
    Constants, Definition, Domain, DynamicStiffness, MAX_CONSTANTS, Motion, Parameter, State, parameter,
};
use num_complex::Complex64;

/// f = k0 d + sum q_i, q_i' + q_i/tau_i = k_i v, with two branches (Wiechert 1893; Park and Schapery 1999).
pub(super) struct Maxwell2;
/// The same with three branches.
pub(super) struct Maxwell3;

const PARAMETERS: &[Parameter] = &[
    parameter("k0", "N/m", Domain::Real),
    parameter("k1", "N/m", Domain::NonNegative),
    parameter("tau1", "s", Domain::Positive),
    parameter("k2", "N/m", Domain::NonNegative),
    parameter("tau2", "s", Domain::Positive),
    parameter("k3", "N/m", Domain::NonNegative),
    parameter("tau3", "s", Domain::Positive),
];

/// (k0, then per branch: stiffness, decay over the step, force per displacement increment).
fn constants<T: Scalar>(p: &[T], dt: f64) -> Constants<T> {
    let mut c = [T::constant(0.0); MAX_CONSTANTS];
    c[0] = p[0];
    for (i, branch) in p[1..].chunks_exact(2).enumerate() {
        let h = T::constant(dt) / branch[1];
        c[1 + 3 * i] = branch[0];
        c[2 + 3 * i] = (-h).exp();
        c[3 + 3 * i] = branch[0] * relaxed(h);
    }
    c
}

/// State: (d, q_1, q_2, ...); exact for a displacement that is linear over the step.
fn step<T: Scalar>(branches: usize, c: &Constants<T>, x: Motion<T>, s: &State<T>) -> (T, State<T>) {
    let mut new = *s;
    let increment = x.d - s[0];
    let mut f = c[0] * x.d;
    new[0] = x.d;
    for i in 0..branches {
        new[1 + i] = c[2 + 3 * i] * s[1 + i] + c[3 + 3 * i] * increment;
        f = f + new[1 + i];
    }
    (f, new)
}

fn stored(branches: usize, c: &Constants<f64>, x: Motion<f64>, s: &State<f64>) -> f64 {
    let branch = |i: usize| if c[1 + 3 * i] > 0.0 { 0.5 * s[1 + i] * s[1 + i] / c[1 + 3 * i] } else { 0.0 };
    0.5 * c[0] * x.d * x.d + (0..branches).map(branch).sum::<f64>()
}

fn stiffness_bound<T: Scalar>(p: &[T]) -> T {
    p[1..].chunks_exact(2).fold(p[0], |sum, branch| sum + branch[0])
}

fn dynamic_stiffness(p: &[f64], s: Complex64) -> DynamicStiffness {
    let mut kappa = Complex64::from(p[0]);
    let mut slopes = vec![Complex64::from(1.0)];
    for branch in p[1..].chunks_exact(2) {
        let open = 1.0 + branch[1] * s;
        let ratio = branch[1] * s / open;
        kappa += branch[0] * ratio;
        slopes.extend([ratio, branch[0] * s / (open * open)]);
    }
    (kappa, slopes)
}

macro_rules! maxwell {
    ($law:ident, $name:literal, $branches:literal) => {
        impl Definition for $law {
            const NAME: &'static str = $name;
            const PARAMETERS: &'static [Parameter] = PARAMETERS.split_at(1 + 2 * $branches).0;
            const N_STATE: usize = 1 + $branches;
            const LINEAR: bool = true;

            fn constants<T: Scalar>(p: &[T], dt: f64) -> Constants<T> {
                constants(p, dt)
            }

            fn step<T: Scalar>(c: &Constants<T>, _dt: f64, x: Motion<T>, s: &State<T>) -> (T, State<T>) {
                step($branches, c, x, s)
            }

            fn stored(c: &Constants<f64>, x: Motion<f64>, s: &State<f64>) -> Option<f64> {
                Some(stored($branches, c, x, s))
            }

            fn stiffness_bound<T: Scalar>(p: &[T]) -> T {
                stiffness_bound(p)
            }

            fn dynamic_stiffness(p: &[f64], s: Complex64) -> Option<DynamicStiffness> {
                Some(dynamic_stiffness(p, s))
            }
        }
    };
}

maxwell!(Maxwell2, "generalised_maxwell", 2);
maxwell!(Maxwell3, "generalised_maxwell_3", 3);
