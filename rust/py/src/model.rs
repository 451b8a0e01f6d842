//! `_core.FeModel`: the finite-element model for Python.

use crate::deck::{PyDeck, deck_error};
use crate::moved::{MovedNodes, moved_error, moved_mesh};
use femend_fem::Part;
use femend_fem::deck::{Choice, Deck, Selection, build};
use femend_fem::element::spin::SpinAxes;
use femend_fem::error::FemError;
use femend_fem::mesh::{Id, NodeComponent};
use femend_fem::model::{Model, System};
use femend_fem::parameter::Parameter;
use femend_fem::project::Reduced;
use femend_fem::rotor::Spin;
use ndarray::{Array1, Array2, Array3};
use numpy::{
    IntoPyArray, PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2,
    PyUntypedArrayMethods,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::sync::Arc;

pyo3::import_exception!(femend.errors, ModelError);

pub(crate) type Vector<'py> = Bound<'py, PyArray1<f64>>;
type Matrix<'py> = Bound<'py, PyArray2<f64>>;
type Cube<'py> = Bound<'py, PyArray3<f64>>;
/// Name, property, kind of target, ids.
type ParameterSpec = (String, String, String, Vec<Id>);
pub(crate) type Indices<'py> = Bound<'py, PyArray1<i64>>;

pub(crate) fn model_error(error: FemError) -> PyErr {
    ModelError::new_err(error.to_string())
}

/// Finite-element model with constraints eliminated: `u_g = T u_a`.
#[pyclass(frozen, module = "femend._core")]
pub(crate) struct FeModel {
    pub(crate) model: Arc<Model>,
    deck: Arc<Deck>,
    selection: Selection,
}

pub(crate) fn factors_of(model: &Model, factors: Option<PyReadonlyArray1<'_, f64>>) -> Vec<f64> {
    match factors {
        Some(f) => f.as_array().to_vec(),
        None => vec![1.0; model.parameters.len()],
    }
}

impl FeModel {
    fn factors(&self, factors: Option<PyReadonlyArray1<'_, f64>>) -> Vec<f64> {
        factors_of(&self.model, factors)
    }
}

pub(crate) fn arrays<'py>(
    py: Python<'py>,
    s: System,
) -> (Vector<'py>, Vector<'py>, Vector<'py>, Vector<'py>) {
    (s.k.into_pyarray(py), s.m.into_pyarray(py), s.c.into_pyarray(py), s.h.into_pyarray(py))
}

fn square<'py>(py: Python<'py>, r: usize, data: Vec<f64>) -> PyResult<Matrix<'py>> {
    let array = Array2::from_shape_vec((r, r), data).map_err(|e| ModelError::new_err(e.to_string()))?;
    Ok(array.into_pyarray(py))
}

fn cube<'py>(
    py: Python<'py>,
    r: usize,
    parts: &[Reduced],
    get: fn(&Reduced) -> &Vec<f64>,
) -> PyResult<Cube<'py>> {
    let data: Vec<f64> = parts.iter().flat_map(|p| get(p).iter().copied()).collect();
    let array =
        Array3::from_shape_vec((parts.len(), r, r), data).map_err(|e| ModelError::new_err(e.to_string()))?;
    Ok(array.into_pyarray(py))
}

