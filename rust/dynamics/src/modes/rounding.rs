//! What is left of a stiffness where rounding is larger.

use femend_linalg::{Dense, Factor, SymmetricCsc};

/// Rounding of `φᵀ K φ`, a few units in the last place of `|φ|ᵀ |K| |φ|`.
const UNITS: f64 = 64.0 * f64::EPSILON;

/// A stiffness with the sums of its rows' sizes.
pub(super) struct Rounding<'a> {
    k: &'a SymmetricCsc,
    rows: Vec<f64>,
}

impl<'a> Rounding<'a> {
    pub fn of(k: &'a SymmetricCsc) -> Self {
        let row = |j: usize| k.pattern().range(j).map(|e| k.values()[e].abs()).sum();
        Self { k, rows: (0..k.n()).map(row).collect() }
    }

    /// Whether the energy `φᵀ K φ` of a shape is no more than what rounding leaves.
    pub fn hides(&self, phi: &[f64], energy: f64) -> bool {
        // row sums bound |φ|ᵀ |K| |φ| at less work
        let bound: f64 = phi.iter().zip(&self.rows).map(|(v, r)| v * v * r).sum();
        energy.abs() <= UNITS * bound && energy.abs() <= UNITS * self.size(phi)
    }

    /// `|φ|ᵀ |K| |φ|`.
    fn size(&self, phi: &[f64]) -> f64 {
        let row = |j: usize| -> f64 {
            let entry = |e: usize| (self.k.values()[e] * phi[self.k.pattern().row_idx()[e] as usize]).abs();
            self.k.pattern().range(j).map(entry).sum()
        };
        phi.iter().enumerate().map(|(j, v)| v.abs() * row(j)).sum()
    }
}

/// Whether a stiffness whose `factor` exists holds nothing: rounding can leave the pivots of a free body positive. Forces on
/// masses that have no pattern move it then as a rigid body, by far, and hardly strain it.
pub(super) fn free_all_the_same(k: &SymmetricCsc, m: &SymmetricCsc, factor: &Factor) -> bool {
    // alternating signs and sizes, the same at every call
    let uneven = |j: usize| (1.0 + (j % 7) as f64) * if j.is_multiple_of(3) { -1.0 } else { 1.0 };
    let start = Dense::from_vec(k.n(), 1, (0..k.n()).map(uneven).collect());
    let x = factor.solve(&m.times(&start));
    let energy: f64 = x.col(0).iter().zip(k.times(&x).col(0)).map(|(a, b)| a * b).sum();
    let moves = x.col(0).iter().any(|v| *v != 0.0);
    // where nothing has mass nothing moves, and what is not even a number no shape can be
    moves && (!energy.is_finite() || Rounding::of(k).hides(x.col(0), energy))
}

#[cfg(test)]
mod tests {
    use super::free_all_the_same;
    use crate::modes::{ModeOptions, modes};
    use femend_linalg::{Factor, Kind, Ordering, Pattern, Symbolic, SymmetricCsc};
    use std::sync::Arc;

    const N: usize = 400;

    /// K and M of a chain of masses on springs of different stiffness, the first on one of stiffness `held`.
    fn chain(held: f64) -> (Arc<Symbolic>, SymmetricCsc, SymmetricCsc) {
        let spring = |j: usize| 1e6 * (1.0 + 0.3 * (j as f64).sin());
        let pattern = Arc::new(Pattern::from_entries(N, (1..N).map(|i| (i, i - 1))).unwrap());
        let before = |j: usize| if j == 0 { held } else { spring(j - 1) };
        let after = |j: usize| if j + 1 == N { 0.0 } else { spring(j) };
        let matrix = |at: &dyn Fn(usize, usize) -> f64, what| {
            let column = |j: usize| pattern.column(j).iter().map(move |&i| at(i as usize, j));
            SymmetricCsc::new(pattern.clone(), (0..N).flat_map(column).collect(), what).unwrap()
        };
        let k = matrix(&|i, j| if i == j { before(j) + after(j) } else { -spring(i.min(j)) }, "K");
        let m = matrix(&|i, j| if i == j { 2.0 } else { 0.0 }, "M");
        (Arc::new(Symbolic::new(pattern.clone(), Ordering::Auto).unwrap()), k, m)
    }

    #[test]
    fn what_rounding_alone_holds_is_free() {
        // a spring that is less than what rounding leaves of the energy of all others, and a soft one
        for (held, free) in [(1e-6, true), (1e-2, false)] {
            let (symbolic, k, m) = chain(held);
            let factor = Factor::new(symbolic.clone(), k.values(), Kind::Cholesky, None).unwrap();
            assert_eq!(free_all_the_same(&k, &m, &factor), free);
            let options = ModeOptions { n_modes: Some(6), ..Default::default() };
            let found = modes(&symbolic, &k, &m, &options).unwrap();
            assert_eq!(found.info.n_rigid, usize::from(free));
            assert_eq!(found.info.sigma < 0.0, free);
            // of the slow mode itself rounding is all that is left
            assert!(found.residual[1..].iter().all(|r| *r < 1e-7), "{:?}", found.residual);
        }
    }

    #[test]
    fn where_nothing_has_mass_nothing_is_free() {
        let (symbolic, k, m) = chain(1e-2);
        let factor = Factor::new(symbolic, k.values(), Kind::Cholesky, None).unwrap();
        assert!(!free_all_the_same(&k, &m.plus(-1.0, &m), &factor));
    }
}
