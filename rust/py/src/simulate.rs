//! Closed-loop response of a modal model that carries laws.

use femend_dynamics::laws::Law;
use femend_dynamics::simulate::{
    ModalModel, Output, Response, Run, SimulationError, simulate, simulate_tangents,
};
use ndarray::ArrayViewD;
use numpy::{PyArray2, PyArray3, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArrayDyn};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::prelude::*;

use crate::arrays::shaped;
use crate::laws::{law, law_error};
use crate::own_law::raised;

pub(crate) fn simulation_error(py: Python<'_>, error: &SimulationError) -> PyErr {
    match error {
        SimulationError::Law(error) => law_error(py, error),
        other => PyValueError::new_err(other.to_string()),
    }
}

/// One list of (name, parameters) for each coordinate.
fn joints(laws: &Bound<'_, PyAny>) -> PyResult<Vec<Vec<Law>>> {
    let lists: Vec<Vec<(String, Bound<'_, PyAny>)>> = laws.extract().map_err(|_| {
        PyTypeError::new_err("laws must be one list of (name, parameters) pairs for each row of w")
    })?;
    lists.iter().map(|list| list.iter().map(|(name, p)| law(name, p)).collect()).collect()
}

fn quantity(output: &str) -> PyResult<Output> {
    match output {
        "displacement" => Ok(Output::Displacement),
        "velocity" => Ok(Output::Velocity),
        "acceleration" => Ok(Output::Acceleration),
        _ => Err(PyValueError::new_err(format!(
            "output = {output:?}; it must be \"displacement\", \"velocity\" or \"acceleration\""
        ))),
    }
}

/// Arrays that are the same for all sets (`base` dimensions) or given for each (`base` + 1), in row-major order.
struct PerSet {
    name: &'static str,
    values: Vec<f64>,
    shape: Vec<usize>,
    n_sets: Option<usize>,
}

impl PerSet {
    fn new(name: &'static str, array: ArrayViewD<'_, f64>, base: usize) -> PyResult<Self> {
        let dims = array.shape();
        if dims.len() != base && dims.len() != base + 1 {
            return Err(PyValueError::new_err(format!(
                "{name} has {} dimensions; {base} are needed, or {} with one entry for each set",
                dims.len(),
                base + 1
            )));
        }
        let n_sets = (dims.len() > base).then(|| dims[0]);
        let shape = dims[dims.len() - base..].to_vec();
        Ok(Self { name, values: array.iter().copied().collect(), shape, n_sets })
    }

    fn check(&self, n_sets: usize, n_modes: usize) -> PyResult<()> {
        if self.n_sets.is_some_and(|n| n != n_sets) {
            let given = self.n_sets.unwrap_or_default();
            return Err(PyValueError::new_err(format!(
                "{} is given for {given} sets, laws for {n_sets}",
                self.name
            )));
        }
        let last = self.shape.last().copied().unwrap_or_default();
        if last != n_modes {
            return Err(PyValueError::new_err(format!(
                "the last axis of {} has {last} entries, omega has {n_modes} modes",
                self.name
            )));
        }
        Ok(())
    }

    fn of(&self, set: usize) -> &[f64] {
        let size: usize = self.shape.iter().product();
        let first = if self.n_sets.is_some() { set * size } else { 0 };
        &self.values[first..first + size]
    }
}

/// The modal model's arrays, shared or per set.
struct Modal {
    omega: PerSet,
    zeta: PerSet,
    phi_in: PerSet,
    phi_out: PerSet,
    w: PerSet,
    residual: Option<Vec<f64>>,
}

impl Modal {
    fn new(arrays: [ArrayViewD<'_, f64>; 5], residual: Option<PyReadonlyArray2<'_, f64>>) -> PyResult<Self> {
        let [omega, zeta, phi_in, phi_out, w] = arrays;
        Ok(Self {
            omega: PerSet::new("omega", omega, 1)?,
            zeta: PerSet::new("zeta", zeta, 1)?,
            phi_in: PerSet::new("phi_in", phi_in, 2)?,
            phi_out: PerSet::new("phi_out", phi_out, 2)?,
            w: PerSet::new("w", w, 2)?,
            residual: residual.map(|r| r.as_array().iter().copied().collect()),
        })
    }

    fn check(&self, n_sets: usize, n_w: usize, n_in: usize) -> PyResult<()> {
        let n_modes = self.omega.shape[0];
        for array in [&self.omega, &self.zeta, &self.phi_in, &self.phi_out, &self.w] {
            array.check(n_sets, n_modes)?;
        }
        if self.w.shape[0] != n_w {
            return Err(PyValueError::new_err(format!(
                "w has {} rows, laws are given for {n_w} coordinates; give one list of laws for each row",
                self.w.shape[0]
            )));
        }
        if self.phi_in.shape[0] != n_in {
            return Err(PyValueError::new_err(format!(
                "u has {n_in} inputs, phi_in has {} rows",
                self.phi_in.shape[0]
            )));
        }
        Ok(())
    }

    fn of(&self, set: usize) -> ModalModel<'_> {
        ModalModel {
            omega: self.omega.of(set),
            zeta: self.zeta.of(set),
            phi_in: self.phi_in.of(set),
            phi_out: self.phi_out.of(set),
            w: self.w.of(set),
            residual_compliance: self.residual.as_deref(),
        }
    }
}

