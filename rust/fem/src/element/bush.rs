//! Bush (CBUSH): six springs and dashpots at a point between two nodes, or between a node and ground.
//!
//! The point is reached from each node by a rigid arm, so a bush of any length has six exact rigid-body modes.

use super::Matrices;
use crate::mesh::{BushProperty, Rotation};
use crate::parameter::{Factors, Quantity};
use crate::scalar::Scalar;
use crate::small::{Mat, matmul, rigid, rotations};

/// A bush with its relative-motion map.
#[derive(Debug, Clone, PartialEq)]
pub struct BushElement {
    /// Property.
    pub property: BushProperty,
    /// Relative displacement and rotation in the bush's axes (6) from nodal displacements in basic axes (6 or 12).
    pub map: Mat<f64>,
}

impl BushElement {
    /// Map for a bush whose spring sits at `arms` from its nodes (one arm = grounded).
    #[must_use]
    pub fn relative_motion(frame: &Rotation, arms: &[[f64; 3]]) -> Mat<f64> {
        let turn = rotations(frame, 2);
        let mut map = Mat::zeros(6, 6 * arms.len());
        for (n, arm) in arms.iter().enumerate() {
            let part = matmul(&turn, &rigid(*arm));
            // end B minus end A; a grounded bush measures its node's own motion
            let sign = if n == 0 && arms.len() == 2 { -1.0 } else { 1.0 };
            for i in 0..6 {
                for j in 0..6 {
                    map[(i, 6 * n + j)] = sign * part[(i, j)];
                }
            }
        }
        map
    }

    /// K, C and the loss matrix in basic axes.
    #[must_use]
    pub fn matrices<S: Scalar>(&self, f: &Factors<S>) -> Matrices<S> {
        let p = &self.property;
        let of = |i: usize| f.of(Quantity::K(i as u8)) * p.k[i];
        let diagonal = |d: &dyn Fn(usize) -> S| {
            let mut local = Mat::zeros(6, 6);
            for i in 0..6 {
                local[(i, i)] = d(i);
            }
            local.congruence(&self.map)
        };
        let has = |v: &[f64; 6]| v.iter().any(|&x| x != 0.0);
        Matrices {
            k: has(&p.k).then(|| diagonal(&of)),
            m: None,
            c: has(&p.c).then(|| diagonal(&|i| f.of(Quantity::C(i as u8)) * p.c[i])),
            h: has(&p.ge).then(|| diagonal(&|i| of(i) * f.of(Quantity::Eta) * p.ge[i])),
        }
    }
}
