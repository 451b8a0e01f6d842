//! Springpot: a stiffness that grows with a power of frequency, with the same loss factor at every frequency.

use super::dual::Scalar;
use super::fractional::Fractional;
use super::{Constants, Definition, Domain, DynamicStiffness, Motion, Parameter, State, parameter};
use num_complex::Complex64;

/// f = c D^alpha d, kappa(s) = c s^alpha (Scott Blair 1947): what constant structural damping is where the force follows
/// from the past alone (Kjartansson, J. Geophys. Res. 84 (1979) 4737, eq. 10). The loss factor is tan(pi alpha / 2). In
/// time as `fractional` without its spring.
pub(super) struct Springpot;

/// Parameters of `fractional` with a spring of nothing.
fn beside_nothing<T: Scalar>(p: &[T]) -> [T; 3] {
    [T::constant(0.0), p[0], p[1]]
}

impl Definition for Springpot {
    const NAME: &'static str = "springpot";
    const PARAMETERS: &'static [Parameter] =
        &[parameter("c", "N s^alpha/m", Domain::NonNegative), parameter("alpha", "-", Domain::Fraction)];
    const N_STATE: usize = Fractional::N_STATE;
    const LINEAR: bool = true;

    fn constants<T: Scalar>(p: &[T], dt: f64) -> Constants<T> {
        Fractional::constants(&beside_nothing(p), dt)
    }

    fn step<T: Scalar>(c: &Constants<T>, dt: f64, x: Motion<T>, s: &State<T>) -> (T, State<T>) {
        Fractional::step(c, dt, x, s)
    }

    fn stored(c: &Constants<f64>, x: Motion<f64>, s: &State<f64>) -> Option<f64> {
        Fractional::stored(c, x, s)
    }

    fn stiffness_bound<T: Scalar>(p: &[T]) -> T {
        Fractional::stiffness_bound(&beside_nothing(p))
    }

    fn dynamic_stiffness(p: &[f64], s: Complex64) -> Option<DynamicStiffness> {
        let (kappa, by) = Fractional::dynamic_stiffness(&beside_nothing(p), s)?;
        Some((kappa, by[1..].to_vec()))
    }
}
