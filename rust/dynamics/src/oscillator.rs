//! Exact step of one linear oscillator under a force that is linear over the step.

use crate::laws::dual::Scalar;

/// Step of q'' + damping q' + stiffness q = p (unit mass) over `dt`, p linear from p0 to p1:
/// `[q1, v1] = a [q0, v0] + b0 p0 + b1 p1`.
#[derive(Clone, Copy, Debug)]
pub struct Step<T> {
    /// Homogeneous transition of (displacement, velocity).
    pub a: [[T; 2]; 2],
    /// Effect of the force at the start of the step on (displacement, velocity).
    pub b0: [T; 2],
    /// Effect of the force at the end of the step on (displacement, velocity).
    pub b1: [T; 2],
}

type Square<T> = [[T; 4]; 4];

fn product<T: Scalar>(x: &Square<T>, y: &Square<T>) -> Square<T> {
    std::array::from_fn(|i| {
        std::array::from_fn(|j| (0..4).fold(T::constant(0.0), |sum, k| sum + x[i][k] * y[k][j]))
    })
}

/// Coefficients by the matrix exponential of the oscillator joined with its linear force (Van Loan 1978), by scaling
/// and squaring; the same for free, light, critical and heavy damping and for stiffness zero.
///
/// `stiffness` = omega^2 in 1/s^2, `damping` = 2 zeta omega in 1/s, `dt` in s.
pub fn exact_step<T: Scalar>(stiffness: T, damping: T, dt: f64) -> Step<T> {
    let zero = T::constant(0.0);
    let one = T::constant(1.0);
    // time in units of dt, so that the entries are of the same size
    let (k, c) = (stiffness * (dt * dt), damping * dt);
    let size = 1.0 + k.value().abs() + c.value().abs();
    let halvings = (size / 0.125).log2().ceil().max(0.0) as i32;
    let scale = 0.5_f64.powi(halvings);
    let m: Square<T> = [
        [zero, one * scale, zero, zero],
        [-k * scale, -c * scale, one * scale, zero],
        [zero, zero, zero, one * scale],
        [zero; 4],
    ];
    let identity: Square<T> =
        std::array::from_fn(|i| std::array::from_fn(|j| if i == j { one } else { zero }));
    // Horner form of the Taylor series; 0.125^10 / 10! is below rounding
    let mut e = identity;
    for order in (1..=9).rev() {
        let next = product(&m, &e);
        e = std::array::from_fn(|i| std::array::from_fn(|j| identity[i][j] + next[i][j] / f64::from(order)));
    }
    for _ in 0..halvings {
        e = product(&e, &e);
    }
    let (h, h2) = (dt, dt * dt);
    Step {
        a: [[e[0][0], e[0][1] * h], [e[1][0] / h, e[1][1]]],
        b0: [(e[0][2] - e[0][3]) * h2, (e[1][2] - e[1][3]) * h],
        b1: [e[0][3] * h2, e[1][3] * h],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn free_mass_is_the_polynomial() {
        let s = exact_step(0.0, 0.0, 0.5);
        assert_eq!(s.a, [[1.0, 0.5], [0.0, 1.0]]);
        assert!((s.b0[0] - 0.25 / 3.0).abs() < 1e-16 && (s.b1[0] - 0.25 / 6.0).abs() < 1e-16);
        assert!((s.b0[1] - 0.25).abs() < 1e-16 && (s.b1[1] - 0.25).abs() < 1e-16);
    }

    #[test]
    fn damped_transition_is_the_closed_form() {
        for (omega, zeta, dt) in [(3.0_f64, 0.02_f64, 0.1_f64), (200.0, 0.3, 0.01), (1e3, 1e-3, 2e-3)] {
            let s = exact_step(omega * omega, 2.0 * zeta * omega, dt);
            let wd = omega * (1.0 - zeta * zeta).sqrt();
            let (decay, sin, cos) = ((-zeta * omega * dt).exp(), (wd * dt).sin(), (wd * dt).cos());
            let a00 = decay * (cos + zeta * omega / wd * sin);
            let a01 = decay * sin / wd;
            let a11 = decay * (cos - zeta * omega / wd * sin);
            // squaring loses a few digits where omega dt is large
            assert!((s.a[0][0] - a00).abs() < 1e-13 && (s.a[1][1] - a11).abs() < 1e-13);
            assert!((s.a[0][1] - a01).abs() < 1e-13 / omega);
            // a constant force keeps its static displacement: q = p / omega^2
            let rest = s.a[0][0] / (omega * omega) + s.b0[0] + s.b1[0];
            assert!((rest * omega * omega - 1.0).abs() < 1e-12);
        }
    }
}
