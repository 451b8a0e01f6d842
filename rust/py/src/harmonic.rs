//! Periodic steady states of a model with laws, over frequency.

use femend_dynamics::harmonic::{Branch, Ended, HarmonicError, Options, Steady, branches};
use femend_dynamics::laws::Law;
use femend_dynamics::simulate::ModalModel;
use num_complex::Complex64;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArray3, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays::shaped;
use crate::laws::{law, law_error};
use crate::own_law::raised;
use crate::simulate::simulation_error;

pyo3::import_exception!(femend.errors, ConvergenceError);

fn harmonic_error(py: Python<'_>, error: &HarmonicError) -> PyErr {
    match error {
        HarmonicError::Law(error) => law_error(py, error),
        HarmonicError::Model(error) => simulation_error(py, error),
        HarmonicError::NoStart { .. } => ConvergenceError::new_err(error.to_string()),
        HarmonicError::Value { .. } => PyValueError::new_err(error.to_string()),
    }
}

type Told<'py> = (
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray2<Complex64>>,
    Bound<'py, PyArray2<Complex64>>,
    Bound<'py, PyArray3<Complex64>>,
    Vec<(usize, bool)>,
    &'static str,
    usize,
);

fn told(py: Python<'_>, branch: Branch, n_out: usize, n_h: usize) -> PyResult<Told<'_>> {
    let n = branch.omega.len();
    let ended = match branch.ended {
        Ended::Upper => "upper",
        Ended::Lower => "lower",
        Ended::MaxPoints => "max_points",
        Ended::MaxFolds => "max_folds",
        Ended::Stuck => "stuck",
    };
    Ok((
        branch.omega.into_pyarray(py),
        shaped(py, (n, n_h), branch.d)?,
        shaped(py, (n, n_h), branch.f)?,
        shaped(py, (n, n_out, n_h), branch.y)?,
        branch.folds.iter().map(|fold| (fold.point, fold.upper)).collect(),
        ended,
        branch.n_iterations,
    ))
}

/// An error for modal rows that have other modes than there are frequencies.
fn one_column_a_mode(phi: [&PyReadonlyArray2<'_, f64>; 2], n_modes: usize) -> PyResult<()> {
    match phi.iter().map(|rows| rows.as_array().ncols()).find(|n| *n != n_modes) {
        Some(columns) => Err(PyValueError::new_err(format!(
            "phi_in or phi_out has {columns} columns, omega has {n_modes} modes"
        ))),
        None => Ok(()),
    }
}

/// Branches of periodic motions of every set of laws at every level; see the stub of `femend._core`.
#[pyfunction]
#[pyo3(signature = (omega, zeta, phi_in, phi_out, w, laws, force, levels, band, *, harmonics=7, samples=128,
                   settling=2, max_step=0.1, max_points=4000, max_folds=None, residual_compliance=0.0))]
#[allow(clippy::too_many_arguments)]
fn harmonic_branches<'py>(
    py: Python<'py>,
    omega: PyReadonlyArray1<'py, f64>,
    zeta: PyReadonlyArray1<'py, f64>,
    phi_in: PyReadonlyArray2<'py, f64>,
    phi_out: PyReadonlyArray2<'py, f64>,
    w: PyReadonlyArray1<'py, f64>,
    laws: Vec<Vec<(String, Bound<'py, PyAny>)>>,
    force: PyReadonlyArray1<'py, Complex64>,
    levels: Vec<f64>,
    band: (f64, f64),
    harmonics: usize,
    samples: usize,
    settling: usize,
    max_step: f64,
    max_points: usize,
    max_folds: Option<usize>,
    residual_compliance: f64,
) -> PyResult<Vec<Vec<Told<'py>>>> {
    let sets: Vec<Vec<Law>> =
        laws.iter().map(|set| set.iter().map(|(name, p)| law(name, p)).collect()).collect::<PyResult<_>>()?;
    let flat = |x: &PyReadonlyArray1<'_, f64>| x.as_array().to_vec();
    let rows = |x: &PyReadonlyArray2<'_, f64>| x.as_array().iter().copied().collect::<Vec<f64>>();
    let (omega, zeta, w) = (flat(&omega), flat(&zeta), flat(&w));
    let n_out = phi_out.as_array().nrows();
    one_column_a_mode([&phi_in, &phi_out], omega.len())?;
    let (phi_in, phi_out, residual) = (rows(&phi_in), rows(&phi_out), [residual_compliance]);
    let model = ModalModel {
        omega: &omega,
        zeta: &zeta,
        phi_in: &phi_in,
        phi_out: &phi_out,
        w: &w,
        residual_compliance: Some(&residual),
    };
    let force = force.as_array().to_vec();
    let steady = Steady { model, force: &force, band };
    let options = Options {
        harmonics,
        samples,
        settling,
        max_step,
        max_points,
        max_folds: max_folds.unwrap_or(usize::MAX),
    };
    let done = py.detach(|| branches(&steady, &sets, &levels, &options));
    raised()?;
    let mut done = done.map_err(|error| harmonic_error(py, &error))?.into_iter();
    sets.iter()
        .map(|_| {
            let of_set = done.by_ref().take(levels.len());
            of_set.map(|branch| told(py, branch, n_out, harmonics + 1)).collect()
        })
        .collect()
}

/// Adds this file's function to `_core`.
pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(harmonic_branches, module)?)
}
