//! What complex modes are asked for with.

/// Models up to this size are solved in their whole space.
pub(super) const SMALL: usize = 60;

/// What to compute.
#[derive(Debug, Clone)]
pub struct ComplexOptions {
    /// The lowest modes by |λ|; with `f_max` at most so many.
    pub n_modes: Option<usize>,
    /// All modes with |λ| up to this frequency in Hz.
    pub f_max: Option<f64>,
    /// Residual to reach, ‖D(λ)ψ‖ / (‖λ²Mψ‖ + ‖λCψ‖ + ‖(K + iD - σM)ψ‖).
    pub tolerance: f64,
    /// The same of left vectors. The error of a pole goes with the product of both.
    pub left_tolerance: f64,
}
