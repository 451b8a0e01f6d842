//! Free-form restoring force: a smooth curve over displacement plus one over velocity.

use super::dual::Scalar;
use super::{Constants, Definition, Domain, MAX_CONSTANTS, Motion, Parameter, State, parameter};

/// f = S_d(d / d_span) + S_v(v / v_span): additive restoring-force surface (Masri and Caughey 1979, separable case).
///
/// Each S is a natural cubic spline (de Boor 1978, ch. IV), denser where a vibration spends its time: zero at rest,
/// continuous curvature, straight beyond its ends. `fd1..fd8` are the forces at -1, -0.7, -0.4, -0.15, 0.15, 0.4, 0.7, 1
/// of d_span, `fv1..fv6` those at -1, -0.5, -0.2, 0.2, 0.5, 1 of v_span; the force is linear in them.
pub(super) struct FreeForm;

/// Knots over displacement and over velocity, in units of the span.
const D_AT: [f64; 9] = [-1.0, -0.7, -0.4, -0.15, 0.0, 0.15, 0.4, 0.7, 1.0];
const V_AT: [f64; 7] = [-1.0, -0.5, -0.2, 0.0, 0.2, 0.5, 1.0];
/// Places of the constants: forces and second derivatives of the curve over d, those of the curve over v, the spans.
const OVER_D: std::ops::Range<usize> = 0..2 * D_AT.len();
const OVER_V: std::ops::Range<usize> = OVER_D.end..OVER_D.end + 2 * V_AT.len();
const SPANS: usize = OVER_V.end;

/// Forces, then second derivatives, at the knots of a curve from the forces beside rest.
fn curve<T: Scalar>(at: &[f64], forces: &[T], out: &mut [T]) {
    let (n, rest) = (at.len(), at.len() / 2);
    out[..rest].copy_from_slice(&forces[..rest]);
    out[rest + 1..n].copy_from_slice(&forces[rest..]);
    // h0 M0 + 2 (h0 + h1) M1 + h1 M2 = 6 (change of slope) at the inner knots, M = 0 at the ends (Thomas' elimination)
    let h = |i: usize| at[i + 1] - at[i];
    let mut pivot = [0.0; D_AT.len()];
    let mut rhs = [T::constant(0.0); D_AT.len()];
    for i in 1..n - 1 {
        let factor = if i > 1 { h(i - 1) / pivot[i - 1] } else { 0.0 };
        pivot[i] = 2.0 * (h(i - 1) + h(i)) - factor * h(i - 1);
        let change = (out[i + 1] - out[i]) / h(i) - (out[i] - out[i - 1]) / h(i - 1);
        rhs[i] = change * 6.0 - rhs[i - 1] * factor;
    }
    for i in (1..n - 1).rev() {
        out[n + i] = (rhs[i] - out[n + i + 1] * h(i)) / pivot[i];
    }
}

/// The curve at x, in spans.
fn value<T: Scalar>(at: &[f64], curve: &[T], x: T) -> T {
    let n = at.len();
    let (f, m) = curve.split_at(n);
    if x.value().abs() >= 1.0 {
        let (end, inner, turn) = if x.value() > 0.0 { (n - 1, n - 2, 1.0) } else { (0, 1, -1.0) };
        let h = (at[end] - at[inner]) * turn;
        let slope = ((f[end] - f[inner]) / h + m[inner] * (h / 6.0)) * turn;
        return f[end] + slope * (x - turn);
    }
    let i = at[1..n - 1].iter().take_while(|knot| **knot <= x.value()).count();
    let h = at[i + 1] - at[i];
    let t = (x - at[i]) / h;
    let u = -t + 1.0;
    u * f[i] + t * f[i + 1] + (u * (u * u - 1.0) * m[i] + t * (t * t - 1.0) * m[i + 1]) * (h * h / 6.0)
}

/// Integral of the curve from rest to x, in spans.
fn integral(at: &[f64], curve: &[f64], x: f64) -> f64 {
    // two Gauss points are exact for the cubic between knots, and for the straight line outside
    let turn = x.signum();
    let mut ends: Vec<f64> = at[at.len() / 2..].iter().copied().filter(|end| *end < x.abs()).collect();
    ends.push(x.abs());
    let gauss = 0.5 / 3.0_f64.sqrt();
    ends.windows(2)
        .map(|w| {
            let (middle, width) = (0.5 * (w[0] + w[1]), w[1] - w[0]);
            let at = |share: f64| value(at, curve, turn * (middle + share * width));
            0.5 * turn * width * (at(gauss) + at(-gauss))
        })
        .sum()
}

impl Definition for FreeForm {
    const NAME: &'static str = "free_form";
    const PARAMETERS: &'static [Parameter] = &[
        parameter("fd1", "N", Domain::Real),
        parameter("fd2", "N", Domain::Real),
        parameter("fd3", "N", Domain::Real),
        parameter("fd4", "N", Domain::Real),
        parameter("fd5", "N", Domain::Real),
        parameter("fd6", "N", Domain::Real),
        parameter("fd7", "N", Domain::Real),
        parameter("fd8", "N", Domain::Real),
        parameter("fv1", "N", Domain::Real),
        parameter("fv2", "N", Domain::Real),
        parameter("fv3", "N", Domain::Real),
        parameter("fv4", "N", Domain::Real),
        parameter("fv5", "N", Domain::Real),
        parameter("fv6", "N", Domain::Real),
        parameter("d_span", "m", Domain::Positive),
        parameter("v_span", "m/s", Domain::Positive),
    ];

    fn constants<T: Scalar>(p: &[T], _dt: f64) -> Constants<T> {
        let mut c = [T::constant(0.0); MAX_CONSTANTS];
        curve(&D_AT, &p[..8], &mut c[OVER_D]);
        curve(&V_AT, &p[8..14], &mut c[OVER_V]);
        c[SPANS] = p[14];
        c[SPANS + 1] = p[15];
        c
    }

    fn step<T: Scalar>(c: &Constants<T>, _dt: f64, x: Motion<T>, s: &State<T>) -> (T, State<T>) {
        let over_d = value(&D_AT, &c[OVER_D], x.d / c[SPANS]);
        let over_v = value(&V_AT, &c[OVER_V], x.v / c[SPANS + 1]);
        (over_d + over_v, *s)
    }

    fn stored(c: &Constants<f64>, x: Motion<f64>, _s: &State<f64>) -> Option<f64> {
        Some(c[SPANS] * integral(&D_AT, &c[OVER_D], x.d / c[SPANS]))
    }

    fn stiffness_bound<T: Scalar>(_p: &[T]) -> T {
        // not known without looking through the spline; the simulation watches the slope itself
        T::constant(f64::INFINITY)
    }
}