fn status<'py>(py: Python<'py>, response: &Response) -> PyResult<Bound<'py, PyDict>> {
    let (out, status) = (PyDict::new(py), &response.status);
    out.set_item("converged", status.failed_at.is_none())?;
    out.set_item("failed_at", status.failed_at)?;
    out.set_item("advice", &status.advice)?;
    out.set_item("n_iterations", status.n_iterations)?;
    out.set_item("n_static_modes", status.n_static_modes)?;
    out.set_item("added_compliance", status.added_compliance)?;
    Ok(out)
}

type Histories<'py> = (
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyDict>,
);

fn histories<'py>(py: Python<'py>, out: Response, n_out: usize, n_w: usize) -> PyResult<Histories<'py>> {
    let (status, n) = (status(py, &out)?, out.n);
    Ok((
        shaped(py, (n_out, n), out.y)?,
        shaped(py, (n_w, n), out.d)?,
        shaped(py, (n_w, n), out.v)?,
        shaped(py, (n_w, n), out.f)?,
        status,
    ))
}

/// Response from rest of a modal model that carries laws; see the stub of `femend._core`.
#[pyfunction]
#[pyo3(name = "simulate", signature = (omega, zeta, phi_in, phi_out, w, laws, u, dt, *, substeps=1, stride=1,
                   decimate=1, output="acceleration", residual_compliance=None))]
#[allow(clippy::too_many_arguments)]
fn py_simulate<'py>(
    py: Python<'py>,
    omega: PyReadonlyArray1<'py, f64>,
    zeta: PyReadonlyArray1<'py, f64>,
    phi_in: PyReadonlyArray2<'py, f64>,
    phi_out: PyReadonlyArray2<'py, f64>,
    w: PyReadonlyArray2<'py, f64>,
    laws: &Bound<'py, PyAny>,
    u: PyReadonlyArray2<'py, f64>,
    dt: f64,
    substeps: usize,
    stride: usize,
    decimate: usize,
    output: &str,
    residual_compliance: Option<PyReadonlyArray2<'py, f64>>,
) -> PyResult<Histories<'py>> {
    let laws = joints(laws)?;
    let arrays = [
        omega.as_array().into_dyn(),
        zeta.as_array().into_dyn(),
        phi_in.as_array().into_dyn(),
        phi_out.as_array().into_dyn(),
        w.as_array().into_dyn(),
    ];
    let modal = Modal::new(arrays, residual_compliance)?;
    let record = Record::new(&u);
    modal.check(1, laws.len(), record.n_in)?;
    let (n_out, n_w, output) = (modal.phi_out.shape[0], laws.len(), quantity(output)?);
    let run = record.run(dt, [substeps, stride, decimate], output);
    let out = py.detach(|| simulate(&modal.of(0), &laws, &run));
    raised()?;
    histories(py, out.map_err(|error| simulation_error(py, &error))?, n_out, n_w)
}

type Tangents<'py> = (
    Histories<'py>,
    Bound<'py, PyArray3<f64>>,
    Bound<'py, PyArray3<f64>>,
    Bound<'py, PyArray3<f64>>,
    Bound<'py, PyArray3<f64>>,
);

/// Records with derivatives over law parameters, and models moved a little beside them; see the stub of `femend._core`.
#[pyfunction]
#[pyo3(name = "simulate_tangents", signature = (omega, zeta, phi_in, phi_out, w, laws, wanted, u, dt, *, substeps=1,
                   stride=1, decimate=1, output="acceleration", residual_compliance=None))]
