//! Matrix terms given directly (DMIG): a dense block between DOFs in their displacement frames.

use super::Matrices;
use crate::mesh::DirectKind;
use crate::scalar::Scalar;
use crate::small::Mat;

/// A symmetric block of one direct matrix.
#[derive(Debug, Clone, PartialEq)]
pub struct DirectElement {
    /// What it is added to.
    pub kind: DirectKind,
    /// The block.
    pub values: Mat<f64>,
}

impl DirectElement {
    /// The block as a matrix of its kind. No factor acts on it.
    #[must_use]
    pub fn matrices<S: Scalar>(&self) -> Matrices<S> {
        let mut out = Matrices::default();
        let part = match self.kind {
            DirectKind::K => &mut out.k,
            DirectKind::M => &mut out.m,
            DirectKind::C => &mut out.c,
            DirectKind::H => &mut out.h,
        };
        *part = Some(Mat::lift(&self.values));
        out
    }
}
