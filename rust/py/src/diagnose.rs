//! Estimation on spectral lines: systems, records and hypotheses as classes, one call for a batch of hypotheses.

use femend_dynamics::identify::{
    Attached, Dashpots, Hypothesis as CoreHypothesis, IdentifyError, Job, PickedUp, Race,
    RecordLines as CoreLines, Settings, Solution, System as CoreSystem, Term, What,
    closing_sigma as core_closing_sigma, fitted as core_fitted, force_products as core_force_products,
    model_columns as core_model_columns, n_decaying as core_n_decaying, solve_batch,
};
use femend_dynamics::laws::Kind;
use femend_linalg::Dense;
use num_complex::Complex64;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays::dense;

pyo3::import_exception!(femend.errors, ModelError);

fn refused(error: IdentifyError) -> PyErr {
    ModelError::new_err(error.to_string())
}

fn rows(a: &Dense) -> ndarray::Array2<f64> {
    ndarray::Array2::from_shape_fn((a.nrows(), a.ncols()), |(i, j)| a[(i, j)])
}

fn complex_rows(v: Vec<Complex64>, n: usize) -> ndarray::Array2<Complex64> {
    let k = v.len().checked_div(n).unwrap_or(0);
    ndarray::Array2::from_shape_vec((k, n), v).unwrap_or_default()
}

/// Rows and columns without anything from which leaving them out pays.
const WORTH: usize = 64;

/// A symmetric part without the last rows and columns that hold nothing, where these are many.
fn leading(a: Dense) -> Dense {
    let n = (0..a.ncols()).rev().find(|&j| a.col(j).iter().any(|v| *v != 0.0)).map_or(0, |j| j + 1);
    if n + WORTH > a.ncols() {
        return a;
    }
    Dense::from_vec(n, n, (0..n).flat_map(|j| a.col(j)[..n].iter().copied()).collect())
}

type Vector<'py> = Bound<'py, PyArray1<f64>>;
type Matrix<'py> = Bound<'py, PyArray2<f64>>;
type TermArgument<'py> =
    (Vec<(usize, f64)>, Option<PyReadonlyArray2<'py, f64>>, Option<PyReadonlyArray2<'py, f64>>);

/// Reduced model with its unknowns and their priors.
#[pyclass(frozen, module = "femend._core")]
pub(crate) struct System {
    inner: CoreSystem,
}

#[pymethods]
impl System {
    #[new]
    #[pyo3(signature = (k_fixed, m_fixed, terms, n_par, n_tuned, mean, sd, dashpots=None, dashpot_of=None))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        k_fixed: PyReadonlyArray2<'_, f64>,
        m_fixed: PyReadonlyArray2<'_, f64>,
        terms: Vec<TermArgument<'_>>,
        n_par: usize,
        n_tuned: usize,
        mean: PyReadonlyArray1<'_, f64>,
        sd: PyReadonlyArray1<'_, f64>,
        dashpots: Option<PyReadonlyArray2<'_, f64>>,
        dashpot_of: Option<Vec<Option<usize>>>,
    ) -> PyResult<Self> {
        let rows = dashpots.as_ref().map_or_else(|| Dense::zeros(0, 0), dense);
        let of = dashpot_of.unwrap_or_else(|| vec![None; rows.nrows()]);
        let k_fixed = dense(&k_fixed);
        let inner = CoreSystem {
            r: k_fixed.nrows(),
            k_fixed,
            m_fixed: dense(&m_fixed),
            terms: terms
                .into_iter()
                .map(|(exponents, k, m)| Term {
                    exponents,
                    k: k.as_ref().map(dense).map(leading),
                    m: m.as_ref().map(dense).map(leading),
                })
                .collect(),
            n_par,
            n_tuned,
            mean: mean.as_array().to_vec(),
            sd: sd.as_array().to_vec(),
            dashpots: Dashpots { rows, of },
        };
        inner.check().map_err(refused)?;
        Ok(Self { inner })
    }

    /// Frequencies, damping ratios and modes in the basis at the unknowns, and the model's own dashpots over the modes.
    #[pyo3(signature = (p))]
    #[allow(clippy::type_complexity)]
    fn modal<'py>(
        &self,
        py: Python<'py>,
        p: PyReadonlyArray1<'_, f64>,
    ) -> PyResult<(Vector<'py>, Vector<'py>, Matrix<'py>, Matrix<'py>)> {
        let p = p.as_array().to_vec();
        if p.len() != self.inner.n_unknowns() {
            return Err(refused(IdentifyError::Shape {
                what: "unknowns",
                found: p.len(),
                expected: self.inner.n_unknowns(),
            }));
        }
        let solved = || self.inner.modal(&p).map(|modal| (self.inner.modal_dashpots(&p, &modal.q), modal));
        let (own, modal) = py.detach(solved).map_err(|e| refused(e.into()))?;
        let matrix = |a: &Dense| rows(a).into_pyarray(py);
        Ok((modal.omega.into_pyarray(py), modal.zeta.into_pyarray(py), matrix(&modal.q), matrix(&own)))
    }
}