#[allow(clippy::too_many_arguments)]
fn py_simulate_tangents<'py>(
    py: Python<'py>,
    omega: PyReadonlyArrayDyn<'py, f64>,
    zeta: PyReadonlyArrayDyn<'py, f64>,
    phi_in: PyReadonlyArrayDyn<'py, f64>,
    phi_out: PyReadonlyArrayDyn<'py, f64>,
    w: PyReadonlyArrayDyn<'py, f64>,
    laws: &Bound<'py, PyAny>,
    wanted: Vec<bool>,
    u: Vec<PyReadonlyArray2<'py, f64>>,
    dt: f64,
    substeps: usize,
    stride: usize,
    decimate: usize,
    output: &str,
    residual_compliance: Option<PyReadonlyArray2<'py, f64>>,
) -> PyResult<Vec<Tangents<'py>>> {
    let laws = joints(laws)?;
    let records: Vec<Record> = u.iter().map(Record::new).collect();
    let shape = omega.as_array().shape().to_vec();
    let n_sets = shape.first().copied().unwrap_or_default();
    if shape.len() != 2 || n_sets == 0 {
        return Err(PyValueError::new_err(format!(
            "omega has {} dimensions; a row for the model and one for each moved model are needed",
            shape.len()
        )));
    }
    let arrays = [omega.as_array(), zeta.as_array(), phi_in.as_array(), phi_out.as_array(), w.as_array()];
    let modal = Modal::new(arrays, residual_compliance)?;
    let output = quantity(output)?;
    for record in &records {
        modal.check(n_sets, laws.len(), record.n_in)?;
    }
    let moved: Vec<ModalModel<'_>> = (1..n_sets).map(|set| modal.of(set)).collect();
    let one = |record: &Record| {
        let run = record.run(dt, [substeps, stride, decimate], output);
        simulate_tangents(&modal.of(0), &laws, &run, &wanted, &moved)
    };
    let done: Result<Vec<Response>, SimulationError> = py.detach(|| records.par_iter().map(one).collect());
    raised()?;
    let done = done.map_err(|error| simulation_error(py, &error))?;
    let (n_out, n_w, n_p) = (modal.phi_out.shape[0], laws.len(), wanted.iter().filter(|w| **w).count());
    done.into_iter()
        .map(|mut out| {
            let (dy, df) = (std::mem::take(&mut out.dy), std::mem::take(&mut out.df));
            let (y, f) = (std::mem::take(&mut out.moved_y), std::mem::take(&mut out.moved_f));
            let n = out.n;
            Ok((
                histories(py, out, n_out, n_w)?,
                shaped(py, (n_p, n_out, n), dy)?,
                shaped(py, (n_p, n_w, n), df)?,
                shaped(py, (moved.len(), n_out, n), y)?,
                shaped(py, (moved.len(), n_w, n), f)?,
            ))
        })
        .collect()
}

/// Inputs of one record, row by row.
struct Record {
    u: Vec<f64>,
    n_in: usize,
    n: usize,
}

impl Record {
    fn new(u: &PyReadonlyArray2<'_, f64>) -> Self {
        let array = u.as_array();
        Self { u: array.iter().copied().collect(), n_in: array.nrows(), n: array.ncols() }
    }

    fn run(&self, dt: f64, [substeps, stride, decimate]: [usize; 3], output: Output) -> Run<'_> {
        Run { u: &self.u, n: self.n, dt, substeps, stride, decimate, output }
    }
}

/// Many law sets times many records on all cores; see the stub of `femend._core`.
#[pyfunction]
#[pyo3(name = "simulate_batch", signature = (omega, zeta, phi_in, phi_out, w, laws, u, dt, *, substeps=1, stride=1,
                   decimate=1, output="acceleration", residual_compliance=None))]
#[allow(clippy::too_many_arguments)]
fn py_simulate_batch<'py>(
    py: Python<'py>,
    omega: PyReadonlyArrayDyn<'py, f64>,
    zeta: PyReadonlyArrayDyn<'py, f64>,
    phi_in: PyReadonlyArrayDyn<'py, f64>,
    phi_out: PyReadonlyArrayDyn<'py, f64>,
    w: PyReadonlyArrayDyn<'py, f64>,
    laws: Vec<Bound<'py, PyAny>>,
    u: Vec<PyReadonlyArray2<'py, f64>>,
    dt: f64,
    substeps: usize,
    stride: usize,
    decimate: usize,
    output: &str,
    residual_compliance: Option<PyReadonlyArray2<'py, f64>>,
) -> PyResult<Vec<Vec<Histories<'py>>>> {
    let sets: Vec<Vec<Vec<Law>>> = laws.iter().map(joints).collect::<PyResult<_>>()?;
    let records: Vec<Record> = u.iter().map(Record::new).collect();
    let arrays = [omega.as_array(), zeta.as_array(), phi_in.as_array(), phi_out.as_array(), w.as_array()];
    let modal = Modal::new(arrays, residual_compliance)?;
    let output = quantity(output)?;
    for set in &sets {
        for record in &records {
            modal.check(sets.len(), set.len(), record.n_in)?;
        }
    }
    let jobs: Vec<(usize, usize)> =
        (0..sets.len()).flat_map(|set| (0..records.len()).map(move |record| (set, record))).collect();
    let one = |(set, record): &(usize, usize)| {
        simulate(
            &modal.of(*set),
            &sets[*set],
            &records[*record].run(dt, [substeps, stride, decimate], output),
        )
    };
    let done: Result<Vec<Response>, SimulationError> = py.detach(|| jobs.par_iter().map(one).collect());
    raised()?;
    let mut done = done.map_err(|error| simulation_error(py, &error))?.into_iter();
    let n_out = modal.phi_out.shape[0];
    sets.iter()
        .map(|set| {
            done.by_ref().take(records.len()).map(|out| histories(py, out, n_out, set.len())).collect()
        })
        .collect()
}

/// Adds this file's functions to `_core`.
pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(py_simulate, module)?)?;
    module.add_function(wrap_pyfunction!(py_simulate_batch, module)?)?;
    module.add_function(wrap_pyfunction!(py_simulate_tangents, module)?)
}
