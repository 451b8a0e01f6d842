//! Closed-loop response from rest of a modal model with local laws attached.
//!
//! Every mode is stepped exactly for forces that are linear over a substep; a law's force at the end of the substep is
//! found with the motion it causes (implicit), so the cost does not depend on the size of the mesh. A linear hold with
//! an implicit end is the linear acceleration method at the law's coordinate: accurate, but unstable above a stiffness
//! given by the modes' response at the Nyquist frequency of the substep. Only where a law is stiffer than that, a series
//! compliance takes the excess away (with the whole of it the scheme is the average acceleration method, stable for any
//! stiffness). Modes whose half period is close to a substep follow their force statically.

mod abreast;
mod beside;
mod decimate;
mod lane;
mod modal;
mod newton;
mod run;
mod sensitivity;
mod stable;

pub use run::{simulate, simulate_tangents};

use crate::laws::{Law, LawError};

/// Most law coordinates in one simulation.
pub const MAX_COORDINATES: usize = 10;

/// Modal model, all arrays row by row; mass-normalised shapes.
#[derive(Clone, Copy, Debug)]
pub struct ModalModel<'a> {
    /// Circular frequencies (r), rad/s; zero for rigid-body modes.
    pub omega: &'a [f64],
    /// Damping ratios (r).
    pub zeta: &'a [f64],
    /// Modal coordinates of the inputs (n_in, r).
    pub phi_in: &'a [f64],
    /// Modal coordinates of the outputs (n_out, r).
    pub phi_out: &'a [f64],
    /// Modal coordinates of the laws' directions (n_w, r).
    pub w: &'a [f64],
    /// Static compliance of the omitted modes at the laws' coordinates (n_w, n_w), m/N.
    pub residual_compliance: Option<&'a [f64]>,
}

/// Quantity given out at the rows of `phi_out`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Output {
    /// m
    Displacement,
    /// m/s
    Velocity,
    /// m/s^2, with the instantaneous effect of the forces at the sample
    Acceleration,
}

/// What is simulated.
#[derive(Clone, Copy, Debug)]
pub struct Run<'a> {
    /// Inputs (n_in, n), N, row by row.
    pub u: &'a [f64],
    /// Number of input samples.
    pub n: usize,
    /// Step of the input samples, s.
    pub dt: f64,
    /// Parts of a step, the input linear inside.
    pub substeps: usize,
    /// Every how many input samples an output is kept.
    pub stride: usize,
    /// How many of these are filtered to one, as a recorder does it; 1 leaves them as they are.
    pub decimate: usize,
    /// Output quantity.
    pub output: Output,
}

/// How a simulation went.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Status {
    /// First kept sample that is not to be trusted; the rest of the record is NaN.
    pub failed_at: Option<usize>,
    /// What happened there and what to do; empty when all went well.
    pub advice: String,
    /// Newton iterations of the whole record.
    pub n_iterations: usize,
    /// Modes too fast for the substep, taken statically.
    pub n_static_modes: usize,
    /// Share (0 to 1) of the stabilising compliance in use.
    pub added_compliance: f64,
}

/// Histories at the kept samples, row by row.
#[derive(Clone, Debug, Default)]
pub struct Response {
    /// Kept samples.
    pub n: usize,
    /// Outputs (n_out, n).
    pub y: Vec<f64>,
    /// Displacement of the laws' coordinates (n_w, n), m.
    pub d: Vec<f64>,
    /// Their velocity (n_w, n), m/s.
    pub v: Vec<f64>,
    /// Law forces against the motion (n_w, n), N.
    pub f: Vec<f64>,
    /// Derivatives of y (n_wanted, n_out, n), parameters in the order of coordinates and laws; empty if not asked for.
    pub dy: Vec<f64>,
    /// Derivatives of f (n_wanted, n_w, n); empty if not asked for.
    pub df: Vec<f64>,
    /// Outputs of the moved models (n_moved, n_out, n).
    pub moved_y: Vec<f64>,
    /// Law forces there (n_moved, n_w, n).
    pub moved_f: Vec<f64>,
    /// How it went.
    pub status: Status,
}

