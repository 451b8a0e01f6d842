//! Modal superposition: residues of all pairs times gains of all lines, written once in the layout wanted.

use std::f64::consts::TAU;

use femend_linalg::Dense;
use num_complex::Complex64;
use rayon::prelude::*;

use super::FrfKind;
use super::tile::{NARROW, Panels, Sink, Tile, multiply};
use crate::DynamicsError;

/// Lines of a tile: real and imaginary parts are its rows.
pub(super) const GROUP: usize = NARROW / 2;
/// Lines per parallel task; fixed, so that sums do not depend on the number of threads.
pub(super) const LINES: usize = 16 * GROUP;

/// Modes seen from outputs and inputs.
#[derive(Debug, Clone)]
pub struct ModalModel {
    /// ω_r in rad/s.
    pub omega: Vec<f64>,
    /// Damping fraction of each mode.
    pub zeta: Vec<f64>,
    /// Mass-normalised shapes at the outputs (n_out, r).
    pub phi_out: Dense,
    /// Mass-normalised shapes at the inputs (n_in, r).
    pub phi_in: Dense,
}

impl ModalModel {
    pub(crate) fn check(&self) -> Result<(), DynamicsError> {
        let r = self.omega.len();
        let bad = |what: &str, found: usize| {
            Err(DynamicsError::Argument(format!(
                "{what} has {found} modes, omega has {r}; give every mode once"
            )))
        };
        match (self.zeta.len(), self.phi_out.ncols(), self.phi_in.ncols()) {
            (z, _, _) if z != r => bad("zeta", z),
            (_, o, _) if o != r => bad("phi_out", o),
            (_, _, i) if i != r => bad("phi_in", i),
            _ => Ok(()),
        }
    }

    /// 1 / (ω² + 2 ζ ω s + s²) of each mode.
    ///
    /// # Errors
    /// [`DynamicsError::Argument`] where s is a pole.
    pub(crate) fn gains(&self, s: Complex64, gains: &mut [Complex64]) -> Result<(), DynamicsError> {
        let (square, norm) = (s * s, s.norm_sqr());
        let mut pole = false;
        for ((g, &w), &zeta) in gains.iter_mut().zip(&self.omega).zip(&self.zeta) {
            let u = 2.0 * zeta * w;
            let (re, im) = (w * w + u * s.re + square.re, u * s.im + square.im);
            let size = re * re + im * im;
            let limit = f64::EPSILON * (w * w + norm);
            pole |= size <= limit * limit;
            *g = Complex64::new(re / size, -im / size);
        }
        if pole { Err(self.pole(s)) } else { Ok(()) }
    }

    /// The first mode that has a pole at s.
    fn pole(&self, s: Complex64) -> DynamicsError {
        let close = |r: &usize| {
            let w = self.omega[*r];
            (w * w + 2.0 * self.zeta[*r] * w * s + s * s).norm()
                <= 2.0 * f64::EPSILON * (w * w + s.norm_sqr())
        };
        let r = (0..self.omega.len()).find(close).unwrap_or(0);
        DynamicsError::Argument(format!(
            "the FRF has a pole at s = {s:.6e} rad/s: mode {r} ({:.6} Hz, damping {}); give it damping or leave the line out",
            self.omega[r] / TAU,
            self.zeta[r]
        ))
    }

    /// FRFs at complex frequencies `s` (n_lines), written to `out` (n_lines, n_out, n_in), last axis fastest.
    ///
    /// `residual` (n_out * n_in, last axis fastest) is the receptance of the modes left out, real or complex.
    ///
    /// # Errors
    /// [`DynamicsError::Argument`] for shapes that do not fit or a line on an undamped pole.
    pub fn frf(
        &self,
        s: &[Complex64],
        kind: FrfKind,
        residual: Option<&[Complex64]>,
        out: &mut [Complex64],
    ) -> Result<(), DynamicsError> {
        let sum = Superposition::new(self, kind, residual, s.len(), out.len(), "out")?;
        let pairs = sum.pairs;
        if pairs == 0 {
            return Ok(());
        }
        out.par_chunks_mut(LINES * pairs).zip(s.par_chunks(LINES)).try_for_each(|(out, s)| {
            multiply(&sum.residues, &sum.gains(s)?, &mut Write { out, pairs });
            Ok(())
        })
    }
}

