//! The terms of D(s) = Σ s^p W^q A, and their products with complex vectors.

use femend_linalg::{Dense, Pattern};
use num_complex::Complex64;

use crate::modes::Compact;

/// What a term multiplies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Power {
    /// Displacements.
    Stiffness,
    /// Velocities.
    Damping,
    /// Accelerations.
    Mass,
    /// Displacements times i: structural damping.
    Structural,
}

/// A matrix with its place in the equation of motion; values on the pattern of K, in its order, symmetric or not.
#[derive(Debug, Clone)]
pub struct Term {
    /// What it multiplies.
    pub power: Power,
    /// Power of the speed W that goes with it.
    pub speed_power: i32,
    /// Values.
    pub values: Vec<f64>,
}

/// A term with its symmetric and its antisymmetric part as they are multiplied; `None` where a part is zero.
#[derive(Debug)]
pub(super) struct Parts {
    pub power: Power,
    pub speed_power: i32,
    pub symmetric: Option<Compact>,
    pub skew: Option<Compact>,
}

/// Part of an entry below which it is rounding.
const ROUNDING: f64 = 1e-14;

impl Parts {
    pub fn new(pattern: &Pattern, term: &Term) -> Self {
        let n = pattern.n();
        let mut next: Vec<u32> = pattern.col_ptr()[..n].to_vec();
        let (mut even, mut odd) = (vec![0.0; term.values.len()], vec![0.0; term.values.len()]);
        for j in 0..n {
            for k in pattern.range(j) {
                let i = pattern.row_idx()[k] as usize;
                // entry (i, j) at k, (j, i) at its mirror; row j of A is stored where column j stands
                let (a, b) = (term.values[k], term.values[next[i] as usize]);
                next[i] += 1;
                even[k] = 0.5 * (a + b);
                let half = 0.5 * (b - a);
                odd[k] = if half.abs() > ROUNDING * (a.abs() + b.abs()) { half } else { 0.0 };
            }
        }
        let part =
            |values: Vec<f64>| values.iter().any(|v| *v != 0.0).then(|| Compact::of_values(pattern, &values));
        Self { power: term.power, speed_power: term.speed_power, symmetric: part(even), skew: part(odd) }
    }

    /// Real factor at a speed.
    pub fn weight(&self, speed: f64) -> f64 {
        speed.powi(self.speed_power)
    }

    /// A X, or Aᵀ X.
    pub fn times(&self, x: &Dense, transposed: bool) -> Dense {
        let mut y = match &self.symmetric {
            Some(a) => a.times(x),
            None => Dense::zeros(x.nrows(), x.ncols()),
        };
        if let Some(a) = &self.skew {
            let sign = if transposed { -1.0 } else { 1.0 };
            add(&mut y, sign, &a.times(x));
        }
        y
    }
}

/// y += factor x.
pub(super) fn add(y: &mut Dense, factor: f64, x: &Dense) {
    y.data_mut().iter_mut().zip(x.data()).for_each(|(y, x)| *y += factor * x);
}

/// A complex block as its real parts followed by its imaginary parts: (n, 2 k).
pub(super) fn stacked(n: usize, x: &[Complex64]) -> Dense {
    let k = x.len() / n.max(1);
    let mut out = Dense::zeros(n, 2 * k);
    let (re, im) = out.data_mut().split_at_mut(n * k);
    for ((re, im), x) in re.iter_mut().zip(im).zip(x) {
        (*re, *im) = (x.re, x.im);
    }
    out
}

/// The products of a block Ψ with the matrices of one speed.
pub(super) struct Products {
    /// M Ψ, C Ψ, K Ψ, D Ψ, each (n, 2 k): real parts, imaginary parts.
    blocks: [Dense; 4],
}

impl Products {
    /// Products with all terms, transposed for left vectors.
    pub fn new(terms: &[Parts], speed: f64, x: &Dense, transposed: bool) -> Self {
        let mut blocks = [(); 4].map(|()| Dense::zeros(x.nrows(), x.ncols()));
        for term in terms {
            let place = match term.power {
                Power::Mass => 0,
                Power::Damping => 1,
                Power::Stiffness => 2,
                Power::Structural => 3,
            };
            add(&mut blocks[place], term.weight(speed), &term.times(x, transposed));
        }
        Self { blocks }
    }

    fn column(&self, block: usize, j: usize) -> impl Iterator<Item = Complex64> {
        let block = &self.blocks[block];
        let k = block.ncols() / 2;
        block.col(j).iter().zip(block.col(j + k)).map(|(&re, &im)| Complex64::new(re, im))
    }

    /// D(λ) ψ of column j with the norms of its terms added up, ‖λ²Mψ‖ + ‖λCψ‖ + ‖(K + iD + s₀²M)ψ‖.
    pub fn residual(&self, j: usize, lambda: Complex64, shift: f64) -> (Vec<Complex64>, f64) {
        let mut sizes = [0.0f64; 3];
        let terms = self.column(0, j).zip(self.column(1, j)).zip(self.column(2, j)).zip(self.column(3, j));
        let r = terms
            .map(|(((m, c), k), d)| {
                let (inertia, damping, stiffness) = (lambda * lambda * m, lambda * c, k + Complex64::I * d);
                sizes[0] += inertia.norm_sqr();
                sizes[1] += damping.norm_sqr();
                sizes[2] += (stiffness + shift * m).norm_sqr();
                inertia + damping + stiffness
            })
            .collect();
        (r, sizes.iter().map(|s| s.sqrt()).sum())
    }

    /// yᵀ M ψ and yᵀ C ψ with column j, without conjugation.
    pub fn forms(&self, j: usize, y: &[Complex64]) -> (Complex64, Complex64) {
        let form = |block: usize| self.column(block, j).zip(y).map(|(a, y)| a * y).sum();
        (form(0), form(1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_multiply_as_the_matrix_does() {
        // A = [[1, 2], [5, 3]], columns one after the other
        let pattern = Pattern::from_entries(2, [(1, 0)]).unwrap();
        let term = Term { power: Power::Damping, speed_power: 1, values: vec![1.0, 5.0, 2.0, 3.0] };
        let parts = Parts::new(&pattern, &term);
        let x = Dense::from_vec(2, 1, vec![1.0, 10.0]);
        assert_eq!(parts.times(&x, false).data(), [21.0, 35.0]);
        assert_eq!(parts.times(&x, true).data(), [51.0, 32.0]);
        assert_eq!(parts.weight(3.0), 3.0);
        let even = Term { power: Power::Mass, speed_power: 0, values: vec![1.0, 5.0, 5.0, 3.0] };
        assert!(Parts::new(&pattern, &even).skew.is_none());
    }
}
