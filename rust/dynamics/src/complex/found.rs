//! What complex modes are told with: poles by kind, vectors scaled by the mass, residuals, condition.

use femend_linalg::Dense;
use num_complex::Complex64;

use super::coinciding::biorthogonal;
use super::select::{PoleKind, Wanted};
use super::side::Side;

/// Complex modes at one speed.
#[derive(Debug, Clone)]
pub struct ComplexModes {
    /// Poles in rad/s: rigid, oscillatory by |λ|, overdamped, mirrored.
    pub lambda: Vec<Complex64>,
    /// What each is.
    pub kind: Vec<PoleKind>,
    /// Right vectors (n, m) column after column, ψᴴMψ = 1, largest component real and positive.
    pub right: Vec<Complex64>,
    /// Left vectors, yᵀ D(λ) = 0, scaled alike; those of poles that coincide each orthogonal to the others' right ones.
    pub left: Vec<Complex64>,
    /// a = yᵀ (2λM + C + W G) ψ.
    pub modal_a: Vec<Complex64>,
    /// Residuals of the full problem, right and left.
    pub residual: [Vec<f64>; 2],
    /// (2|λ| ‖ψ‖ ‖y‖ + |yᵀCψ|) / |a| with norms by the mass: 1 where a mode is like a real one, √((1 + ζ)/(1 - ζ)) of
    /// one mass on a spring, large near a defective pole, infinite for rigid-body modes.
    pub condition: Vec<f64>,
    /// Poles that the probe added before they had converged too.
    pub n_late: usize,
}

/// Modes of vectors whose residuals are small: `own` the right ones, `other` the left ones.
pub(super) fn told(wanted: Vec<Wanted>, own: Side, other: Side, n_late: usize) -> ComplexModes {
    let (mut right, mut left) = (Vec::new(), Vec::new());
    let (mut modal_a, mut condition) = (Vec::new(), Vec::new());
    let [right_mass, mut left_mass] = [&own, &other].map(|side| masses(side, wanted.len()));
    let mut lefts: Vec<Vec<Complex64>> = (0..wanted.len()).map(|j| unstacked(&other.x, j)).collect();
    biorthogonal(&wanted, &own, &other, &right_mass, &mut lefts, &mut left_mass);
    for ((j, w), mut y) in wanted.iter().enumerate().zip(lefts) {
        let mut psi = unstacked(&own.x, j);
        let masses = [right_mass[j], left_mass[j]];
        let factors = [scale(&psi, masses[0]), scale(&y, masses[1])];
        psi.iter_mut().for_each(|v| *v *= factors[0]);
        y.iter_mut().for_each(|v| *v *= factors[1]);
        let (m, c) = own.products.forms(j, &y);
        let (m, c) = (m * factors[0], c * factors[0]);
        let a = 2.0 * w.pair.lambda * m + c;
        let mass: f64 = masses.iter().zip(factors).map(|(m, f)| m.max(0.0).sqrt() * f.norm()).product();
        condition.push((2.0 * w.pair.lambda.norm() * mass + c.norm()) / a.norm());
        modal_a.push(a);
        right.append(&mut psi);
        left.append(&mut y);
    }
    ComplexModes {
        lambda: wanted.iter().map(|w| w.pair.lambda).collect(),
        kind: wanted.iter().map(|w| w.kind).collect(),
        right,
        left,
        modal_a,
        residual: [own.residual, other.residual],
        condition,
        n_late,
    }
}

/// ψᴴ M ψ of each vector of a side.
fn masses(side: &Side, count: usize) -> Vec<f64> {
    let mass = |j: usize| {
        let conj: Vec<Complex64> = unstacked(&side.x, j).iter().map(|v| v.conj()).collect();
        side.products.forms(j, &conj).0.re
    };
    (0..count).map(mass).collect()
}

fn unstacked(x: &Dense, j: usize) -> Vec<Complex64> {
    let k = x.ncols() / 2;
    x.col(j).iter().zip(x.col(j + k)).map(|(&re, &im)| Complex64::new(re, im)).collect()
}

/// Factor that makes the mass 1 and the largest component real and positive; a vector without mass gets the length 1.
fn scale(x: &[Complex64], mass: f64) -> Complex64 {
    let largest = x.iter().copied().fold(Complex64::ZERO, |a, v| {
        // of components that are equal to rounding the first
        if v.norm_sqr() > a.norm_sqr() * (1.0 + 1e-9) { v } else { a }
    });
    let length = x.iter().map(|v| v.norm_sqr()).sum::<f64>();
    let size = if mass > f64::MIN_POSITIVE { mass } else { length }.sqrt();
    if largest == Complex64::ZERO { Complex64::ONE } else { largest.conj() / largest.norm() / size }
}
