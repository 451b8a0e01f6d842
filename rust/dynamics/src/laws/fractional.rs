//! Fractional Kelvin-Voigt solid: a spring beside a springpot.

use super::dual::Scalar;
use super::viscoelastic::relaxed;
use super::{
    Constants, Definition, Domain, DynamicStiffness, MAX_CONSTANTS, Motion, Parameter, State, parameter,
};
use num_complex::Complex64;
use std::f64::consts::PI;

/// f = k d + c D^alpha d, kappa(s) = k + c s^alpha (Caputo and Mainardi 1971; Koeller 1984): alpha = 0 is a spring,
/// alpha = 1 a dashpot.
///
/// In time the springpot is a sum of exponentials: s^alpha = sin(pi alpha)/pi int_0^inf s/(s + x) x^(alpha-1) dx (Yuan
/// and Agrawal 2002), by the trapezoidal rule in ln x over nine rates from 1/31 000 of the step's Nyquist frequency pi/dt
/// up to it. What lies below them is one slow branch of the same weight and mean rate, what lies above a dashpot. The
/// stiffness is good to 0.5 % from 2e-4 to 0.1 of pi/dt; below that the springpot turns into a spring. State: (d, q_0
/// .. q_9), exact for
/// a displacement that is a parabola over the step (a straight line would see fast branches half a step late).
pub(super) struct Fractional;

/// Rates of the rule.
pub(super) const NODES: usize = 9;
/// With the slow branch.
const BRANCHES: usize = NODES + 1;
/// Step of ln x: the trapezoidal rule errs by exp(-pi^2 / LN_RATIO), 5e-4, on the imaginary axis.
pub(super) const LN_RATIO: f64 = 1.295;

/// Integral of exp(-h (1 - x)) (2 x - 1) over a step, by its series where the difference would cancel.
fn bent<T: Scalar>(h: T) -> T {
    if h.value() < 0.05 {
        return h / 6.0 - h * h / 12.0 + h * h * h / 40.0 - h * h * h * h / 180.0;
    }
    let left = (-h).exp();
    (-left + 1.0) / h - (-(h + 1.0) * left + 1.0) * 2.0 / (h * h)
}

/// What branch `i` needs at every step; `h` is the step in its relaxation times.
pub(super) fn branch<T: Scalar>(out: &mut Constants<T>, i: usize, stiffness: T, h: T) {
    out[2 + 4 * i] = (-h).exp();
    out[3 + 4 * i] = stiffness * relaxed(h);
    out[4 + 4 * i] = stiffness * bent(h);
    out[5 + 4 * i] = stiffness;
}

fn sin_pi<T: Scalar>(alpha: T) -> T {
    let (sin, cos) = (PI * alpha.value()).sin_cos();
    // sin(pi) is not quite zero in floating point; a dashpot has no branches
    let sin = if alpha.value() == 1.0 { 0.0 } else { sin };
    alpha.apply(sin, PI * cos)
}

/// Factors of the tails: sin(pi a)/(pi a) and sin(pi a)/(pi (1 - a)), finite at both ends.
fn tails<T: Scalar>(alpha: T) -> (T, T) {
    let over = |x: T| {
        let a = PI * x.value();
        if a.abs() < 1e-4 {
            x.apply(1.0 - a * a / 6.0, -PI * a / 3.0)
        } else {
            x.apply(a.sin() / a, PI * (a * a.cos() - a.sin()) / (a * a))
        }
    };
    (over(alpha), over(-alpha + 1.0))
}

impl Definition for Fractional {
    const NAME: &'static str = "fractional";
    const PARAMETERS: &'static [Parameter] = &[
        parameter("k", "N/m", Domain::Real),
        parameter("c", "N s^alpha/m", Domain::NonNegative),
        parameter("alpha", "-", Domain::Fraction),
    ];
    const N_STATE: usize = 1 + BRANCHES;
    const LINEAR: bool = true;

    fn constants<T: Scalar>(p: &[T], dt: f64) -> Constants<T> {
        let mut out = [T::constant(0.0); MAX_CONSTANTS];
        let (k, c, alpha) = (p[0], p[1], p[2]);
        let top = (PI / dt).ln();
        let bottom = top - LN_RATIO * (NODES - 1) as f64;
        let (low, high) = (bottom - 0.5 * LN_RATIO, top + 0.5 * LN_RATIO);
        let (below, above) = tails(alpha);
        out[0] = k;
        out[1] = c * above * ((alpha - 1.0) * high).exp();
        let slow = alpha / (alpha + 1.0) * (low.exp() * dt);
        branch(&mut out, 0, c * below * (alpha * low).exp(), slow);
        for i in 0..NODES {
            let u = bottom + LN_RATIO * i as f64;
            let stiffness = c * sin_pi(alpha) * (alpha * u).exp() * (LN_RATIO / PI);
            branch(&mut out, 1 + i, stiffness, T::constant(u.exp() * dt));
        }
        out
    }

    fn step<T: Scalar>(c: &Constants<T>, dt: f64, x: Motion<T>, s: &State<T>) -> (T, State<T>) {
        let mut new = *s;
        let increment = x.d - s[0];
        let bend = x.v * dt - increment;
        let mut f = c[0] * x.d + c[1] * x.v;
        new[0] = x.d;
        for i in 0..BRANCHES {
            new[1 + i] = c[2 + 4 * i] * s[1 + i] + c[3 + 4 * i] * increment + c[4 + 4 * i] * bend;
            f = f + new[1 + i];
        }
        (f, new)
    }

    fn stored(c: &Constants<f64>, x: Motion<f64>, s: &State<f64>) -> Option<f64> {
        let branch = |i: usize| {
            let stiffness = c[5 + 4 * i];
            if stiffness > 0.0 { 0.5 * s[1 + i] * s[1 + i] / stiffness } else { 0.0 }
        };
        Some(0.5 * c[0] * x.d * x.d + (0..BRANCHES).map(branch).sum::<f64>())
    }

    fn stiffness_bound<T: Scalar>(_p: &[T]) -> T {
        // it grows with frequency without bound; the simulation watches the slope itself
        T::constant(f64::INFINITY)
    }

    fn dynamic_stiffness(p: &[f64], s: Complex64) -> Option<DynamicStiffness> {
        if s.norm() == 0.0 {
            return Some((p[0].into(), vec![1.0.into(), 0.0.into(), 0.0.into()]));
        }
        let power = s.powf(p[2]);
        Some((p[0] + p[1] * power, vec![1.0.into(), power, p[1] * power * s.ln()]))
    }
}
