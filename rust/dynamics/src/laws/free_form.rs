//! Free-form restoring force: a smooth curve over displacement plus one over velocity.

use super::dual::Scalar;
use super::{Constants, Definition, Domain, MAX_CONSTANTS, Motion, Parameter, State, parameter};

/// f = S_d(d / d_span) + S_v(v / v_span): additive restoring-force surface (Masri and Caughey 1979, separable case).
///
/// Each S is the natural cubic spline (de Boor 1978, ch. IV) through forces at -1, -2/3, -1/3, 0, 1/3, 2/3, 1 of its
/// span: zero at rest, continuous curvature, straight beyond its ends. `fd1..fd6` and `fv1..fv6` are the forces at the
/// six knots beside rest from the negative to the positive end; the force is linear in them.
pub(super) struct FreeForm;

/// Knots of a curve with the one at rest.
const KNOTS: usize = 7;
/// Where a curve's constants begin: forces (7), then second derivatives (7), in units of the knot distance.
const CURVES: [usize; 2] = [0, 2 * KNOTS];
/// Where the knots' distances stand.
const SPACING: usize = 4 * KNOTS;

/// Forces and second derivatives at the knots of a curve from the six forces beside rest.
fn curve<T: Scalar>(forces: &[T]) -> [T; 2 * KNOTS] {
    let zero = T::constant(0.0);
    let mut out = [zero; 2 * KNOTS];
    out[..3].copy_from_slice(&forces[..3]);
    out[4..KNOTS].copy_from_slice(&forces[3..6]);
    // [1 4 1] M = 6 (f_{i+1} - 2 f_i + f_{i-1}) at the inner knots, M = 0 at the ends (Thomas' elimination)
    let mut pivot = [0.0; KNOTS];
    let mut rhs = [zero; KNOTS];
    for i in 1..KNOTS - 1 {
        let factor = if i > 1 { 1.0 / pivot[i - 1] } else { 0.0 };
        pivot[i] = 4.0 - factor;
        rhs[i] = (out[i + 1] - out[i] * 2.0 + out[i - 1]) * 6.0 - rhs[i - 1] * factor;
    }
    for i in (1..KNOTS - 1).rev() {
        out[KNOTS + i] = (rhs[i] - out[KNOTS + i + 1]) / pivot[i];
    }
    out
}

/// The curve at x, in knot distances from rest.
fn value<T: Scalar>(curve: &[T], x: T) -> T {
    let half = (KNOTS / 2) as f64;
    let (f, m) = curve.split_at(KNOTS);
    if x.value().abs() >= half {
        let (end, inner, turn) = if x.value() > 0.0 { (KNOTS - 1, KNOTS - 2, 1.0) } else { (0, 1, -1.0) };
        let slope = (f[end] - f[inner] + m[inner] / 6.0) * turn;
        return f[end] + slope * (x - half * turn);
    }
    let i = (x.value() + half).floor().clamp(0.0, (KNOTS - 2) as f64) as usize;
    let t = x - (i as f64 - half);
    let u = -t + 1.0;
    u * f[i] + t * f[i + 1] + (u * (u * u - 1.0) * m[i] + t * (t * t - 1.0) * m[i + 1]) / 6.0
}

/// Integral of the curve from rest to x, in knot distances.
fn integral(curve: &[f64], x: f64) -> f64 {
    // two Gauss points are exact for the cubic between knots, and for the straight line outside
    let (half, turn) = ((KNOTS / 2) as f64, x.signum());
    let mut ends: Vec<f64> = (0..=KNOTS / 2).map(|i| i as f64).filter(|end| *end < x.abs()).collect();
    ends.push(x.abs());
    debug_assert!(half > 0.0);
    let gauss = 0.5 / 3.0_f64.sqrt();
    ends.windows(2)
        .map(|w| {
            let (middle, width) = (0.5 * (w[0] + w[1]), w[1] - w[0]);
            let at = |share: f64| value(curve, turn * (middle + share * width));
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
        for (curve_at, forces) in CURVES.into_iter().zip(p.chunks_exact(6)) {
            c[curve_at..curve_at + 2 * KNOTS].copy_from_slice(&curve(forces));
        }
        let per_span = (KNOTS / 2) as f64;
        c[SPACING] = p[12] / per_span;
        c[SPACING + 1] = p[13] / per_span;
        c
    }

    fn step<T: Scalar>(c: &Constants<T>, _dt: f64, x: Motion<T>, s: &State<T>) -> (T, State<T>) {
        let over_d = value(&c[CURVES[0]..CURVES[1]], x.d / c[SPACING]);
        let over_v = value(&c[CURVES[1]..SPACING], x.v / c[SPACING + 1]);
        (over_d + over_v, *s)
    }

    fn stored(c: &Constants<f64>, x: Motion<f64>, _s: &State<f64>) -> Option<f64> {
        Some(c[SPACING] * integral(&c[CURVES[0]..CURVES[1]], x.d / c[SPACING]))
    }

    fn stiffness_bound<T: Scalar>(_p: &[T]) -> T {
        // not known without looking through the spline; the simulation watches the slope itself
        T::constant(f64::INFINITY)
    }
}