/// One record as spectral lines.
#[pyclass(frozen, module = "femend._core")]
pub(crate) struct RecordLines {
    inner: CoreLines,
}

#[pymethods]
impl RecordLines {
    #[new]
    #[pyo3(signature = (s, u, y, weight, out_rows, in_rows, dt, sigma, n_samples, thinning, tempering, cut_off = None, picked_up = None, driven_to = 0.0))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        s: PyReadonlyArray1<'_, Complex64>,
        u: PyReadonlyArray2<'_, Complex64>,
        y: PyReadonlyArray2<'_, Complex64>,
        weight: PyReadonlyArray2<'_, f64>,
        out_rows: PyReadonlyArray2<'_, f64>,
        in_rows: PyReadonlyArray2<'_, f64>,
        dt: f64,
        sigma: f64,
        n_samples: usize,
        thinning: f64,
        tempering: f64,
        cut_off: Option<PyReadonlyArray2<'_, Complex64>>,
        picked_up: Option<(Vec<usize>, PyReadonlyArray2<'_, Complex64>, f64)>,
        driven_to: f64,
    ) -> PyResult<Self> {
        let inner = CoreLines {
            driven_to,
            cut_off: cut_off.map_or_else(Vec::new, |a| a.as_array().iter().copied().collect()),
            picked_up: picked_up.map_or_else(PickedUp::default, |(sensor, motion, sd)| PickedUp {
                sensor,
                motion: motion.as_array().iter().copied().collect(),
                sd,
            }),
            s: s.as_array().to_vec(),
            u: u.as_array().iter().copied().collect(),
            y: y.as_array().iter().copied().collect(),
            weight: weight.as_array().iter().copied().collect(),
            out_rows: dense(&out_rows),
            in_rows: dense(&in_rows),
            dt,
            sigma,
            n_samples: n_samples as f64,
            thinning,
            share: tempering * thinning,
        };
        inner.check(inner.out_rows.ncols()).map_err(refused)?;
        Ok(Self { inner })
    }
}

/// Laws by name at the coordinates `at`, or each at all of `n_w`.
fn attached(names: &[String], at: Option<Vec<Vec<usize>>>, n_w: usize) -> PyResult<What> {
    let kinds = names.iter().map(|n| Kind::from_name(n)).collect::<Result<Vec<_>, _>>();
    let kinds = kinds.map_err(|e| refused(e.into()))?;
    let Some(at) = at else { return Ok(What::everywhere(&kinds, n_w)) };
    if at.len() != kinds.len() {
        let (given, laws) = (at.len(), kinds.len());
        return Err(PyValueError::new_err(format!(
            "coordinates are given for {given} laws, there are {laws}; give one list of coordinates for each law"
        )));
    }
    Ok(What::Laws(kinds.into_iter().zip(at).map(|(kind, at)| Attached::unknown(kind, at)).collect()))
}

/// Where (direction vectors) and what (nothing, a free force, linear laws).
#[pyclass(frozen, module = "femend._core")]
pub(crate) struct Hypothesis {
    inner: CoreHypothesis,
}