/// A simulation that cannot be set up.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SimulationError {
    /// A law that cannot be used.
    #[error(transparent)]
    Law(#[from] LawError),
    /// Arrays that do not fit together.
    #[error("{name} has {given} values, {expected} are needed ({why})")]
    Shape {
        /// Array.
        name: &'static str,
        /// Its size.
        given: usize,
        /// Size needed.
        expected: usize,
        /// Where the size comes from.
        why: &'static str,
    },
    /// A value that makes no sense.
    #[error("{name}{place} = {value}; it must be {need}")]
    Value {
        /// Quantity.
        name: &'static str,
        /// Index text, such as `[3]`.
        place: String,
        /// Value given.
        value: f64,
        /// What it must be.
        need: &'static str,
    },
}

impl ModalModel<'_> {
    fn n_modes(&self) -> usize {
        self.omega.len()
    }

    pub(crate) fn check(&self, n_w: usize, n_in: usize) -> Result<(), SimulationError> {
        let r = self.n_modes();
        if r == 0 {
            let need = "1 or more; keep at least one mode";
            return Err(SimulationError::Value {
                name: "number of modes",
                place: String::new(),
                value: 0.0,
                need,
            });
        }
        let shape = |name, given, expected, why| {
            if given == expected {
                Ok(())
            } else {
                Err(SimulationError::Shape { name, given, expected, why })
            }
        };
        shape("zeta", self.zeta.len(), r, "one for each omega")?;
        shape("phi_in", self.phi_in.len(), n_in * r, "n_in x n_modes")?;
        shape("phi_out", self.phi_out.len() % r, 0, "a multiple of n_modes")?;
        shape("w", self.w.len(), n_w * r, "one row of n_modes for each list of laws")?;
        if let Some(residual) = self.residual_compliance {
            shape("residual_compliance", residual.len(), n_w * n_w, "n_w x n_w")?;
            finite("residual_compliance", residual)?;
        }
        for (name, values) in [("phi_in", self.phi_in), ("phi_out", self.phi_out), ("w", self.w)] {
            finite(name, values)?;
        }
        for (name, values) in [("omega", self.omega), ("zeta", self.zeta)] {
            if let Some(i) = values.iter().position(|x| !(*x >= 0.0 && x.is_finite())) {
                let need = "a finite number >= 0";
                return Err(SimulationError::Value { name, place: format!("[{i}]"), value: values[i], need });
            }
        }
        Ok(())
    }
}

impl Run<'_> {
    fn check(&self) -> Result<usize, SimulationError> {
        let value =
            |name, value, need| Err(SimulationError::Value { name, place: String::new(), value, need });
        if !(self.dt > 0.0 && self.dt.is_finite()) {
            return value("dt", self.dt, "a finite number > 0");
        }
        if self.substeps == 0 {
            return value("substeps", 0.0, "1 or more");
        }
        if self.stride == 0 {
            return value("stride", 0.0, "1 or more");
        }
        if self.decimate == 0 {
            return value("decimate", 0.0, "1 or more");
        }
        if self.n == 0 {
            return value("number of samples", 0.0, "1 or more");
        }
        finite("u", self.u)?;
        Ok(self.u.len() / self.n)
    }
}

fn finite(name: &'static str, values: &[f64]) -> Result<(), SimulationError> {
    match values.iter().position(|x| !x.is_finite()) {
        None => Ok(()),
        Some(i) => {
            let need = "finite (index counts through the rows)";
            Err(SimulationError::Value { name, place: format!("[{i}]"), value: values[i], need })
        }
    }
}

/// Number of parameters of all laws of all coordinates.
pub fn n_parameters(laws: &[Vec<Law>]) -> usize {
    laws.iter().flatten().map(|law| law.values().len()).sum()
}