/// A modal model ready to be summed over its modes.
pub(super) struct Superposition<'a> {
    model: &'a ModalModel,
    kind: FrfKind,
    with_residual: bool,
    residues: Panels,
    pub pairs: usize,
}

impl<'a> Superposition<'a> {
    /// `found` is the number of values of the array `what` that goes with `lines` lines.
    pub fn new(
        model: &'a ModalModel,
        kind: FrfKind,
        residual: Option<&[Complex64]>,
        lines: usize,
        found: usize,
        what: &str,
    ) -> Result<Self, DynamicsError> {
        model.check()?;
        let (n_out, n_in, r) = (model.phi_out.nrows(), model.phi_in.nrows(), model.omega.len());
        let pairs = n_out * n_in;
        if found != lines * pairs || residual.is_some_and(|v| v.len() != pairs) {
            return Err(DynamicsError::Argument(format!(
                "FRF of {lines} lines, {n_out} outputs and {n_in} inputs needs {} values, {what} has {found}, residual {:?}",
                lines * pairs,
                residual.map(<[Complex64]>::len)
            )));
        }
        // a residual is a mode with gain 1, its imaginary part one with gain i
        let depth = if residual.is_some() { r + 2 } else { r.max(1) };
        let residues = Panels::new(depth, pairs, |mode, first, lanes| {
            if mode < r {
                let (phi_out, phi_in) = (model.phi_out.col(mode), model.phi_in.col(mode));
                let (mut o, mut i) = (first / n_in, first % n_in);
                for v in lanes {
                    *v = phi_out[o] * phi_in[i];
                    i += 1;
                    if i == n_in {
                        (o, i) = (o + 1, 0);
                    }
                }
            } else if let Some(residual) = residual {
                for (v, z) in lanes.iter_mut().zip(&residual[first..]) {
                    *v = if mode == r { z.re } else { z.im };
                }
            }
        });
        Ok(Self { model, kind, with_residual: residual.is_some(), residues, pairs })
    }

    /// Gains of up to `LINES` lines as rows of tiles.
    pub fn gains(&self, s: &[Complex64]) -> Result<Vec<[f64; NARROW]>, DynamicsError> {
        let r = self.model.omega.len();
        let depth = if self.with_residual { r + 2 } else { r.max(1) };
        let mut rows = vec![[0.0; NARROW]; depth * s.len().div_ceil(GROUP)];
        let mut gains = vec![Complex64::ZERO; depth];
        for (l, &s) in s.iter().enumerate() {
            self.model.gains(s, &mut gains[..r])?;
            if self.with_residual {
                (gains[r], gains[r + 1]) = (Complex64::ONE, Complex64::I);
            }
            let factor = self.kind.factor(s);
            let at = 2 * (l % GROUP);
            for (row, g) in rows[l / GROUP * depth..].iter_mut().zip(&gains) {
                let value = g * factor;
                (row[at], row[at + 1]) = (value.re, value.im);
            }
        }
        Ok(rows)
    }

    /// Sums over the modes for lines with these gains.
    pub fn sum(&self, rows: &[[f64; NARROW]], sink: &mut impl Sink) {
        multiply(&self.residues, rows, sink);
    }
}

/// Writes tiles to lines of pairs.
struct Write<'a> {
    out: &'a mut [Complex64],
    pairs: usize,
}

impl Sink for Write<'_> {
    #[inline(always)]
    fn take(&mut self, group: usize, first: usize, tile: &Tile) {
        let lines = self.out[group * GROUP * self.pairs..].chunks_exact_mut(self.pairs);
        for (line, rows) in lines.zip(tile.chunks_exact(2)) {
            for (value, (&re, &im)) in line[first..].iter_mut().zip(rows[0].iter().zip(&rows[1])) {
                *value = Complex64::new(re, im);
            }
        }
    }
}
