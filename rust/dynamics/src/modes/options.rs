//! What modes are asked for with.

use femend_linalg::Dense;

/// Models up to this size are solved densely.
pub(super) const SMALL: usize = 300;

/// What to compute.
#[derive(Debug, Clone, Default)]
pub struct ModeOptions {
    /// The lowest `n_modes`; with `f_max` at most so many.
    pub n_modes: Option<usize>,
    /// All modes up to this frequency in Hz.
    pub f_max: Option<f64>,
    /// Shift in rad²/s², below the lowest mode; automatic if absent.
    pub sigma: Option<f64>,
    /// Shapes (n, k) near the wanted ones, e.g. of the previous parameter set.
    pub start: Option<Dense>,
    /// Leave out the inertia count at the upper end.
    pub unchecked: bool,
}
