//! Free forces at a place, and linear laws fitted to them.

use femend_dynamics::free_force::{Follow, FreeForce as CoreForce, follow};
use femend_dynamics::laws::Kind;
use num_complex::Complex64;
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use rayon::prelude::*;

use crate::laws::law_error;

/// A free force on the lines of a record; see the stub of `femend._core`.
#[pyclass(frozen, module = "femend._core")]
pub(crate) struct FreeForce {
    inner: CoreForce,
}

#[pymethods]
impl FreeForce {
    #[new]
    #[pyo3(signature = (s, without, force, moved, gram))]
    fn new(
        s: PyReadonlyArray1<'_, Complex64>,
        without: PyReadonlyArray2<'_, Complex64>,
        force: PyReadonlyArray2<'_, Complex64>,
        moved: PyReadonlyArray3<'_, Complex64>,
        gram: PyReadonlyArray3<'_, Complex64>,
    ) -> PyResult<Self> {
        let (n_lines, n) = force.as_array().dim();
        let square = (n_lines, n, n);
        let fit = s.as_array().len() == n_lines
            && without.as_array().dim() == (n_lines, n)
            && moved.as_array().dim() == square
            && gram.as_array().dim() == square;
        let made = if fit {
            CoreForce::new(
                s.as_array().iter().copied().collect(),
                without.as_array().iter().copied().collect(),
                force.as_array().iter().copied().collect(),
                moved.as_array().iter().copied().collect(),
                gram.as_array().iter().copied().collect(),
            )
        } else {
            None
        };
        made.map(|inner| Self { inner }).ok_or_else(|| {
            PyValueError::new_err(format!(
                "s, without, force, moved and gram must have the shapes (K,), (K, n), (K, n), (K, n, n), (K, n, n), K \
                 and n > 0; force has {n_lines} x {n} values"
            ))
        })
    }

    /// What laws of dynamic stiffness kappa (n_laws, K) leave (n_laws,).
    #[pyo3(signature = (kappa))]
    fn left<'py>(
        &self,
        py: Python<'py>,
        kappa: PyReadonlyArray2<'py, Complex64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let (n_laws, n_lines) = kappa.as_array().dim();
        if n_lines != self.inner.len() {
            let expected = self.inner.len();
            return Err(PyValueError::new_err(format!(
                "kappa has {n_lines} lines, the free force {expected}"
            )));
        }
        let rows: Vec<Vec<Complex64>> = kappa.as_array().outer_iter().map(|row| row.to_vec()).collect();
        let left: Vec<f64> = py.detach(|| rows.par_iter().map(|row| self.inner.left(row)).collect());
        debug_assert_eq!(left.len(), n_laws);
        Ok(left.into_pyarray(py))
    }
}

/// A law fitted to free forces from each of its starts; see the stub of `femend._core`.
#[pyfunction]
#[pyo3(signature = (name, starts, free, steps, longest, farthest))]
#[allow(clippy::type_complexity)]
fn follow_free_force(
    py: Python<'_>,
    name: &str,
    starts: Vec<Vec<f64>>,
    free: Vec<PyRef<'_, FreeForce>>,
    steps: usize,
    longest: f64,
    farthest: f64,
) -> PyResult<Vec<Option<(f64, Vec<f64>)>>> {
    let kind = Kind::from_name(name).map_err(|error| law_error(py, &error))?;
    let forces: Vec<CoreForce> = free.iter().map(|one| one.inner.clone()).collect();
    Ok(py.detach(|| follow(kind, &starts, &forces, Follow { steps, longest, farthest })))
}

/// Adds this file's classes and functions to `_core`.
pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<FreeForce>()?;
    module.add_function(wrap_pyfunction!(follow_free_force, module)?)
}
