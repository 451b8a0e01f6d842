//! Histories as a recorder gives them: a low-pass filter before every so many samples are kept.
//!
//! A law's force has harmonics far above the band, which excite modes there. A recorder's filter takes them out; kept as
//! they are, samples would show them folded into the band.

use super::Response;
use super::lane::{LANES, Lane, scaled_add};
use pulp::Simd;

/// Kept samples that the filter reaches to either side.
const REACH: usize = 11;
/// Shape of the Kaiser window (Oppenheim and Schafer, Discrete-Time Signal Processing, section 7.6): flat to 0.41 of the kept
/// samples' rate, 60 dB down from 0.59 on.
const BETA: f64 = 6.0;

/// Modified Bessel function of the first kind of order zero, by its series.
fn bessel(x: f64) -> f64 {
    let (mut term, mut sum) = (1.0, 1.0);
    for k in 1..100 {
        term *= (x / (2.0 * f64::from(k))).powi(2);
        sum += term;
        if term < 1e-17 * sum {
            break;
        }
    }
    sum
}

/// Filter of linear phase with its middle at `REACH` times `factor`, sum 1.
fn filter(factor: usize) -> Vec<f64> {
    let reach = (REACH * factor) as f64;
    let tap = |i: usize| {
        let t = i as f64 - reach;
        let x = std::f64::consts::PI * t / factor as f64;
        let ideal = if t == 0.0 { 1.0 } else { x.sin() / x };
        ideal * bessel(BETA * (1.0 - (t / reach).powi(2)).max(0.0).sqrt())
    };
    let taps: Vec<f64> = (0..=2 * REACH * factor).map(tap).collect();
    let sum: f64 = taps.iter().sum();
    taps.into_iter().map(|v| v / sum).collect()
}

/// Lanes of kept samples that are summed side by side.
const SIDE_BY_SIDE: usize = 4;
/// Kept samples that are summed at once.
const AT_ONCE: usize = SIDE_BY_SIDE * LANES;

/// The samples of a row by their place between kept ones: those of a place lie together, so that sums of neighbouring kept
/// samples go on side by side.
struct Places {
    /// Places one after the other, `length` samples each.
    samples: Vec<f64>,
    length: usize,
    factor: usize,
}

impl Places {
    /// Room for rows of `n` samples.
    fn new(n: usize, factor: usize) -> Self {
        let length = n.div_ceil(factor).next_multiple_of(AT_ONCE) + 2 * REACH + 1;
        Self { samples: vec![0.0; length * factor], length, factor }
    }

    /// Takes over a row with what is before it and beyond it; `padded` is taken for the whole.
    fn fill(&mut self, row: &[f64], padded: &mut [f64]) {
        let (n, reach) = (row.len(), REACH * self.factor);
        padded[reach..reach + n].copy_from_slice(row);
        for i in 0..reach {
            padded[reach + n + i] = 2.0 * row[n - 1] - row[(n - 1).saturating_sub(i + 1)];
        }
        for (place, to) in self.samples.chunks_exact_mut(self.length).enumerate() {
            for (to, from) in to.iter_mut().zip(padded[place..].iter().step_by(self.factor)) {
                *to = *from;
            }
        }
    }

    /// `AT_ONCE` kept samples from `k` on. Its loops are plain ones: closures in them would be compiled for the narrowest
    /// registers.
    #[inline(always)]
    fn filtered<S: Simd>(&self, simd: S, taps: &[f64], k: usize) -> [Lane; SIDE_BY_SIDE] {
        let mut sums = [[0.0; LANES]; SIDE_BY_SIDE];
        for place in 0..self.factor {
            let mut from = &self.samples[place * self.length + k..(place + 1) * self.length];
            let mut at = place;
            while at < taps.len() {
                let Some(part) = from.first_chunk::<AT_ONCE>() else { break };
                let parts = part.as_chunks::<LANES>().0;
                for i in 0..SIDE_BY_SIDE {
                    sums[i] = scaled_add(simd, taps[at], &parts[i], &sums[i]);
                }
                from = &from[1..];
                at += self.factor;
            }
        }
        sums
    }
}

