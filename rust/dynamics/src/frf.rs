//! Frequency response functions by modal superposition and by direct solution.
//!
//! H(s) = Σ_r φ_out,r φ_in,r / (ω_r² + 2 ζ_r ω_r s + s²) + R, time convention exp(+iωt), s = iω on the frequency axis.

use std::f64::consts::TAU;
use std::sync::Arc;

use femend_linalg::{
    ComplexFactor, Dense, Factor, Kind as FactorKind, Ordering, Symbolic, SymmetricCsc, gemm, gemm_tn,
};
use num_complex::Complex64;
use rayon::prelude::*;

use crate::DynamicsError;

/// Lines per parallel task.
const LINES: usize = 16;

/// Displacement, velocity or acceleration per force.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FrfKind {
    /// Displacement per force.
    Receptance,
    /// Velocity per force.
    Mobility,
    /// Acceleration per force.
    Accelerance,
}

impl FrfKind {
    /// s^0, s^1 or s^2.
    pub(crate) fn factor(self, s: Complex64) -> Complex64 {
        match self {
            Self::Receptance => Complex64::ONE,
            Self::Mobility => s,
            Self::Accelerance => s * s,
        }
    }
}

impl std::str::FromStr for FrfKind {
    type Err = DynamicsError;
    fn from_str(text: &str) -> Result<Self, DynamicsError> {
        match text {
            "receptance" => Ok(Self::Receptance),
            "mobility" => Ok(Self::Mobility),
            "accelerance" => Ok(Self::Accelerance),
            _ => Err(DynamicsError::Argument(format!(
                "FRF kind '{text}' is unknown; use receptance, mobility or accelerance"
            ))),
        }
    }
}

/// Modes seen from outputs and inputs.
#[derive(Debug, Clone)]
pub struct ModalModel {
    /// ω_r in rad/s.
    pub omega: Vec<f64>,
    /// Damping fraction of each mode.
    pub zeta: Vec<f64>,
    /// Mass-normalised shapes at the outputs (n_out, r).
    pub phi_out: Dense,
    /// Mass-normalised shapes at the inputs (n_in, r).
    pub phi_in: Dense,
}

impl ModalModel {
    pub(crate) fn check(&self) -> Result<(), DynamicsError> {
        let r = self.omega.len();
        let bad = |what: &str, found: usize| {
            Err(DynamicsError::Argument(format!(
                "{what} has {found} modes, omega has {r}; give every mode once"
            )))
        };
        match (self.zeta.len(), self.phi_out.ncols(), self.phi_in.ncols()) {
            (z, _, _) if z != r => bad("zeta", z),
            (_, o, _) if o != r => bad("phi_out", o),
            (_, _, i) if i != r => bad("phi_in", i),
            _ => Ok(()),
        }
    }

    /// 1 / (ω² + 2 ζ ω s + s²) of each mode.
    ///
    /// # Errors
    /// [`DynamicsError::Argument`] where s is a pole.
    pub(crate) fn gains(&self, s: Complex64, gains: &mut [Complex64]) -> Result<(), DynamicsError> {
        for (r, g) in gains.iter_mut().enumerate() {
            let w = self.omega[r];
            let d = w * w + 2.0 * self.zeta[r] * w * s + s * s;
            if d.norm() <= f64::EPSILON * (w * w + s.norm_sqr()) {
                return Err(DynamicsError::Argument(format!(
                    "the FRF has a pole at s = {s:.6e} rad/s: mode {r} ({:.6} Hz, damping {}); give it damping or leave the line out",
                    w / TAU,
                    self.zeta[r]
                )));
            }
            *g = d.inv();
        }
        Ok(())
    }

