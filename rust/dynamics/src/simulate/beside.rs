//! What derivatives go beside: the model as it is with its substeps taken down, and the same moved a little.

use super::MAX_COORDINATES;
use super::modal::Stepper;
use super::newton::{Compliance, Forces, Motions};
use crate::laws::{Joint, Linearised};

pub(super) type Square = [[f64; MAX_COORDINATES]; MAX_COORDINATES];

/// A model moved a little, with what couples its coordinates.
pub(super) struct Moved {
    pub(super) stepper: Stepper,
    pub(super) compliance: Compliance,
    /// The same at the start from rest.
    pub(super) compliance_at_rest: Compliance,
}

/// What the model as it is did in a substep.
#[derive(Default)]
pub(super) struct Frame {
    pub(super) x: Motions,
    pub(super) f: Forces,
    pub(super) slopes: [[f64; 3]; MAX_COORDINATES],
    pub(super) at: Vec<Linearised>,
    /// Inputs at the end of the substep.
    pub(super) u: Vec<f64>,
    /// Whether this is the start from rest.
    pub(super) first: bool,
    /// Kept sample at its end.
    pub(super) kept: Option<usize>,
}

/// What belongs to all substeps.
pub(super) struct Model<'a> {
    pub(super) stepper: &'a Stepper,
    pub(super) joints: &'a [Joint],
    pub(super) compliance: &'a Compliance,
    /// The same at the start from rest.
    pub(super) compliance_at_rest: &'a Compliance,
    /// Velocity compliance that acts on the force at the start of the substep.
    pub(super) memory: &'a Square,
    /// The stabilising compliance at its full share.
    pub(super) lacking: &'a Square,
    pub(super) moved: &'a [Moved],
    /// Whether some law depends on the acceleration.
    pub(super) inertial: bool,
}
