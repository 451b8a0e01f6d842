//! Rod (CROD, CONROD): axial force and torsion. Consistent mass is that of a linear bar in all three directions;
//! a rod has no rotary inertia.

use super::{Matrices, lossy};
use crate::mesh::{Material, RodSection};
use crate::parameter::{Factors, Quantity};
use crate::scalar::Scalar;
use crate::small::Mat;

/// A rod.
#[derive(Debug, Clone, PartialEq)]
pub struct RodElement {
    /// Material.
    pub material: Material,
    /// Section.
    pub section: RodSection,
    /// Length.
    pub length: f64,
    /// Unit vector from end A to B.
    pub axis: [f64; 3],
    /// Consistent mass?
    pub coupled_mass: bool,
    /// Components per node: 3 without torsion, 6 with.
    pub width: usize,
}

impl RodElement {
    /// K, M and the loss matrix in basic axes.
    #[must_use]
    pub fn matrices<S: Scalar>(&self, f: &Factors<S>) -> Matrices<S> {
        let el = f.elastic(0, &self.material);
        let (w, l) = (self.width, self.length);
        let area = f.of(Quantity::A) * self.section.a;
        let mut k = Mat::zeros(2 * w, 2 * w);
        let mut springs = vec![(0, el.e * area * (1.0 / l))];
        if w == 6 {
            springs.push((3, el.g * f.of(Quantity::J) * (self.section.j / l)));
        }
        for (first, stiffness) in springs {
            for i in 0..3 {
                for j in 0..3 {
                    let s = stiffness * (self.axis[i] * self.axis[j]);
                    k[(first + i, first + j)] += s;
                    k[(w + first + i, w + first + j)] += s;
                    k[(first + i, w + first + j)] += -s;
                    k[(w + first + i, first + j)] += -s;
                }
            }
        }
        let mass = (el.rho * area + S::c(self.section.nsm)) * l;
        let (own, cross) = if self.coupled_mass { (1.0 / 3.0, 1.0 / 6.0) } else { (0.5, 0.0) };
        let mut m = Mat::zeros(2 * w, 2 * w);
        for c in 0..3 {
            for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                m[(w * i + c, w * j + c)] = mass * if i == j { own } else { cross };
            }
        }
        Matrices { h: lossy(&k, el.eta), k: Some(k), m: Some(m), c: None }
    }
}
