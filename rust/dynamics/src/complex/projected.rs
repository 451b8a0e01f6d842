//! The projected quadratic eigenproblem by linearisation about s₀: λ = s₀ + τ/μ.
//!
//! With D₀ = D(s₀), D₁ = τ D'(s₀), D₂ = τ² M the problem is μ² D₀ + μ D₁ + D₂ = 0, and D₀ is near the unit matrix. μ = 0
//! belongs to λ = ∞, which massless DOFs have (first companion form; Tisseur and Meerbergen, SIAM Review 43 (2001) 235).

use femend_linalg::{Dense, GeneralEigen, general_eigen, general_eigen_complex, solve_complex_dense};
use num_complex::Complex64;

use super::space::Space;
use super::terms::Power;
use crate::DynamicsError;

/// μ below this beside the largest belongs to λ = ∞.
const INFINITE: f64 = 1e-11;

/// An eigenvalue with the coefficients of its vector in V.
#[derive(Debug, Clone)]
pub(super) struct Pair {
    pub lambda: Complex64,
    pub right: Vec<Complex64>,
    /// Place in the spectrum; `None` for a rigid-body motion.
    place: Option<usize>,
}

impl Pair {
    /// A motion x with λ = 0.
    pub fn rigid(x: Vec<Complex64>) -> Self {
        Self { lambda: Complex64::ZERO, right: x, place: None }
    }
}

/// Eigenvalues of the linearised problem.
pub(super) struct Spectrum {
    pub pairs: Vec<Pair>,
    eigen: GeneralEigen,
    /// D₀ᵀ.
    d0_t: Vec<Complex64>,
}

impl Spectrum {
    /// Left vectors of the quadratic problem, yᵀ D(λ) = 0, bi-orthogonal to the right ones: y = D₀⁻ᵀ z₁.
    pub fn left(&self, pairs: &[&Pair]) -> Result<Vec<Vec<Complex64>>, DynamicsError> {
        let r = self.eigen.values.len() / 2;
        let places: Vec<usize> = pairs.iter().filter_map(|p| p.place).collect();
        let z = self.eigen.left(&places)?;
        let z1: Vec<Complex64> = z.chunks_exact(2 * r).flat_map(|z| z[..r].iter().copied()).collect();
        let y = solve_complex_dense(r, &self.d0_t, &z1)?;
        let mut found = y.chunks_exact(r).map(unit);
        let own = |p: &&Pair| match p.place {
            Some(_) => found.next().unwrap_or_default(),
            None => p.right.clone(),
        };
        Ok(pairs.iter().map(own).collect())
    }
}

/// Matrices of one speed in the space, each (r, r).
pub(super) struct Projected {
    pub mass: Dense,
    pub damping: Dense,
    pub stiffness: Dense,
    pub structural: Option<Dense>,
}

impl Projected {
    pub fn new(space: &mut Space, speed: f64) -> Self {
        space.settle();
        let r = space.len();
        let zero = || Dense::zeros(r, r);
        let (mut mass, mut damping, mut stiffness, mut structural) = (zero(), zero(), zero(), None);
        for (term, square) in space.terms.iter().zip(&space.squares) {
            let into = match term.power {
                Power::Mass => &mut mass,
                Power::Damping => &mut damping,
                Power::Stiffness => &mut stiffness,
                Power::Structural => structural.get_or_insert_with(zero),
            };
            for part in [&square.symmetric, &square.skew].into_iter().flatten() {
                super::terms::add(into, term.weight(speed), part);
            }
        }
        Self { mass, damping, stiffness, structural }
    }

    fn r(&self) -> usize {
        self.mass.nrows()
    }

