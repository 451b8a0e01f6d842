//! What every evaluation of a record needs and no unknown changes, line after line in memory.

use super::RecordLines;
use super::arrays::{PairMut, Split, inverse, update, update_real};
use femend_linalg::Dense;
use num_complex::Complex64;

/// A record, its arrays column after column.
#[derive(Debug)]
pub(crate) struct Prepared<'a> {
    pub record: &'a RecordLines,
    /// Lines s and their squares, one column each.
    pub s: Split,
    pub s2: Split,
    /// exp(-i omega dt), one column.
    pub turn: Split,
    /// Spectra of the measured forces, a column each.
    pub u: Split,
    /// Spectra of the accelerations, a column each.
    pub y: Split,
    /// What a cut through the forces keeps from the accelerations, a column each; none for nothing.
    pub cut_off: Split,
    /// Motion that sensors may pick up besides, a column each.
    pub picked_up: Split,
    /// Square roots of the weights (K, n_out).
    pub weight: Dense,
    /// Their products with s², a column for each sensor.
    pub weighted_s2: Split,
}

impl<'a> Prepared<'a> {
    pub fn new(record: &'a RecordLines) -> Self {
        let (n, n_in, n_out) = (record.n_lines(), record.n_in(), record.n_out());
        let n_picked = record.picked_up.sensor.len();
        let mut weight = Dense::zeros(n, n_out);
        for s in 0..n_out {
            (0..n).for_each(|k| weight[(k, s)] = record.weight[k * n_out + s]);
        }
        Self {
            record,
            s: Split::new(n, 1, |k, _| record.s[k]),
            s2: Split::new(n, 1, |k, _| record.s[k] * record.s[k]),
            turn: Split::new(n, 1, |k, _| Complex64::new(0.0, -record.s[k].im * record.dt).exp()),
            u: Split::new(n, n_in, |k, i| record.u[k * n_in + i]),
            y: Split::new(n, n_out, |k, s| record.y[k * n_out + s]),
            cut_off: Split::new(n, record.cut_off.len() / n.max(1), |k, s| record.cut_off[k * n_out + s]),
            picked_up: Split::new(n, n_picked, |k, c| record.picked_up.motion[k * n_picked + c]),
            weighted_s2: Split::new(n, n_out, |k, s| record.s[k] * record.s[k] * weight[(k, s)]),
            weight,
        }
    }

    pub fn n_lines(&self) -> usize {
        self.record.n_lines()
    }

    pub fn n_out(&self) -> usize {
        self.record.n_out()
    }

    /// Length of a weighted column: real and imaginary parts of all lines, sensor after sensor.
    pub fn n_rows(&self) -> usize {
        2 * self.n_lines() * self.n_out()
    }

    /// The parts of a column, sensor after sensor, with their weights.
    pub fn sensors<'c>(&'c self, column: &'c mut [f64]) -> impl Iterator<Item = (PairMut<'c>, &'c [f64])> {
        let n = self.n_lines();
        let parts = column.chunks_exact_mut((2 * n).max(1)).enumerate();
        parts.map(move |(s, part)| (part.split_at_mut(n), self.weight.col(s)))
    }

    /// Writes the weighted accelerations `y` to a column.
    pub fn fill(&self, column: &mut [f64], y: &Split) {
        for (s, (part, w)) in self.sensors(column).enumerate() {
            update_real(part, y.col(s), w, |_, y, w| y * w);
        }
    }

    /// Transform of a decay exp(pole t) that begins where the record ends.
    pub fn tail(&self, pole: Complex64, out: PairMut<'_>) {
        let lambda = ((pole - self.record.sigma) * self.record.dt).exp();
        update(out, self.turn.col(0), |_, z| inverse(1.0 - lambda * z));
    }
}