#[pymethods]
impl FeModel {
    #[new]
    #[pyo3(signature = (deck, spc=None, parameters=None, added_mass=None, moving=None))]
    fn new(
        py: Python<'_>,
        deck: &PyDeck,
        spc: Option<Id>,
        parameters: Option<Vec<ParameterSpec>>,
        added_mass: Option<Vec<(Id, f64)>>,
        moving: Option<(Vec<Id>, PyReadonlyArray2<'_, f64>)>,
    ) -> PyResult<Self> {
        // 0 is no set, as SPC = 0 in case control
        let spc = match spc {
            None => Choice::CaseControl,
            Some(0) => Choice::Nothing,
            Some(id) => Choice::Set(id),
        };
        let selection = Selection { spc, ..Selection::default() };
        let mesh = py.detach(|| build(&deck.deck, &selection)).map_err(|e| deck_error(py, &e))?;
        let probe = match &moving {
            Some((ids, xyz)) => Some(moved_mesh(py, &deck.deck, &selection, ids, xyz)?),
            None => None,
        };
        let added_mass = added_mass.unwrap_or_default();
        let parameters = parameters
            .unwrap_or_default()
            .into_iter()
            .map(|(name, property, kind, ids)| Parameter::parse(&name, &property, &kind, ids))
            .collect::<Result<Vec<_>, _>>()
            .map_err(model_error)?;
        let make = || Model::with_probe(&mesh, probe.as_ref(), &parameters, &added_mass);
        let model =
            py.detach(make).map_err(|e| if probe.is_some() { moved_error(py, e) } else { model_error(e) })?;
        Ok(Self { model: Arc::new(model), deck: Arc::clone(&deck.deck), selection })
    }

    /// The model with nodes `ids` (n,) at `xyz` (n, 3), basic coordinates: what that changes.
    #[pyo3(signature = (ids, xyz))]
    fn moved(&self, py: Python<'_>, ids: Vec<Id>, xyz: PyReadonlyArray2<'_, f64>) -> PyResult<MovedNodes> {
        let mesh = moved_mesh(py, &self.deck, &self.selection, &ids, &xyz)?;
        let make = || Ok((self.model.moved(&mesh)?, self.model.moved_rows(&mesh)?));
        let (moved, rows) = py.detach(make).map_err(|e| moved_error(py, e))?;
        Ok(MovedNodes::new(Arc::clone(&self.model), moved, rows))
    }

    /// Indices into `elements()` of what moving nodes reaches.
    #[getter]
    fn reached<'py>(&self, py: Python<'py>) -> Indices<'py> {
        self.model.reached().iter().map(|&e| e as i64).collect::<Vec<_>>().into_pyarray(py)
    }

    /// Number of independent DOFs.
    #[getter]
    fn n_a(&self) -> usize {
        self.model.n_a()
    }

    /// Number of rows of the g-set: six per node.
    #[getter]
    fn n_g(&self) -> usize {
        self.model.nodes.n_g()
    }

    /// Node ids, in the order of the g-set.
    #[getter]
    fn node_ids<'py>(&self, py: Python<'py>) -> Indices<'py> {
        let ids: Vec<i64> = self.model.nodes.nodes.iter().map(|n| i64::from(n.id)).collect();
        ids.into_pyarray(py)
    }

    /// Ids of the nodes that are scalar points: one DOF each, without a place (`xyz` has the middle of the others).
    #[getter]
    fn scalar_points<'py>(&self, py: Python<'py>) -> Indices<'py> {
        self.model.scalar_points.iter().map(|&id| i64::from(id)).collect::<Vec<_>>().into_pyarray(py)
    }

    /// Node positions, basic coordinates, (n_nodes, 3).
    #[getter]
    fn xyz<'py>(&self, py: Python<'py>) -> Matrix<'py> {
        let n = self.model.nodes.len();
        Array2::from_shape_fn((n, 3), |(i, j)| self.model.nodes.xyz(i)[j]).into_pyarray(py)
    }

    /// Displacement frames, (n_nodes, 3, 3): row i of each is local axis i in basic coordinates.
    #[getter]
    fn frames<'py>(&self, py: Python<'py>) -> Cube<'py> {
        let nodes = &self.model.nodes;
        let entry = |(n, i, j): (usize, usize, usize)| {
            nodes.frame(n).map_or(f64::from(u8::from(i == j)), |frame| frame[i][j])
        };
        Array3::from_shape_fn((nodes.len(), 3, 3), entry).into_pyarray(py)
    }

    /// Node id of every a-set DOF.
    #[getter]
    fn dof_nodes<'py>(&self, py: Python<'py>) -> Indices<'py> {
        let of = |&g: &usize| i64::from(self.model.nodes.component(g).node);
        self.model.a_rows.iter().map(of).collect::<Vec<_>>().into_pyarray(py)
    }

    /// Component 1..6 of every a-set DOF, in its node's displacement frame.
    #[getter]
    fn dof_components<'py>(&self, py: Python<'py>) -> Indices<'py> {
        let of = |&g: &usize| (g % 6) as i64 + 1;
        self.model.a_rows.iter().map(of).collect::<Vec<_>>().into_pyarray(py)
    }

    /// T of `u_g = T u_a` as (indptr, indices, data) of compressed columns, (n_g, n_a).
    #[getter]
    #[pyo3(name = "T")]
    fn t<'py>(&self, py: Python<'py>) -> (Indices<'py>, Indices<'py>, Vector<'py>) {
        let mut columns: Vec<Vec<(i64, f64)>> = vec![Vec::new(); self.model.n_a()];
        for (g, row) in self.model.t_rows.iter().enumerate() {
            for &(a, v) in row {
                columns[a as usize].push((g as i64, v));
            }
        }
        let mut indptr = vec![0_i64];
        for column in &columns {
            indptr.push(indptr[indptr.len() - 1] + column.len() as i64);
        }
        let indices: Vec<i64> = columns.iter().flatten().map(|t| t.0).collect();
        let data: Vec<f64> = columns.iter().flatten().map(|t| t.1).collect();
        (indptr.into_pyarray(py), indices.into_pyarray(py), data.into_pyarray(py))
    }

    /// DOFs held because no element resists or loads them, as "node:component".
    #[getter]
    fn auto_constrained(&self) -> Vec<String> {
        let scalar = |node| self.model.scalar_points.binary_search(&node).is_ok();
        let component = |d: &NodeComponent| if scalar(d.node) { 0 } else { d.component };
        self.model.auto_constrained.iter().map(|d| format!("{}:{}", d.node, component(d))).collect()
    }

    /// Names of the parameters.
    #[getter]
    fn parameter_names(&self) -> Vec<String> {
        self.model.parameters.iter().map(|p| p.name.clone()).collect()
    }

    /// Are K, M, C and structural damping affine in all factors jointly?
    #[getter]
    fn affine(&self) -> bool {
        self.model.is_affine()
    }

    /// Mass of the whole structure, held nodes included.
    #[pyo3(signature = ())]
    fn total_mass(&self) -> f64 {
        self.model.total_mass()
    }

    /// (id, card, node ids) of every element; masses added by a configuration have id 0.
    #[pyo3(signature = ())]
    fn elements(&self) -> Vec<(Id, &'static str, Vec<Id>)> {
        let ids = |nodes: &[usize]| nodes.iter().map(|&n| self.model.nodes.nodes[n].id).collect();
        self.model.elements.iter().map(|e| (e.id, e.card, ids(&e.nodes))).collect()
    }

    /// Pattern and values of K, M, C and structural damping at the factors.
    #[pyo3(signature = (factors=None))]
    #[allow(clippy::type_complexity)]
    fn assemble<'py>(
        &self,
        py: Python<'py>,
        factors: Option<PyReadonlyArray1<'py, f64>>,
    ) -> PyResult<(
        Bound<'py, PyArray1<i32>>,
        Bound<'py, PyArray1<i32>>,
        Vector<'py>,
        Vector<'py>,
        Vector<'py>,
        Vector<'py>,
    )> {
        let factors = self.factors(factors);
        let system = py.detach(|| self.model.assemble(&factors)).map_err(model_error)?;
        let p = self.model.pattern();
        let int = |v: &[u32]| Array1::from_iter(v.iter().map(|&i| i as i32)).into_pyarray(py);
        let (k, m, c, h) = arrays(py, system);
        Ok((int(p.col_ptr()), int(p.row_idx()), k, m, c, h))
    }

    /// Writes the values of one matrix ("K", "M", "C", "H") at the factors into `out` (nnz,), on the pattern of `assemble`.
    #[pyo3(signature = (matrix, factors, out))]
    fn refill(
        &self,
        py: Python<'_>,
        matrix: &str,
        factors: Option<PyReadonlyArray1<'_, f64>>,
        out: &Bound<'_, PyArray1<f64>>,
    ) -> PyResult<()> {
        let part = Part::parse(matrix).ok_or_else(|| {
            PyValueError::new_err(format!("matrix '{matrix}' is unknown; use K, M, C or H"))
        })?;
        let factors = self.factors(factors);
        let mut view =
            out.try_readwrite().map_err(|e| PyValueError::new_err(format!("out cannot be written: {e}")))?;
        let values = view.as_slice_mut().map_err(|e| PyValueError::new_err(e.to_string()))?;
        py.detach(|| self.model.refill(part, &factors, values)).map_err(model_error)
    }

    /// Derivatives of K, M, C and structural damping with respect to factor `i`, on the same pattern.
    #[pyo3(signature = (i, factors=None))]
    fn derivative<'py>(
        &self,
        py: Python<'py>,
        i: usize,
        factors: Option<PyReadonlyArray1<'py, f64>>,
    ) -> PyResult<(Vector<'py>, Vector<'py>, Vector<'py>, Vector<'py>)> {
        let factors = self.factors(factors);
        let system = py.detach(|| self.model.derivative(i, &factors)).map_err(model_error)?;
        Ok(arrays(py, system))
    }

    /// Reduced matrices on the basis `v` (n_a, r) and their derivatives with respect to every factor.
    #[pyo3(signature = (factors, v))]
    #[allow(clippy::type_complexity)]
    fn project<'py>(
        &self,
        py: Python<'py>,
        factors: Option<PyReadonlyArray1<'py, f64>>,
        v: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<(
        (Matrix<'py>, Matrix<'py>, Matrix<'py>, Matrix<'py>),
        (Cube<'py>, Cube<'py>, Cube<'py>, Cube<'py>),
    )> {
        let factors = self.factors(factors);
        let (v, r) = rows_of(&v);
        let (reduced, d) = py.detach(|| self.model.project(&factors, &v, r)).map_err(model_error)?;
        let now = (
            square(py, r, reduced.k)?,
            square(py, r, reduced.m)?,
            square(py, r, reduced.c)?,
            square(py, r, reduced.h)?,
        );
        let then = (
            cube(py, r, &d, |p| &p.k)?,
            cube(py, r, &d, |p| &p.m)?,
            cube(py, r, &d, |p| &p.c)?,
            cube(py, r, &d, |p| &p.h)?,
        );
        Ok((now, then))
    }

    /// g-set rows, K and M of one element, in displacement frames.
    #[pyo3(signature = (eid, factors=None))]
    fn element_matrices<'py>(
        &self,
        py: Python<'py>,
        eid: Id,
        factors: Option<PyReadonlyArray1<'py, f64>>,
    ) -> PyResult<(Indices<'py>, Matrix<'py>, Matrix<'py>)> {
        let factors = self.factors(factors);
        let index = self.model.element_index(eid).map_err(model_error)?;
        let matrices = self.model.element_matrices(index, &factors).map_err(model_error)?;
        let rows: Vec<i64> = self.model.elements[index].rows.iter().map(|&g| g as i64).collect();
        let n = rows.len();
        let dense =
            |a: Option<femend_fem::small::Mat<f64>>| square(py, n, a.map_or(vec![0.0; n * n], |a| a.data));
        Ok((rows.into_pyarray(py), dense(matrices.k)?, dense(matrices.m)?))
    }

    /// Local axes (3, 3) in basic coordinates, one per row, and length of a beam.
    #[pyo3(signature = (eid))]
    fn element_frame<'py>(&self, py: Python<'py>, eid: Id) -> PyResult<(Matrix<'py>, f64)> {
        let index = self.model.element_index(eid).map_err(model_error)?;
        let element = &self.model.elements[index];
        let (frame, length) = element.beam_frame().ok_or_else(|| {
            ModelError::new_err(format!("{} {eid} has no beam axes; ask for a CBAR or CBEAM", element.card))
        })?;
        Ok((Array2::from_shape_fn((3, 3), |(i, j)| frame[i][j]).into_pyarray(py), length))
    }

    /// Stress stiffness of the preload that the displacements `u` (n_a,) make, on the pattern of `assemble`.
    #[pyo3(signature = (u, factors=None))]
    fn stress_stiffness<'py>(
        &self,
        py: Python<'py>,
        u: PyReadonlyArray1<'py, f64>,
        factors: Option<PyReadonlyArray1<'py, f64>>,
    ) -> PyResult<Vector<'py>> {
        let (factors, u) = (self.factors(factors), u.as_array().to_vec());
        let values = py.detach(|| self.model.stress_stiffness(&factors, &u)).map_err(model_error)?;
        Ok(values.into_pyarray(py))
    }

    /// Gyroscopic matrix (antisymmetric) per rad/s and softening per (rad/s)², on the pattern of `assemble`.
    #[pyo3(signature = (axis, elements=None, rotating=false, factors=None))]
    fn gyroscopic<'py>(
        &self,
        py: Python<'py>,
        axis: [f64; 3],
        elements: Option<Vec<Id>>,
        rotating: bool,
        factors: Option<PyReadonlyArray1<'py, f64>>,
    ) -> PyResult<(Vector<'py>, Vector<'py>)> {
        let axes = if rotating { SpinAxes::Rotating } else { SpinAxes::Fixed };
        let (factors, spin) = (self.factors(factors), Spin { axis, axes, elements });
        let out = py.detach(|| self.model.gyroscopic(&factors, &spin)).map_err(model_error)?;
        Ok((out.g.into_pyarray(py), out.softening.into_pyarray(py)))
    }

    /// All six components of every node, (n_g, r), from the a-set, (n_a, r).
    #[pyo3(signature = (v))]
    fn recover<'py>(&self, py: Python<'py>, v: PyReadonlyArray2<'py, f64>) -> PyResult<Matrix<'py>> {
        let (v, r) = rows_of(&v);
        let data = py.detach(|| self.model.recover(&v, r)).map_err(model_error)?;
        let array = Array2::from_shape_vec((self.model.nodes.n_g(), r), data);
        Ok(array.map_err(|e| ModelError::new_err(e.to_string()))?.into_pyarray(py))
    }
}

/// Row-major copy of an array and its number of columns.
fn rows_of(v: &PyReadonlyArray2<'_, f64>) -> (Vec<f64>, usize) {
    (v.as_array().iter().copied().collect(), v.shape()[1])
}

/// Adds this file's classes and functions to `_core`.
pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<FeModel>()
}
