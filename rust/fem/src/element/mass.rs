//! Concentrated masses (CONM1, CONM2) and masses added by a configuration.

use super::Matrices;
use crate::mesh::MassKind;
use crate::parameter::{Factors, Quantity};
use crate::scalar::Scalar;
use crate::small::{Mat, rigid};

/// A concentrated mass at a node.
#[derive(Debug, Clone, PartialEq)]
pub struct MassElement {
    /// Matrix.
    pub kind: MassKind,
    /// Components: 3 for a mass without offset and inertia, else 6.
    pub width: usize,
}

impl MassElement {
    /// A mass over as few components as it needs.
    #[must_use]
    pub fn new(kind: MassKind) -> Self {
        let width = match &kind {
            MassKind::Conm2 { offset, inertia, .. } if *offset == [0.0; 3] && *inertia == [[0.0; 3]; 3] => 3,
            _ => 6,
        };
        Self { kind, width }
    }

    /// M in basic axes.
    #[must_use]
    pub fn matrices<S: Scalar>(&self, f: &Factors<S>) -> Matrices<S> {
        let factor = f.of(Quantity::M);
        let m = match &self.kind {
            MassKind::Conm1(matrix) => {
                let mut out = Mat::zeros(6, 6);
                for i in 0..6 {
                    for j in 0..6 {
                        out[(i, j)] = factor * (0.5 * (matrix[i][j] + matrix[j][i]));
                    }
                }
                out
            }
            MassKind::Conm2 { m, offset, inertia } => {
                let mut at_cg = Mat::zeros(6, 6);
                for i in 0..3 {
                    at_cg[(i, i)] = factor * *m;
                    for j in 0..3 {
                        at_cg[(3 + i, 3 + j)] = S::c(inertia[i][j]);
                    }
                }
                if self.width == 3 {
                    let mut out = Mat::zeros(3, 3);
                    for i in 0..3 {
                        out[(i, i)] = at_cg[(i, i)];
                    }
                    out
                } else {
                    at_cg.congruence(&rigid(*offset))
                }
            }
        };
        Matrices { k: None, m: Some(m), c: None, h: None }
    }
}
