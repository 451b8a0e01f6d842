//! Eigenvalues of small dense matrices without symmetry, with right and left vectors.

use faer::{MatRef, Par};
use num_complex::Complex64;

use crate::dense::solve_complex_dense;
use crate::{Dense, LinalgError};

/// Change of the vectors, of unit length, that makes those of a defective matrix independent.
const APART: f64 = 1e-13;

/// Eigenvalues of a general matrix with the vectors of both sides.
#[derive(Debug, Clone)]
pub struct GeneralEigen {
    /// Eigenvalues, n, in no order.
    pub values: Vec<Complex64>,
    /// Right vectors x of length 1 (n, n), column after column: A x = λ x.
    pub right: Vec<Complex64>,
}

impl GeneralEigen {
    /// Left vectors z (n, k) of some eigenvalues, column after column: zᵀ A = λ zᵀ and zᵀ x = 1 with the right vector of
    /// the same eigenvalue, 0 with the others. The length of z is the condition of the eigenvalue.
    ///
    /// Right vectors that coincide (a defective matrix) are taken apart by a little, which leaves the others as they are.
    ///
    /// # Errors
    /// [`LinalgError::Library`] where the right vectors are dependent even so.
    pub fn left(&self, chosen: &[usize]) -> Result<Vec<Complex64>, LinalgError> {
        let (n, x) = (self.values.len(), &self.right);
        let mut t = vec![Complex64::ZERO; n * n];
        for j in 0..n {
            for i in 0..n {
                t[i * n + j] = x[j * n + i];
            }
        }
        let mut unit = vec![Complex64::ZERO; n * chosen.len()];
        for (k, &e) in chosen.iter().enumerate() {
            unit[k * n + e] = Complex64::ONE;
        }
        solve_complex_dense(n, &t, &unit).or_else(|_| {
            for j in 0..n {
                t[j * n + (j * 7 + 1) % n] += APART * (1.0 + (j % 5) as f64);
                t[j * n + j] += APART * (2.0 + (j % 3) as f64);
            }
            solve_complex_dense(n, &t, &unit)
        })
    }
}

/// Eigenvalues of a real square matrix.
///
/// # Errors
/// [`LinalgError::Library`] when the iteration does not converge.
pub fn general_eigen(a: &Dense) -> Result<GeneralEigen, LinalgError> {
    faer::set_global_parallelism(Par::Seq);
    finite(a.data().iter().all(|v| v.is_finite()))?;
    let found = faer::linalg::solvers::Eigen::new_from_real(a.view()).map_err(|_| not_converged())?;
    unit_vectors(a.nrows(), &found)
}

/// Eigenvalues of a complex square matrix (n, n), column after column.
///
/// # Errors
/// [`LinalgError::Library`] when the iteration does not converge.
pub fn general_eigen_complex(n: usize, a: &[Complex64]) -> Result<GeneralEigen, LinalgError> {
    faer::set_global_parallelism(Par::Seq);
    finite(a.iter().all(|v| v.re.is_finite() && v.im.is_finite()))?;
    let view = MatRef::from_column_major_slice(a, n, n);
    let found = faer::linalg::solvers::Eigen::new(view).map_err(|_| not_converged())?;
    unit_vectors(n, &found)
}

fn finite(all: bool) -> Result<(), LinalgError> {
    if all {
        Ok(())
    } else {
        Err(LinalgError::Library("dense matrix with entries that are not finite".into()))
    }
}

fn not_converged() -> LinalgError {
    LinalgError::Library("dense eigenvalue iteration did not converge".into())
}

fn unit_vectors(n: usize, found: &faer::linalg::solvers::Eigen<f64>) -> Result<GeneralEigen, LinalgError> {
    let values: Vec<Complex64> = (0..n).map(|i| found.S()[i]).collect();
    let mut right = Vec::with_capacity(n * n);
    for j in 0..n {
        let column: Vec<Complex64> = (0..n).map(|i| found.U()[(i, j)]).collect();
        let size = column.iter().map(|v| v.norm_sqr()).sum::<f64>().sqrt();
        right.extend(column.iter().map(|v| v / size));
    }
    Ok(GeneralEigen { values, right })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(n: usize, seed: u64) -> Dense {
        let mut state = seed;
        let mut draw = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        Dense::from_vec(n, n, (0..n * n).map(|_| draw()).collect())
    }

    /// Largest entry of A X - X Λ, of Zᵀ A - Λ Zᵀ and of Zᵀ X - 1.
    fn errors(n: usize, a: &[Complex64], e: &GeneralEigen) -> [f64; 3] {
        let at = |i: usize, j: usize| a[j * n + i];
        let mut worst = [0.0f64; 3];
        let left = e.left(&(0..n).collect::<Vec<_>>()).unwrap();
        for j in 0..n {
            let (x, z) = (&e.right[j * n..(j + 1) * n], &left[j * n..(j + 1) * n]);
            for i in 0..n {
                let ax: Complex64 = (0..n).map(|k| at(i, k) * x[k]).sum();
                let za: Complex64 = (0..n).map(|k| z[k] * at(k, i)).sum();
                let zx: Complex64 = (0..n).map(|k| z[k] * e.right[i * n + k]).sum();
                worst[0] = worst[0].max((ax - e.values[j] * x[i]).norm());
                worst[1] = worst[1].max((za - e.values[j] * z[i]).norm());
                worst[2] = worst[2].max((zx - f64::from(u8::from(i == j))).norm());
            }
        }
        worst
    }

    #[test]
    fn both_sides_satisfy_their_equations() {
        for n in [1, 2, 7, 90] {
            let a = noise(n, 3);
            let e = general_eigen(&a).unwrap();
            let full: Vec<Complex64> = a.data().iter().map(|&v| v.into()).collect();
            assert!(errors(n, &full, &e).iter().all(|w| *w < 1e-10), "{n}: {:?}", errors(n, &full, &e));
            let other = noise(n, 5);
            let full: Vec<Complex64> =
                a.data().iter().zip(other.data()).map(|(&a, &b)| Complex64::new(a, b)).collect();
            let e = general_eigen_complex(n, &full).unwrap();
            assert!(errors(n, &full, &e).iter().all(|w| *w < 1e-10), "{n}: {:?}", errors(n, &full, &e));
        }
    }

    #[test]
    fn a_defective_matrix_has_vectors_all_the_same() {
        let mut a = Dense::zeros(3, 3);
        (a[(0, 0)], a[(0, 1)], a[(1, 1)], a[(2, 2)]) = (2.0, 1.0, 2.0, 5.0);
        let e = general_eigen(&a).unwrap();
        let simple = (0..3).find(|&j| (e.values[j] - 5.0).norm() < 1e-12).unwrap();
        let z = e.left(&[simple]).unwrap();
        assert!((z[2].norm() - 1.0).abs() < 1e-9 && z[0].norm() < 1e-9);
        assert!(general_eigen(&Dense::from_vec(1, 1, vec![f64::NAN])).is_err());
    }
}