    /// FRFs at complex frequencies `s` (n_lines), written to `out` (n_lines, n_out, n_in), last axis fastest.
    ///
    /// `residual` (n_out * n_in, last axis fastest) is the receptance of the modes left out, real or complex.
    ///
    /// # Errors
    /// [`DynamicsError::Argument`] for shapes that do not fit or a line on an undamped pole.
    pub fn frf(
        &self,
        s: &[Complex64],
        kind: FrfKind,
        residual: Option<&[Complex64]>,
        out: &mut [Complex64],
    ) -> Result<(), DynamicsError> {
        self.check()?;
        let (n_out, n_in, r) = (self.phi_out.nrows(), self.phi_in.nrows(), self.omega.len());
        let pairs = n_out * n_in;
        if out.len() != s.len() * pairs || residual.is_some_and(|v| v.len() != pairs) {
            return Err(DynamicsError::Argument(format!(
                "FRF of {} lines, {n_out} outputs and {n_in} inputs needs {} values, out has {}, residual {:?}",
                s.len(),
                s.len() * pairs,
                out.len(),
                residual.map(<[Complex64]>::len)
            )));
        }
        // residues as columns; a residual is a mode with gain 1, its imaginary part one with gain i
        let mut residues = Dense::zeros(pairs, r + 2);
        for mode in 0..r {
            let column = residues.col_mut(mode);
            for o in 0..n_out {
                for i in 0..n_in {
                    column[o * n_in + i] = self.phi_out[(o, mode)] * self.phi_in[(i, mode)];
                }
            }
        }
        for (p, v) in residual.unwrap_or(&[]).iter().enumerate() {
            residues[(p, r)] = v.re;
            residues[(p, r + 1)] = v.im;
        }
        sum_lines(&residues, s, out, |s, gains| {
            self.gains(s, &mut gains[..r])?;
            (gains[r], gains[r + 1]) = (Complex64::ONE, Complex64::I);
            let factor = kind.factor(s);
            gains.iter_mut().for_each(|g| *g *= factor);
            Ok(())
        })
    }
}

/// out[l, p] = Σ_c residues[p, c] gains_c(s_l): one real product for a group of lines, real and imaginary side by side.
pub(crate) fn sum_lines(
    residues: &Dense,
    s: &[Complex64],
    out: &mut [Complex64],
    gains: impl Fn(Complex64, &mut [Complex64]) -> Result<(), DynamicsError> + Sync,
) -> Result<(), DynamicsError> {
    let (pairs, columns) = (residues.nrows(), residues.ncols());
    if pairs == 0 {
        return Ok(());
    }
    out.par_chunks_mut(LINES * pairs).zip(s.par_chunks(LINES)).try_for_each(|(out, s)| {
        let mut g = vec![Complex64::ZERO; columns];
        let mut table = Dense::zeros(columns, 2 * s.len());
        for (l, &s) in s.iter().enumerate() {
            gains(s, &mut g)?;
            for (c, g) in g.iter().enumerate() {
                table[(c, 2 * l)] = g.re;
                table[(c, 2 * l + 1)] = g.im;
            }
        }
        let mut sums = Dense::zeros(pairs, 2 * s.len());
        gemm(&mut sums, 0.0, 1.0, residues, &table);
        for (l, line) in out.chunks_exact_mut(pairs).enumerate() {
            let (re, im) = (sums.col(2 * l), sums.col(2 * l + 1));
            for (p, value) in line.iter_mut().enumerate() {
                *value = Complex64::new(re[p], im[p]);
            }
        }
        Ok(())
    })
}

/// Matrices of the direct dynamic stiffness Z(s) = K + i H + s C + s² M on one pattern.
#[derive(Debug, Clone, Copy)]
pub struct DirectModel<'a> {
    /// Stiffness.
    pub k: &'a SymmetricCsc,
    /// Mass.
    pub m: &'a SymmetricCsc,
    /// Viscous damping.
    pub c: Option<&'a SymmetricCsc>,
    /// Structural damping (imaginary part of the stiffness for Im s > 0).
    pub h: Option<&'a SymmetricCsc>,
}

