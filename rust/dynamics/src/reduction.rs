//! Ritz bases: modes, static vectors of loads and sensors, derivative vectors of parameters.

use std::sync::Arc;

use femend_linalg::{Dense, Symbolic, SymmetricCsc};

use crate::frf::residual_vectors;
use crate::modes::{Basis, Compact, ModeOptions, modes};
use crate::{DynamicsError, Modes, ParameterDerivatives};

/// What a basis is to hold.
#[derive(Debug, Clone, Default)]
pub struct RitzOptions {
    /// Modes up to this frequency in Hz, or the lowest `n_modes`.
    pub f_max: Option<f64>,
    /// See `f_max`.
    pub n_modes: Option<usize>,
    /// Vectors whose new part is smaller than this beside themselves (M norm) are left out.
    pub drop: f64,
}

/// A reduced basis.
#[derive(Debug, Clone)]
pub struct RitzBasis {
    /// M-orthonormal columns (n, r); the first are the modes.
    pub v: Dense,
    /// The modes it starts with.
    pub modes: Modes,
}

/// M-orthonormal basis of the modes, of the static responses to the columns of `loads` (n, n_b) beside those modes
/// (inertia relief where the model is free), and of the static derivative vectors K⁻¹ (dK_p - λ dM_p) φ_r of the modes.
///
/// Directions without mass (in the null space of M) cannot be part of an M-orthonormal basis and are left out.
///
/// # Errors
/// As [`modes`] and [`residual_vectors`].
pub fn ritz_basis(
    symbolic: &Arc<Symbolic>,
    k: &SymmetricCsc,
    m: &SymmetricCsc,
    loads: &Dense,
    parameters: ParameterDerivatives<'_>,
    options: &RitzOptions,
) -> Result<RitzBasis, DynamicsError> {
    if loads.nrows() != k.n() {
        let text = format!("loads have {} rows, K has {}", loads.nrows(), k.n());
        return Err(DynamicsError::Argument(text));
    }
    let wanted = ModeOptions { f_max: options.f_max, n_modes: options.n_modes, ..Default::default() };
    let mut found = modes(symbolic, k, m, &wanted)?;
    // a free model is balanced by inertia: its rigid-body modes belong to the basis whatever the band
    if found.phi.ncols() == 0 {
        found = modes(symbolic, k, m, &ModeOptions { n_modes: Some(1), ..Default::default() })?;
    }
    crate::sensitivity::check_parameters(k.n(), parameters, &found.lambda, &found.phi)?;
    let ParameterDerivatives { dk, dm } = parameters;
    let mut b = loads.clone();
    for p in 0..dk.len() {
        let mut load = dk[p].times(&found.phi);
        if let Some(dm) = dm {
            let mass = dm[p].times(&found.phi);
            for j in 0..load.ncols() {
                let lambda = found.lambda[j];
                load.col_mut(j).iter_mut().zip(mass.col(j)).for_each(|(f, v)| *f -= lambda * v);
            }
        }
        b.append(&load);
    }
    let compact = Compact::new(m);
    let mut basis = Basis::with_room(k.n(), 0);
    basis.v = found.phi.clone();
    if b.ncols() > 0 {
        let mut x = residual_vectors(symbolic, k, m, &found.phi, &b)?;
        let norms = crate::modes::norms(&compact, &x);
        let own: Vec<usize> = (0..x.ncols()).filter(|&j| norms[j] > 0.0).collect();
        x = x.select(&own);
        for (c, &j) in own.iter().enumerate() {
            x.col_mut(c).iter_mut().for_each(|v| *v /= norms[j]);
        }
        let fresh = basis.split(&compact, &x, options.drop);
        basis.v.append(&fresh.q);
    }
    Ok(RitzBasis { v: basis.v, modes: found })
}
