//! Harmonics of the laws' force from those of the motion, by way of samples of a period.
//!
//! A real series is held as (x_0, c_1, s_1, c_2, s_2, ...): x(t) = x_0 + sum c_n cos(n w t) + s_n sin(n w t).

use crate::laws::{Joint, Linearised, MAX_STATE, Motion};
use std::f64::consts::TAU;

/// Cosines and sines of a period, and how states are settled.
#[derive(Debug)]
pub(super) struct Aft {
    samples: usize,
    settling: usize,
    /// Number of coefficients, 2 H + 1.
    size: usize,
    /// Series (samples, size) and its first and second derivatives over w t.
    basis: Vec<f64>,
    slope: Vec<f64>,
    bend: Vec<f64>,
}

/// Force coefficients (size), and their derivatives (size, size) row by row where asked for.
#[derive(Debug)]
pub(super) struct Harmonics {
    pub(super) f: Vec<f64>,
    pub(super) df: Vec<f64>,
}

impl Aft {
    pub(super) fn new(harmonics: usize, samples: usize, settling: usize) -> Self {
        let size = 2 * harmonics + 1;
        let mut out =
            Self { samples, settling, size, basis: Vec::new(), slope: Vec::new(), bend: Vec::new() };
        for k in 0..samples {
            out.basis.push(1.0);
            out.slope.push(0.0);
            out.bend.push(0.0);
            for n in 1..=harmonics {
                // whole turns are taken off before they are rounded
                let (sin, cos) = (TAU * ((n * k) % samples) as f64 / samples as f64).sin_cos();
                let order = n as f64;
                out.basis.extend([cos, sin]);
                out.slope.extend([-order * sin, order * cos]);
                out.bend.extend([-order * order * cos, -order * order * sin]);
            }
        }
        out
    }

    /// Step of the samples at a circular frequency, s.
    pub(super) fn step(&self, omega: f64) -> f64 {
        TAU / (omega * self.samples as f64)
    }

    fn row<'a>(&self, table: &'a [f64], k: usize) -> &'a [f64] {
        &table[k * self.size..(k + 1) * self.size]
    }

    fn motion(&self, x: &[f64], omega: f64, k: usize) -> Motion<f64> {
        let along = |table: &[f64]| self.row(table, k).iter().zip(x).map(|(b, x)| b * x).sum::<f64>();
        Motion { d: along(&self.basis), v: omega * along(&self.slope), a: omega * omega * along(&self.bend) }
    }

    /// Derivatives (size) of the motion at sample `k` over the coefficient `m`.
    fn moved(&self, omega: f64, k: usize, m: usize) -> [f64; 3] {
        let i = k * self.size + m;
        [self.basis[i], omega * self.slope[i], omega * omega * self.bend[i]]
    }

    /// Adds a sample's force, and its derivatives, to the coefficients.
    fn project(&self, k: usize, f: f64, slopes: &[f64], out: &mut Harmonics) {
        let share = 1.0 / self.samples as f64;
        for (i, b) in self.row(&self.basis, k).iter().enumerate() {
            let weight = if i == 0 { share } else { 2.0 * share * b };
            out.f[i] += weight * f;
            for (to, slope) in out.df[i * slopes.len()..].iter_mut().zip(slopes) {
                *to += weight * slope;
            }
        }
    }

    /// Force of `joint`, prepared for [`Aft::step`], along the motion with coefficients `x`.
    pub(super) fn forces(&self, joint: &Joint, omega: f64, x: &[f64], derivatives: bool) -> Harmonics {
        let columns = if derivatives { self.size } else { 0 };
        let mut out = Harmonics { f: vec![0.0; self.size], df: vec![0.0; self.size * columns] };
        let mut slopes = vec![0.0; columns];
        if !joint.remembers() {
            let (rest, mut new) = (joint.rest(), joint.rest());
            for k in 0..self.samples {
                let (f, df) = joint.tangent(self.motion(x, omega, k), &rest, &mut new);
                for (m, slope) in slopes.iter_mut().enumerate() {
                    *slope = dot(df, self.moved(omega, k, m));
                }
                self.project(k, f, &slopes, &mut out);
            }
            return out;
        }
        self.with_states(joint, omega, x, &mut slopes, &mut out);
        out
    }

    /// The same where the force depends on the past: states, and their derivatives over every coefficient, go along with
    /// the samples from rest, and the last period is read.
    fn with_states(&self, joint: &Joint, omega: f64, x: &[f64], slopes: &mut [f64], out: &mut Harmonics) {
        let (mut states, mut new) = (joint.rest(), joint.rest());
        let mut ds = vec![vec![[[0.0]; MAX_STATE]; joint.laws().len()]; slopes.len()];
        let mut at = Linearised::default();
        for period in 0..=self.settling {
            for k in 0..self.samples {
                let motion = self.motion(x, omega, k);
                let (f, _) = joint.tangent(motion, &states, &mut new);
                if !slopes.is_empty() {
                    joint.linearise(motion, &states, &mut at);
                    self.advance(joint, &at, omega, k, &mut ds, slopes);
                }
                states.copy_from_slice(&new);
                if period == self.settling {
                    self.project(k, f, slopes, out);
                }
            }
        }
    }

    fn advance(
        &self,
        joint: &Joint,
        at: &Linearised,
        omega: f64,
        k: usize,
        ds: &mut [Vec<[[f64; 1]; MAX_STATE]>],
        slopes: &mut [f64],
    ) {
        for (m, (slope, ds)) in slopes.iter_mut().zip(ds).enumerate() {
            let dx = self.moved(omega, k, m);
            let [remembered] = joint.from_states(at, ds);
            *slope = dot(at.df, dx) + remembered;
            joint.advance_states(at, &dx.map(|x| [x]), (0, &[None]), ds);
        }
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
