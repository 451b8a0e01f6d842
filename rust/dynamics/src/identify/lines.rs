//! One record as spectral lines.

use super::{IdentifyError, expect};
use femend_linalg::Dense;
use num_complex::Complex64;

/// Motion that sensors may pick up besides their own, in shares nobody knows (their transverse sensitivity): these are
/// eliminated as the free decays are.
#[derive(Debug, Clone, Default)]
pub struct PickedUp {
    /// Sensor of every column.
    pub sensor: Vec<usize>,
    /// Spectra of the motion, K x columns, line after line.
    pub motion: Vec<Complex64>,
    /// Standard deviation of the shares.
    pub sd: f64,
}

/// Lines of one record. Arrays over (channel, line) are line after line.
#[derive(Debug, Clone)]
pub struct RecordLines {
    /// Lines s = sigma + i omega, rad/s (K).
    pub s: Vec<Complex64>,
    /// Spectra of the measured forces, K x n_in.
    pub u: Vec<Complex64>,
    /// Spectra of the accelerations, K x n_out.
    pub y: Vec<Complex64>,
    /// Square roots of the weights, K x n_out.
    pub weight: Vec<f64>,
    /// Accelerations that a cut through the forces keeps from the record, of modes without free decays, K x n_out; empty
    /// for none.
    pub cut_off: Vec<Complex64>,
    /// What sensors may pick up besides.
    pub picked_up: PickedUp,
    /// Rows of the sensors in the basis (n_out, r).
    pub out_rows: Dense,
    /// Rows of the forces in the basis (n_in, r).
    pub in_rows: Dense,
    /// Sampling step, s; 0 for a frequency response function, which has no free decays.
    pub dt: f64,
    /// Number of samples of the record.
    pub n_samples: f64,
    /// Lines of the record that each of these stands for.
    pub thinning: f64,
    /// Decay of the exponential window, 1/s.
    pub sigma: f64,
    /// Up to where the forces excite, rad/s; 0 where that is not above the lines.
    pub driven_to: f64,
    /// Share of a line in the cost: tempering times the lines it stands for.
    pub share: f64,
}

impl RecordLines {
    /// Checks the sizes against each other.
    ///
    /// # Errors
    /// [`IdentifyError::Shape`].
    pub fn check(&self, r: usize) -> Result<(), IdentifyError> {
        let k = self.s.len();
        expect("basis rows of the sensors", self.out_rows.ncols(), r)?;
        expect("basis rows of the forces", self.in_rows.ncols(), r)?;
        expect("spectra of the forces", self.u.len(), k * self.n_in())?;
        expect("spectra of the responses", self.y.len(), k * self.n_out())?;
        expect(
            "what the record's end cuts off",
            self.cut_off.len(),
            if self.cut_off.is_empty() { 0 } else { k * self.n_out() },
        )?;
        expect("motion that sensors pick up", self.picked_up.motion.len(), k * self.picked_up.sensor.len())?;
        let last = self.picked_up.sensor.iter().max().map_or(0, |s| s + 1);
        expect("sensors that pick up motion", last.max(self.n_out()), self.n_out())?;
        expect("weights", self.weight.len(), k * self.n_out())
    }

    /// Number of lines.
    pub fn n_lines(&self) -> usize {
        self.s.len()
    }

    /// Number of sensors.
    pub fn n_out(&self) -> usize {
        self.out_rows.nrows()
    }

    /// Number of measured forces.
    pub fn n_in(&self) -> usize {
        self.in_rows.nrows()
    }
}
