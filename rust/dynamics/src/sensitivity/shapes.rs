//! Exact derivatives of mode shapes (Nelson 1976) with one factor for all modes and parameters.
//!
//! Nelson's bordered systems need a factorisation per mode. Here the part of the derivative in the known modes is
//! explicit, and the rest solves (K - λ_i M) v = g beside those modes, where the matrix is positive definite: conjugate
//! gradients preconditioned by the one factor of K - σM, on blocks of modes and parameters at once.

use std::sync::Arc;

use femend_linalg::{Dense, Factor, Symbolic, SymmetricCsc, gemm, gemm_tn};

use super::eigen::{ParameterDerivatives, check_parameters, clusters};
use crate::DynamicsError;
use crate::modes::{ModesInfo, count_below, static_shift};

/// Columns iterated together.
const BLOCK: usize = 16;
/// Relative residual at which a column has converged.
const TOLERANCE: f64 = 1e-12;
const MAX_STEPS: usize = 300;

/// dΦ/dp of M-normalised modes `phi` (n, m), which must be all modes up to the last one: one block (n, m) per parameter.
///
/// Modes whose λ differ by less than `gap` (relative) coincide: single shapes have no derivative then, and what is returned
/// is that of a basis of their common subspace, whose M-orthonormality is kept (its inner rotation is left at zero).
///
/// # Errors
/// [`DynamicsError::Argument`] for shapes that do not fit; [`DynamicsError::NotConverged`] where a mode that is not in
/// `phi` lies at or below one that is.
pub fn shape_sensitivities(
    symbolic: &Arc<Symbolic>,
    k: &SymmetricCsc,
    m: &SymmetricCsc,
    parameters: ParameterDerivatives<'_>,
    lambda: &[f64],
    phi: &Dense,
    gap: f64,
) -> Result<Vec<Dense>, DynamicsError> {
    check_parameters(k.n(), parameters, lambda, phi)?;
    check_complete(symbolic, k, m, lambda, gap)?;
    let ParameterDerivatives { dk, dm } = parameters;
    let shifted = static_shift(symbolic, k, m, phi)?;
    let space = Complement { k, m, factor: &shifted.factor, phi, m_phi: m.times(phi) };
    let cluster = clusters(lambda, gap);
    let mut result = Vec::with_capacity(dk.len());
    for p in 0..dk.len() {
        let dm_phi = dm.map(|dm| dm[p].times(phi));
        let mut load = dk[p].times(phi);
        for j in 0..lambda.len() {
            let mass = dm_phi.as_ref().map(|d| d.col(j));
            for (i, f) in load.col_mut(j).iter_mut().enumerate() {
                *f = -*f + mass.map_or(0.0, |d| lambda[j] * d[i]);
            }
        }
        let mut inside = gemm_tn(phi, &load);
        let mass = dm_phi.as_ref().map(|d| gemm_tn(phi, d));
        gemm(&mut load, 1.0, -1.0, &space.m_phi, &inside);
        for j in 0..lambda.len() {
            for r in 0..lambda.len() {
                inside[(r, j)] = if cluster[r] == cluster[j] {
                    mass.as_ref().map_or(0.0, |b| -0.5 * b[(r, j)])
                } else {
                    inside[(r, j)] / (lambda[r] - lambda[j])
                };
            }
        }
        let mut derivative = Dense::zeros(k.n(), lambda.len());
        let mut first = 0;
        while first < lambda.len() {
            let width = BLOCK.min(lambda.len() - first);
            let columns: Vec<usize> = (first..first + width).collect();
            let x = space.solve(&load.select(&columns), &lambda[first..first + width], first)?;
            derivative.cols_mut(first, width).copy_from_slice(x.data());
            first += width;
        }
        gemm(&mut derivative, 1.0, 1.0, phi, &inside);
        result.push(derivative);
    }
    Ok(result)
}

