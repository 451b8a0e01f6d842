//! `Symbolic`, `Factor` and `modes`.

use std::sync::Arc;

use femend_dynamics::{ModeOptions, ModesMemory};
use femend_linalg::{Dense, Factor, Kind, LinalgError, Symbolic, SymmetricCsc};
use numpy::{PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{self, Indices};

/// Ordering and symbolic factor of a pattern, for any number of factorisations and eigensolutions on it.
#[pyclass(name = "Symbolic", module = "femend._core", frozen)]
pub(crate) struct PySymbolic {
    pub(crate) inner: Arc<Symbolic>,
}

#[pymethods]
impl PySymbolic {
    #[new]
    #[pyo3(signature = (indptr, indices, ordering = "auto"))]
    fn new(py: Python<'_>, indptr: Indices, indices: Indices, ordering: &str) -> PyResult<Self> {
        let pattern = Arc::new(arrays::pattern(&indptr, &indices)?);
        Ok(Self { inner: arrays::symbolic(py, &pattern, ordering)? })
    }

    /// Ordering taken: amd, nd or natural.
    #[getter]
    fn ordering(&self) -> &'static str {
        use femend_linalg::Ordering as O;
        match self.inner.permutation().ordering {
            O::Auto => "auto",
            O::Amd => "amd",
            O::NestedDissection => "nd",
            O::Natural => "natural",
        }
    }

    /// Multiplications and additions of one factorisation.
    #[getter]
    fn flops(&self) -> f64 {
        self.inner.flops()
    }

    /// Stored values of the factor.
    #[getter]
    fn nnz(&self) -> usize {
        self.inner.nnz()
    }

    /// Bytes a real factorisation will add to what is in use; a complex one adds twice as much.
    #[getter]
    fn memory(&self) -> usize {
        self.inner.memory().numeric(8)
    }

    /// Bytes that `n_modes` modes will add to what is in use; without a number the least that a band takes.
    #[pyo3(signature = (n_modes = None, check = true))]
    fn modes_memory(&self, n_modes: Option<usize>, check: bool) -> usize {
        ModesMemory::of(&self.inner, n_modes, !check).total()
    }
}

/// Factor of a sparse symmetric matrix: Cholesky where it is positive definite, else with 1x1 and 2x2 pivots.
#[pyclass(name = "Factor", module = "femend._core", frozen)]
pub(crate) struct PyFactor {
    inner: Factor,
}

/// Cholesky first when `kind` leaves it open.
fn factorise(symbolic: &Arc<Symbolic>, a: &SymmetricCsc, kind: Option<Kind>) -> Result<Factor, LinalgError> {
    let new = |kind| Factor::new(symbolic.clone(), a.values(), kind, None);
    match kind {
        Some(kind) => new(kind),
        None => match new(Kind::Cholesky) {
            Err(LinalgError::NotPositiveDefinite) => new(Kind::Indefinite),
            other => other,
        },
    }
}

#[pymethods]
impl PyFactor {
    #[new]
    #[pyo3(signature = (indptr, indices, values, ordering = "auto", *, symbolic = None, indefinite = None))]
    fn new(
        py: Python<'_>,
        indptr: Indices,
        indices: Indices,
        values: PyReadonlyArray1<f64>,
        ordering: &str,
        symbolic: Option<PyRef<PySymbolic>>,
        indefinite: Option<bool>,
    ) -> PyResult<Self> {
        let (symbolic, matrices) =
            prepare(py, &indptr, &indices, &[(&values, "values")], ordering, symbolic)?;
        let kind = indefinite.map(|yes| if yes { Kind::Indefinite } else { Kind::Cholesky });
        let inner = py.detach(|| factorise(&symbolic, &matrices[0], kind)).map_err(arrays::linalg_error)?;
        Ok(Self { inner })
    }

