//! Dense solution for small models.

use femend_linalg::{Dense, SymmetricCsc, gemm, gemm_tn};

use crate::DynamicsError;

/// Full matrix of a sparse one.
fn full(a: &SymmetricCsc) -> Dense {
    let n = a.n();
    let mut d = Dense::zeros(n, n);
    for j in 0..n {
        for k in a.pattern().range(j) {
            d[(a.pattern().row_idx()[k] as usize, j)] = a.values()[k];
        }
    }
    d
}

/// All finite eigenvalues λ (rising) and vectors of K φ = λ M φ through C = L⁻¹ M L⁻ᵀ with L Lᵀ = K - σM: its eigenvalues
/// are θ = 1/(λ - σ), and θ = 0 belongs to massless DOFs. Low modes keep full relative accuracy.
pub(crate) fn all_modes(
    k: &SymmetricCsc,
    m: &SymmetricCsc,
    sigma: f64,
) -> Result<(Vec<f64>, Dense), DynamicsError> {
    let n = k.n();
    let l = full(&k.plus(-sigma, m)).cholesky()?;
    let mut half = full(m);
    l.solve_lower_in_place(false, &mut half);
    let mut c = half.transposed();
    l.solve_lower_in_place(false, &mut c);
    let eigen = c.symmetric_eigen()?;
    let largest = eigen.values.last().copied().unwrap_or(0.0);
    let finite: Vec<usize> =
        (0..n).rev().filter(|&e| eigen.values[e] > n as f64 * f64::EPSILON * largest).collect();
    let mut phi = eigen.vectors.select(&finite);
    l.solve_lower_in_place(true, &mut phi);
    // Rayleigh quotients of the vectors, M-normalised
    let lambda = finite.iter().map(|&e| sigma + 1.0 / eigen.values[e]).collect();
    for (j, &e) in finite.iter().enumerate() {
        let scale = 1.0 / eigen.values[e].sqrt();
        phi.col_mut(j).iter_mut().for_each(|v| *v *= scale);
    }
    Ok((lambda, phi))
}

/// Rayleigh-Ritz of S = K - σM and M in the span of X: M-orthonormal vectors and λ, rising.
pub(crate) fn rayleigh_ritz(
    k: &SymmetricCsc,
    m: &SymmetricCsc,
    sigma: f64,
    x: &Dense,
) -> Result<(Vec<f64>, Dense), DynamicsError> {
    // unit M norm first: columns of A X differ by θ
    let mut x = x.clone();
    for (j, norm) in super::basis::norms(m, &x).into_iter().enumerate() {
        x.col_mut(j).iter_mut().for_each(|v| *v /= norm);
    }
    let mut s = gemm_tn(&x, &k.plus(-sigma, m).times(&x));
    let mut g = gemm_tn(&x, &m.times(&x));
    symmetrise(&mut s);
    symmetrise(&mut g);
    // pencil (G, S): θ = 1/(λ - σ) through S = L Lᵀ, accurate for the lowest modes
    let l = s.cholesky()?;
    l.solve_lower_in_place(false, &mut g);
    let mut c = g.transposed();
    l.solve_lower_in_place(false, &mut c);
    let eigen = c.symmetric_eigen()?;
    let order: Vec<usize> = (0..x.ncols()).rev().collect();
    let mut y = eigen.vectors.select(&order);
    l.solve_lower_in_place(true, &mut y);
    for (j, &e) in order.iter().enumerate() {
        let scale = 1.0 / eigen.values[e].sqrt();
        y.col_mut(j).iter_mut().for_each(|v| *v *= scale);
    }
    let mut phi = Dense::zeros(x.nrows(), x.ncols());
    gemm(&mut phi, 0.0, 1.0, &x, &y);
    Ok((order.iter().map(|&e| sigma + 1.0 / eigen.values[e]).collect(), phi))
}

fn symmetrise(a: &mut Dense) {
    for j in 0..a.ncols() {
        for i in 0..j {
            let mean = 0.5 * (a[(i, j)] + a[(j, i)]);
            a[(i, j)] = mean;
            a[(j, i)] = mean;
        }
    }
}
