//! Between numpy arrays and the types of the core; errors of the core as exceptions of femend.

use std::sync::Arc;

use femend_dynamics::{DynamicsError, ModalModel};
use femend_linalg::{Dense, LinalgError, Ordering, Pattern, Symbolic, SymmetricCsc};
use ndarray::{Array, ArrayView1, Dimension, ShapeBuilder, StrideShape};
use numpy::{Element, PyArray, PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::type_object::PyTypeInfo;
use pyo3::types::{PyDict, PyTuple};

pyo3::import_exception!(femend.errors, ConvergenceError);
pyo3::import_exception!(femend.errors, TooFewModesError);
pyo3::import_exception!(femend.errors, MemoryLimitError);
pyo3::import_exception!(femend.errors, ModelError);
pyo3::import_exception!(femend.errors, SingularModelError);

/// Index arrays as scipy has them.
#[derive(FromPyObject)]
pub(crate) enum Indices<'py> {
    Narrow(PyReadonlyArray1<'py, i32>),
    Wide(PyReadonlyArray1<'py, i64>),
}

impl Indices<'_> {
    fn to_u32(&self, what: &str) -> PyResult<Vec<u32>> {
        let bad = || PyValueError::new_err(format!("{what} has an entry outside 0 .. 2**32"));
        match self {
            Self::Narrow(a) => a.as_array().iter().map(|&v| u32::try_from(v).map_err(|_| bad())).collect(),
            Self::Wide(a) => a.as_array().iter().map(|&v| u32::try_from(v).map_err(|_| bad())).collect(),
        }
    }
}

/// A checked pattern from the arrays of a square compressed-column matrix.
pub(crate) fn pattern(indptr: &Indices, indices: &Indices) -> PyResult<Pattern> {
    let col_ptr = indptr.to_u32("indptr")?;
    let n = col_ptr.len().checked_sub(1).ok_or_else(|| PyValueError::new_err("indptr is empty"))?;
    Pattern::new(n, col_ptr, indices.to_u32("indices")?).map_err(linalg_error)
}

/// A symmetric matrix on a pattern.
pub(crate) fn matrix(
    pattern: &Arc<Pattern>,
    values: &PyReadonlyArray1<f64>,
    what: &'static str,
) -> PyResult<SymmetricCsc> {
    SymmetricCsc::new(pattern.clone(), values.as_array().to_vec(), what).map_err(linalg_error)
}

/// One matrix per row of values (n_p, nnz).
pub(crate) fn family(
    pattern: &Arc<Pattern>,
    values: &PyReadonlyArray2<f64>,
    what: &'static str,
) -> PyResult<Vec<SymmetricCsc>> {
    let rows = values.as_array();
    rows.outer_iter()
        .map(|row| SymmetricCsc::new(pattern.clone(), row.to_vec(), what).map_err(linalg_error))
        .collect()
}

/// One matrix per row of values (n_p, nnz), each on the pattern of its own entries: a parameter changes a few elements,
/// and most of what the pattern of the model holds is zero in its derivatives.
pub(crate) fn compact_family(
    pattern: &Arc<Pattern>,
    values: &PyReadonlyArray2<f64>,
    what: &'static str,
) -> PyResult<Vec<SymmetricCsc>> {
    values.as_array().outer_iter().map(|row| compact(pattern, row, what).map_err(linalg_error)).collect()
}

fn compact(
    pattern: &Arc<Pattern>,
    values: ArrayView1<'_, f64>,
    what: &'static str,
) -> Result<SymmetricCsc, LinalgError> {
    if values.len() != pattern.nnz() {
        return SymmetricCsc::new(pattern.clone(), values.to_vec(), what);
    }
    let (mut starts, mut rows, mut own) = (vec![0u32], Vec::new(), Vec::new());
    for j in 0..pattern.n() {
        for k in pattern.range(j) {
            if values[k] != 0.0 {
                rows.push(pattern.row_idx()[k]);
                own.push(values[k]);
            }
        }
        starts.push(rows.len() as u32);
    }
    match Pattern::new(pattern.n(), starts, rows) {
        Ok(entries) => SymmetricCsc::new(Arc::new(entries), own, what),
        // an entry whose mirror is zero: rounding, or the matrix is not symmetric and the error names where
        Err(_) => SymmetricCsc::new(pattern.clone(), values.to_vec(), what),
    }
}

/// Ordering by name, then the symbolic factor.
pub(crate) fn symbolic(py: Python<'_>, pattern: &Arc<Pattern>, ordering: &str) -> PyResult<Arc<Symbolic>> {
    let ordering: Ordering = ordering.parse().map_err(linalg_error)?;
    let pattern = pattern.clone();
    py.detach(move || Symbolic::new(pattern, ordering)).map(Arc::new).map_err(linalg_error)
}

/// Column-major copy of a 2-D array.
pub(crate) fn dense(array: &PyReadonlyArray2<f64>) -> Dense {
    let a = array.as_array();
    let (n, k) = a.dim();
    Dense::from_vec(n, k, a.t().iter().copied().collect())
}

/// Values as an array of a shape, without copying.
pub(crate) fn shaped<T: Element, D: Dimension>(
    py: Python<'_>,
    shape: impl Into<StrideShape<D>>,
    values: Vec<T>,
) -> PyResult<Bound<'_, PyArray<T, D>>> {
    let array = Array::from_shape_vec(shape, values).map_err(|e| PyValueError::new_err(e.to_string()))?;
    Ok(PyArray::from_owned_array(py, array))
}