    /// X with A X = B; B is (n, k).
    #[pyo3(signature = (b))]
    fn solve<'py>(&self, py: Python<'py>, b: PyReadonlyArray2<f64>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let mut x = arrays::dense(&b);
        if x.nrows() != self.inner.n() {
            let (found, expected) = (x.nrows(), self.inner.n());
            return Err(arrays::linalg_error(LinalgError::Shape { what: "B (rows)", found, expected }));
        }
        py.detach(|| self.inner.solve_in_place(&mut x));
        arrays::to_numpy(py, x)
    }

    /// Number of negative eigenvalues.
    #[getter]
    fn inertia(&self) -> usize {
        self.inner.inertia().negative
    }

    /// Multiplications and additions of the factorisation.
    #[getter]
    fn flops(&self) -> f64 {
        self.inner.symbolic().flops()
    }

    /// Stored values of the factor.
    #[getter]
    fn nnz(&self) -> usize {
        self.inner.symbolic().nnz()
    }

    /// Relative residual of the probe solution.
    #[getter]
    fn probe(&self) -> f64 {
        self.inner.probe()
    }

    /// "cholesky" or "indefinite".
    #[getter]
    fn kind(&self) -> &'static str {
        match self.inner.kind() {
            Kind::Cholesky => "cholesky",
            Kind::Indefinite => "indefinite",
        }
    }
}

/// Pattern, symbolic factor and matrices of a call. With a symbolic factor given, its pattern must be that of the arrays.
pub(crate) fn prepare(
    py: Python<'_>,
    indptr: &Indices,
    indices: &Indices,
    values: &[(&PyReadonlyArray1<f64>, &'static str)],
    ordering: &str,
    symbolic: Option<PyRef<PySymbolic>>,
) -> PyResult<(Arc<Symbolic>, Vec<SymmetricCsc>)> {
    let given = Arc::new(arrays::pattern(indptr, indices)?);
    let symbolic = match symbolic {
        Some(s) if **s.inner.pattern() == *given => s.inner.clone(),
        Some(_) => {
            let text = "the symbolic factor belongs to another pattern than indptr and indices";
            return Err(pyo3::exceptions::PyValueError::new_err(text));
        }
        None => arrays::symbolic(py, &given, ordering)?,
    };
    let pattern = symbolic.pattern().clone();
    let matrices =
        values.iter().map(|(v, what)| arrays::matrix(&pattern, v, what)).collect::<PyResult<_>>()?;
    Ok((symbolic, matrices))
}

type ModesOut<'py> =
    (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<f64>>, Bound<'py, PyDict>);

/// Lowest real modes of K phi = lambda M phi.
#[pyfunction]
#[pyo3(signature = (indptr, indices, k, m, n_modes = None, f_max = None, sigma = None, *, start = None, check = true,
                    ordering = "auto", symbolic = None))]
#[expect(clippy::too_many_arguments, reason = "a Python signature, by keyword")]
fn modes<'py>(
    py: Python<'py>,
    indptr: Indices,
    indices: Indices,
    k: PyReadonlyArray1<f64>,
    m: PyReadonlyArray1<f64>,
    n_modes: Option<usize>,
    f_max: Option<f64>,
    sigma: Option<f64>,
    start: Option<PyReadonlyArray2<f64>>,
    check: bool,
    ordering: &str,
    symbolic: Option<PyRef<PySymbolic>>,
) -> PyResult<ModesOut<'py>> {
    let (symbolic, matrices) = prepare(py, &indptr, &indices, &[(&k, "K"), (&m, "M")], ordering, symbolic)?;
    let start: Option<Dense> = start.as_ref().map(arrays::dense);
    let options = ModeOptions { n_modes, f_max, sigma, start, unchecked: !check };
    let found = py
        .detach(|| femend_dynamics::modes(&symbolic, &matrices[0], &matrices[1], &options))
        .map_err(arrays::dynamics_error)?;
    let info = PyDict::new(py);
    info.set_item("sigma", found.info.sigma)?;
    info.set_item("n_rigid", found.info.n_rigid)?;
    info.set_item("counted", found.info.counted)?;
    info.set_item("vectors", found.info.vectors)?;
    info.set_item("solves", found.info.solves)?;
    info.set_item("factorisations", found.info.factorisations)?;
    info.set_item("eigenvalues", PyArray1::from_vec(py, found.lambda))?;
    Ok((
        PyArray1::from_vec(py, found.freq_hz),
        arrays::to_numpy(py, found.phi)?,
        PyArray1::from_vec(py, found.residual),
        info,
    ))
}

/// Adds this file's classes and functions to `_core`.
pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<PySymbolic>()?;
    module.add_class::<PyFactor>()?;
    module.add_function(wrap_pyfunction!(modes, module)?)
}
