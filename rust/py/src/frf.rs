//! `frf_modal`, `frf_modal_scores`, `frf_direct`, `frf_reduced` and `residual_vectors`.

use femend_dynamics::{DirectModel, FrfKind, LineModel, ReducedOptions};
use femend_linalg::SymmetricCsc;
use num_complex::Complex64;
use numpy::{
    PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3,
    PyReadwriteArray3, PyUntypedArrayMethods,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{self, Indices};
use crate::modes::{PySymbolic, prepare};

/// Real or complex array of the same meaning.
#[derive(FromPyObject)]
enum Residual<'py> {
    Real(PyReadonlyArray2<'py, f64>),
    Complex(PyReadonlyArray2<'py, Complex64>),
}

impl Residual<'_> {
    /// Values with the last axis fastest.
    fn values(&self, shape: (usize, usize)) -> PyResult<Vec<Complex64>> {
        let (found, values): (_, Vec<Complex64>) = match self {
            Self::Real(a) => (a.as_array().dim(), a.as_array().iter().map(|&v| v.into()).collect()),
            Self::Complex(a) => (a.as_array().dim(), a.as_array().iter().copied().collect()),
        };
        if found != shape {
            return Err(PyValueError::new_err(format!(
                "residual is {found:?}, (n_out, n_in) = {shape:?} expected"
            )));
        }
        Ok(values)
    }
}

/// FRFs by modal superposition.
#[pyfunction]
#[pyo3(signature = (omega, zeta, phi_out, phi_in, s, kind = "receptance", residual = None, *, out = None))]
#[expect(clippy::too_many_arguments, reason = "a Python signature, by keyword")]
fn frf_modal<'py>(
    py: Python<'py>,
    omega: PyReadonlyArray1<f64>,
    zeta: PyReadonlyArray1<f64>,
    phi_out: PyReadonlyArray2<f64>,
    phi_in: PyReadonlyArray2<f64>,
    s: PyReadonlyArray1<Complex64>,
    kind: &str,
    residual: Option<Residual>,
    out: Option<Bound<'py, PyArray3<Complex64>>>,
) -> PyResult<Bound<'py, PyArray3<Complex64>>> {
    let kind: FrfKind = kind.parse().map_err(arrays::dynamics_error)?;
    let model = arrays::modal_model(&omega, &zeta, &phi_out, &phi_in);
    let s = s.as_array().to_vec();
    let (n_out, n_in) = (model.phi_out.nrows(), model.phi_in.nrows());
    let residual = residual.map(|r| r.values((n_out, n_in))).transpose()?;
    let shape = [s.len(), n_out, n_in];
    let out = match out {
        None => PyArray3::zeros(py, shape, false),
        Some(a) if a.shape() == shape && a.is_c_contiguous() => a,
        Some(a) => {
            let text =
                format!("out has shape {:?}; a C-contiguous complex array {shape:?} is expected", a.shape());
            return Err(PyValueError::new_err(text));
        }
    };
    {
        let mut view: PyReadwriteArray3<Complex64> =
            out.try_readwrite().map_err(|e| PyValueError::new_err(format!("out cannot be written: {e}")))?;
        let values = view.as_slice_mut().map_err(|e| PyValueError::new_err(e.to_string()))?;
        py.detach(|| model.frf(&s, kind, residual.as_deref(), values)).map_err(arrays::dynamics_error)?;
    }
    Ok(out)
}

/// FRAC, FAAC, CSAC, CSF and squared misfit of modal FRFs with measured ones, for one model.
#[pyfunction]
#[pyo3(signature = (omega, zeta, phi_out, phi_in, s, measured, kind = "receptance", residual = None))]
#[expect(clippy::too_many_arguments, reason = "a Python signature, by keyword")]
fn frf_modal_scores<'py>(
    py: Python<'py>,
    omega: PyReadonlyArray1<f64>,
    zeta: PyReadonlyArray1<f64>,
    phi_out: PyReadonlyArray2<f64>,
    phi_in: PyReadonlyArray2<f64>,
    s: PyReadonlyArray1<Complex64>,
    measured: PyReadonlyArray3<Complex64>,
    kind: &str,
    residual: Option<Residual>,
) -> PyResult<Bound<'py, PyDict>> {
    let kind: FrfKind = kind.parse().map_err(arrays::dynamics_error)?;
    let model = arrays::modal_model(&omega, &zeta, &phi_out, &phi_in);
    let s = s.as_array().to_vec();
    let places = (model.phi_out.nrows(), model.phi_in.nrows());
    let residual = residual.map(|r| r.values(places)).transpose()?;
    let expected = [s.len(), places.0, places.1];
    let values = match measured.as_slice() {
        Ok(values) if measured.shape() == expected => values,
        _ => {
            let text =
                format!("measured has shape {:?}; a C-contiguous {expected:?} is expected", measured.shape());
            return Err(PyValueError::new_err(text));
        }
    };
    let found =
        py.detach(|| model.scores(&s, kind, residual.as_deref(), values)).map_err(arrays::dynamics_error)?;
    let out = PyDict::new(py);
    for (name, values) in [("frac", found.frac), ("faac", found.faac)] {
        out.set_item(name, arrays::shaped(py, places, values)?)?;
    }
    out.set_item("csac", PyArray1::from_vec(py, found.csac))?;
    out.set_item("csf", PyArray1::from_vec(py, found.csf))?;
    out.set_item("misfit", found.misfit)?;
    Ok(out)
}

/// FRFs by reduced direct solution: a few lines are solved, the others in the space of those solutions.
#[pyfunction]
#[pyo3(signature = (indptr, indices, matrices, coefficients, b_out, b_in, s, kind = "receptance", *,
                    tolerance = 1e-6, max_solutions = 60))]