#[pymethods]
impl Hypothesis {
    #[new]
    #[pyo3(signature = (w=None, laws=None, compliance=None, law_mean=None, law_sd=None, at=None, free=0, held=None))]
    #[allow(clippy::too_many_arguments)]
    fn new(
        w: Option<PyReadonlyArray2<'_, f64>>,
        laws: Option<Vec<String>>,
        compliance: Option<Vec<f64>>,
        law_mean: Option<Vec<f64>>,
        law_sd: Option<Vec<f64>>,
        at: Option<Vec<Vec<usize>>>,
        free: usize,
        held: Option<Vec<f64>>,
    ) -> PyResult<Self> {
        let w = w.as_ref().map_or_else(|| Dense::zeros(0, 0), dense);
        let what = match laws {
            _ if w.nrows() == 0 => What::Nothing,
            None => What::FreeForce,
            Some(names) => attached(&names, at, w.nrows())?,
        };
        let compliance = compliance.unwrap_or_else(|| vec![0.0; w.nrows()]);
        let inner = CoreHypothesis {
            what,
            free,
            compliance,
            held: held.unwrap_or_default(),
            law_mean: law_mean.unwrap_or_default(),
            law_sd: law_sd.unwrap_or_default(),
            w,
        };
        inner.check(inner.w.ncols()).map_err(refused)?;
        Ok(Self { inner })
    }
}

type SolvedTuple<'py> = (
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
    f64,
    f64,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray2<f64>>,
    usize,
    bool,
);

fn solved<'py>(py: Python<'py>, s: Solution) -> SolvedTuple<'py> {
    (
        s.p.into_pyarray(py),
        s.x.into_pyarray(py),
        s.at.cost,
        s.at.prior,
        s.at.misfit.into_pyarray(py),
        rows(&s.at.hessian).into_pyarray(py),
        s.iterations,
        s.converged,
    )
}

/// Minimises a batch of hypotheses over the same records, in parallel; see the stub of `femend._core`.
#[pyfunction]
#[pyo3(signature = (jobs, records, iterations=20, tolerance=1e-2, derivatives=true, heats=Vec::new(), groups=Vec::new()))]
#[allow(clippy::type_complexity, clippy::too_many_arguments)]
fn solve_hypotheses<'py>(
    py: Python<'py>,
    jobs: Vec<(Py<System>, Py<Hypothesis>, PyReadonlyArray1<'_, f64>, PyReadonlyArray1<'_, f64>)>,
    records: Vec<Py<RecordLines>>,
    iterations: usize,
    tolerance: f64,
    derivatives: bool,
    heats: Vec<(usize, f64)>,
    groups: Vec<usize>,
) -> PyResult<Vec<Option<SolvedTuple<'py>>>> {
    let records: Vec<CoreLines> = records.iter().map(|r| r.get().inner.clone()).collect();
    let jobs: Vec<Job<'_>> = jobs
        .iter()
        .map(|(s, h, p, x)| Job {
            system: &s.get().inner,
            hypothesis: &h.get().inner,
            p: p.as_array().to_vec(),
            x: x.as_array().to_vec(),
        })
        .collect();
    let settings = Settings { iterations, tolerance, derivatives, ..Settings::default() };
    let race = Race { heats, groups };
    let results = py.detach(|| solve_batch(&jobs, &records, settings, &race));
    results
        .into_iter()
        .map(|r| match r {
            Ok(s) => Ok(Some(solved(py, s))),
            // The model cannot be solved at this start: the hypothesis drops out, the others go on.
            Err(IdentifyError::Algebra(_) | IdentifyError::Law(_)) => Ok(None),
            Err(e) => Err(refused(e)),
        })
        .collect()
}

