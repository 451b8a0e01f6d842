//! The linear model at the harmonics of one frequency.

use crate::simulate::ModalModel;
use num_complex::Complex64;

/// Receptance and free motion at the laws' coordinate, harmonics 0 .. H.
#[derive(Debug)]
pub(super) struct Line {
    /// c(n w), m/N; of the mean without rigid-body modes.
    pub(super) c: Vec<Complex64>,
    /// Motion under the force alone at the fundamental, m.
    pub(super) free: Complex64,
}

/// Modal receptance 1/(omega^2 - w^2 + 2 i zeta omega w).
fn receptance(omega: f64, zeta: f64, w: f64) -> Complex64 {
    Complex64::new(omega * omega - w * w, 2.0 * zeta * omega * w).inv()
}

/// Modal force (r) of complex input amplitudes.
pub(super) fn modal_force(model: &ModalModel, force: &[Complex64], level: f64) -> Vec<Complex64> {
    let r = model.omega.len();
    let mut p = vec![Complex64::ZERO; r];
    for (row, u) in model.phi_in.chunks_exact(r).zip(force) {
        for (p, phi) in p.iter_mut().zip(row) {
            *p += u * (level * phi);
        }
    }
    p
}

/// Whether the mean force of the laws has to vanish: a rigid-body mode moves their coordinate.
pub(super) fn is_free(model: &ModalModel) -> bool {
    model.omega.iter().zip(model.w).any(|(omega, w)| *omega == 0.0 && *w != 0.0)
}

/// The line at circular frequency `w` with harmonics up to `h`; `p` is the modal force.
pub(super) fn line(model: &ModalModel, p: &[Complex64], w: f64, h: usize) -> Line {
    let behind = model.residual_compliance.map_or(0.0, |r| r[0]);
    let mut c = vec![Complex64::from(behind); h + 1];
    let mut free = Complex64::ZERO;
    for (j, shape) in model.w.iter().enumerate() {
        for (n, c) in c.iter_mut().enumerate() {
            if n == 0 && model.omega[j] == 0.0 {
                continue;
            }
            let g = receptance(model.omega[j], model.zeta[j], n as f64 * w);
            *c += shape * shape * g;
            if n == 1 {
                free += *shape * p[j] * g;
            }
        }
    }
    Line { c, free }
}

/// Displacement harmonics of the outputs (n_out, h + 1) under the force and the laws' `f`; where the model is free, its
/// rigid-body modes take the mean `d[0]` of the laws' coordinate, the shortest of all such motions.
pub(super) fn outputs(
    model: &ModalModel,
    p: &[Complex64],
    w: f64,
    d: &[Complex64],
    f: &[Complex64],
) -> Vec<Complex64> {
    let (r, n_h) = (model.omega.len(), f.len());
    let rigid: f64 =
        model.omega.iter().zip(model.w).filter(|(omega, _)| **omega == 0.0).map(|(_, w)| w * w).sum();
    let mut y = vec![Complex64::ZERO; model.phi_out.len() / r * n_h];
    for j in 0..r {
        for (n, f) in f.iter().enumerate() {
            let q = if n == 0 && model.omega[j] == 0.0 {
                if rigid > 0.0 { d[0] * (model.w[j] / rigid) } else { Complex64::ZERO }
            } else {
                let load = if n == 1 { p[j] } else { Complex64::ZERO };
                (load - f * model.w[j]) * receptance(model.omega[j], model.zeta[j], n as f64 * w)
            };
            for (row, phi) in y.chunks_exact_mut(n_h).zip(model.phi_out.chunks_exact(r)) {
                row[n] += q * phi[j];
            }
        }
    }
    y
}
