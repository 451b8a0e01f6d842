//! Dense solution for small models.

use femend_linalg::{Dense, SymmetricCsc, gemm_tn};

use super::product::Compact;
use crate::DynamicsError;

/// Eigenvalues of C below zero by more than this share of the largest are no rounding of M's terms (which a deck may write
/// with five digits): M is indefinite.
const BELOW: f64 = 1e-6;

/// Row with the largest part in a negative xᵀ M x.
fn most_negative(x: &Dense, mx: &Dense) -> usize {
    let part = |j: &usize| x[(*j, 0)] * mx[(*j, 0)];
    (0..x.nrows()).min_by(|i, j| part(i).total_cmp(&part(j))).unwrap_or(0)
}

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
///
/// # Errors
/// [`DynamicsError::NegativeMass`] for an M with negative eigenvalues, and what Cholesky and the eigensolution raise.
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
    if eigen.values.first().is_some_and(|&v| v < -BELOW * largest.max(-v)) {
        let mut x = eigen.vectors.select(&[0]);
        l.solve_lower_in_place(true, &mut x);
        return Err(DynamicsError::NegativeMass { dofs: vec![most_negative(&x, &m.times(&x))] });
    }
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

/// Solutions of a projected problem with their products.
#[derive(Debug)]
pub(crate) struct Pairs {
    /// λ, rising.
    pub lambda: Vec<f64>,
    /// M-orthonormal vectors (n, r).
    pub phi: Dense,
    /// K φ.
    pub k_phi: Dense,
    /// M φ.
    pub m_phi: Dense,
}

impl Pairs {
    /// The products of given vectors.
    pub fn new(k: &SymmetricCsc, m: &SymmetricCsc, lambda: Vec<f64>, phi: Dense) -> Self {
        let (k_phi, m_phi) = (k.times(&phi), m.times(&phi));
        Self { lambda, phi, k_phi, m_phi }
    }

    /// The first `count` of them.
    pub fn first(mut self, count: usize) -> Self {
        self.lambda.truncate(count);
        for block in [&mut self.phi, &mut self.k_phi, &mut self.m_phi] {
            block.truncate(count);
        }
        self
    }

    /// ‖K φ - λ M φ‖ / (|λ - σ| ‖M φ‖) of each.
    pub fn residuals(&self, sigma: f64) -> Vec<f64> {
        let norm = |v: &mut dyn Iterator<Item = f64>| v.map(|a| a * a).sum::<f64>().sqrt();
        (0..self.lambda.len())
            .map(|j| {
                let (lambda, kp, mp) = (self.lambda[j], self.k_phi.col(j), self.m_phi.col(j));
                let r = norm(&mut kp.iter().zip(mp).map(|(a, b)| a - lambda * b));
                r / ((lambda - sigma).abs() * norm(&mut mp.iter().copied()))
            })
            .collect()
    }
}

/// Rayleigh-Ritz of S = K - σM and M in the span of X.
pub(crate) fn rayleigh_ritz(
    k: &SymmetricCsc,
    m: &Compact,
    sigma: f64,
    mut x: Dense,
) -> Result<Pairs, DynamicsError> {
    let (mut kx, mut mx) = (k.times(&x), m.times(&x));
    // unit M norm first: columns of A X differ by θ
    for (j, norm) in super::basis::norms_known(&x, &mx).into_iter().enumerate() {
        for block in [&mut x, &mut kx, &mut mx] {
            block.col_mut(j).iter_mut().for_each(|v| *v /= norm);
        }
    }
    let mut s = gemm_tn(&x, &kx);
    let mut g = gemm_tn(&x, &mx);
    s.data_mut().iter_mut().zip(g.data()).for_each(|(s, g)| *s -= sigma * g);
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
    let lambda = order.iter().map(|&e| sigma + 1.0 / eigen.values[e]).collect();
    for block in [&mut x, &mut kx, &mut mx] {
        block.turn(&y);
    }
    Ok(Pairs { lambda, phi: x, k_phi: kx, m_phi: mx })
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
