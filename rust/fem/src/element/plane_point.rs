//! An integration point in the plane of a shell.

/// Most DOFs of a shell, internal ones included.
pub(crate) const MAX: usize = 28;

/// One integration point: everything but the material. Rows are over six components per corner, internal ones last.
pub(crate) struct PlanePoint<S> {
    /// Weight times Jacobian.
    pub w: f64,
    /// Shape functions.
    pub n: [f64; 4],
    /// Their gradients in the plane.
    pub grad: [[f64; 2]; 4],
    /// Membrane strains, curvatures, transverse shears.
    pub strains: [[S; MAX]; 8],
}
