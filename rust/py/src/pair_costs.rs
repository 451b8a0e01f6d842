//! What every two free forces would leave after one linear step.

use femend_dynamics::pair_costs::{StepLine, StepPrior, pair_costs as costs_of_pairs};
use ndarray::Array2;
use num_complex::Complex64;
use numpy::{IntoPyArray, PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

type Line<'py> =
    (PyReadonlyArray2<'py, Complex64>, PyReadonlyArray1<'py, Complex64>, PyReadonlyArray2<'py, Complex64>);

/// Costs (n, n) of every two directions; see the stub of `femend._core`.
#[pyfunction]
#[pyo3(signature = (lines, curvature, pull, prior))]
fn pair_costs<'py>(
    py: Python<'py>,
    lines: Vec<Line<'py>>,
    curvature: Vec<f64>,
    pull: Vec<f64>,
    prior: f64,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let lines: Vec<StepLine> = lines
        .iter()
        .map(|(h, e, j)| StepLine {
            n_out: e.as_array().len(),
            h: h.as_array().iter().copied().collect(),
            e: e.as_array().iter().copied().collect(),
            j: j.as_array().iter().copied().collect(),
        })
        .collect();
    let prior = StepPrior { curvature, pull, cost: prior };
    let costs = py.detach(|| costs_of_pairs(&lines, &prior)).ok_or_else(|| {
        PyValueError::new_err(
            "lines must be (h (n, n_out), e (n_out,), J (n_out, n_p)) with one n and n_p in all, curvature and pull (n_p,)",
        )
    })?;
    let n = costs.len().isqrt();
    let square =
        Array2::from_shape_vec((n, n), costs).map_err(|error| PyValueError::new_err(error.to_string()))?;
    Ok(square.into_pyarray(py))
}

/// Adds this file's functions to `_core`.
pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(pair_costs, module)?)
}
