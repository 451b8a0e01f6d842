//! The equations of one period: residual and Jacobian over the coefficients of the motion.

use super::aft::Aft;
use super::linear::{self, Line};
use super::{HarmonicError, Options, Steady};
use crate::laws::{Joint, Law, LawError};
use crate::simulate::ModalModel;
use num_complex::Complex64;

/// Relative step over frequency of the residual's derivative: it steers the path and does not enter its points.
const STEP: f64 = 1e-7;
/// Frequency, as a share of the fundamental, that stands for zero where a linear law's stiffness is taken at rest: a
/// power of s has no value at s = 0.
const AT_REST: f64 = 1e-9;

/// The problem of one set of laws at one level.
#[derive(Debug)]
pub(super) struct Balance<'a> {
    pub(super) model: ModalModel<'a>,
    /// Modal force (r) at this level.
    pub(super) p: Vec<Complex64>,
    pub(super) level: f64,
    /// Laws with a dynamic stiffness, which need no samples, and the others.
    linear: Vec<Law>,
    nonlinear: Vec<Law>,
    aft: Aft,
    pub(super) harmonics: usize,
    free: bool,
}

/// Residual (size) in m, and its derivatives (size, size) where asked for.
#[derive(Debug)]
pub(super) struct Residual {
    pub(super) r: Vec<f64>,
    pub(super) jacobian: Vec<f64>,
}

impl<'a> Balance<'a> {
    pub(super) fn new(
        steady: &Steady<'a>,
        laws: &[Law],
        level: f64,
        options: &Options,
    ) -> Result<Self, HarmonicError> {
        let (linear, nonlinear): (Vec<Law>, Vec<Law>) =
            laws.iter().cloned().partition(|law| law.kind().is_linear());
        let aft = Aft::new(options.harmonics, options.samples, options.settling);
        // a law that cannot be stepped is told before the path starts
        Joint::new(&nonlinear, aft.step(steady.band.0))?;
        Ok(Self {
            model: steady.model,
            p: linear::modal_force(&steady.model, steady.force, level),
            level,
            linear,
            nonlinear,
            aft,
            harmonics: options.harmonics,
            free: linear::is_free(&steady.model),
        })
    }

    /// Number of unknowns.
    pub(super) fn size(&self) -> usize {
        2 * self.harmonics + 1
    }

    /// Dynamic stiffness of the linear laws at harmonic `n`.
    fn stiffness(&self, n: usize, omega: f64) -> Result<Complex64, LawError> {
        let s = Complex64::new(0.0, if n == 0 { AT_REST * omega } else { n as f64 * omega });
        let mut sum = Complex64::ZERO;
        for law in &self.linear {
            sum += law.dynamic_stiffness(s)?.0;
        }
        Ok(if n == 0 { sum.re.into() } else { sum })
    }

    /// Motion without the nonlinear laws (size).
    pub(super) fn linear_motion(&self, omega: f64) -> Result<Vec<f64>, LawError> {
        let line = linear::line(&self.model, &self.p, omega, 1);
        let d = line.free / (1.0 + line.c[1] * self.stiffness(1, omega)?);
        let mut x = vec![0.0; self.size()];
        (x[1], x[2]) = (d.re, -d.im);
        Ok(x)
    }

    /// The equations at coefficients `x`, with the force and the free motion times `share`.
    pub(super) fn residual(
        &self,
        x: &[f64],
        omega: f64,
        share: f64,
        derivatives: bool,
    ) -> Result<Residual, LawError> {
        let n = self.size();
        let joint = Joint::new(&self.nonlinear, self.aft.step(omega))?;
        let forces = self.aft.forces(&joint, omega, x, derivatives);
        let line = linear::line(&self.model, &self.p, omega, self.harmonics);
        let mut out = Residual { r: vec![0.0; n], jacobian: vec![0.0; if derivatives { n * n } else { 0 }] };
        let (own, c0) = self.mean(&line, omega)?;
        out.r[0] = own * x[0] + c0 * forces.f[0];
        if derivatives {
            for j in 0..n {
                out.jacobian[j] = c0 * forces.df[j];
            }
            out.jacobian[0] += own;
        }
        for h in 1..=self.harmonics {
            let (i, c) = (2 * h - 1, line.c[h]);
            let own = 1.0 + c * self.stiffness(h, omega)?;
            // z (c - i s) has the coefficients (Re z c + Im z s, Re z s - Im z c)
            let turned = |z: Complex64, a: f64, b: f64| [z.re * a + z.im * b, z.re * b - z.im * a];
            let (d, f) = (turned(own, x[i], x[i + 1]), turned(c, forces.f[i], forces.f[i + 1]));
            let free = if h == 1 { share * line.free } else { Complex64::ZERO };
            out.r[i] = d[0] + f[0] - free.re;
            out.r[i + 1] = d[1] + f[1] + free.im;
            if derivatives {
                for j in 0..n {
                    let by = turned(c, forces.df[i * n + j], forces.df[(i + 1) * n + j]);
                    out.jacobian[i * n + j] = by[0];
                    out.jacobian[(i + 1) * n + j] = by[1];
                }
                for (j, (a, b)) in [(1.0, 0.0), (0.0, 1.0)].into_iter().enumerate() {
                    let by = turned(own, a, b);
                    out.jacobian[i * n + i + j] += by[0];
                    out.jacobian[(i + 1) * n + i + j] += by[1];
                }
            }
        }
        Ok(out)
    }

    /// Factors of the mean motion and of the mean nonlinear force. Where the model is free the mean force vanishes; its
    /// equation is taken times a receptance, to be in metres as the others.
    fn mean(&self, line: &Line, omega: f64) -> Result<(f64, f64), LawError> {
        let kappa = self.stiffness(0, omega)?.re;
        if self.free {
            let c = line.c[1].norm();
            return Ok((c * kappa, c));
        }
        let c = line.c[0].re;
        Ok((1.0 + c * kappa, c))
    }

    /// Derivative (size) of the residual `at` (x, omega) over omega.
    pub(super) fn over_omega(&self, x: &[f64], omega: f64, at: &Residual) -> Result<Vec<f64>, LawError> {
        let moved = self.residual(x, omega * (1.0 + STEP), 1.0, false)?;
        Ok(moved.r.iter().zip(&at.r).map(|(a, b)| (a - b) / (omega * STEP)).collect())
    }

    /// Complex harmonics of the motion and of the force of all laws.
    pub(super) fn harmonics(
        &self,
        x: &[f64],
        omega: f64,
    ) -> Result<(Vec<Complex64>, Vec<Complex64>), LawError> {
        let joint = Joint::new(&self.nonlinear, self.aft.step(omega))?;
        let forces = self.aft.forces(&joint, omega, x, false);
        let (d, mut f) = (complex(x), complex(&forces.f));
        for (h, f) in f.iter_mut().enumerate() {
            *f += self.stiffness(h, omega)? * d[h];
        }
        Ok((d, f))
    }
}

/// Complex harmonics of real coefficients.
fn complex(x: &[f64]) -> Vec<Complex64> {
    let mut out = vec![Complex64::from(x[0])];
    out.extend(x[1..].chunks_exact(2).map(|pair| Complex64::new(pair[0], -pair[1])));
    out
}