/// Every `factor`-th sample of each row of `n`, filtered; before the first all is at rest, beyond the last it goes on as it
/// came, turned round its last value.
fn decimated(rows: &[f64], n: usize, factor: usize, taps: &[f64]) -> Vec<f64> {
    struct All<'a>(&'a [f64], usize, usize, &'a [f64]);
    impl pulp::WithSimd for All<'_> {
        type Output = Vec<f64>;
        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> Vec<f64> {
            let Self(rows, n, factor, taps) = self;
            let mut places = Places::new(n, factor);
            let mut padded = vec![0.0; n + 2 * REACH * factor];
            let mut out = Vec::with_capacity(rows.len().div_ceil(factor));
            for row in rows.chunks_exact(n) {
                places.fill(row, &mut padded);
                let n_kept = n.div_ceil(factor);
                let mut k = 0;
                while k < n_kept {
                    let sums = places.filtered(simd, taps, k);
                    out.extend_from_slice(&sums.as_flattened()[..AT_ONCE.min(n_kept - k)]);
                    k += AT_ONCE;
                }
            }
            out
        }
    }
    pulp::Arch::new().dispatch(All(rows, n.max(1), factor, taps))
}

impl Response {
    /// The response with each `factor` kept samples filtered to one. Where it failed, what the filter would reach beyond is
    /// NaN too.
    pub(super) fn decimated(mut self, factor: usize) -> Self {
        if factor <= 1 {
            return self;
        }
        let (n, taps) = (self.n, filter(factor));
        let Self { y, d, v, f, dy, df, moved_y, moved_f, .. } = &mut self;
        for rows in [y, d, v, f, dy, df, moved_y, moved_f] {
            *rows = decimated(rows, n, factor, &taps);
        }
        self.n = n.div_ceil(factor);
        let (n, rows) = (self.n, [&self.y, &self.d]);
        let missing = |row: &[f64]| row.iter().position(|v| v.is_nan());
        let first = rows.into_iter().flat_map(|rows| rows.chunks_exact(n.max(1))).filter_map(missing).min();
        self.status.failed_at = self.status.failed_at.map(|k| first.unwrap_or(k / factor));
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// A sine of `cycles` a kept sample.
    fn sine(cycles: f64, n: usize, factor: usize) -> Vec<f64> {
        (0..n * factor).map(|i| (TAU * cycles * i as f64 / factor as f64).sin()).collect()
    }

    fn largest(values: &[f64]) -> f64 {
        values.iter().fold(0.0, |a, v| a.max(v.abs()))
    }

    #[test]
    fn the_band_stays_and_what_would_fold_into_it_goes() {
        let (n, factor) = (400, 4);
        for (cycles, passes) in [(0.05, true), (0.41, true), (0.59, false), (0.9, false), (1.6, false)] {
            let rows = sine(cycles, n, factor);
            let kept = decimated(&rows, n * factor, factor, &filter(factor));
            let plain: Vec<f64> = rows.iter().step_by(factor).copied().collect();
            let inside = REACH..n - REACH;
            let error: Vec<f64> =
                kept[inside.clone()].iter().zip(&plain[inside.clone()]).map(|(a, b)| a - b).collect();
            if passes {
                assert!(largest(&error) < 2e-3, "{cycles}: {}", largest(&error));
            } else {
                assert!(largest(&kept[inside]) < 2e-3, "{cycles}");
            }
        }
    }

    #[test]
    fn rows_keep_apart() {
        let (n, factor) = (80, 2);
        let rows: Vec<f64> = std::iter::repeat_n(0.0, n).chain(std::iter::repeat_n(1.0, n)).collect();
        let kept = decimated(&rows, n, factor, &filter(factor));
        assert_eq!(kept.len(), n);
        assert!(largest(&kept[..n / 2]) == 0.0);
        assert!((kept[n - 1] - 1.0).abs() < 1e-6, "{}", kept[n - 1]);
    }

    #[test]
    fn what_failed_is_told_by_the_samples_that_are_kept() {
        let n = 400;
        let mut y = vec![0.0; n];
        y[300..].fill(f64::NAN);
        let mut out = Response { n, y, ..Response::default() };
        out.status.failed_at = Some(300);
        let out = out.decimated(4);
        let first = out.y.iter().position(|v| v.is_nan());
        assert_eq!(out.n, 100);
        assert_eq!(first, out.status.failed_at);
        assert!((50..75).contains(&first.unwrap_or(0)), "{first:?}");
    }
}
