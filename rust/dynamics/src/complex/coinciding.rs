//! Left vectors of poles that coincide, each made to belong to one right vector.
//!
//! Where poles are apart, yᵢᵀ((λᵢ + λⱼ) M + C) ψⱼ vanishes by itself. Of a repeated pole any basis of left and of right vectors
//! is as good as another, and a sum over modes is right only where they are biorthogonal (Lancaster 2002).

use femend_linalg::solve_complex_dense;
use num_complex::Complex64;

use super::select::Wanted;
use super::side::Side;

/// Poles nearer than this share of their size coincide: their vectors may be mixed without a residual above the tolerance.
const COINCIDE: f64 = 1e-8;

/// A basis whose inverse is this large beside its sizes is that of a defective pole, which has no biorthogonal one.
const DEFECTIVE: f64 = 1e6;

/// Left vectors `y` with their masses yᴴ M y, mixed inside every group of poles that coincide so that each is orthogonal to
/// the right vectors of the others.
pub(super) fn biorthogonal(
    wanted: &[Wanted],
    own: &Side,
    other: &Side,
    psi_mass: &[f64],
    y: &mut [Vec<Complex64>],
    y_mass: &mut [f64],
) {
    for group in groups(wanted) {
        let n = group.len();
        let pairs = || group.iter().flat_map(|&j| group.iter().map(move |&i| (i, j)));
        let slope: Vec<Complex64> = pairs()
            .map(|(i, j)| {
                let (m, c) = own.products.forms(j, &y[i]);
                2.0 * wanted[j].pair.lambda * m + c
            })
            .collect();
        let mut unit = vec![Complex64::ZERO; n * n];
        (0..n).for_each(|k| unit[k * n + k] = Complex64::ONE);
        let Ok(inverse) = solve_complex_dense(n, &slope, &unit) else { continue };
        let size = |i: usize, j: usize| 2.0 * wanted[j].pair.lambda.norm() * (psi_mass[j] * y_mass[i]).sqrt();
        // row k of the inverse mixes the left vectors, column l is the share of the l-th
        let share = |k: usize, l: usize| inverse[k + n * l].norm() * size(group[l], group[k]);
        if !(0..n).all(|k| (0..n).all(|l| share(k, l) <= DEFECTIVE)) {
            continue;
        }
        let forms: Vec<Complex64> = pairs()
            .map(|(i, j)| {
                let conj: Vec<Complex64> = y[i].iter().map(|v| v.conj()).collect();
                other.products.forms(j, &conj).0
            })
            .collect();
        let old: Vec<Vec<Complex64>> = group.iter().map(|&j| y[j].clone()).collect();
        for (k, &j) in group.iter().enumerate() {
            let shares: Vec<Complex64> = (0..n).map(|l| inverse[k + n * l]).collect();
            for (row, value) in y[j].iter_mut().enumerate() {
                *value = shares.iter().zip(&old).map(|(b, y)| b * y[row]).sum();
            }
            let all = (0..n).flat_map(|q| (0..n).map(move |p| (p, q)));
            y_mass[j] = all.map(|(p, q)| (shares[p].conj() * shares[q] * forms[p + n * q]).re).sum();
        }
    }
}

/// Groups of more than one pole other than 0 that coincide.
fn groups(wanted: &[Wanted]) -> Vec<Vec<usize>> {
    let mut left: Vec<usize> =
        (0..wanted.len()).filter(|&j| wanted[j].pair.lambda != Complex64::ZERO).collect();
    let mut found = Vec::new();
    while let Some(first) = left.pop() {
        let pole = wanted[first].pair.lambda;
        let near = |j: &usize| (wanted[*j].pair.lambda - pole).norm() <= COINCIDE * pole.norm();
        let mut group: Vec<usize> = left.iter().copied().filter(near).collect();
        left.retain(|j| !near(j));
        group.push(first);
        if group.len() > 1 {
            found.push(group);
        }
    }
    found
}
