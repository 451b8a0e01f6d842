//! Agreement of a modal model's FRFs with measured ones, summed while they are computed: they are never stored.

use num_complex::Complex64;
use rayon::prelude::*;

use super::FrfKind;
use super::modal::{GROUP, LINES, ModalModel, Superposition};
use super::tile::{Sink, Tile, WIDE};
use crate::DynamicsError;

/// Criteria of agreement; NaN where an FRF is zero.
#[derive(Debug, Clone, PartialEq)]
pub struct FrfScores {
    /// Frequency response assurance criterion of each pair (n_out * n_in, last axis fastest).
    pub frac: Vec<f64>,
    /// Frequency amplitude assurance criterion of each pair.
    pub faac: Vec<f64>,
    /// Cross signature assurance criterion of each line.
    pub csac: Vec<f64>,
    /// Cross signature scale factor of each line.
    pub csf: Vec<f64>,
    /// Σ |H - H_measured|² over lines and pairs.
    pub misfit: f64,
}

/// Σ conj(H) H_m, Σ |H|², Σ |H_m|².
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    re: f64,
    im: f64,
    own: f64,
    measured: f64,
}

impl Sums {
    fn add(&mut self, other: &Self) {
        self.re += other.re;
        self.im += other.im;
        self.own += other.own;
        self.measured += other.measured;
    }

    /// |cross|² / (own measured).
    fn shape(&self) -> f64 {
        ratio(self.re * self.re + self.im * self.im, self.own * self.measured)
    }

    /// 2 |cross| / (own + measured).
    fn scale(&self) -> f64 {
        ratio(2.0 * self.re.hypot(self.im), self.own + self.measured)
    }
}

fn ratio(top: f64, bottom: f64) -> f64 {
    if bottom > 0.0 { (top / bottom).min(1.0) } else { f64::NAN }
}

/// [`Sums`] in lanes.
#[derive(Debug, Clone, Copy)]
struct Lanes {
    re: [f64; WIDE],
    im: [f64; WIDE],
    own: [f64; WIDE],
    measured: [f64; WIDE],
}

const ZERO: Lanes = Lanes { re: [0.0; WIDE], im: [0.0; WIDE], own: [0.0; WIDE], measured: [0.0; WIDE] };

impl Lanes {
    #[inline(always)]
    fn add(&mut self, re: &[f64; WIDE], im: &[f64; WIDE], m_re: &[f64; WIDE], m_im: &[f64; WIDE]) {
        for c in 0..WIDE {
            self.re[c] += re[c] * m_re[c] + im[c] * m_im[c];
            self.im[c] += re[c] * m_im[c] - im[c] * m_re[c];
            self.own[c] += re[c] * re[c] + im[c] * im[c];
            self.measured[c] += m_re[c] * m_re[c] + m_im[c] * m_im[c];
        }
    }

    fn lane(&self, c: usize) -> Sums {
        Sums { re: self.re[c], im: self.im[c], own: self.own[c], measured: self.measured[c] }
    }

    fn total(&self) -> Sums {
        let sum = |v: &[f64; WIDE]| v.iter().sum();
        Sums { re: sum(&self.re), im: sum(&self.im), own: sum(&self.own), measured: sum(&self.measured) }
    }
}

/// Sums of a task's lines.
struct Collect<'a> {
    measured: &'a [Complex64],
    pairs: usize,
    by_pair: Vec<Lanes>,
    by_line: Vec<Lanes>,
    misfit: [f64; WIDE],
}

impl Sink for Collect<'_> {
    #[inline(always)]
    fn take(&mut self, group: usize, first: usize, tile: &Tile) {
        let lanes = WIDE.min(self.pairs - first);
        let lines = self.by_line[group * GROUP..].iter_mut();
        for (l, (by_line, rows)) in lines.take(GROUP).zip(tile.chunks_exact(2)).enumerate() {
            let at = (group * GROUP + l) * self.pairs + first;
            let (mut re, mut im) = ([0.0; WIDE], [0.0; WIDE]);
            for ((re, im), z) in re.iter_mut().zip(&mut im).zip(&self.measured[at..at + lanes]) {
                (*re, *im) = (z.re, z.im);
            }
            self.by_pair[first / WIDE].add(&rows[0], &rows[1], &re, &im);
            by_line.add(&rows[0], &rows[1], &re, &im);
            for c in 0..WIDE {
                let (a, b) = (rows[0][c] - re[c], rows[1][c] - im[c]);
                self.misfit[c] += a * a + b * b;
            }
        }
    }
}

