//! Gyroscopic matrices of spinning parts.

use crate::element::spin::SpinAxes;
use crate::error::FemError;
use crate::mesh::Id;
use crate::model::Model;
use crate::pattern::antisymmetrise;
use crate::small::{norm3, scale3};

/// A part that spins.
#[derive(Debug, Clone, PartialEq)]
pub struct Spin {
    /// Direction of the spin axis, basic coordinates; the part turns about it by the right hand.
    pub axis: [f64; 3],
    /// Axes in which its vibration is described.
    pub axes: SpinAxes,
    /// Elements of the part (masses with these ids included); `None` = all.
    pub elements: Option<Vec<Id>>,
}

/// Matrices on [`Model::pattern`]: with speed W the equation of motion is
/// `M u'' + (C + W G) u' + (K + W² S) u = f`.
#[derive(Debug, Clone, PartialEq)]
pub struct Gyroscopic {
    /// G, antisymmetric, per rad/s.
    pub g: Vec<f64>,
    /// S, symmetric, per (rad/s)²; zero in fixed axes. Stiffening by centrifugal preload is not in it.
    pub softening: Vec<f64>,
}

impl Model {
    /// Gyroscopic matrix of a spinning part per unit of speed.
    ///
    /// Rotating axes: every element with mass counts (shells by their middle plane, beams across the axis without rotary
    /// inertia). Fixed axes: beams along the axis and concentrated masses, symmetric about it.
    ///
    /// # Errors
    /// [`FemError::Spin`] for an axis of zero length, [`FemError::UnknownElement`], [`FemError::Element`] for an element
    /// that cannot spin in fixed axes; as [`Model::assemble`].
    pub fn gyroscopic(&self, factors: &[f64], spin: &Spin) -> Result<Gyroscopic, FemError> {
        self.check_factors(factors)?;
        let length = norm3(spin.axis);
        if !(length > 0.0 && length.is_finite()) {
            return Err(FemError::Spin { axis: spin.axis });
        }
        let a = scale3(1.0 / length, spin.axis);
        let chosen = match &spin.elements {
            None => None,
            Some(ids) => {
                let known: std::collections::HashSet<Id> = self.elements.iter().map(|e| e.id).collect();
                if let Some(&id) = ids.iter().find(|id| **id == 0 || !known.contains(id)) {
                    return Err(FemError::UnknownElement { id });
                }
                Some(ids.iter().copied().collect::<std::collections::HashSet<Id>>())
            }
        };
        let n = self.pattern().nnz();
        let (mut g, mut softening) = (vec![0.0; n], vec![0.0; n]);
        for (e, element) in self.elements.iter().enumerate() {
            if chosen.as_ref().is_some_and(|ids| !ids.contains(&element.id)) {
                continue;
            }
            let fail = |why| FemError::Element { what: element.card.to_owned(), id: element.id, why };
            let f = self.element_factors(e, |i| factors[i]);
            if let Some((own, soft)) = element.spin(&f, a, spin.axes).map_err(fail)? {
                self.scatter.add(e, &own.scaled(self.wtmass()), &mut g);
                self.scatter.add(e, &soft.scaled(self.wtmass()), &mut softening);
            }
        }
        antisymmetrise(self.pattern(), self.scatter.mirror(), &mut g);
        self.scatter.symmetrise(&mut softening);
        Ok(Gyroscopic { g, softening })
    }
}
