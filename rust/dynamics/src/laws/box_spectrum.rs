//! Maxwell branches of one stiffness at all rates above one: a loss that hardly changes with frequency.

use super::dual::Scalar;
use super::fractional::{Fractional, LN_RATIO, NODES, branch};
use super::{
    Constants, Definition, Domain, DynamicStiffness, MAX_CONSTANTS, Motion, Parameter, State, parameter,
};
use num_complex::Complex64;
use std::f64::consts::PI;

/// kappa(s) = c int s/(s + x) dx/x over x > 1/tau = c ln(1 + s tau): relaxation rates spread evenly over ln x, from 1/tau
/// up (the box distribution of Neubert, Aeronautical Quarterly 14 (1963) 187; Fung, Biomechanics, 1981, ch. 7.6, with
/// its fast end far above the band). Above 1/tau the loss is c pi/2 at every frequency, while the stiffness
/// c ln(omega tau) grows as causality asks: constant structural damping by a force that follows from the past alone.
///
/// In time the integral is a Gauss rule in ln x over the rates that `fractional` has; what lies below them is one slow
/// branch, what lies above a dashpot. State as `fractional`.
pub(super) struct BoxSpectrum;

/// Nodes and weights of the rule of nine points on (-1, 1) (Abramowitz and Stegun 1964, table 25.4).
const RULE: [(f64, f64); NODES] = [
    (-0.968_160_239_507_626_1, 0.081_274_388_361_574_4),
    (-0.836_031_107_326_635_8, 0.180_648_160_694_857_4),
    (-0.613_371_432_700_590_4, 0.260_610_696_402_935_4),
    (-0.324_253_423_403_808_9, 0.312_347_077_040_002_9),
    (0.0, 0.330_239_355_001_259_8),
    (0.324_253_423_403_808_9, 0.312_347_077_040_002_9),
    (0.613_371_432_700_590_4, 0.260_610_696_402_935_4),
    (0.836_031_107_326_635_8, 0.180_648_160_694_857_4),
    (0.968_160_239_507_626_1, 0.081_274_388_361_574_4),
];

impl Definition for BoxSpectrum {
    const NAME: &'static str = "box_spectrum";
    const PARAMETERS: &'static [Parameter] =
        &[parameter("c", "N/m", Domain::NonNegative), parameter("tau", "s", Domain::Positive)];
    const N_STATE: usize = Fractional::N_STATE;
    const LINEAR: bool = true;

    fn constants<T: Scalar>(p: &[T], dt: f64) -> Constants<T> {
        let mut out = [T::constant(0.0); MAX_CONSTANTS];
        let (c, slowest) = (p[0], -p[1].ln());
        let high = (PI / dt).ln() + 0.5 * LN_RATIO;
        let low = T::constant(high - LN_RATIO * NODES as f64);
        let within = slowest.value() > low.value();
        let from = if within { slowest } else { low };
        let top = if from.value() < high { T::constant(high) } else { from };
        out[1] = c * (-top).exp();
        let zero = T::constant(0.0);
        let below = if within { zero } else { low - slowest };
        let mean = if within { zero } else { (low.exp() - slowest.exp()) / below };
        branch(&mut out, 0, c * below, mean * dt);
        let half = (top - from) * 0.5;
        for (i, (at, weight)) in RULE.into_iter().enumerate() {
            branch(&mut out, 1 + i, c * half * weight, (from + half * (1.0 + at)).exp() * dt);
        }
        out
    }

    fn step<T: Scalar>(c: &Constants<T>, dt: f64, x: Motion<T>, s: &State<T>) -> (T, State<T>) {
        Fractional::step(c, dt, x, s)
    }

    fn stored(c: &Constants<f64>, x: Motion<f64>, s: &State<f64>) -> Option<f64> {
        Fractional::stored(c, x, s)
    }

    fn stiffness_bound<T: Scalar>(_p: &[T]) -> T {
        // it grows with frequency without bound; the simulation watches the slope itself
        T::constant(f64::INFINITY)
    }

    fn dynamic_stiffness(p: &[f64], s: Complex64) -> Option<DynamicStiffness> {
        let x = 1.0 + s * p[1];
        let power = x.ln();
        Some((p[0] * power, vec![power, p[0] * s / x]))
    }
}