    /// All finite eigenvalues.
    pub fn eigen(&self, s0: f64) -> Result<Spectrum, DynamicsError> {
        let r = self.r();
        let largest = (0..r).map(|i| self.mass[(i, i)]).fold(0.0, f64::max);
        let tau = if largest > 0.0 { 1.0 / largest.sqrt() } else { 1.0 };
        let d0: Vec<Complex64> = (0..r * r)
            .map(|e| {
                let re = self.stiffness.data()[e] + s0 * (self.damping.data()[e] + s0 * self.mass.data()[e]);
                Complex64::new(re, self.structural.as_ref().map_or(0.0, |d| d.data()[e]))
            })
            .collect();
        let mut rhs = Vec::with_capacity(2 * r * r);
        rhs.extend(
            (0..r * r)
                .map(|e| Complex64::from(-tau * (2.0 * s0 * self.mass.data()[e] + self.damping.data()[e]))),
        );
        rhs.extend(self.mass.data().iter().map(|m| Complex64::from(-tau * tau * m)));
        let top = solve_complex_dense(r, &d0, &rhs)?;
        let eigen = if self.structural.is_some() {
            general_eigen_complex(2 * r, &companion(r, &top))?
        } else {
            let real = companion(r, &top).into_iter().map(|v| v.re).collect();
            general_eigen(&Dense::from_vec(2 * r, 2 * r, real))?
        };
        let mut d0_t = vec![Complex64::ZERO; r * r];
        for j in 0..r {
            for i in 0..r {
                d0_t[i * r + j] = d0[j * r + i];
            }
        }
        let size = eigen.values.iter().map(|v| v.norm()).fold(0.0, f64::max);
        let finite = (0..2 * r).filter(|&e| eigen.values[e].norm() > INFINITE * size);
        let pair = |e: usize| {
            let mu = eigen.values[e];
            let column = &eigen.right[2 * r * e..2 * r * (e + 1)];
            let right = if mu.norm() > 1.0 { &column[..r] } else { &column[r..] };
            Pair { lambda: s0 + tau / mu, right: unit(right), place: Some(e) }
        };
        Ok(Spectrum { pairs: finite.map(pair).collect(), eigen, d0_t })
    }

    /// Undamped eigenvalues ω² of K and M alone, rising.
    pub fn at_rest(&self) -> Result<Vec<f64>, DynamicsError> {
        let l = self.stiffness.cholesky()?;
        let mut half = self.mass.clone();
        l.solve_lower_in_place(false, &mut half);
        let mut c = half.transposed();
        l.solve_lower_in_place(false, &mut c);
        let eigen = c.symmetric_eigen()?;
        let largest = eigen.values.last().copied().unwrap_or(0.0);
        let finite = eigen.values.iter().rev().filter(|v| **v > 1e-14 * largest);
        Ok(finite.map(|v| 1.0 / v).collect())
    }

    /// Vectors x of the space, orthonormal, with (K + iD) x = 0: what stands still in the direction of a rigid motion.
    pub fn still(&self) -> Result<Vec<Vec<Complex64>>, DynamicsError> {
        let r = self.r();
        let mut gram = femend_linalg::gemm_tn(&self.stiffness, &self.stiffness);
        if let Some(d) = &self.structural {
            super::terms::add(&mut gram, 1.0, &femend_linalg::gemm_tn(d, d));
        }
        let eigen = gram.symmetric_eigen()?;
        Ok((0..r)
            .filter(|&e| eigen.values[e] < 1e-12)
            .map(|e| eigen.vectors.col(e).iter().map(|&v| v.into()).collect())
            .collect())
    }
}

fn companion(r: usize, top: &[Complex64]) -> Vec<Complex64> {
    let mut a = vec![Complex64::ZERO; 4 * r * r];
    for j in 0..2 * r {
        a[2 * r * j..2 * r * j + r].copy_from_slice(&top[r * j..r * (j + 1)]);
        if j < r {
            a[2 * r * j + r + j] = Complex64::ONE;
        }
    }
    a
}

fn unit(x: &[Complex64]) -> Vec<Complex64> {
    let size = x.iter().map(|v| v.norm_sqr()).sum::<f64>().sqrt();
    x.iter().map(|v| v / size).collect()
}
