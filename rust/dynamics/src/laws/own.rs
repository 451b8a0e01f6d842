//! Laws that are not part of the library: a recorded formula, or a function called back for every step.

use super::dual::{Dual, Scalar};
use super::tape::Tape;
use super::{Constants, MANY, MAX_PARAMETERS, MAX_STATE, Motion, Parameter, State};
use std::fmt;
use std::sync::RwLock;

/// Most inputs of a formula: d, v, internal variables, parameters.
const MAX_INPUTS: usize = 2 + MAX_STATE + MAX_PARAMETERS;
/// Fourth-order Runge-Kutta steps of the internal variables within a step.
const PARTS: usize = 2;

/// A function that gives the force and the rates of the internal variables at (d, v, z.., p..).
pub trait Callback: Send + Sync {
    /// Force, then rates, written to `out`; NaN where it could not be evaluated.
    fn values(&self, inputs: &[f64], out: &mut [f64]);
    /// The same with slopes (outputs, inputs) row by row.
    fn slopes(&self, inputs: &[f64], out: &mut [f64], slopes: &mut [f64]);
}

/// Where force and rates come from.
pub enum Source {
    /// A recorded formula.
    Tape(Tape),
    /// A function.
    Callback(Box<dyn Callback>),
}

/// A law of one's own: f(d, v, z; p) with internal variables z' = r(d, v, z; p), zero at rest.
pub struct OwnLaw {
    name: &'static str,
    parameters: &'static [Parameter],
    n_z: usize,
    source: Source,
}

/// A registered law; as long-lived as the process, so that it can be passed about like a law of the library.
#[derive(Clone, Copy)]
pub struct OwnKind(&'static OwnLaw);

static REGISTERED: RwLock<Vec<OwnKind>> = RwLock::new(Vec::new());

impl PartialEq for OwnKind {
    fn eq(&self, other: &Self) -> bool {
        std::ptr::eq(self.0, other.0)
    }
}

impl Eq for OwnKind {}

impl fmt::Debug for OwnKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Own({})", self.0.name)
    }
}

/// Makes a law known by `name` from now on, in place of an own law that had the name; `None` where it has too many
/// parameters or internal variables, or the formula does not give a force and a rate for each of them.
///
/// The law stays in memory: simulations that run meanwhile keep the one they began with.
pub fn register(name: &str, parameters: Vec<Parameter>, n_z: usize, source: Source) -> Option<OwnKind> {
    let outputs_fit = !matches!(&source, Source::Tape(tape) if tape.n_outputs() != 1 + n_z);
    // one place of the state holds the displacement at the start of the step
    let state = if n_z > 0 { n_z + 1 } else { 0 };
    if !outputs_fit
        || parameters.len() > MAX_PARAMETERS
        || state > MAX_STATE
        || 3 + state + parameters.len() > MANY
    {
        return None;
    }
    let law = OwnLaw { name: name.to_owned().leak(), parameters: parameters.leak(), n_z, source };
    let kind = OwnKind(Box::leak(Box::new(law)));
    let mut known = REGISTERED.write().unwrap_or_else(std::sync::PoisonError::into_inner);
    known.retain(|other| other.name() != name);
    known.push(kind);
    Some(kind)
}

/// Takes the own law of that name out of the register.
pub fn forget(name: &str) {
    let mut known = REGISTERED.write().unwrap_or_else(std::sync::PoisonError::into_inner);
    known.retain(|other| other.name() != name);
}

/// The own law of that name.
pub fn find(name: &str) -> Option<OwnKind> {
    let known = REGISTERED.read().unwrap_or_else(std::sync::PoisonError::into_inner);
    known.iter().copied().find(|kind| kind.name() == name)
}

/// Names of all own laws.
pub fn names() -> Vec<&'static str> {
    let known = REGISTERED.read().unwrap_or_else(std::sync::PoisonError::into_inner);
    known.iter().map(|kind| kind.name()).collect()
}

