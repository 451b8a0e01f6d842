//! Scalar springs (CELAS1/2) and dashpots (CDAMP1/2) between two components, or one and ground.

use super::Matrices;
use crate::parameter::{Factors, Quantity};
use crate::scalar::Scalar;
use crate::small::Mat;

/// A scalar spring or dashpot over one or two displacement components.
#[derive(Debug, Clone, PartialEq)]
pub struct ScalarElement {
    /// Stiffness.
    pub k: f64,
    /// Loss factor of the stiffness.
    pub eta: f64,
    /// Viscous damping.
    pub c: f64,
    /// Number of components: 1 = to ground, 2.
    pub n: usize,
}

impl ScalarElement {
    /// K, C and the loss matrix over the components.
    #[must_use]
    pub fn matrices<S: Scalar>(&self, f: &Factors<S>) -> Matrices<S> {
        let k = f.of(Quantity::K(0)) * self.k;
        let c = f.of(Quantity::C(0)) * self.c;
        let h = k * f.of(Quantity::Eta) * self.eta;
        let some = |v: S, there: bool| there.then(|| self.pair(v));
        Matrices {
            k: some(k, self.k != 0.0),
            m: None,
            c: some(c, self.c != 0.0),
            h: some(h, self.k * self.eta != 0.0),
        }
    }

    fn pair<S: Scalar>(&self, v: S) -> Mat<S> {
        let mut out = Mat::zeros(self.n, self.n);
        for i in 0..self.n {
            for j in 0..self.n {
                out[(i, j)] = if i == j { v } else { -v };
            }
        }
        out
    }
}
