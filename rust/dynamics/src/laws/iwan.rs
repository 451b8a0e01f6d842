//! Hysteretic surrogate: parallel Jenkins elements with a fixed grid of yield displacements.

use super::dual::Scalar;
use super::{Constants, Definition, Domain, Motion, Parameter, State, parameter};

/// f = sum k_i (d - s_i), each slider s_i dragged along once |d - s_i| = span GRID_i (Iwan 1966, the parallel-series
/// model, with slopes k_i instead of a yield distribution). State: (s_1, ..., s_6).
///
/// Linear in the slopes, so that any rate-independent hysteresis of Masing type up to `span` is fitted by non-negative
/// least squares; beyond `span` every element slips.
pub(super) struct Iwan;

/// Elements.
const ELEMENTS: usize = 6;
/// Yield displacements as shares of `span`.
pub(super) const GRID: [f64; ELEMENTS] = [0.03125, 0.0625, 0.125, 0.25, 0.5, 1.0];

impl Definition for Iwan {
    const NAME: &'static str = "iwan";
    const PARAMETERS: &'static [Parameter] = &[
        parameter("k1", "N/m", Domain::NonNegative),
        parameter("k2", "N/m", Domain::NonNegative),
        parameter("k3", "N/m", Domain::NonNegative),
        parameter("k4", "N/m", Domain::NonNegative),
        parameter("k5", "N/m", Domain::NonNegative),
        parameter("k6", "N/m", Domain::NonNegative),
        parameter("span", "m", Domain::Positive),
    ];
    const N_STATE: usize = ELEMENTS;

    fn step<T: Scalar>(c: &Constants<T>, _dt: f64, x: Motion<T>, s: &State<T>) -> (T, State<T>) {
        let mut new = *s;
        let mut f = T::constant(0.0);
        for i in 0..ELEMENTS {
            let (stretch, limit) = (x.d - s[i], c[ELEMENTS] * GRID[i]);
            if stretch.value().abs() <= limit.value() {
                f = f + c[i] * stretch;
                continue;
            }
            let held = limit * stretch.value().signum();
            new[i] = x.d - held;
            f = f + c[i] * held;
        }
        (f, new)
    }

    fn known_slope(c: &Constants<f64>, d: f64, s: &State<f64>) -> Option<(f64, f64, State<f64>)> {
        let (mut f, mut slope, mut new) = (0.0, 0.0, *s);
        for i in 0..ELEMENTS {
            let (stretch, limit) = (d - s[i], c[ELEMENTS] * GRID[i]);
            if stretch.abs() <= limit {
                f += c[i] * stretch;
                slope += c[i];
                continue;
            }
            let held = limit * stretch.signum();
            new[i] = d - held;
            f += c[i] * held;
        }
        Some((f, slope, new))
    }

    fn stored(c: &Constants<f64>, x: Motion<f64>, s: &State<f64>) -> Option<f64> {
        Some((0..ELEMENTS).map(|i| 0.5 * c[i] * (x.d - s[i]).powi(2)).sum())
    }

    fn stiffness_bound<T: Scalar>(p: &[T]) -> T {
        p[1..ELEMENTS].iter().fold(p[0], |sum, k| sum + *k)
    }
}