impl OwnKind {
    /// Its name.
    pub fn name(self) -> &'static str {
        self.0.name
    }

    /// Its parameters in their order.
    pub fn parameters(self) -> &'static [Parameter] {
        self.0.parameters
    }

    /// Places of the state in use: the displacement at the start of the step, and the internal variables.
    pub fn n_state(self) -> usize {
        if self.0.n_z > 0 { self.0.n_z + 1 } else { 0 }
    }

    /// Number of its inputs: d, v, internal variables, parameters.
    pub fn n_inputs(self) -> usize {
        2 + self.0.n_z + self.0.parameters.len()
    }

    /// Force and rates at `inputs`, each followed by its slopes over the inputs; `None` for another number of inputs.
    pub fn at(self, inputs: &[f64]) -> Option<Vec<f64>> {
        let n = self.n_inputs();
        if inputs.len() != n {
            return None;
        }
        let seeded: Vec<Dual<MAX_INPUTS>> =
            inputs.iter().enumerate().map(|(i, x)| Dual::variable(*x, i)).collect();
        let mut out = vec![Dual::constant(0.0); 1 + self.0.n_z];
        self.evaluate(&seeded, &mut out);
        Some(out.iter().flat_map(|y| std::iter::once(y.re).chain(y.eps[..n].iter().copied())).collect())
    }

    /// Force and rates at (d, v, z, p).
    fn evaluate<T: Scalar>(self, inputs: &[T], out: &mut [T]) {
        match &self.0.source {
            Source::Tape(tape) => tape.evaluate(inputs, out),
            Source::Callback(function) => lift(function.as_ref(), inputs, out),
        }
    }

    /// Force at the end of a step and the state there. The internal variables are taken over the step with d linear.
    pub(super) fn step<T: Scalar>(
        self,
        c: &Constants<T>,
        dt: f64,
        x: Motion<T>,
        s: &State<T>,
    ) -> (T, State<T>) {
        let (n_z, n_p) = (self.0.n_z, self.0.parameters.len());
        let zero = T::constant(0.0);
        let mut inputs = [zero; MAX_INPUTS];
        let n = 2 + n_z + n_p;
        inputs[2 + n_z..n].copy_from_slice(&c[..n_p]);
        let mut out = [zero; MAX_STATE + 1];
        let mut new = *s;
        if n_z > 0 {
            let velocity = (x.d - s[0]) / dt;
            let h = dt / PARTS as f64;
            let mut rate = |share: f64, z: &[T], k: &mut [T]| {
                inputs[0] = s[0] + velocity * (share * dt);
                inputs[1] = velocity;
                inputs[2..2 + n_z].copy_from_slice(z);
                self.evaluate(&inputs[..n], &mut out[..1 + n_z]);
                k.copy_from_slice(&out[1..1 + n_z]);
            };
            let mut z: Vec<T> = s[1..1 + n_z].to_vec();
            let mut k = [vec![zero; n_z], vec![zero; n_z], vec![zero; n_z], vec![zero; n_z]];
            for part in 0..PARTS {
                let from = part as f64 / PARTS as f64;
                let half = 0.5 / PARTS as f64;
                let moved = |k: &[T], by: f64| z.iter().zip(k).map(|(z, k)| *z + *k * by).collect::<Vec<T>>();
                rate(from, &z, &mut k[0]);
                let next = moved(&k[0], 0.5 * h);
                rate(from + half, &next, &mut k[1]);
                let next = moved(&k[1], 0.5 * h);
                rate(from + half, &next, &mut k[2]);
                let next = moved(&k[2], h);
                rate(from + 2.0 * half, &next, &mut k[3]);
                for i in 0..n_z {
                    z[i] = z[i] + (k[0][i] + (k[1][i] + k[2][i]) * 2.0 + k[3][i]) * (h / 6.0);
                }
            }
            new[0] = x.d;
            new[1..1 + n_z].copy_from_slice(&z);
        }
        inputs[0] = x.d;
        inputs[1] = x.v;
        inputs[2..2 + n_z].copy_from_slice(&new[1..1 + n_z]);
        self.evaluate(&inputs[..n], &mut out[..1 + n_z]);
        (out[0], new)
    }
}

/// A function of plain numbers in another scalar: its value, and its slopes times what the inputs carry.
fn lift<T: Scalar>(function: &dyn Callback, inputs: &[T], out: &mut [T]) {
    let mut plain = [0.0; MAX_INPUTS];
    for (to, from) in plain.iter_mut().zip(inputs) {
        *to = from.value();
    }
    let (n, n_out) = (inputs.len(), out.len());
    let mut values = [0.0; MAX_STATE + 1];
    if T::CARRIES == 0 {
        function.values(&plain[..n], &mut values[..n_out]);
        for (to, from) in out.iter_mut().zip(values) {
            *to = T::constant(from);
        }
        return;
    }
    let mut slopes = vec![0.0; n_out * n];
    function.slopes(&plain[..n], &mut values[..n_out], &mut slopes);
    for (i, to) in out.iter_mut().enumerate() {
        *to = T::constant(values[i]);
        for (j, input) in inputs.iter().enumerate() {
            *to = *to + (*input - plain[j]) * slopes[i * n + j];
        }
    }
}
