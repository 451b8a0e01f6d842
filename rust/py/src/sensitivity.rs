//! Derivatives of eigenvalues, shapes and FRFs, and Ritz bases.

use std::sync::Arc;

use femend_dynamics::{
    DirectDerivative, DirectModel, FrfKind, ModalDerivatives, ParameterDerivatives, RitzOptions,
};
use femend_linalg::Dense;
use num_complex::Complex64;
use numpy::{
    PyArray1, PyArray2, PyArray3, PyArray4, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2,
    PyReadonlyArray3,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays::{self, Indices, compact_family, family, shaped};
use crate::modes::{PySymbolic, prepare};

/// One square block per parameter, from (n_p, r, r).
fn blocks(values: &PyReadonlyArray3<f64>) -> Vec<Dense> {
    let all = values.as_array();
    all.outer_iter().map(|a| Dense::from_vec(a.nrows(), a.ncols(), a.t().iter().copied().collect())).collect()
}

/// Blocks of equal shape as (n_p, rows, columns).
fn stack<'py>(
    py: Python<'py>,
    blocks: &[Dense],
    rows: usize,
    cols: usize,
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let mut values = Vec::with_capacity(blocks.len() * rows * cols);
    for block in blocks {
        values.extend((0..rows).flat_map(|i| (0..cols).map(move |j| block[(i, j)])));
    }
    shaped(py, (blocks.len(), rows, cols), values)
}

/// Phi^T A_p Phi of every matrix in values (n_p, nnz).
#[pyfunction]
#[pyo3(signature = (indptr, indices, values, phi))]
fn modal_projections<'py>(
    py: Python<'py>,
    indptr: Indices,
    indices: Indices,
    values: PyReadonlyArray2<f64>,
    phi: PyReadonlyArray2<f64>,
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let pattern = Arc::new(arrays::pattern(&indptr, &indices)?);
    let (family, phi) = (compact_family(&pattern, &values, "values")?, arrays::dense(&phi));
    if phi.nrows() != pattern.n() {
        let text = format!("phi has {} rows, the matrices have {}", phi.nrows(), pattern.n());
        return Err(PyValueError::new_err(text));
    }
    let result: Vec<Dense> = py.detach(|| family.iter().map(|a| femend_dynamics::project(a, &phi)).collect());
    stack(py, &result, phi.ncols(), phi.ncols())
}

type EigenOut<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<i64>>);

/// Derivatives of eigenvalues with respect to parameters.
#[pyfunction]
#[pyo3(signature = (indptr, indices, dk, dm, eigenvalues, phi, gap = 1e-8))]
#[expect(clippy::too_many_arguments, reason = "a Python signature, by keyword")]
fn eigen_sensitivities<'py>(
    py: Python<'py>,
    indptr: Indices,
    indices: Indices,
    dk: PyReadonlyArray2<f64>,
    dm: Option<PyReadonlyArray2<f64>>,
    eigenvalues: PyReadonlyArray1<f64>,
    phi: PyReadonlyArray2<f64>,
    gap: f64,
) -> PyResult<EigenOut<'py>> {
    let pattern = Arc::new(arrays::pattern(&indptr, &indices)?);
    let dk = compact_family(&pattern, &dk, "dK")?;
    let dm = dm.map(|v| compact_family(&pattern, &v, "dM")).transpose()?;
    let (lambda, phi) = (eigenvalues.as_array().to_vec(), arrays::dense(&phi));
    if phi.nrows() != pattern.n() {
        let text = format!("phi has {} rows, the matrices have {}", phi.nrows(), pattern.n());
        return Err(PyValueError::new_err(text));
    }
    let found = py
        .detach(|| {
            femend_dynamics::eigen_sensitivities(
                ParameterDerivatives { dk: &dk, dm: dm.as_deref() },
                &lambda,
                &phi,
                gap,
            )
        })
        .map_err(arrays::dynamics_error)?;
    let cluster = found.cluster.iter().map(|&c| c as i64).collect();
    Ok((shaped(py, (dk.len(), lambda.len()), found.dlambda.concat())?, PyArray1::from_vec(py, cluster)))
}

/// Derivatives of mass-normalised shapes with respect to parameters.
#[pyfunction]
#[pyo3(signature = (indptr, indices, k, m, dk, dm, eigenvalues, phi, gap = 1e-8, *, ordering = "auto",
                    symbolic = None))]
