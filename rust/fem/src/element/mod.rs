//! Elements, one file each: from factors on the deck's values to K, M, C and the structural damping matrix.
//!
//! Every element returns matrices in basic coordinates over the g-set rows it lists. Arithmetic is generic over
//! [`Scalar`], so the same code gives exact derivatives.

use crate::mesh::{Id, Rotation};
use crate::parameter::Factors;
use crate::scalar::Scalar;
use crate::small::Mat;

pub mod beam;
mod beam_stress;
pub mod bush;
pub mod direct;
pub mod mass;
pub mod plane_law;
mod plane_point;
pub mod quad4;
pub mod quadrature;
pub mod rod;
pub mod scalar_element;
pub mod shell;
pub mod shell_section;
pub mod solid;
pub mod solid_shape;
pub mod spin;
pub mod tria3;

/// Matrices of one element; `None` = zero.
#[derive(Debug, Clone, PartialEq)]
pub struct Matrices<S> {
    /// Stiffness.
    pub k: Option<Mat<S>>,
    /// Mass.
    pub m: Option<Mat<S>>,
    /// Viscous damping.
    pub c: Option<Mat<S>>,
    /// Structural damping: imaginary part of the stiffness (loss factor times stiffness).
    pub h: Option<Mat<S>>,
}

impl<S> Default for Matrices<S> {
    fn default() -> Self {
        Self { k: None, m: None, c: None, h: None }
    }
}

/// The element itself, ready to be evaluated.
#[derive(Debug, Clone, PartialEq)]
pub enum Data {
    /// CBAR, CBEAM.
    Beam(beam::BeamElement),
    /// CROD, CONROD.
    Rod(rod::RodElement),
    /// CELAS, CDAMP.
    Scalar(scalar_element::ScalarElement),
    /// CBUSH.
    Bush(bush::BushElement),
    /// CONM1, CONM2 and masses added by a configuration.
    Mass(mass::MassElement),
    /// CQUAD4, CTRIA3.
    Shell(Box<shell::ShellElement>),
    /// CTETRA, CPENTA, CHEXA, CPYRAM.
    Solid(solid::SolidElement),
    /// DMIG.
    Direct(direct::DirectElement),
}

/// An element with its place in the model.
#[derive(Debug, Clone, PartialEq)]
pub struct Element {
    /// Element id; 0 for a mass added by a configuration and for direct matrices.
    pub id: Id,
    /// Card name.
    pub card: &'static str,
    /// Property id if there is one.
    pub property: Option<Id>,
    /// Material ids, by slot.
    pub materials: Vec<Id>,
    /// Node indices.
    pub nodes: Vec<usize>,
    /// Rows of the g-set its matrices stand for.
    pub rows: Vec<usize>,
    /// Are the rows already in displacement frames (scalar springs)? Otherwise the matrices are in basic axes.
    pub in_displacement_frames: bool,
    /// The element.
    pub data: Data,
}

impl Element {
    /// Matrices with factors, without PARAM,G and WTMASS.
    #[must_use]
    pub fn matrices<S: Scalar>(&self, factors: &Factors<S>) -> Matrices<S> {
        match &self.data {
            Data::Beam(e) => e.matrices(factors),
            Data::Rod(e) => e.matrices(factors),
            Data::Scalar(e) => e.matrices(factors),
            Data::Bush(e) => e.matrices(factors),
            Data::Mass(e) => e.matrices(factors),
            Data::Shell(e) => e.matrices(factors),
            Data::Solid(e) => e.matrices(factors),
            Data::Direct(e) => e.matrices(),
        }
    }

    /// Stress stiffness of the stresses that displacements `u` of its rows make; `None` for elements without any.
    /// Everything in basic axes.
    #[must_use]
    pub fn stress_stiffness(&self, factors: &Factors<f64>, u: &[f64]) -> Option<Mat<f64>> {
        match &self.data {
            Data::Beam(e) => e.stress_stiffness(factors, u),
            Data::Rod(e) => e.stress_stiffness(factors, u),
            Data::Shell(e) => e.stress_stiffness(factors, u),
            Data::Solid(e) => e.stress_stiffness(factors, u),
            Data::Scalar(_) | Data::Bush(_) | Data::Mass(_) | Data::Direct(_) => None,
        }
    }

    /// Is this a concentrated mass? Masses and other elements may share an id.
    #[must_use]
    pub fn is_mass(&self) -> bool {
        matches!(self.data, Data::Mass(_))
    }

    /// Local axes in basic coordinates and length of a beam, `None` for other elements.
    #[must_use]
    pub fn beam_frame(&self) -> Option<(Rotation, f64)> {
        match &self.data {
            Data::Beam(e) => Some((e.frame, e.length)),
            _ => None,
        }
    }
}

/// Rows of the g-set: the first `n` components of every node.
#[must_use]
pub fn node_rows(nodes: &[usize], n: usize) -> Vec<usize> {
    nodes.iter().flat_map(|&node| (0..n).map(move |c| 6 * node + c)).collect()
}

/// Loss factor times stiffness, `None` when the loss factor is zero.
#[must_use]
pub fn lossy<S: Scalar>(k: &Mat<S>, eta: S) -> Option<Mat<S>> {
    (!eta.is_zero()).then(|| k.scaled(eta))
}
