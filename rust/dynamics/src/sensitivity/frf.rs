//! Derivatives of FRFs: of a modal model in its own modal coordinates, and exactly by direct solution.

use femend_linalg::{Dense, SymmetricCsc, gemm};
use num_complex::Complex64;
use rayon::prelude::*;

use crate::DynamicsError;
use crate::frf::{DirectModel, FrfKind, ModalModel};

/// Lines per parallel task.
const LINES: usize = 8;

/// dK and dM of each parameter in the modal coordinates of a model, A_p = Φᵀ dK_p Φ and B_p = Φᵀ dM_p Φ.
#[derive(Debug, Clone)]
pub struct ModalDerivatives {
    /// A_p, (r, r) each.
    pub a: Vec<Dense>,
    /// B_p, (r, r) each, or none where no parameter changes the mass.
    pub b: Option<Vec<Dense>>,
}

impl ModalDerivatives {
    /// dH/dp of a modal model whose damping fractions stay with their modes: (n_p, n_lines, n_out, n_in), last axis
    /// fastest.
    ///
    /// With g = 1/(ω² + 2ζωs + s²) the derivative of Σ φ g φᵀ through eigenvalues and shapes together is
    /// -Φ_o G (A + s C + s² B) G Φ_iᵀ, C_qr = 2 κ A_qr + 2 η B_qr, κ = (ζ_r ω_r - ζ_q ω_q)/(λ_r - λ_q),
    /// η = (ζ_q ω_q λ_r - ζ_r ω_r λ_q)/(λ_r - λ_q); no difference of eigenvalues is left in the denominator, so coinciding
    /// modes need no care (their limits are κ = ζ/2ω, η = ζω/2). It is exact when Φ is a complete set, e.g. that of a
    /// Ritz basis, whose static vectors then act as the static correction. Rigid-body modes are taken as undamped.
    ///
    /// # Errors
    /// [`DynamicsError::Argument`] for shapes that do not fit or lines on undamped poles.
    pub fn frf(
        &self,
        model: &ModalModel,
        s: &[Complex64],
        kind: FrfKind,
    ) -> Result<Vec<Complex64>, DynamicsError> {
        model.check()?;
        let r = model.omega.len();
        let square = |d: &Dense| d.nrows() == r && d.ncols() == r;
        let fits = self.b.as_ref().is_none_or(|b| b.len() == self.a.len() && b.iter().all(square));
        if !fits || !self.a.iter().all(square) {
            return Err(DynamicsError::Argument(format!(
                "A and B must hold one ({r}, {r}) matrix per parameter"
            )));
        }
        let stacked = self.stacked(model);
        let (n_out, n_in, n_p) = (model.phi_out.nrows(), model.phi_in.nrows(), self.a.len());
        let pairs = n_out * n_in;
        let parts: Vec<Vec<Complex64>> = s
            .par_chunks(LINES)
            .map(|s| self.lines(model, &stacked, s, kind))
            .collect::<Result<_, DynamicsError>>()?;
        // tasks are (line, parameter, pair); the result has the parameter first
        let mut out = vec![Complex64::ZERO; n_p * s.len() * pairs];
        for (chunk, part) in parts.iter().enumerate() {
            for (index, values) in part.chunks_exact(pairs.max(1)).enumerate() {
                let (line, p) = (chunk * LINES + index / n_p, index % n_p);
                let at = (p * s.len() + line) * pairs;
                out[at..at + pairs].copy_from_slice(values);
            }
        }
        Ok(out)
    }

    /// A, C and (if any) B of all parameters below one another.
    fn stacked(&self, model: &ModalModel) -> Dense {
        let r = model.omega.len();
        let blocks = if self.b.is_some() { 3 } else { 2 };
        let mut stacked = Dense::zeros(blocks * r * self.a.len(), r);
        for j in 0..r {
            for i in 0..r {
                let (kappa, eta) = damping_slopes(model, i, j);
                for (p, a) in self.a.iter().enumerate() {
                    let at = p * blocks * r + i;
                    let b = self.b.as_ref().map_or(0.0, |b| b[p][(i, j)]);
                    stacked[(at, j)] = a[(i, j)];
                    stacked[(at + r, j)] = 2.0 * kappa * a[(i, j)] + 2.0 * eta * b;
                    if blocks == 3 {
                        stacked[(at + 2 * r, j)] = b;
                    }
                }
            }
        }
        stacked
    }

