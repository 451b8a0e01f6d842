//! Smooth hysteresis of Bouc and Wen.

use super::dual::Scalar;
use super::{Constants, Definition, Domain, MAX_CONSTANTS, Motion, Parameter, State, parameter};

/// f = k (alpha d + (1 - alpha) z), z' = v - |z|^n (beta |v| sgn(z) + gamma v).
///
/// (Wen 1976 with A = 1, so that k is the slope at rest, alpha the share of it left after yield, and z a displacement
/// bounded by (beta + gamma)^(-1/n), the yield displacement.) beta > 0 and -beta < gamma <= beta make every closed loop
/// dissipate (Erlicher and Point 2004). The law is rate independent: z is integrated over the increment of d by
/// fourth-order Runge-Kutta in as many parts as the increment asks for. State: (z, d).
pub(super) struct BoucWen;

/// Parts of the yield displacement taken in one go.
const PART: f64 = 0.5;
/// Share of its bound from which z has reached it.
const THERE: f64 = 1.0 - 1e-9;
/// Beyond this many parts z has long reached its bound.
const MAX_PARTS: f64 = 64.0;

impl Definition for BoucWen {
    const NAME: &'static str = "bouc_wen";
    const PARAMETERS: &'static [Parameter] = &[
        parameter("k", "N/m", Domain::NonNegative),
        parameter("alpha", "-", Domain::Fraction),
        parameter("n", "-", Domain::AtLeastOne),
        parameter("beta", "1/m^n", Domain::Positive),
        parameter("gamma", "1/m^n", Domain::Real),
    ];
    const N_STATE: usize = 2;

    fn check(p: &[f64]) -> Option<(usize, &'static str)> {
        let admissible = -p[3] < p[4] && p[4] <= p[3];
        (!admissible).then_some((4, "more than -beta and at most beta, or a closed loop could create energy"))
    }

    fn constants<T: Scalar>(p: &[T], _dt: f64) -> Constants<T> {
        let mut c = [T::constant(0.0); MAX_CONSTANTS];
        c[..5].copy_from_slice(p);
        c[5] = (-(p[3] + p[4]).ln() / p[2]).exp();
        c
    }

    #[inline(always)]
    fn step<T: Scalar>(c: &Constants<T>, _dt: f64, x: Motion<T>, s: &State<T>) -> (T, State<T>) {
        let (k, alpha) = (c[0], c[1]);
        let z = advance(c, s[0], x.d - s[1]);
        let mut new = *s;
        new[0] = z;
        new[1] = x.d;
        (k * (alpha * x.d + (T::constant(1.0) - alpha) * z), new)
    }

    fn known_slope(c: &Constants<f64>, d: f64, s: &State<f64>) -> Option<(f64, f64, State<f64>)> {
        let (k, alpha) = (c[0], c[1]);
        let increment = d - s[1];
        let z = advance(c, s[0], increment);
        let mut new = *s;
        new[0] = z;
        new[1] = d;
        // where z is at its bound it stays there, whatever the increment
        let held = z.abs() >= c[5];
        let rate = if held { 0.0 } else { rate(c, z, sign(increment)) };
        Some((k * (alpha * d + (1.0 - alpha) * z), k * (alpha + (1.0 - alpha) * rate), new))
    }

    fn stored(_c: &Constants<f64>, _x: Motion<f64>, _s: &State<f64>) -> Option<f64> {
        None
    }

    fn stiffness_bound<T: Scalar>(p: &[T]) -> T {
        // unloading is stiffer than k where gamma < 0: dz/dd = 1 + |z|^n (beta - gamma) at the bound of z
        let (alpha, beta, gamma) = (p[1], p[3], p[4]);
        let steepest = beta * 2.0 / (beta + gamma);
        let slope = if steepest.value() > 1.0 { steepest } else { T::constant(1.0) };
        p[0] * (alpha + (T::constant(1.0) - alpha) * slope)
    }
}

fn sign(x: f64) -> f64 {
    if x > 0.0 {
        1.0
    } else if x < 0.0 {
        -1.0
    } else {
        0.0
    }
}

/// dz/dd where the displacement moves towards the sign `turn`.
#[inline(always)]
fn rate<T: Scalar>(c: &Constants<T>, z: T, turn: f64) -> T {
    let (n, beta, gamma) = (c[2], c[3], c[4]);
    T::constant(1.0) - z.abs_pow(n) * (beta * sign(z.value() * turn) + gamma)
}

/// z after the displacement moved by `increment`.
#[inline(always)]
fn advance<T: Scalar>(c: &Constants<T>, z: T, increment: T) -> T {
    let (n, beta, gamma, bound) = (c[2].value(), c[3].value(), c[4].value(), c[5]);
    let turn = sign(increment.value());
    // z comes back from its bound as much steeper as gamma is near -beta, and never goes towards it steeper than n
    let back = z.value() * turn < 0.0;
    let steep = if back { n.max(2.0 * beta / (beta + gamma)) } else { n };
    let parts = (increment.value().abs() / bound.value() * steep / PART).ceil();
    if parts > MAX_PARTS {
        return bound * turn;
    }
    let parts = parts.max(1.0);
    let h = increment / parts;
    let mut z = z;
    for _ in 0..parts as usize {
        if z.value() * turn >= THERE * bound.value() {
            return bound * turn; // and stays there
        }
        let k1 = rate(c, z, turn);
        let k2 = rate(c, z + h * k1 / 2.0, turn);
        let k3 = rate(c, z + h * k2 / 2.0, turn);
        let k4 = rate(c, z + h * k3, turn);
        z = z + h * (k1 + (k2 + k3) * 2.0 + k4) / 6.0;
        if z.value().abs() > bound.value() {
            z = bound * z.value().signum();
        }
    }
    z
}
