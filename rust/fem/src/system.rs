//! Values of K, M, C and structural damping: whole, and as what a factor adds on the part of the pattern it reaches.

use rayon::prelude::*;

/// Values of K, M, C and of the structural damping matrix (imaginary part of K) on [`femend_linalg::Pattern`].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct System {
    /// Stiffness.
    pub k: Vec<f64>,
    /// Mass.
    pub m: Vec<f64>,
    /// Viscous damping.
    pub c: Vec<f64>,
    /// Structural damping: `K (1 + i eta)` has this imaginary part.
    pub h: Vec<f64>,
}

/// One of the four matrices.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// Stiffness.
    K,
    /// Mass.
    M,
    /// Viscous damping.
    C,
    /// Structural damping.
    H,
}

impl Part {
    /// Part by its letter.
    #[must_use]
    pub fn parse(text: &str) -> Option<Self> {
        Some(match text {
            "K" => Self::K,
            "M" => Self::M,
            "C" => Self::C,
            "H" => Self::H,
            _ => return None,
        })
    }
}

/// The four arrays in the order K, M, C, H; a matrix that nothing was added to takes no memory.
#[derive(Debug, Clone, Default)]
pub(crate) struct Parts(pub(crate) [Option<Vec<f64>>; 4]);

impl Parts {
    /// With zeros for what is absent.
    pub(crate) fn into_system(self, nnz: usize) -> System {
        let [k, m, c, h] = self.0.map(|a| a.unwrap_or_else(|| vec![0.0; nnz]));
        System { k, m, c, h }
    }

    /// Adds another set.
    pub(crate) fn add(&mut self, other: &Self) {
        for (a, b) in self.0.iter_mut().zip(&other.0) {
            match (a, b) {
                (Some(a), Some(b)) => a.iter_mut().zip(b).for_each(|(x, y)| *x += y),
                (a @ None, Some(b)) => *a = Some(b.clone()),
                (_, None) => {}
            }
        }
    }
}

/// Zeros shorter than this do not end a run.
const BRIDGE: usize = 4;
/// Entries filled per parallel task; small enough to stay in cache while increments are added, and so large that each
/// increment is read in stretches of pages, which processors fetch ahead.
const CHUNK: usize = 1 << 17;

/// The values of a matrix that are not zero, in runs of neighbouring positions.
#[derive(Debug, Clone, Default)]
pub(crate) struct Increment {
    /// First position of each run, ascending, and where its values start.
    runs: Vec<(u32, u32)>,
    values: Vec<f64>,
}

impl Increment {
    pub(crate) fn new(dense: Option<&[f64]>) -> Self {
        let mut out = Self::default();
        let dense = dense.unwrap_or(&[]);
        let mut at = 0;
        while let Some(skip) = dense[at..].iter().position(|&v| v != 0.0) {
            let start = at + skip;
            let mut end = start + 1;
            let mut zeros = 0;
            while end + zeros < dense.len() && zeros < BRIDGE {
                zeros += 1;
                if dense[end + zeros - 1] != 0.0 {
                    (end, zeros) = (end + zeros, 0);
                }
            }
            out.runs.push((start as u32, out.values.len() as u32));
            out.values.extend_from_slice(&dense[start..end]);
            at = end;
        }
        out
    }

    /// Is there nothing to add?
    pub(crate) fn is_empty(&self) -> bool {
        self.runs.is_empty()
    }

    /// All values.
    pub(crate) fn dense(&self, nnz: usize) -> Vec<f64> {
        let mut out = vec![0.0; nnz];
        self.add(1.0, 0, &mut out);
        out
    }

    /// Adds `w` times the values at positions `first..first + out.len()`.
    fn add(&self, w: f64, first: usize, out: &mut [f64]) {
        let end = first + out.len();
        let from = self.runs.partition_point(|r| (r.0 as usize) < first).saturating_sub(1);
        for (i, &(start, value)) in self.runs.iter().enumerate().skip(from) {
            let (mut start, mut value) = (start as usize, value as usize);
            if start >= end {
                break;
            }
            let stop = self.runs.get(i + 1).map_or(self.values.len(), |r| r.1 as usize);
            let cut = first.saturating_sub(start).min(stop - value);
            (start, value) = (start + cut, value + cut);
            let length = (stop - value).min(end - start.min(end));
            let target = &mut out[start - first.min(start)..][..length];
            for (o, v) in target.iter_mut().zip(&self.values[value..value + length]) {
                *o += w * v;
            }
        }
    }
}

/// `out = base + Σ (factor - 1) increment`, chunk by chunk.
pub(crate) fn refill(base: Option<&[f64]>, terms: &[(f64, &Increment)], out: &mut [f64]) {
    out.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, out)| {
        let first = chunk * CHUNK;
        match base {
            Some(base) => out.copy_from_slice(&base[first..first + out.len()]),
            None => out.fill(0.0),
        }
        for (w, increment) in terms {
            increment.add(*w, first, out);
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn increments_hold_every_value_whatever_the_runs() {
        let n = 3 * CHUNK + 77;
        let dense: Vec<f64> =
            (0..n).map(|i| if (i * i) % 11 < 4 || i % 1000 < 37 { (i as f64).sin() } else { 0.0 }).collect();
        let increment = Increment::new(Some(&dense));
        assert_eq!(increment.dense(n), dense);
        assert!(increment.values.len() < n);
        let base: Vec<f64> = (0..n).map(|i| i as f64).collect();
        let mut out = vec![f64::NAN; n];
        refill(Some(&base), &[(0.5, &increment), (-2.0, &increment)], &mut out);
        for i in 0..n {
            assert!((out[i] - (base[i] - 1.5 * dense[i])).abs() <= 1e-12 * base[i].max(1.0));
        }
        refill(None, &[], &mut out);
        assert!(out.iter().all(|v| *v == 0.0));
        assert!(Increment::new(None).dense(3) == [0.0; 3]);
        assert!(Increment::new(Some(&[0.0; 9])).runs.is_empty());
    }
}
