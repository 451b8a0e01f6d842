//! Eigenvalue derivatives (Fox, Kapoor 1968), coinciding modes by their subspace (Lancaster 1964).

use femend_linalg::{Dense, SymmetricCsc, gemm_tn};
use rayon::prelude::*;

use crate::DynamicsError;

/// dK and dM of every parameter, on the pattern of the model.
#[derive(Debug, Clone, Copy)]
pub struct ParameterDerivatives<'a> {
    /// dK, one matrix per parameter.
    pub dk: &'a [SymmetricCsc],
    /// dM, one matrix per parameter, or none where no parameter changes the mass.
    pub dm: Option<&'a [SymmetricCsc]>,
}

/// Derivatives of eigenvalues with respect to parameters.
#[derive(Debug, Clone)]
pub struct EigenSensitivities {
    /// dλ_r/dp, one list of modes per parameter, in (rad/s)² per unit of the parameter.
    pub dlambda: Vec<Vec<f64>>,
    /// Number of the cluster of each mode; modes with one number coincide, and their derivatives are those of the
    /// branches into which the parameter splits them, rising.
    pub cluster: Vec<usize>,
}

/// Φᵀ A Φ.
pub fn project(a: &SymmetricCsc, phi: &Dense) -> Dense {
    gemm_tn(phi, &a.times(phi))
}

/// Numbers the groups of neighbouring modes whose λ (rising) differ by less than `gap`, relative.
pub fn clusters(lambda: &[f64], gap: f64) -> Vec<usize> {
    let mut number = 0;
    (0..lambda.len())
        .map(|j| {
            if j > 0 && lambda[j] - lambda[j - 1] > gap * lambda[j].abs() {
                number += 1;
            }
            number
        })
        .collect()
}

pub(crate) fn check_parameters(
    n: usize,
    ParameterDerivatives { dk, dm }: ParameterDerivatives<'_>,
    lambda: &[f64],
    phi: &Dense,
) -> Result<(), DynamicsError> {
    let bad = |text: String| Err(DynamicsError::Argument(text));
    if phi.nrows() != n || phi.ncols() != lambda.len() {
        let (rows, cols) = (phi.nrows(), phi.ncols());
        return bad(format!(
            "phi is ({rows}, {cols}), K has {n} rows and there are {} eigenvalues",
            lambda.len()
        ));
    }
    if lambda.windows(2).any(|w| w[1] < w[0]) {
        return bad("eigenvalues are not in rising order".into());
    }
    match dm {
        Some(dm) if dm.len() != dk.len() => {
            bad(format!("dM has {} parameters, dK has {}", dm.len(), dk.len()))
        }
        _ => Ok(()),
    }
}

/// dλ of M-normalised modes: φᵀ (dK - λ dM) φ, for coinciding modes the eigenvalues of that matrix over their subspace.
///
/// `gap` is the relative distance of λ below which modes count as coinciding.
///
/// # Errors
/// [`DynamicsError::Argument`] for shapes that do not fit.
pub fn eigen_sensitivities(
    parameters: ParameterDerivatives<'_>,
    lambda: &[f64],
    phi: &Dense,
    gap: f64,
) -> Result<EigenSensitivities, DynamicsError> {
    check_parameters(phi.nrows(), parameters, lambda, phi)?;
    let ParameterDerivatives { dk, dm } = parameters;
    let cluster = clusters(lambda, gap);
    let dlambda = (0..dk.len())
        .into_par_iter()
        .map(|p| {
            let dk_phi = dk[p].times(phi);
            let dm_phi = dm.map(|dm| dm[p].times(phi));
            let entry = |i: usize, j: usize, mean: f64| {
                let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
                let mass = dm_phi.as_ref().map_or(0.0, |d| dot(phi.col(i), d.col(j)));
                dot(phi.col(i), dk_phi.col(j)) - mean * mass
            };
            let mut values = Vec::with_capacity(lambda.len());
            while values.len() < lambda.len() {
                let first = values.len();
                let size = cluster[first..].iter().take_while(|&&c| c == cluster[first]).count();
                let mean = lambda[first..first + size].iter().sum::<f64>() / size as f64;
                if size == 1 {
                    values.push(entry(first, first, mean));
                    continue;
                }
                let mut d = Dense::zeros(size, size);
                for i in 0..size {
                    for j in 0..=i {
                        d[(i, j)] = entry(first + i, first + j, mean);
                    }
                }
                values.extend(d.symmetric_eigen()?.values);
            }
            Ok(values)
        })
        .collect::<Result<_, DynamicsError>>()?;
    Ok(EigenSensitivities { dlambda, cluster })
}
