//! Laws registered from Python: as a recorded formula, or as a function that is called for every step.

use femend_dynamics::laws::tape::{Op, Tape};
use femend_dynamics::laws::{Domain, Parameter, own};
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::sync::Mutex;

/// The first error a called function raised; simulations run without the interpreter and tell it afterwards.
static PENDING: Mutex<Option<PyErr>> = Mutex::new(None);

/// Raises what a law's function raised since the last call.
pub(crate) fn raised() -> PyResult<()> {
    match PENDING.lock().unwrap_or_else(std::sync::PoisonError::into_inner).take() {
        Some(error) => Err(error),
        None => Ok(()),
    }
}

/// A Python function of (d, v, z.., p..) that gives the force and the rates of z.
struct Function {
    call: Py<PyAny>,
    /// The derivatives (outputs, inputs) row by row, where there are some.
    slopes: Option<Py<PyAny>>,
    /// Ordinary size of every input, for differences.
    scales: Vec<f64>,
}

/// Relative step of a central difference: its error is of the order of its square.
const STEP: f64 = 1e-5;

impl Function {
    fn ask(&self, function: &Py<PyAny>, inputs: &[f64], out: &mut [f64]) {
        let answer = Python::attach(|py| -> PyResult<Vec<f64>> {
            function.call1(py, (inputs.to_vec(),))?.extract::<Vec<f64>>(py)
        });
        match answer {
            Ok(values) if values.len() == out.len() => out.copy_from_slice(&values),
            Ok(values) => {
                let (given, needed) = (values.len(), out.len());
                fail(PyValueError::new_err(format!(
                    "a law's function gave {given} values, {needed} are needed"
                )));
                out.fill(f64::NAN);
            }
            Err(error) => {
                fail(error);
                out.fill(f64::NAN);
            }
        }
    }
}

fn fail(error: PyErr) {
    PENDING.lock().unwrap_or_else(std::sync::PoisonError::into_inner).get_or_insert(error);
}

impl own::Callback for Function {
    fn values(&self, inputs: &[f64], out: &mut [f64]) {
        self.ask(&self.call, inputs, out);
    }

    fn slopes(&self, inputs: &[f64], out: &mut [f64], slopes: &mut [f64]) {
        self.ask(&self.call, inputs, out);
        if let Some(function) = &self.slopes {
            return self.ask(function, inputs, slopes);
        }
        let (n, n_out) = (inputs.len(), out.len());
        let mut moved = inputs.to_vec();
        let (mut above, mut below) = (vec![0.0; n_out], vec![0.0; n_out]);
        for j in 0..n {
            let h = STEP * self.scales[j].max(inputs[j].abs());
            moved[j] = inputs[j] + h;
            self.ask(&self.call, &moved, &mut above);
            moved[j] = inputs[j] - h;
            self.ask(&self.call, &moved, &mut below);
            moved[j] = inputs[j];
            for i in 0..n_out {
                slopes[i * n + j] = (above[i] - below[i]) / (2.0 * h);
            }
        }
    }
}

fn operation(name: &str, at: &[usize], value: f64) -> Option<Op> {
    Some(match (name, at) {
        ("input", [i]) => Op::Input(*i),
        ("constant", []) => Op::Constant(value),
        ("add", [a, b]) => Op::Add(*a, *b),
        ("subtract", [a, b]) => Op::Sub(*a, *b),
        ("multiply", [a, b]) => Op::Mul(*a, *b),
        ("divide", [a, b]) => Op::Div(*a, *b),
        ("power", [a, b]) => Op::Power(*a, *b),
        ("power_integer", [a]) => Op::PowerInteger(*a, value as i32),
        ("negative", [a]) => Op::Negate(*a),
        ("absolute", [a]) => Op::Abs(*a),
        ("sign", [a]) => Op::Sign(*a),
        ("exp", [a]) => Op::Exp(*a),
        ("log", [a]) => Op::Ln(*a),
        ("sqrt", [a]) => Op::Sqrt(*a),
        ("sin", [a]) => Op::Sin(*a),
        ("cos", [a]) => Op::Cos(*a),
        ("tanh", [a]) => Op::Tanh(*a),
        ("arctan", [a]) => Op::Atan(*a),
        ("minimum", [a, b]) => Op::Min(*a, *b),
        ("maximum", [a, b]) => Op::Max(*a, *b),
        ("less", [a, b]) => Op::Less(*a, *b),
        ("less_equal", [a, b]) => Op::LessEqual(*a, *b),
        ("where", [a, b, c]) => Op::Select(*a, *b, *c),
        _ => return None,
    })
}