impl DirectModel<'_> {
    /// Values of Z(s).
    fn values(&self, s: Complex64) -> Vec<Complex64> {
        let mut z: Vec<Complex64> =
            self.k.values().iter().zip(self.m.values()).map(|(&k, &m)| k + s * s * m).collect();
        if let Some(c) = self.c {
            z.iter_mut().zip(c.values()).for_each(|(z, &c)| *z += s * c);
        }
        if let Some(h) = self.h {
            z.iter_mut().zip(h.values()).for_each(|(z, &h)| *z += Complex64::new(0.0, h));
        }
        z
    }

    /// X(s) = Z(s)⁻¹ B for each line: a list of (n, k) column-major blocks.
    ///
    /// # Errors
    /// [`DynamicsError::Linalg`] where Z(s) is singular, [`DynamicsError::Argument`] for unequal patterns.
    pub fn responses<T: Send>(
        &self,
        b: &Dense,
        s: &[Complex64],
        use_line: impl Fn(Complex64, &[Complex64]) -> T + Sync,
    ) -> Result<Vec<T>, DynamicsError> {
        let same = |a: &SymmetricCsc| a.pattern() == self.k.pattern();
        if !(same(self.m) && self.c.is_none_or(same) && self.h.is_none_or(same)) {
            return Err(DynamicsError::Argument("K, M, C and H do not share one pattern".into()));
        }
        let symbolic = Arc::new(Symbolic::new(self.k.pattern().clone(), Ordering::Auto)?);
        let rhs: Vec<Complex64> = b.data().iter().map(|&v| Complex64::from(v)).collect();
        s.par_iter()
            .map_init(
                || None,
                |kept: &mut Option<ComplexFactor>, &s| {
                    let factor = match kept.take() {
                        Some(mut factor) => factor.refresh(&self.values(s)).map(|()| factor),
                        None => ComplexFactor::new(symbolic.clone(), &self.values(s)),
                    };
                    let mut x = rhs.clone();
                    kept.insert(factor?).solve_in_place(&mut x);
                    Ok(use_line(s, &x))
                },
            )
            .collect()
    }

    /// FRFs B_outᵀ Z(s)⁻¹ B_in, (n_lines, n_out, n_in) with the last axis fastest; `b_out` (n, n_out), `b_in` (n, n_in).
    ///
    /// # Errors
    /// As [`DirectModel::responses`].
    pub fn frf(
        &self,
        b_out: &Dense,
        b_in: &Dense,
        s: &[Complex64],
        kind: FrfKind,
    ) -> Result<Vec<Complex64>, DynamicsError> {
        let n = self.k.n();
        let lines = self.responses(b_in, s, |s, x| {
            let factor = kind.factor(s);
            let mut line = Vec::with_capacity(b_out.ncols() * b_in.ncols());
            for o in 0..b_out.ncols() {
                for x in x.chunks_exact(n) {
                    let sum: Complex64 = b_out.col(o).iter().zip(x).map(|(&b, &x)| b * x).sum();
                    line.push(factor * sum);
                }
            }
            line
        })?;
        Ok(lines.concat())
    }
}

/// Static response of the modes left out: X = K⁻¹ B - Φ Λ⁻¹ Φᵀ B without its rigid-body part (n, n_b).
///
/// For a free structure `phi` must hold all rigid-body modes; the load is then balanced by inertia (inertia relief) and
/// the equations at the shift are iterated to those at zero.
///
/// # Errors
/// [`DynamicsError::Argument`] where rigid-body modes are missing from `phi`; shift errors as for modes.
pub fn residual_vectors(
    symbolic: &Arc<Symbolic>,
    k: &SymmetricCsc,
    m: &SymmetricCsc,
    phi: &Dense,
    b: &Dense,
) -> Result<Dense, DynamicsError> {
    let shifted = crate::modes::static_shift(symbolic, k, m, phi)?;
    let (sigma, factor): (f64, Factor) = (shifted.sigma, shifted.factor);
    debug_assert_eq!(factor.kind(), FactorKind::Cholesky);
    let m_phi = m.times(phi);
    let project = |x: &mut Dense| gemm(x, 1.0, -1.0, phi, &gemm_tn(&m_phi, x));
    let mut load = b.clone();
    gemm(&mut load, 1.0, -1.0, &m_phi, &gemm_tn(phi, b));
    let mut x = factor.solve(&load);
    project(&mut x);
    if sigma == 0.0 {
        return Ok(x);
    }
    let size = |x: &Dense| x.data().iter().fold(0.0f64, |a, v| a.max(v.abs()));
    let mut term = x.clone();
    for _ in 0..200 {
        // S x = f - σ M x on the complement of phi, as a series
        term = m.times(&term);
        term.data_mut().iter_mut().for_each(|v| *v *= -sigma);
        factor.solve_in_place(&mut term);
        project(&mut term);
        x.data_mut().iter_mut().zip(term.data()).for_each(|(x, t)| *x += t);
        if size(&term) <= 1e-15 * size(&x) {
            return Ok(x);
        }
    }
    Err(DynamicsError::Argument(
        "the static response of the modes left out does not converge: phi lacks rigid-body modes of this free model; \
         pass all of them"
            .into(),
    ))
}