/// Predicted accelerations, displacements and forces at the coordinates of a hypothesis, on the lines of each record.
#[pyfunction]
#[pyo3(signature = (system, hypothesis, records, p, x))]
#[allow(clippy::type_complexity)]
fn fitted_lines<'py>(
    py: Python<'py>,
    system: Py<System>,
    hypothesis: Py<Hypothesis>,
    records: Vec<Py<RecordLines>>,
    p: PyReadonlyArray1<'_, f64>,
    x: PyReadonlyArray1<'_, f64>,
) -> PyResult<
    Vec<(Bound<'py, PyArray2<Complex64>>, Bound<'py, PyArray2<Complex64>>, Bound<'py, PyArray2<Complex64>>)>,
> {
    let records: Vec<CoreLines> = records.iter().map(|r| r.get().inner.clone()).collect();
    let (system, hypothesis) = (&system.get().inner, &hypothesis.get().inner);
    let (p, x) = (p.as_array().to_vec(), x.as_array().to_vec());
    let results = py.detach(|| core_fitted(system, &records, hypothesis, &p, &x)).map_err(refused)?;
    let n_w = hypothesis.w.nrows();
    Ok(results
        .into_iter()
        .zip(&records)
        .map(|(f, r)| {
            (
                complex_rows(f.y, r.n_out()).into_pyarray(py),
                complex_rows(f.d, n_w).into_pyarray(py),
                complex_rows(f.force, n_w).into_pyarray(py),
            )
        })
        .collect())
}

/// How the weighted accelerations of a record change with the unknowns of the model; see the stub of `femend._core`.
#[pyfunction]
#[pyo3(signature = (system, record, w, kappa, p))]
fn model_columns<'py>(
    py: Python<'py>,
    system: Py<System>,
    record: Py<RecordLines>,
    w: PyReadonlyArray2<'_, f64>,
    kappa: PyReadonlyArray2<'_, Complex64>,
    p: PyReadonlyArray1<'_, f64>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let (system, record) = (&system.get().inner, &record.get().inner);
    let (w, p) = (dense(&w), p.as_array().to_vec());
    let kappa = kappa.as_array().columns().into_iter().map(|c| c.to_vec()).collect();
    let columns = py.detach(|| core_model_columns(system, record, w, kappa, &p)).map_err(refused)?;
    Ok(rows(&columns).into_pyarray(py))
}

/// What forces at one place of the basis would do to a record; see the stub of `femend._core`.
#[pyfunction]
#[pyo3(signature = (system, record, row, spectra, p))]
fn force_products<'py>(
    py: Python<'py>,
    system: Py<System>,
    record: Py<RecordLines>,
    row: PyReadonlyArray1<'_, f64>,
    spectra: PyReadonlyArray2<'_, Complex64>,
    p: PyReadonlyArray1<'_, f64>,
) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
    let (system, record) = (&system.get().inner, &record.get().inner);
    let (row, p) = (row.as_array().to_vec(), p.as_array().to_vec());
    let spectra: Vec<Complex64> = spectra.as_array().iter().copied().collect();
    match py.detach(|| core_force_products(system, record, &row, &spectra, &p)) {
        Ok(products) => Ok(Some(rows(&products).into_pyarray(py))),
        Err(IdentifyError::Algebra(_)) => Ok(None),
        Err(e) => Err(refused(e)),
    }
}

/// How many modes have free decays on a record's lines; see the stub of `femend._core`.
#[pyfunction]
#[pyo3(signature = (omega, highest, n_tuned, driven = 0.0))]
fn n_decaying(omega: PyReadonlyArray1<'_, f64>, highest: f64, n_tuned: usize, driven: f64) -> usize {
    core_n_decaying(&omega.as_array().to_vec(), highest, n_tuned, driven)
}

/// Decay from which a window has closed at a record's end; see the stub of `femend._core`.
#[pyfunction]
#[pyo3(signature = (duration))]
fn closing_sigma(duration: f64) -> f64 {
    core_closing_sigma(duration)
}

/// Adds this file's classes and functions to `_core`.
pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<System>()?;
    module.add_class::<RecordLines>()?;
    module.add_class::<Hypothesis>()?;
    module.add_function(wrap_pyfunction!(solve_hypotheses, module)?)?;
    module.add_function(wrap_pyfunction!(fitted_lines, module)?)?;
    module.add_function(wrap_pyfunction!(force_products, module)?)?;
    module.add_function(wrap_pyfunction!(model_columns, module)?)?;
    module.add_function(wrap_pyfunction!(n_decaying, module)?)?;
    module.add_function(wrap_pyfunction!(closing_sigma, module)?)
}
