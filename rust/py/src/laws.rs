//! The library of local laws: one of them by its name, its force along a motion, its dynamic stiffness.

use femend_dynamics::laws::{Kind, Law, LawError};
use ndarray::ArrayView1;
use num_complex::Complex64;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyReadonlyArray1};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::own_law::raised;

pyo3::import_exception!(femend.errors, LawParameterError);

pub(crate) fn law_error(py: Python<'_>, error: &LawError) -> PyErr {
    let (law, parameter) = match error {
        LawError::UnknownLaw { name, .. } => (Some(name.clone()), None),
        LawError::UnknownParameter { law, parameter, .. } => {
            (Some((*law).to_owned()), Some(parameter.clone()))
        }
        LawError::MissingParameter { law, parameter, .. } | LawError::BadValue { law, parameter, .. } => {
            (Some((*law).to_owned()), Some((*parameter).to_owned()))
        }
        LawError::WrongCount { law, .. } | LawError::FrequencyOnly { law } | LawError::NotLinear { law } => {
            (Some((*law).to_owned()), None)
        }
    };
    let build = || -> PyResult<PyErr> {
        let keywords = PyDict::new(py);
        keywords.set_item("law", law)?;
        keywords.set_item("parameter", parameter)?;
        let class = py.get_type::<LawParameterError>();
        Ok(PyErr::from_value(class.call((error.to_string(),), Some(&keywords))?))
    };
    build().unwrap_or_else(|failed| failed)
}

/// A law from its name and either {parameter: value} or the values in their order.
pub(crate) fn law(name: &str, parameters: &Bound<'_, PyAny>) -> PyResult<Law> {
    let py = parameters.py();
    let kind = Kind::from_name(name).map_err(|error| law_error(py, &error))?;
    let law = if let Ok(named) = parameters.cast::<PyDict>() {
        let named: Vec<(String, f64)> = named
            .iter()
            .map(|(key, value)| Ok((key.extract()?, value.extract()?)))
            .collect::<PyResult<_>>()?;
        Law::from_named(kind, &named)
    } else {
        let values: Vec<f64> = parameters.extract().map_err(|_| {
            PyTypeError::new_err(format!("parameters of {name} must be a dict or a sequence of numbers"))
        })?;
        Law::new(kind, &values)
    };
    law.map_err(|error| law_error(py, &error))
}

/// Force history (n,) of a law along a given motion from rest; see the stub of `femend._core`.
#[pyfunction]
#[pyo3(signature = (name, parameters, d, v, a, dt))]
fn law_force<'py>(
    py: Python<'py>,
    name: &str,
    parameters: &Bound<'py, PyAny>,
    d: PyReadonlyArray1<'py, f64>,
    v: PyReadonlyArray1<'py, f64>,
    a: PyReadonlyArray1<'py, f64>,
    dt: f64,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let law = law(name, parameters)?;
    if !(dt > 0.0 && dt.is_finite()) {
        return Err(PyValueError::new_err(format!("dt = {dt}; it must be a finite number > 0")));
    }
    let flat = |x: ArrayView1<'_, f64>| x.iter().copied().collect::<Vec<f64>>();
    let (d, v, a) = (flat(d.as_array()), flat(v.as_array()), flat(a.as_array()));
    if v.len() != d.len() || a.len() != d.len() {
        return Err(PyValueError::new_err(format!(
            "d, v and a have {}, {} and {} samples; they must have the same number",
            d.len(),
            v.len(),
            a.len()
        )));
    }
    let prepared = law.prepare(dt).map_err(|error| law_error(py, &error))?;
    let force = py.detach(|| prepared.history(&d, &v, &a));
    raised()?;
    Ok(force.into_pyarray(py))
}

/// kappa(s) (n,) and its parameter derivatives (n_p, n) of a linear law; see the stub of `femend._core`.
#[pyfunction]
#[pyo3(signature = (name, parameters, s))]
#[allow(clippy::type_complexity)]
fn law_dynamic_stiffness<'py>(
    py: Python<'py>,
    name: &str,
    parameters: &Bound<'py, PyAny>,
    s: PyReadonlyArray1<'py, Complex64>,
) -> PyResult<(Bound<'py, PyArray1<Complex64>>, Bound<'py, PyArray2<Complex64>>)> {
    let law = law(name, parameters)?;
    let (n_p, n) = (law.values().len(), s.as_array().len());
    let mut kappa = ndarray::Array1::zeros(n);
    let mut slopes = ndarray::Array2::zeros((n_p, n));
    for (i, s) in s.as_array().iter().enumerate() {
        let (value, over_p) = law.dynamic_stiffness(*s).map_err(|error| law_error(py, &error))?;
        kappa[i] = value;
        for (j, slope) in over_p.into_iter().enumerate() {
            slopes[[j, i]] = slope;
        }
    }
    Ok((kappa.into_pyarray(py), slopes.into_pyarray(py)))
}

/// {law: [(parameter, unit), ...]} of the whole library.
#[pyfunction]
#[pyo3(signature = ())]
fn law_library<'py>(py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
    let out = PyDict::new(py);
    for kind in Kind::ALL {
        let parameters: Vec<_> = kind.parameters().iter().map(|p| (p.name, p.unit)).collect();
        out.set_item(kind.name(), parameters)?;
    }
    Ok(out)
}

/// Adds this file's classes and functions to `_core`.
pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(law_force, module)?)?;
    module.add_function(wrap_pyfunction!(law_dynamic_stiffness, module)?)?;
    module.add_function(wrap_pyfunction!(law_library, module)?)
}
