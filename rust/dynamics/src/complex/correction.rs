//! The correction equation D(λ) t = r beside the space, solved roughly (as in the Jacobi-Davidson method; Bai, Sleijpen and
//! van der Vorst in Templates for the Solution of Algebraic Eigenvalue Problems, SIAM 2000, chapter 9).

use femend_linalg::{Dense, solve_complex_dense};
use num_complex::Complex64;

use super::space::Space;
use super::terms::{Products, stacked};

/// Applications of K_σ⁻¹ D(λ) for one correction. More make it better and the space smaller; each costs a solution.
const STEPS: usize = 2;

/// Corrections t (n, 2 k: real parts, imaginary parts) for residuals r (n, k) at `lambda`, K_σ-orthogonal to the space: of
/// the Krylov space of A = P K_σ⁻¹ D(λ) from K_σ⁻¹ r, P the projection beside V, the member with the least remainder
/// ‖K_σ⁻¹ r - A t‖ in K_σ. Components along higher modes of the model converge as ω² / ω_c² with the last real mode in V.
pub(super) fn correct(
    space: &mut Space,
    speed: f64,
    lambda: &[Complex64],
    residuals: &[Complex64],
    transposed: bool,
) -> Dense {
    let n = space.n();
    let k = lambda.len();
    let first = space.solve(stacked(n, residuals));
    let mut chain = vec![first];
    let mut weighed = vec![space.metric_times(&chain[0])];
    for _ in 0..STEPS {
        let last = &chain[chain.len() - 1];
        let products = Products::new(&space.terms, speed, last, transposed);
        let next: Vec<Complex64> = (0..k).flat_map(|j| products.residual(j, lambda[j], 0.0).0).collect();
        let mut z = space.solve(stacked(n, &next));
        let mut kz = space.metric_times(&z);
        space.remove(&mut z, &mut kz);
        chain.push(z);
        weighed.push(kz);
    }
    let mut out = Dense::zeros(n, 2 * k);
    for j in 0..k {
        for (step, c) in coefficients(&chain, &weighed, j).into_iter().enumerate() {
            let (re, im) = (chain[step].col(j), chain[step].col(j + k));
            out.col_mut(j)
                .iter_mut()
                .zip(re.iter().zip(im))
                .for_each(|(o, (a, b))| *o += c.re * a - c.im * b);
            out.col_mut(j + k)
                .iter_mut()
                .zip(re.iter().zip(im))
                .for_each(|(o, (a, b))| *o += c.re * b + c.im * a);
        }
    }
    out
}

/// Coefficients c with the least ‖a₀ - Σ c_s a_{s+1}‖ for column j, a_s the members of the chain.
fn coefficients(chain: &[Dense], weighed: &[Dense], j: usize) -> Vec<Complex64> {
    let k = chain[0].ncols() / 2;
    let steps = chain.len() - 1;
    let dot = |a: usize, b: usize| -> Complex64 {
        let (re, im) = (chain[a].col(j), chain[a].col(j + k));
        let (w_re, w_im) = (weighed[b].col(j), weighed[b].col(j + k));
        let mut sum = Complex64::ZERO;
        for i in 0..re.len() {
            sum += Complex64::new(re[i], -im[i]) * Complex64::new(w_re[i], w_im[i]);
        }
        sum
    };
    let size: Vec<f64> = (0..=steps).map(|s| dot(s, s).re.max(f64::MIN_POSITIVE).sqrt()).collect();
    let mut gram = vec![Complex64::ZERO; steps * steps];
    let mut rhs = vec![Complex64::ZERO; steps];
    for b in 0..steps {
        rhs[b] = dot(b + 1, 0) / size[b + 1];
        for a in 0..steps {
            gram[b * steps + a] = dot(a + 1, b + 1) / (size[a + 1] * size[b + 1]);
        }
        gram[b * steps + b] *= 1.0 + 1e-12;
    }
    // a chain that ends early has dependent members: its first is a correction too
    let plain = || (0..steps).map(|s| if s == 0 { size[1].into() } else { Complex64::ZERO }).collect();
    let c = solve_complex_dense(steps, &gram, &rhs).unwrap_or_else(|_| plain());
    c.iter().zip(&size[1..]).map(|(c, s)| c / s).collect()
}