impl ModalModel {
    /// Agreement with `measured` (n_lines, n_out, n_in; last axis fastest) of the FRFs that [`ModalModel::frf`] would
    /// write. FRAC, CSAC: Heylen and Lammens 1996; Dascotte and Strobbe 1999; FAAC: Zang, Schwingshackl and Ewins 2008.
    ///
    /// # Errors
    /// As [`ModalModel::frf`].
    pub fn scores(
        &self,
        s: &[Complex64],
        kind: FrfKind,
        residual: Option<&[Complex64]>,
        measured: &[Complex64],
    ) -> Result<FrfScores, DynamicsError> {
        let sum = Superposition::new(self, kind, residual, s.len(), measured.len(), "the measured FRF")?;
        let pairs = sum.pairs;
        let parts = s
            .par_chunks(LINES)
            .zip(measured.par_chunks(LINES * pairs.max(1)))
            .map(|(s, measured)| {
                let by_pair = vec![ZERO; pairs.div_ceil(WIDE)];
                let by_line = vec![ZERO; s.len()];
                let mut part = Collect { measured, pairs, by_pair, by_line, misfit: [0.0; WIDE] };
                sum.sum(&sum.gains(s)?, &mut part);
                Ok(part)
            })
            .collect::<Result<Vec<_>, DynamicsError>>()?;
        let mut by_pair = vec![Sums::default(); pairs];
        for part in &parts {
            for (p, sums) in by_pair.iter_mut().enumerate() {
                sums.add(&part.by_pair[p / WIDE].lane(p % WIDE));
            }
        }
        let by_line: Vec<Sums> =
            parts.iter().flat_map(|part| part.by_line.iter().map(Lanes::total)).collect();
        Ok(FrfScores {
            frac: by_pair.iter().map(Sums::shape).collect(),
            faac: by_pair.iter().map(Sums::scale).collect(),
            csac: by_line.iter().map(Sums::shape).collect(),
            csf: by_line.iter().map(Sums::scale).collect(),
            misfit: parts.iter().map(|part| part.misfit.iter().sum::<f64>()).sum(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use femend_linalg::Dense;

    fn model(scale: f64) -> ModalModel {
        let shape = |n: usize| {
            Dense::from_vec(n, 5, (0..5 * n).map(|i| scale * (1.7 * i as f64 + n as f64).sin()).collect())
        };
        ModalModel {
            omega: vec![10.0, 20.0, 31.0, 55.0, 80.0],
            zeta: vec![0.01; 5],
            phi_out: shape(13),
            phi_in: shape(3),
        }
    }

    #[test]
    fn fused_sums_equal_those_of_the_stored_frf() {
        let s: Vec<Complex64> = (1..150).map(|l| Complex64::new(0.0, 0.6 * f64::from(l))).collect();
        let (a, b) = (model(1.0), model(0.8));
        let residual: Vec<Complex64> = (0..39).map(|p| Complex64::new(1e-4 * f64::from(p), 2e-4)).collect();
        let mut h = vec![Complex64::ZERO; s.len() * 39];
        let mut m = h.clone();
        a.frf(&s, FrfKind::Mobility, Some(&residual), &mut h).unwrap();
        b.frf(&s, FrfKind::Mobility, None, &mut m).unwrap();
        m.iter_mut().enumerate().for_each(|(i, v)| *v *= 1.0 + 0.3 * (i as f64).cos());
        let found = a.scores(&s, FrfKind::Mobility, Some(&residual), &m).unwrap();
        let sums = |at: &mut dyn Iterator<Item = usize>| {
            let mut t = Sums::default();
            for i in at {
                let cross = h[i].conj() * m[i];
                t.add(&Sums { re: cross.re, im: cross.im, own: h[i].norm_sqr(), measured: m[i].norm_sqr() });
            }
            t
        };
        for p in 0..39 {
            let t = sums(&mut (0..s.len()).map(|l| l * 39 + p));
            assert!((found.frac[p] - t.shape()).abs() < 1e-12 && (found.faac[p] - t.scale()).abs() < 1e-12);
        }
        for l in 0..s.len() {
            let t = sums(&mut (l * 39..(l + 1) * 39));
            assert!((found.csac[l] - t.shape()).abs() < 1e-12 && (found.csf[l] - t.scale()).abs() < 1e-12);
        }
        let misfit: f64 = h.iter().zip(&m).map(|(h, m)| (h - m).norm_sqr()).sum();
        assert!((found.misfit / misfit - 1.0).abs() < 1e-12);
        assert!(found.frac.iter().all(|&v| v < 0.9999) && found.csf.iter().all(|v| v.is_finite()));
    }
}