    fn lines(
        &self,
        model: &ModalModel,
        stacked: &Dense,
        s: &[Complex64],
        kind: FrfKind,
    ) -> Result<Vec<Complex64>, DynamicsError> {
        let (n_out, n_in, n_p, r) =
            (model.phi_out.nrows(), model.phi_in.nrows(), self.a.len(), model.omega.len());
        let blocks = if self.b.is_some() { 3 } else { 2 };
        let mut gains = vec![vec![Complex64::ZERO; r]; s.len()];
        let mut q = Dense::zeros(r, 2 * n_in * s.len());
        for (l, &s) in s.iter().enumerate() {
            model.gains(s, &mut gains[l])?;
            for i in 0..n_in {
                for (mode, g) in gains[l].iter().enumerate() {
                    let value = g * model.phi_in[(i, mode)];
                    q[(mode, 2 * (l * n_in + i))] = value.re;
                    q[(mode, 2 * (l * n_in + i) + 1)] = value.im;
                }
            }
        }
        let mut w = Dense::zeros(stacked.nrows(), q.ncols());
        gemm(&mut w, 0.0, 1.0, stacked, &q);
        let mut out = Vec::with_capacity(s.len() * n_p * n_out * n_in);
        for (l, &s) in s.iter().enumerate() {
            // G (A + s C + s² B) G Φ_i of all parameters, real and imaginary parts as columns
            let mut y = Dense::zeros(r, 2 * n_in * n_p);
            let powers = [Complex64::ONE, s, s * s];
            for p in 0..n_p {
                for i in 0..n_in {
                    for mode in 0..r {
                        let mut sum = Complex64::ZERO;
                        for (block, power) in powers.iter().take(blocks).enumerate() {
                            let row = (p * blocks + block) * r + mode;
                            let column = 2 * (l * n_in + i);
                            sum += power * Complex64::new(w[(row, column)], w[(row, column + 1)]);
                        }
                        let value = -kind.factor(s) * gains[l][mode] * sum;
                        y[(mode, 2 * (p * n_in + i))] = value.re;
                        y[(mode, 2 * (p * n_in + i) + 1)] = value.im;
                    }
                }
            }
            let mut h = Dense::zeros(n_out, y.ncols());
            gemm(&mut h, 0.0, 1.0, &model.phi_out, &y);
            for p in 0..n_p {
                for o in 0..n_out {
                    for i in 0..n_in {
                        let column = 2 * (p * n_in + i);
                        out.push(Complex64::new(h[(o, column)], h[(o, column + 1)]));
                    }
                }
            }
        }
        Ok(out)
    }
}

/// κ and η of a pair of modes.
fn damping_slopes(model: &ModalModel, q: usize, r: usize) -> (f64, f64) {
    let (wq, wr) = (model.omega[q], model.omega[r]);
    let (uq, ur) = (model.zeta[q] * wq, model.zeta[r] * wr);
    let (lq, lr) = (wq * wq, wr * wr);
    if (lr - lq).abs() > 1e-9 * (lr + lq) {
        return ((ur - uq) / (lr - lq), (uq * lr - ur * lq) / (lr - lq));
    }
    let (w, u) = (0.5 * (wq + wr), 0.5 * (uq + ur));
    if w == 0.0 { (0.0, 0.0) } else { (0.5 * u / (w * w), 0.5 * u) }
}

/// Derivatives of the matrices of a direct model with respect to one parameter.
#[derive(Debug, Clone, Default)]
pub struct DirectDerivative {
    /// dK.
    pub dk: Option<SymmetricCsc>,
    /// dM.
    pub dm: Option<SymmetricCsc>,
    /// dC.
    pub dc: Option<SymmetricCsc>,
    /// dH (structural damping).
    pub dh: Option<SymmetricCsc>,
}

/// Exact dH/dp = -X_outᵀ dZ X_in with X = Z⁻¹ B: (n_p, n_lines, n_out, n_in), last axis fastest.
///
/// # Errors
/// As [`DirectModel::responses`].
pub fn frf_direct_sensitivities(
    model: &DirectModel<'_>,
    derivatives: &[DirectDerivative],
    b_out: &Dense,
    b_in: &Dense,
    s: &[Complex64],
    kind: FrfKind,
) -> Result<Vec<Complex64>, DynamicsError> {
    let n = model.k.n();
    let (n_out, n_in) = (b_out.ncols(), b_in.ncols());
    let mut both = b_out.clone();
    both.append(b_in);
    let lines = model.responses(&both, s, |s, x| {
        let (x_out, x_in) = x.split_at(n * n_out);
        let mut line = Vec::with_capacity(derivatives.len() * n_out * n_in);
        for d in derivatives {
            let terms = [(Complex64::ONE, &d.dk), (s * s, &d.dm), (s, &d.dc), (Complex64::I, &d.dh)];
            let mut forces = vec![Complex64::ZERO; n * n_in];
            for (power, matrix) in terms {
                let Some(a) = matrix else { continue };
                let pattern = a.pattern();
                for (force, x) in forces.chunks_exact_mut(n).zip(x_in.chunks_exact(n)) {
                    for (j, f) in force.iter_mut().enumerate() {
                        let rows = pattern.range(j);
                        *f += power
                            * rows
                                .map(|k| a.values()[k] * x[pattern.row_idx()[k] as usize])
                                .sum::<Complex64>();
                    }
                }
            }
            let factor = -kind.factor(s);
            for x in x_out.chunks_exact(n) {
                for force in forces.chunks_exact(n) {
                    line.push(factor * x.iter().zip(force).map(|(x, f)| x * f).sum::<Complex64>());
                }
            }
        }
        line
    })?;
    let pairs = n_out * n_in;
    let mut out = Vec::with_capacity(derivatives.len() * s.len() * pairs);
    for p in 0..derivatives.len() {
        for line in &lines {
            out.extend_from_slice(&line[p * pairs..(p + 1) * pairs]);
        }
    }
    Ok(out)
}
