//! Periodic steady state of a modal model with nonlinear laws on one coordinate, and its branch over frequency.
//!
//! All that is linear is condensed to the laws' coordinate d: its harmonics obey `D_n + c(n w) F_n(d) = D_0,n`, with the
//! receptance c of the model there and the motion D_0 without the laws (w the forcing frequency). The forces' harmonics
//! follow from those of the motion over samples of a period (alternating frequency/time: Cameron and Griffin, J. Appl.
//! Mech. 56 (1989) 149), the equations are solved by Newton with exact tangents, and the branch is followed over
//! frequency by pseudo-arclength (Keller 1977), which goes around the turning points where a sweep falls. The cost does
//! not depend on the size of the mesh. Stability is not computed.

mod aft;
mod balance;
mod continuation;
mod elimination;
mod linear;
#[cfg(test)]
mod tests;

use crate::laws::{Law, LawError};
use crate::simulate::{ModalModel, SimulationError};
use balance::Balance;
use num_complex::Complex64;
use rayon::prelude::*;

/// Most harmonics of a balance: beyond it the dense equations are no longer small.
pub const MAX_HARMONICS: usize = 64;

/// A modal model with one coordinate for laws under forces of one frequency.
#[derive(Clone, Copy, Debug)]
pub struct Steady<'a> {
    /// The model; `w` has one row.
    pub model: ModalModel<'a>,
    /// Complex amplitude of each input at level 1 (n_in), N: Re(u exp(i w t)).
    pub force: &'a [Complex64],
    /// Band in which the branch is followed, rad/s; it starts at the lower end.
    pub band: (f64, f64),
}

/// How a branch is computed.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Highest harmonic; the mean and all harmonics up to it are balanced.
    pub harmonics: usize,
    /// Samples of a period; more than twice the harmonics.
    pub samples: usize,
    /// Periods run before the one that is read, for laws with an internal state.
    pub settling: usize,
    /// Largest step: share of the amplitude, and of the band, that changes in it.
    pub max_step: f64,
    /// Most points of a branch.
    pub max_points: usize,
    /// Turning points after which the branch is followed no further; 1 for what a sweep up goes through before it falls.
    pub max_folds: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            harmonics: 7,
            samples: 128,
            settling: 2,
            max_step: 0.1,
            max_points: 4000,
            max_folds: usize::MAX,
        }
    }
}

/// A turning point of a branch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fold {
    /// Point of the branch.
    pub point: usize,
    /// Whether the branch turns back towards lower frequencies there: a sweep up falls.
    pub upper: bool,
}

/// How a branch ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ended {
    /// At the upper end of the band.
    Upper,
    /// Back at the lower end of the band.
    Lower,
    /// After `max_points`.
    MaxPoints,
    /// At the last of `max_folds` turning points.
    MaxFolds,
    /// Inside the band, where even the shortest step did not converge.
    Stuck,
}

/// A branch of periodic motions. Harmonics are D_n of `d(t) = Re sum D_n exp(i n w t)`, n = 0 the mean.
#[derive(Clone, Debug)]
pub struct Branch {
    /// Frequencies (n_points), rad/s, in the order of the branch: they fall between an upper and a lower turning point.
    pub omega: Vec<f64>,
    /// Motion of the laws' coordinate (n_points, harmonics + 1), m.
    pub d: Vec<Complex64>,
    /// Force of all laws against it (n_points, harmonics + 1), N.
    pub f: Vec<Complex64>,
    /// Displacement at the outputs (n_points, n_out, harmonics + 1), m.
    pub y: Vec<Complex64>,
    /// Turning points, which are points of the branch.
    pub folds: Vec<Fold>,
    /// How it ended.
    pub ended: Ended,
    /// Newton iterations in all.
    pub n_iterations: usize,
}

/// A branch that cannot be computed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum HarmonicError {
    /// A law that cannot be used.
    #[error(transparent)]
    Law(#[from] LawError),
    /// A model whose arrays do not fit or make no sense.
    #[error(transparent)]
    Model(#[from] SimulationError),
    /// An argument that makes no sense.
    #[error("{name} = {value}; it must be {need}")]
    Value {
        /// Argument.
        name: &'static str,
        /// Value given.
        value: f64,
        /// What it must be.
        need: &'static str,
    },
    /// No periodic motion found where the branch should start.
    #[error(
        "no periodic motion was found at {freq_hz:.6} Hz, where the branch starts, at level {level}; \
             start the band further below the resonance, or ask for more harmonics and samples"
    )]
    NoStart {
        /// Lower end of the band, Hz.
        freq_hz: f64,
        /// Level.
        level: f64,
    },
}

/// The branch of periodic motions under the force times `level` (> 0) that starts at the lower end of the band.
///
/// # Errors
/// [`HarmonicError`]. A branch that ends inside the band is none: see [`Branch::ended`].
pub fn branch(steady: &Steady, laws: &[Law], level: f64, options: &Options) -> Result<Branch, HarmonicError> {
    checked(steady, options)?;
    if !(level > 0.0 && level.is_finite()) {
        return Err(HarmonicError::Value { name: "level", value: level, need: "a finite number > 0" });
    }
    continuation::follow(&Balance::new(steady, laws, level, options)?, steady.band, options)
}

/// Branches of many sets of laws, each at every level, on all cores: those of the first set come first.
///
/// # Errors
/// As [`branch`], the first in that order.
pub fn branches(
    steady: &Steady,
    laws: &[Vec<Law>],
    levels: &[f64],
    options: &Options,
) -> Result<Vec<Branch>, HarmonicError> {
    let jobs: Vec<(&Vec<Law>, f64)> =
        laws.iter().flat_map(|laws| levels.iter().map(move |level| (laws, *level))).collect();
    let done: Vec<_> = jobs.par_iter().map(|(laws, level)| branch(steady, laws, *level, options)).collect();
    done.into_iter().collect()
}

fn checked(steady: &Steady, options: &Options) -> Result<(), HarmonicError> {
    let refuse = |name, value, need| Err(HarmonicError::Value { name, value, need });
    steady.model.check(1, steady.force.len())?;
    if let Some(bad) = steady.force.iter().find(|u| !(u.re.is_finite() && u.im.is_finite())) {
        return refuse("force", bad.norm(), "finite");
    }
    let (low, high) = steady.band;
    if !(low > 0.0 && low.is_finite()) {
        return refuse("lower end of the band", low, "a finite frequency > 0");
    }
    if !(high > low && high.is_finite()) {
        return refuse("upper end of the band", high, "a finite frequency above the lower end");
    }
    if !(1..=MAX_HARMONICS).contains(&options.harmonics) {
        return refuse("harmonics", options.harmonics as f64, "1 to 64");
    }
    if options.samples <= 2 * options.harmonics {
        return refuse("samples", options.samples as f64, "more than twice the harmonics");
    }
    if !(options.max_step > 0.0 && options.max_step <= 1.0) {
        return refuse("max_step", options.max_step, "more than 0 and at most 1");
    }
    if options.max_folds == 0 {
        return refuse("max_folds", 0.0, "1 or more");
    }
    if options.max_points < 2 {
        return refuse("max_points", options.max_points as f64, "2 or more");
    }
    Ok(())
}