/// A block as a Fortran-ordered array, without copying.
pub(crate) fn to_numpy<'py>(py: Python<'py>, block: Dense) -> PyResult<Bound<'py, PyArray2<f64>>> {
    shaped(py, (block.nrows(), block.ncols()).f(), block.into_vec())
}

/// A modal model from its frequencies (r,), damping ratios (r,), and modes (n_out, r) and (n_in, r).
pub(crate) fn modal_model(
    omega: &PyReadonlyArray1<f64>,
    zeta: &PyReadonlyArray1<f64>,
    phi_out: &PyReadonlyArray2<f64>,
    phi_in: &PyReadonlyArray2<f64>,
) -> ModalModel {
    ModalModel {
        omega: omega.as_array().to_vec(),
        zeta: zeta.as_array().to_vec(),
        phi_out: dense(phi_out),
        phi_in: dense(phi_in),
    }
}

/// An exception of type `E` with a message and what `fill` puts into its keyword arguments.
fn with_attributes<E: PyTypeInfo>(
    message: String,
    fill: impl FnOnce(&Bound<'_, PyDict>) -> PyResult<()>,
) -> PyErr {
    Python::attach(|py| {
        let build = || -> PyResult<PyErr> {
            let kwargs = PyDict::new(py);
            fill(&kwargs)?;
            Ok(PyErr::from_value(py.get_type::<E>().call((message,), Some(&kwargs))?))
        };
        build().unwrap_or_else(|e| e)
    })
}

/// `SingularModelError` with its DOFs as text.
fn singular(message: String, dofs: Vec<usize>) -> PyErr {
    with_attributes::<SingularModelError>(message, |kwargs| {
        kwargs.set_item("dofs", PyTuple::new(kwargs.py(), dofs.into_iter().map(|d| d.to_string()))?)
    })
}

/// `MemoryLimitError` with both numbers in bytes.
fn too_large(message: String, needed: usize, free: Option<usize>) -> PyErr {
    with_attributes::<MemoryLimitError>(message, |kwargs| {
        kwargs.set_item("needed", needed)?;
        kwargs.set_item("free", free)
    })
}

/// An error of sparse algebra as an exception.
pub(crate) fn linalg_error(error: LinalgError) -> PyErr {
    let message = error.to_string();
    match error {
        LinalgError::Pattern(_) | LinalgError::Shape { .. } | LinalgError::Library(_) => {
            PyValueError::new_err(message)
        }
        LinalgError::NotFinite { .. }
        | LinalgError::NotSymmetric { .. }
        | LinalgError::NotPositiveDefinite => ModelError::new_err(message),
        LinalgError::Singular { pivots } => singular(message, pivots.iter().map(|p| p.dof).collect()),
        LinalgError::Probe { .. } => ConvergenceError::new_err(message),
        LinalgError::Memory { bytes, free } => too_large(message, bytes, free),
    }
}

/// An error of the dynamics as an exception.
pub(crate) fn dynamics_error(error: DynamicsError) -> PyErr {
    let message = error.to_string();
    match error {
        DynamicsError::Linalg(inner) => linalg_error(inner),
        DynamicsError::Argument(_) => PyValueError::new_err(message),
        DynamicsError::Mechanism { dofs } => singular(message, dofs),
        DynamicsError::NegativeStiffness { .. } | DynamicsError::NegativeMass { .. } => {
            ModelError::new_err(message)
        }
        DynamicsError::Memory { need, free, .. } => too_large(message, need.total(), Some(free)),
        DynamicsError::TooFewModes { found, .. } => {
            with_attributes::<TooFewModesError>(message, |kwargs| kwargs.set_item("available", found))
        }
        DynamicsError::NotConverged { converged, .. }
        | DynamicsError::ComplexNotConverged { converged, .. } => {
            with_attributes::<ConvergenceError>(message, |kwargs| kwargs.set_item("converged", converged))
        }
        DynamicsError::ResponseNotConverged { .. } | DynamicsError::Missing { .. } => {
            ConvergenceError::new_err(message)
        }
    }
}
