//! Stress (geometric) stiffness of a preloaded structure.

use crate::error::FemError;
use crate::model::{BATCH, Model};
use rayon::prelude::*;

impl Model {
    /// Stress stiffness on [`Model::pattern`] of the stresses that the displacements `u` (n_a) make: small vibration
    /// about the preloaded state has the stiffness `K + K_sigma`.
    ///
    /// Beams and rods count with their axial force, shells with their membrane forces, solids with all stresses; springs,
    /// bushes and direct matrices have none. The load keeps its direction, and constraint equations stay those of the
    /// undeformed structure.
    ///
    /// # Errors
    /// [`FemError::Shape`] when `u` is not n_a long, [`FemError::Element`] when an element has no finite stress with
    /// these factors; as [`Model::assemble`].
    pub fn stress_stiffness(&self, factors: &[f64], u: &[f64]) -> Result<Vec<f64>, FemError> {
        self.check_factors(factors)?;
        let g = self.recover(u, 1)?;
        let one = |e: usize| {
            let element = &self.elements[e];
            let own: Vec<f64> = element.rows.iter().map(|&row| g[row]).collect();
            let t = self.basic_from_frames(element);
            let n = own.len();
            let basic: Vec<f64> = (0..n).map(|i| (0..n).map(|j| t[(i, j)] * own[j]).sum()).collect();
            element.stress_stiffness(&self.element_factors(e, |i| factors[i]), &basic)
        };
        let mut out = vec![0.0; self.pattern().nnz()];
        let all: Vec<usize> = (0..self.elements.len()).collect();
        for batch in all.chunks(BATCH) {
            let parts: Vec<_> = batch.par_iter().with_min_len(64).map(|&e| one(e)).collect();
            for (&e, part) in batch.iter().zip(&parts) {
                let Some(k) = part else { continue };
                if k.data.iter().any(|v| !v.is_finite()) {
                    let element = &self.elements[e];
                    let why = "has no finite stress with these displacements".to_owned();
                    return Err(FemError::Element { what: element.card.to_owned(), id: element.id, why });
                }
                self.scatter.add(e, k, &mut out);
            }
        }
        self.scatter.symmetrise(&mut out);
        Ok(out)
    }
}
