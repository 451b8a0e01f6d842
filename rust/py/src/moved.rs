//! `_core.MovedNodes`: elements of a model with some of its nodes elsewhere.

use crate::deck::deck_error;
use crate::model::{Indices, Vector, arrays, factors_of, model_error};
use femend_fem::deck::{Deck, Positions, Selection, build_moved};
use femend_fem::error::FemError;
use femend_fem::mesh::{Id, Mesh};
use femend_fem::model::Model;
use femend_fem::morph::Moved;
use numpy::{IntoPyArray, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::Arc;

pyo3::import_exception!(femend.errors, GeometryError);
pyo3::import_exception!(femend.errors, ModelError);

/// The error of a model with moved nodes: `femend.errors.GeometryError` where an element is to blame.
pub(crate) fn moved_error(py: Python<'_>, error: FemError) -> PyErr {
    let element = match &error {
        FemError::ZeroLength { what, id, .. }
        | FemError::Orientation { what, id }
        | FemError::Element { what, id, .. }
        | FemError::Jacobian { what, id, .. }
        | FemError::InsideOut { what, id, .. } => format!("{what} {id}"),
        FemError::Constraint { what, id, .. } => format!("{what} {id}"),
        _ => return model_error(error),
    };
    let make = || -> PyResult<PyErr> {
        let keywords = PyDict::new(py);
        keywords.set_item("element", element)?;
        Ok(PyErr::from_value(py.get_type::<GeometryError>().call((error.to_string(),), Some(&keywords))?))
    };
    make().unwrap_or_else(|other| other)
}

/// The deck's mesh with some nodes elsewhere. `xyz` is (n, 3).
pub(crate) fn moved_mesh(
    py: Python<'_>,
    deck: &Deck,
    selection: &Selection,
    ids: &[Id],
    xyz: &PyReadonlyArray2<'_, f64>,
) -> PyResult<Mesh> {
    let xyz = xyz.as_array();
    if xyz.dim() != (ids.len(), 3) {
        let (rows, columns) = xyz.dim();
        let n = ids.len();
        return Err(ModelError::new_err(format!(
            "{n} nodes and positions ({rows}, {columns}); give ({n}, 3)"
        )));
    }
    let at = |(i, id): (usize, &Id)| (*id, [xyz[(i, 0)], xyz[(i, 1)], xyz[(i, 2)]]);
    let moved: Positions = ids.iter().enumerate().map(at).collect();
    py.detach(|| build_moved(deck, selection, &moved)).map_err(|e| deck_error(py, &e))
}

/// Elements of a model with their nodes elsewhere: what that adds to K, M, C and structural damping.
#[pyclass(frozen, module = "femend._core")]
pub(crate) struct MovedNodes {
    model: Arc<Model>,
    moved: Moved,
    rows: Vec<usize>,
}

impl MovedNodes {
    pub(crate) fn new(model: Arc<Model>, moved: Moved, rows: Vec<usize>) -> Self {
        Self { model, moved, rows }
    }
}

#[pymethods]
impl MovedNodes {
    /// g-set rows whose row of T is another one there.
    #[getter]
    fn rows<'py>(&self, py: Python<'py>) -> Indices<'py> {
        self.rows.iter().map(|&g| g as i64).collect::<Vec<_>>().into_pyarray(py)
    }

    /// What the new positions add to (K, M, C, H) at the factors, on the pattern of `FeModel.assemble`.
    #[pyo3(signature = (factors=None))]
    fn change<'py>(
        &self,
        py: Python<'py>,
        factors: Option<PyReadonlyArray1<'py, f64>>,
    ) -> PyResult<(Vector<'py>, Vector<'py>, Vector<'py>, Vector<'py>)> {
        let factors = factors_of(&self.model, factors);
        let system =
            py.detach(|| self.model.change(&self.moved, &factors)).map_err(|e| moved_error(py, e))?;
        Ok(arrays(py, system))
    }

    /// (K, M, C, H) at these positions less those at the positions of `other`, at the factors.
    #[pyo3(signature = (other, factors=None))]
    fn minus<'py>(
        &self,
        py: Python<'py>,
        other: &Self,
        factors: Option<PyReadonlyArray1<'py, f64>>,
    ) -> PyResult<(Vector<'py>, Vector<'py>, Vector<'py>, Vector<'py>)> {
        if !Arc::ptr_eq(&self.model, &other.model) {
            return Err(ModelError::new_err("these are moved nodes of another model; take both of one"));
        }
        let factors = factors_of(&self.model, factors);
        let system = py.detach(|| self.model.between(&self.moved, &other.moved, &factors));
        Ok(arrays(py, system.map_err(|e| moved_error(py, e))?))
    }

    /// What the new positions add to the derivatives of (K, M, C, H) with respect to factor `i`.
    #[pyo3(signature = (i, factors=None))]
    fn derivative<'py>(
        &self,
        py: Python<'py>,
        i: usize,
        factors: Option<PyReadonlyArray1<'py, f64>>,
    ) -> PyResult<(Vector<'py>, Vector<'py>, Vector<'py>, Vector<'py>)> {
        let factors = factors_of(&self.model, factors);
        let system = py
            .detach(|| self.model.derivative_change(&self.moved, i, &factors))
            .map_err(|e| moved_error(py, e))?;
        Ok(arrays(py, system))
    }
}

/// Adds this file's classes and functions to `_core`.
pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<MovedNodes>()
}