type Recorded = (Vec<(String, Vec<usize>, f64)>, Vec<usize>);

fn tape(recorded: Recorded, n_inputs: usize) -> PyResult<Tape> {
    let ops: Option<Vec<Op>> =
        recorded.0.iter().map(|(name, at, value)| operation(name, at, *value)).collect();
    ops.and_then(|ops| Tape::new(ops, recorded.1, n_inputs))
        .ok_or_else(|| PyValueError::new_err("a recorded formula holds an operation that is not known"))
}

fn domain(name: &str) -> PyResult<Domain> {
    match name {
        "real" | "signed" => Ok(Domain::Real),
        "positive" => Ok(Domain::NonNegative),
        "fraction" => Ok(Domain::Fraction),
        "above_one" => Ok(Domain::AtLeastOne),
        _ => Err(PyValueError::new_err(format!(
            "domain {name:?}; use \"real\", \"signed\", \"positive\", \"fraction\" or \"above_one\""
        ))),
    }
}

/// Makes a law known under a name; see the stub of `femend._core`.
#[pyfunction]
#[pyo3(signature = (name, parameters, n_z, *, recorded=None, function=None, slopes=None, scales=Vec::new()))]
fn register_law(
    name: &str,
    parameters: Vec<(String, String, String)>,
    n_z: usize,
    recorded: Option<Recorded>,
    function: Option<Py<PyAny>>,
    slopes: Option<Py<PyAny>>,
    scales: Vec<f64>,
) -> PyResult<()> {
    let n_inputs = 2 + n_z + parameters.len();
    let source = match (recorded, function) {
        (Some(recorded), _) => own::Source::Tape(tape(recorded, n_inputs)?),
        (None, Some(call)) if scales.len() == n_inputs => {
            own::Source::Callback(Box::new(Function { call, slopes, scales }))
        }
        _ => {
            return Err(PyValueError::new_err(
                "give either a recorded formula, or a function and the size of each input",
            ));
        }
    };
    let known = parameters
        .into_iter()
        .map(|(name, unit, values)| {
            Ok(Parameter { name: name.leak(), unit: unit.leak(), domain: domain(&values)? })
        })
        .collect::<PyResult<Vec<Parameter>>>()?;
    own::register(name, known, n_z, source).map(|_| ()).ok_or_else(|| {
        PyValueError::new_err(format!(
            "law {name}: {n_z} internal variables and {} parameters are too many; at most 16 parameters and 10 internal \
             variables, and 16 of both together",
            n_inputs - 2 - n_z
        ))
    })
}

/// Takes a registered law out again; nothing happens where there is none of that name.
#[pyfunction]
#[pyo3(signature = (name))]
fn forget_law(name: &str) {
    own::forget(name);
}

/// Force and rates (1 + n_z, 1 + n_inputs) of a registered law at (d, v, z.., p..), each with its slopes.
#[pyfunction]
#[pyo3(signature = (name, inputs))]
fn law_slopes<'py>(
    py: Python<'py>,
    name: &str,
    inputs: PyReadonlyArray1<'py, f64>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let inputs: Vec<f64> = inputs.as_array().to_vec();
    let kind =
        own::find(name).ok_or_else(|| PyValueError::new_err(format!("no own law is called {name:?}")))?;
    let found = py.detach(|| kind.at(&inputs));
    raised()?;
    found
        .map(|values| values.into_pyarray(py))
        .ok_or_else(|| PyValueError::new_err(format!("law {name} takes {} inputs", kind.n_inputs())))
}

/// Adds this file's functions to `_core`.
pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(register_law, module)?)?;
    module.add_function(wrap_pyfunction!(forget_law, module)?)?;
    module.add_function(wrap_pyfunction!(law_slopes, module)?)
}