/// Refuses modes that are not all up to the last one, by the inertia just above it: the systems are singular then, which
/// rounding may hide.
fn check_complete(
    symbolic: &Arc<Symbolic>,
    k: &SymmetricCsc,
    m: &SymmetricCsc,
    lambda: &[f64],
    gap: f64,
) -> Result<(), DynamicsError> {
    let Some(last) = lambda.iter().copied().reduce(f64::max) else { return Ok(()) };
    // a shift that happens to make a leading minor vanish is no reason to stop; a little further there is another
    let counted = [1e-7, 1e-6, 1e-5].into_iter().find_map(|off| {
        let above_last = last + gap.max(off) * last.abs().max(1e-30);
        count_below(symbolic, k, m, above_last, lambda, &mut ModesInfo::default()).ok()
    });
    let Some((below, upper)) = counted.filter(|(below, _)| *below > lambda.len()) else { return Ok(()) };
    Err(DynamicsError::Argument(format!(
        "{below} modes lie below eigenvalue {upper:.6e}, but phi has {}: {} of them are not in phi; pass all lowest modes \
         and leave out the last of a cluster that phi cuts",
        lambda.len(),
        below - lambda.len()
    )))
}

/// The space M-orthogonal to known modes.
struct Complement<'a> {
    k: &'a SymmetricCsc,
    m: &'a SymmetricCsc,
    factor: &'a Factor,
    phi: &'a Dense,
    m_phi: Dense,
}

impl Complement<'_> {
    /// z = P (K - σM)⁻¹ r.
    fn precondition(&self, r: &Dense) -> Dense {
        let mut z = self.factor.solve(r);
        let known = gemm_tn(&self.m_phi, &z);
        gemm(&mut z, 1.0, -1.0, self.phi, &known);
        z
    }

    /// Conjugate gradients on each column with its own λ.
    fn solve(&self, load: &Dense, lambda: &[f64], first_mode: usize) -> Result<Dense, DynamicsError> {
        let (n, width) = (load.nrows(), load.ncols());
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let mut x = Dense::zeros(n, width);
        let mut r = load.clone();
        let mut z = self.precondition(&r);
        let mut direction = z.clone();
        let mut rz: Vec<f64> = (0..width).map(|j| dot(r.col(j), z.col(j))).collect();
        let start = rz.clone();
        let mut worst = 0.0;
        for _ in 0..MAX_STEPS {
            let converged = |j: usize| rz[j] <= TOLERANCE * TOLERANCE * start[j];
            if (0..width).all(converged) {
                return Ok(x);
            }
            let (kd, md) = (self.k.times(&direction), self.m.times(&direction));
            for j in 0..width {
                if converged(j) {
                    direction.col_mut(j).fill(0.0);
                    continue;
                }
                let a: Vec<f64> = kd.col(j).iter().zip(md.col(j)).map(|(k, m)| k - lambda[j] * m).collect();
                let curvature = dot(direction.col(j), &a);
                if curvature <= 0.0 {
                    return Err(above(first_mode + j, f64::NAN));
                }
                let step = rz[j] / curvature;
                x.col_mut(j).iter_mut().zip(direction.col(j)).for_each(|(x, d)| *x += step * d);
                r.col_mut(j).iter_mut().zip(&a).for_each(|(r, a)| *r -= step * a);
            }
            // rounding along known modes would grow
            let leak = gemm_tn(self.phi, &r);
            gemm(&mut r, 1.0, -1.0, &self.m_phi, &leak);
            z = self.precondition(&r);
            worst = 0.0f64;
            for j in 0..width {
                if rz[j] <= TOLERANCE * TOLERANCE * start[j] {
                    continue;
                }
                let new = dot(r.col(j), z.col(j)).max(0.0);
                let beta = new / rz[j];
                direction.col_mut(j).iter_mut().zip(z.col(j)).for_each(|(d, z)| *d = z + beta * *d);
                rz[j] = new;
                worst = worst.max((new / start[j]).sqrt());
            }
        }
        // rounding may hold the residual just above the tolerance
        if worst < 1e3 * TOLERANCE { Ok(x) } else { Err(above(first_mode, worst)) }
    }
}

fn above(mode: usize, residual: f64) -> DynamicsError {
    DynamicsError::Argument(format!(
        "the derivative of mode {mode} (from 0) does not converge (residual {residual:.1e}): a mode that is not in phi lies \
         at or below it; pass all lowest modes and leave out the last of a cluster that phi cuts"
    ))
}
