//! `ComplexProblem`: complex modes of a model at any number of speeds.

use std::sync::Mutex;

use femend_dynamics::{ComplexOptions, ComplexProblem, PoleKind, Power, Term};
use ndarray::ShapeBuilder;
use num_complex::Complex64;
use numpy::{PyArray1, PyArray2, PyArray3, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{self, Indices};
use crate::modes::{PySymbolic, prepare};

/// Complex modes at any number of speeds: matrices, factor of K - sigma M, and the space that grows with them.
#[pyclass(name = "ComplexProblem", module = "femend._core", frozen)]
pub(crate) struct PyComplexProblem {
    inner: Mutex<ComplexProblem>,
    n: usize,
}

fn power(text: &str) -> PyResult<Power> {
    match text {
        "K" => Ok(Power::Stiffness),
        "C" => Ok(Power::Damping),
        "M" => Ok(Power::Mass),
        "D" => Ok(Power::Structural),
        _ => Err(PyValueError::new_err(format!("a term is K, C, M or D, not '{text}'"))),
    }
}

fn name(kind: PoleKind) -> &'static str {
    match kind {
        PoleKind::Rigid => "rigid",
        PoleKind::Oscillatory => "oscillatory",
        PoleKind::Overdamped => "overdamped",
        PoleKind::Mirrored => "mirrored",
    }
}

type Block<'py> = Bound<'py, PyArray2<Complex64>>;

pub(crate) fn block(py: Python<'_>, n: usize, values: Vec<Complex64>) -> PyResult<Block<'_>> {
    arrays::shaped(py, (n, values.len() / n.max(1)).f(), values)
}

#[pymethods]
impl PyComplexProblem {
    #[new]
    #[pyo3(signature = (indptr, indices, k, m, terms, n_modes = None, f_max = None, *, speed = 0.0, tolerance = 1e-8, left_tolerance = 1e-8,
                        symbolic = None))]
    #[expect(clippy::too_many_arguments, reason = "a Python signature, by keyword")]
    fn new(
        py: Python<'_>,
        indptr: Indices,
        indices: Indices,
        k: PyReadonlyArray1<f64>,
        m: PyReadonlyArray1<f64>,
        terms: Vec<(String, i32, PyReadonlyArray1<f64>)>,
        n_modes: Option<usize>,
        f_max: Option<f64>,
        speed: f64,
        tolerance: f64,
        left_tolerance: f64,
        symbolic: Option<PyRef<PySymbolic>>,
    ) -> PyResult<Self> {
        let (symbolic, matrices) = prepare(py, &indptr, &indices, &[(&k, "K"), (&m, "M")], "auto", symbolic)?;
        let terms: Vec<Term> = terms
            .iter()
            .map(|(text, speed_power, values)| {
                let values = values.as_array().to_vec();
                Ok(Term { power: power(text)?, speed_power: *speed_power, values })
            })
            .collect::<PyResult<_>>()?;
        let options = ComplexOptions { n_modes, f_max, tolerance, left_tolerance };
        let n = matrices[0].n();
        let inner = py
            .detach(|| ComplexProblem::new(&symbolic, &matrices[0], &matrices[1], &terms, speed, &options))
            .map_err(arrays::dynamics_error)?;
        Ok(Self { inner: Mutex::new(inner), n })
    }

    /// Poles, what they are, right and left vectors, modal a, residuals of both sides, conditions, info.
    #[pyo3(signature = (speed = 0.0))]
    fn modes<'py>(&self, py: Python<'py>, speed: f64) -> PyResult<Bound<'py, PyDict>> {
        let mut problem = self.lock()?;
        let inner: &mut ComplexProblem = &mut problem;
        let found = py.detach(|| inner.modes(speed)).map_err(arrays::dynamics_error)?;
        let out = PyDict::new(py);
        out.set_item("poles", PyArray1::from_vec(py, found.lambda))?;
        out.set_item("kinds", found.kind.into_iter().map(name).collect::<Vec<_>>())?;
        out.set_item("right", block(py, self.n, found.right)?)?;
        out.set_item("left", block(py, self.n, found.left)?)?;
        out.set_item("modal_a", PyArray1::from_vec(py, found.modal_a))?;
        let [right, left] = found.residual;
        out.set_item("residual", PyArray1::from_vec(py, right))?;
        out.set_item("residual_left", PyArray1::from_vec(py, left))?;
        out.set_item("condition", PyArray1::from_vec(py, found.condition))?;
        out.set_item("sigma", problem.sigma())?;
        out.set_item("counted", problem.counted)?;
        out.set_item("n_rigid", problem.n_rigid)?;
        out.set_item("n_late", found.n_late)?;
        out.set_item("vectors", problem.vectors())?;
        out.set_item("solves", problem.solves())?;
        out.set_item("rounds", problem.rounds)?;
        Ok(out)
    }

    /// Receptances (n_lines, n_out, n_in) at the complex `s`, in the space of the modes and what the load adds to it.
    #[pyo3(signature = (b_out, b_in, s, speed = 0.0, *, tolerance = 1e-9))]
    fn receptance<'py>(
        &self,
        py: Python<'py>,
        b_out: PyReadonlyArray2<f64>,
        b_in: PyReadonlyArray2<f64>,
        s: PyReadonlyArray1<Complex64>,
        speed: f64,
        tolerance: f64,
    ) -> PyResult<Bound<'py, PyArray3<Complex64>>> {
        let (b_out, b_in) = (arrays::dense(&b_out), arrays::dense(&b_in));
        let s = s.as_array().to_vec();
        let mut problem = self.lock()?;
        let inner: &mut ComplexProblem = &mut problem;
        let found = py
            .detach(|| inner.receptance(speed, &b_out, &b_in, &s, tolerance))
            .map_err(arrays::dynamics_error)?;
        arrays::shaped(py, (s.len(), b_out.ncols(), b_in.ncols()), found)
    }
}

impl PyComplexProblem {
    fn lock(&self) -> PyResult<std::sync::MutexGuard<'_, ComplexProblem>> {
        self.inner.try_lock().map_err(|_| {
            PyValueError::new_err("this problem is being solved in another thread; make one for each")
        })
    }
}

/// Adds this file's classes and functions to `_core`.
pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<PyComplexProblem>()
}