#[expect(clippy::too_many_arguments, reason = "a Python signature, by keyword")]
fn shape_sensitivities<'py>(
    py: Python<'py>,
    indptr: Indices,
    indices: Indices,
    k: PyReadonlyArray1<f64>,
    m: PyReadonlyArray1<f64>,
    dk: PyReadonlyArray2<f64>,
    dm: Option<PyReadonlyArray2<f64>>,
    eigenvalues: PyReadonlyArray1<f64>,
    phi: PyReadonlyArray2<f64>,
    gap: f64,
    ordering: &str,
    symbolic: Option<PyRef<PySymbolic>>,
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let (symbolic, km) = prepare(py, &indptr, &indices, &[(&k, "K"), (&m, "M")], ordering, symbolic)?;
    let pattern = symbolic.pattern().clone();
    let dk = family(&pattern, &dk, "dK")?;
    let dm = dm.map(|v| family(&pattern, &v, "dM")).transpose()?;
    let (lambda, phi) = (eigenvalues.as_array().to_vec(), arrays::dense(&phi));
    let found = py
        .detach(|| {
            let parameters = ParameterDerivatives { dk: &dk, dm: dm.as_deref() };
            femend_dynamics::shape_sensitivities(&symbolic, &km[0], &km[1], parameters, &lambda, &phi, gap)
        })
        .map_err(arrays::dynamics_error)?;
    stack(py, &found, phi.nrows(), phi.ncols())
}

/// Derivatives of the FRFs of a modal model, from dK and dM in its modal coordinates.
#[pyfunction]
#[pyo3(signature = (omega, zeta, phi_out, phi_in, a, b, s, kind = "receptance"))]
#[expect(clippy::too_many_arguments, reason = "a Python signature, by keyword")]
fn frf_modal_sensitivities<'py>(
    py: Python<'py>,
    omega: PyReadonlyArray1<f64>,
    zeta: PyReadonlyArray1<f64>,
    phi_out: PyReadonlyArray2<f64>,
    phi_in: PyReadonlyArray2<f64>,
    a: PyReadonlyArray3<f64>,
    b: Option<PyReadonlyArray3<f64>>,
    s: PyReadonlyArray1<Complex64>,
    kind: &str,
) -> PyResult<Bound<'py, PyArray4<Complex64>>> {
    let kind: FrfKind = kind.parse().map_err(arrays::dynamics_error)?;
    let model = arrays::modal_model(&omega, &zeta, &phi_out, &phi_in);
    let derivatives = ModalDerivatives { a: blocks(&a), b: b.as_ref().map(blocks) };
    let s = s.as_array().to_vec();
    let shape = [derivatives.a.len(), s.len(), model.phi_out.nrows(), model.phi_in.nrows()];
    // NumPy asks for large pages, which are touched in less time
    let out = PyArray4::zeros(py, shape, false);
    {
        let mut view = out.readwrite();
        let values = view.as_slice_mut().map_err(|e| PyValueError::new_err(e.to_string()))?;
        py.detach(|| derivatives.frf_to(&model, &s, kind, values)).map_err(arrays::dynamics_error)?;
    }
    Ok(out)
}

/// Exact derivatives of FRFs by direct solution on each line.
#[pyfunction]
#[pyo3(signature = (indptr, indices, k, m, dk, dm, b_out, b_in, s, kind = "receptance", *, c = None, h = None,
                    dc = None, dh = None))]
