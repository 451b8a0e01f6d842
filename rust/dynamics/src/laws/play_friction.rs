//! Friction behind play: a dead zone after every reversal.

use super::dual::Scalar;
use super::{Constants, Definition, Domain, Motion, Parameter, State, parameter};

/// A Jenkins element (slip force f, spring kt) in series with a play of half width `gap`; state: (slider position).
///
/// After a reversal the spring unloads over f/kt, nothing resists over 2 gap, then the spring loads again until it slips
/// (a play operator in series with a stop: Visintin 1994). Without play it is the Jenkins element.
pub(super) struct PlayFriction;

/// Stretch of the spring, zero inside the play.
fn stretch<T: Scalar>(gap: T, e: T) -> T {
    if e.value() > gap.value() {
        e - gap
    } else if e.value() < -gap.value() {
        e + gap
    } else {
        T::constant(0.0)
    }
}

impl Definition for PlayFriction {
    const NAME: &'static str = "play_friction";
    const PARAMETERS: &'static [Parameter] = &[
        parameter("f", "N", Domain::NonNegative),
        parameter("kt", "N/m", Domain::Positive),
        parameter("gap", "m", Domain::NonNegative),
    ];
    const N_STATE: usize = 1;

    #[inline(always)]
    fn step<T: Scalar>(c: &Constants<T>, _dt: f64, x: Motion<T>, s: &State<T>) -> (T, State<T>) {
        let (slip, kt, gap) = (c[0], c[1], c[2]);
        let trial = kt * stretch(gap, x.d - s[0]);
        if trial.value().abs() <= slip.value() {
            return (trial, *s);
        }
        let turn = trial.value().signum();
        let mut new = *s;
        new[0] = x.d - (slip / kt + gap) * turn;
        (slip * turn, new)
    }

    fn stored(c: &Constants<f64>, x: Motion<f64>, s: &State<f64>) -> Option<f64> {
        Some(0.5 * c[1] * stretch(c[2], x.d - s[0]).powi(2))
    }

    fn stiffness_bound<T: Scalar>(p: &[T]) -> T {
        if p[0].value() > 0.0 { p[1] } else { T::constant(0.0) }
    }
}