#[expect(clippy::too_many_arguments, reason = "a Python signature, by keyword")]
fn frf_reduced<'py>(
    py: Python<'py>,
    indptr: Indices,
    indices: Indices,
    matrices: PyReadonlyArray2<f64>,
    coefficients: PyReadonlyArray2<Complex64>,
    b_out: PyReadonlyArray2<f64>,
    b_in: PyReadonlyArray2<f64>,
    s: PyReadonlyArray1<Complex64>,
    kind: &str,
    tolerance: f64,
    max_solutions: usize,
) -> PyResult<(Bound<'py, PyArray3<Complex64>>, Bound<'py, PyDict>)> {
    let kind: FrfKind = kind.parse().map_err(arrays::dynamics_error)?;
    let pattern = std::sync::Arc::new(arrays::pattern(&indptr, &indices)?);
    let matrices = arrays::family(&pattern, &matrices, "matrices")?;
    let coefficients = coefficients.as_array().outer_iter().map(|row| row.to_vec()).collect();
    let (b_out, b_in, s) = (arrays::dense(&b_out), arrays::dense(&b_in), s.as_array().to_vec());
    let model = LineModel { matrices: matrices.iter().collect(), coefficients };
    let options = ReducedOptions { tolerance, max_solutions };
    let found =
        py.detach(|| model.frf_reduced(&b_out, &b_in, &s, kind, options)).map_err(arrays::dynamics_error)?;
    let info = PyDict::new(py);
    info.set_item("converged", found.converged)?;
    info.set_item("error", found.error)?;
    info.set_item("residual", found.residual)?;
    info.set_item("solved", found.solved)?;
    info.set_item("basis", found.basis)?;
    Ok((arrays::shaped(py, (s.len(), b_out.ncols(), b_in.ncols()), found.values)?, info))
}

/// FRFs by direct solution of the dynamic stiffness on each line.
#[pyfunction]
#[pyo3(signature = (indptr, indices, k, m, b_out, b_in, s, kind = "receptance", *, c = None, h = None))]
#[expect(clippy::too_many_arguments, reason = "a Python signature, by keyword")]
fn frf_direct<'py>(
    py: Python<'py>,
    indptr: Indices,
    indices: Indices,
    k: PyReadonlyArray1<f64>,
    m: PyReadonlyArray1<f64>,
    b_out: PyReadonlyArray2<f64>,
    b_in: PyReadonlyArray2<f64>,
    s: PyReadonlyArray1<Complex64>,
    kind: &str,
    c: Option<PyReadonlyArray1<f64>>,
    h: Option<PyReadonlyArray1<f64>>,
) -> PyResult<Bound<'py, PyArray3<Complex64>>> {
    let kind: FrfKind = kind.parse().map_err(arrays::dynamics_error)?;
    let pattern = std::sync::Arc::new(arrays::pattern(&indptr, &indices)?);
    let (k, m) = (arrays::matrix(&pattern, &k, "K")?, arrays::matrix(&pattern, &m, "M")?);
    let c: Option<SymmetricCsc> = c.map(|v| arrays::matrix(&pattern, &v, "C")).transpose()?;
    let h: Option<SymmetricCsc> = h.map(|v| arrays::matrix(&pattern, &v, "H")).transpose()?;
    let (b_out, b_in, s) = (arrays::dense(&b_out), arrays::dense(&b_in), s.as_array().to_vec());
    for (what, b) in [("b_out", &b_out), ("b_in", &b_in)] {
        if b.nrows() != k.n() {
            let text = format!("{what} has {} rows, K has {}", b.nrows(), k.n());
            return Err(PyValueError::new_err(text));
        }
    }
    let model = DirectModel { k: &k, m: &m, c: c.as_ref(), h: h.as_ref() };
    let values = py.detach(|| model.frf(&b_out, &b_in, &s, kind)).map_err(arrays::dynamics_error)?;
    arrays::shaped(py, (s.len(), b_out.ncols(), b_in.ncols()), values)
}

/// Static response to the loads B of all modes that are not in phi.
#[pyfunction]
#[pyo3(signature = (indptr, indices, k, m, phi, b, *, ordering = "auto", symbolic = None))]
#[expect(clippy::too_many_arguments, reason = "a Python signature, by keyword")]
fn residual_vectors<'py>(
    py: Python<'py>,
    indptr: Indices,
    indices: Indices,
    k: PyReadonlyArray1<f64>,
    m: PyReadonlyArray1<f64>,
    phi: PyReadonlyArray2<f64>,
    b: PyReadonlyArray2<f64>,
    ordering: &str,
    symbolic: Option<PyRef<PySymbolic>>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let (symbolic, km) = prepare(py, &indptr, &indices, &[(&k, "K"), (&m, "M")], ordering, symbolic)?;
    let (phi, b) = (arrays::dense(&phi), arrays::dense(&b));
    for (what, x) in [("phi", &phi), ("b", &b)] {
        if x.nrows() != km[0].n() {
            let text = format!("{what} has {} rows, K has {}", x.nrows(), km[0].n());
            return Err(PyValueError::new_err(text));
        }
    }
    let x = py
        .detach(|| femend_dynamics::residual_vectors(&symbolic, &km[0], &km[1], &phi, &b))
        .map_err(arrays::dynamics_error)?;
    arrays::to_numpy(py, x)
}

/// Adds this file's classes and functions to `_core`.
pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(frf_modal, module)?)?;
    module.add_function(wrap_pyfunction!(frf_modal_scores, module)?)?;
    module.add_function(wrap_pyfunction!(frf_direct, module)?)?;
    module.add_function(wrap_pyfunction!(frf_reduced, module)?)?;
    module.add_function(wrap_pyfunction!(residual_vectors, module)?)
}