#[expect(clippy::too_many_arguments, reason = "a Python signature, by keyword")]
fn frf_direct_sensitivities<'py>(
    py: Python<'py>,
    indptr: Indices,
    indices: Indices,
    k: PyReadonlyArray1<f64>,
    m: PyReadonlyArray1<f64>,
    dk: PyReadonlyArray2<f64>,
    dm: Option<PyReadonlyArray2<f64>>,
    b_out: PyReadonlyArray2<f64>,
    b_in: PyReadonlyArray2<f64>,
    s: PyReadonlyArray1<Complex64>,
    kind: &str,
    c: Option<PyReadonlyArray1<f64>>,
    h: Option<PyReadonlyArray1<f64>>,
    dc: Option<PyReadonlyArray2<f64>>,
    dh: Option<PyReadonlyArray2<f64>>,
) -> PyResult<Bound<'py, PyArray4<Complex64>>> {
    let kind: FrfKind = kind.parse().map_err(arrays::dynamics_error)?;
    let pattern = Arc::new(arrays::pattern(&indptr, &indices)?);
    let (k, m) = (arrays::matrix(&pattern, &k, "K")?, arrays::matrix(&pattern, &m, "M")?);
    let c = c.map(|v| arrays::matrix(&pattern, &v, "C")).transpose()?;
    let h = h.map(|v| arrays::matrix(&pattern, &v, "H")).transpose()?;
    let mut derivatives: Vec<DirectDerivative> = family(&pattern, &dk, "dK")?
        .into_iter()
        .map(|dk| DirectDerivative { dk: Some(dk), ..Default::default() })
        .collect();
    let optional = [(dm, "dM"), (dc, "dC"), (dh, "dH")];
    for (which, (values, what)) in optional.into_iter().enumerate() {
        let Some(values) = values else { continue };
        let list = family(&pattern, &values, what)?;
        if list.len() != derivatives.len() {
            let text = format!("{what} has {} parameters, dK has {}", list.len(), derivatives.len());
            return Err(PyValueError::new_err(text));
        }
        for (d, a) in derivatives.iter_mut().zip(list) {
            *[&mut d.dm, &mut d.dc, &mut d.dh][which] = Some(a);
        }
    }
    let (b_out, b_in, s) = (arrays::dense(&b_out), arrays::dense(&b_in), s.as_array().to_vec());
    if b_out.nrows() != k.n() || b_in.nrows() != k.n() {
        let text = format!("b_out has {} rows, b_in {}, K {}", b_out.nrows(), b_in.nrows(), k.n());
        return Err(PyValueError::new_err(text));
    }
    let model = DirectModel { k: &k, m: &m, c: c.as_ref(), h: h.as_ref() };
    let values = py
        .detach(|| femend_dynamics::frf_direct_sensitivities(&model, &derivatives, &b_out, &b_in, &s, kind))
        .map_err(arrays::dynamics_error)?;
    shaped(py, (derivatives.len(), s.len(), b_out.ncols(), b_in.ncols()), values)
}

type RitzOut<'py> = (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<f64>>);

/// M-orthonormal basis of modes, static vectors of loads, and derivative vectors of parameters.
#[pyfunction]
#[pyo3(signature = (indptr, indices, k, m, loads, *, f_max = None, n_modes = None, dk = None, dm = None,
                    drop = 1e-6, ordering = "auto", symbolic = None))]
#[expect(clippy::too_many_arguments, reason = "a Python signature, by keyword")]
fn ritz_basis<'py>(
    py: Python<'py>,
    indptr: Indices,
    indices: Indices,
    k: PyReadonlyArray1<f64>,
    m: PyReadonlyArray1<f64>,
    loads: PyReadonlyArray2<f64>,
    f_max: Option<f64>,
    n_modes: Option<usize>,
    dk: Option<PyReadonlyArray2<f64>>,
    dm: Option<PyReadonlyArray2<f64>>,
    drop: f64,
    ordering: &str,
    symbolic: Option<PyRef<PySymbolic>>,
) -> PyResult<RitzOut<'py>> {
    let (symbolic, km) = prepare(py, &indptr, &indices, &[(&k, "K"), (&m, "M")], ordering, symbolic)?;
    let pattern = symbolic.pattern().clone();
    let dk = dk.map(|v| family(&pattern, &v, "dK")).transpose()?.unwrap_or_default();
    let dm = dm.map(|v| family(&pattern, &v, "dM")).transpose()?;
    let loads = arrays::dense(&loads);
    let options = RitzOptions { f_max, n_modes, drop };
    let basis = py
        .detach(|| {
            let parameters = ParameterDerivatives { dk: &dk, dm: dm.as_deref() };
            femend_dynamics::ritz_basis(&symbolic, &km[0], &km[1], &loads, parameters, &options)
        })
        .map_err(arrays::dynamics_error)?;
    Ok((arrays::to_numpy(py, basis.v)?, PyArray1::from_vec(py, basis.modes.freq_hz)))
}

/// Adds this file's functions to `_core`.
pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(modal_projections, module)?)?;
    module.add_function(wrap_pyfunction!(eigen_sensitivities, module)?)?;
    module.add_function(wrap_pyfunction!(shape_sensitivities, module)?)?;
    module.add_function(wrap_pyfunction!(frf_modal_sensitivities, module)?)?;
    module.add_function(wrap_pyfunction!(frf_direct_sensitivities, module)?)?;
    module.add_function(wrap_pyfunction!(ritz_basis, module)?)
}
