//! Derivatives of FRFs: of a modal model in its own modal coordinates, and exactly by direct solution.

use femend_linalg::{Dense, SymmetricCsc, gemm};
use num_complex::Complex64;
use rayon::prelude::*;

use crate::DynamicsError;
use crate::frf::tile::{NARROW, Panels, Sink, Tile, multiply};
use crate::frf::{DirectModel, FrfKind, ModalModel};

/// Pairs of line and input worked on at once.
const COLUMNS: usize = 1024;

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
        let size = self.a.len() * s.len() * model.phi_out.nrows() * model.phi_in.nrows();
        let mut out = vec![Complex64::ZERO; size];
        self.frf_to(model, s, kind, &mut out)?;
        Ok(out)
    }

    /// [`ModalDerivatives::frf`] to memory at hand: what touching new memory costs is a third of the whole.
    ///
    /// # Errors
    /// As [`ModalDerivatives::frf`].
    pub fn frf_to(
        &self,
        model: &ModalModel,
        s: &[Complex64],
        kind: FrfKind,
        out: &mut [Complex64],
    ) -> Result<(), DynamicsError> {
        model.check()?;
        let r = model.omega.len();
        let square = |d: &Dense| d.nrows() == r && d.ncols() == r;
        let fits = self.b.as_ref().is_none_or(|b| b.len() == self.a.len() && b.iter().all(square));
        if !fits || !self.a.iter().all(square) {
            return Err(DynamicsError::Argument(format!(
                "A and B must hold one ({r}, {r}) matrix per parameter"
            )));
        }
        let (n_p, pairs) = (self.a.len(), model.phi_out.nrows() * model.phi_in.nrows());
        if out.len() != n_p * s.len() * pairs {
            let (found, expected) = (out.len(), n_p * s.len() * pairs);
            return Err(DynamicsError::Argument(format!(
                "out holds {found} values, {expected} are expected"
            )));
        }
        if out.is_empty() || r == 0 {
            out.fill(Complex64::ZERO);
            return Ok(());
        }
        let stacked: Vec<Dense> = (0..n_p).into_par_iter().map(|p| self.beside(model, p)).collect();
        let outputs = Panels::new(r, model.phi_out.nrows(), |mode, first, lanes| {
            lanes.copy_from_slice(&model.phi_out.col(mode)[first..first + lanes.len()]);
        });
        // lines whose right-hand sides stay in the second-level caches
        let step = (COLUMNS / model.phi_in.nrows()).max(1);
        for first in (0..s.len()).step_by(step) {
            let lines = &s[first..s.len().min(first + step)];
            let input = Input::new(model, lines, kind, self.blocks())?;
            out.par_chunks_mut(s.len() * pairs).zip(&stacked).for_each(|(out, stacked)| {
                let out = &mut out[first * pairs..(first + lines.len()) * pairs];
                input.derivative(stacked, &outputs, out);
            });
        }
        Ok(())
    }

    fn blocks(&self) -> usize {
        if self.b.is_some() { 3 } else { 2 }
    }

    /// A, C and (if any) B of a parameter beside one another (r, blocks r).
    fn beside(&self, model: &ModalModel, p: usize) -> Dense {
        let r = model.omega.len();
        let mut out = Dense::zeros(r, self.blocks() * r);
        for j in 0..r {
            for i in 0..r {
                let (kappa, eta) = damping_slopes(model, i, j);
                let (a, b) = (self.a[p][(i, j)], self.b.as_ref().map_or(0.0, |b| b[p][(i, j)]));
                out[(i, j)] = a;
                out[(i, r + j)] = 2.0 * kappa * a + 2.0 * eta * b;
                if self.b.is_some() {
                    out[(i, 2 * r + j)] = b;
                }
            }
        }
        out
    }
}

/// Inputs of some lines: what A, C and B multiply, and what their product is multiplied with.
struct Input {
    /// s^k g φ_in below one another, real and imaginary parts of (line, input) as columns (blocks r, 2 n_in lines).
    q: Dense,
    /// - s^kind g, real and imaginary parts as columns (r, 2 lines).
    left: Dense,
    n_in: usize,
}

impl Input {
    fn new(model: &ModalModel, s: &[Complex64], kind: FrfKind, blocks: usize) -> Result<Self, DynamicsError> {
        let (n_in, r) = (model.phi_in.nrows(), model.omega.len());
        let mut gains = vec![Complex64::ZERO; r];
        let (mut q, mut left) = (Dense::zeros(blocks * r, 2 * n_in * s.len()), Dense::zeros(r, 2 * s.len()));
        for (l, &s) in s.iter().enumerate() {
            model.gains(s, &mut gains)?;
            let factor = -kind.factor(s);
            for (mode, &g) in gains.iter().enumerate() {
                let value = factor * g;
                (left[(mode, 2 * l)], left[(mode, 2 * l + 1)]) = (value.re, value.im);
                for i in 0..n_in {
                    let mut value = g * model.phi_in[(i, mode)];
                    let column = 2 * (l * n_in + i);
                    for block in 0..blocks {
                        (q[(block * r + mode, column)], q[(block * r + mode, column + 1)]) =
                            (value.re, value.im);
                        value *= s;
                    }
                }
            }
        }
        Ok(Self { q, left, n_in })
    }

    /// Φ_out G (A + s C + s² B) G Φ_in of one parameter to `out` (lines, n_out, n_in).
    fn derivative(&self, stacked: &Dense, outputs: &Panels, out: &mut [Complex64]) {
        let (r, columns) = (self.left.nrows(), self.q.ncols() / 2);
        let mut w = Dense::zeros(r, self.q.ncols());
        gemm(&mut w, 0.0, 1.0, stacked, &self.q);
        let mut rows = vec![[0.0; NARROW]; r * columns.div_ceil(NARROW / 2)];
        for c in 0..columns {
            let l = c / self.n_in;
            let (g_re, g_im) = (self.left.col(2 * l), self.left.col(2 * l + 1));
            let (re, im) = (w.col(2 * c), w.col(2 * c + 1));
            let at = 2 * (c % (NARROW / 2));
            let rows = &mut rows[c / (NARROW / 2) * r..][..r];
            for (mode, row) in rows.iter_mut().enumerate() {
                row[at] = g_re[mode] * re[mode] - g_im[mode] * im[mode];
                row[at + 1] = g_re[mode] * im[mode] + g_im[mode] * re[mode];
            }
        }
        let n_out = out.len() / columns.max(1);
        multiply(outputs, &rows, &mut Spread { out, n_out, n_in: self.n_in });
    }
}

/// Writes tiles of (line, input) rows and output columns to (lines, n_out, n_in).
struct Spread<'a> {
    out: &'a mut [Complex64],
    n_out: usize,
    n_in: usize,
}

impl Sink for Spread<'_> {
    #[inline(always)]
    fn take(&mut self, group: usize, first: usize, tile: &Tile) {
        let (n_out, n_in) = (self.n_out, self.n_in);
        for (c, rows) in tile.chunks_exact(2).enumerate() {
            let column = group * (NARROW / 2) + c;
            let start = (column / n_in * n_out + first) * n_in + column % n_in;
            if start >= self.out.len() {
                break;
            }
            let lanes = rows[0].len().min(n_out - first);
            let places = self.out[start..].iter_mut().step_by(n_in).take(lanes);
            for (place, (&re, &im)) in places.zip(rows[0].iter().zip(&rows[1])) {
                *place = Complex64::new(re, im);
            }
        }
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
