//! A formula recorded once and evaluated often, in any [`Scalar`]: how a law written elsewhere gets exact derivatives.

use super::dual::Scalar;

/// One operation; operands are indices of earlier operations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Op {
    /// The input of that index.
    Input(usize),
    /// A number.
    Constant(f64),
    /// a + b
    Add(usize, usize),
    /// a - b
    Sub(usize, usize),
    /// a b
    Mul(usize, usize),
    /// a / b
    Div(usize, usize),
    /// a^b for a > 0
    Power(usize, usize),
    /// a^n
    PowerInteger(usize, i32),
    /// -a
    Negate(usize),
    /// |a|
    Abs(usize),
    /// -1, 0 or 1; derivative zero
    Sign(usize),
    /// exp a
    Exp(usize),
    /// ln a
    Ln(usize),
    /// square root of a
    Sqrt(usize),
    /// sin a
    Sin(usize),
    /// cos a
    Cos(usize),
    /// tanh a
    Tanh(usize),
    /// arctan a
    Atan(usize),
    /// The smaller one, with its derivative.
    Min(usize, usize),
    /// The larger one, with its derivative.
    Max(usize, usize),
    /// 1 where a < b, else 0; derivative zero
    Less(usize, usize),
    /// 1 where a <= b, else 0; derivative zero
    LessEqual(usize, usize),
    /// b where a is not zero, else c
    Select(usize, usize, usize),
}

impl Op {
    fn operands(self) -> [Option<usize>; 3] {
        use Op::*;
        match self {
            Input(_) | Constant(_) => [None; 3],
            Add(a, b)
            | Sub(a, b)
            | Mul(a, b)
            | Div(a, b)
            | Power(a, b)
            | Min(a, b)
            | Max(a, b)
            | Less(a, b)
            | LessEqual(a, b) => [Some(a), Some(b), None],
            Select(a, b, c) => [Some(a), Some(b), Some(c)],
            PowerInteger(a, _)
            | Negate(a)
            | Abs(a)
            | Sign(a)
            | Exp(a)
            | Ln(a)
            | Sqrt(a)
            | Sin(a)
            | Cos(a)
            | Tanh(a)
            | Atan(a) => [Some(a), None, None],
        }
    }
}

/// A recorded formula.
#[derive(Clone, Debug)]
pub struct Tape {
    ops: Vec<Op>,
    outputs: Vec<usize>,
}

impl Tape {
    /// A formula of `n_inputs` inputs; `None` where an operation uses a later one or an input that does not exist.
    pub fn new(ops: Vec<Op>, outputs: Vec<usize>, n_inputs: usize) -> Option<Self> {
        let known = |(i, op): (usize, &Op)| {
            op.operands().into_iter().flatten().all(|at| at < i)
                && !matches!(op, Op::Input(k) if *k >= n_inputs)
        };
        let fits = ops.iter().enumerate().all(known) && outputs.iter().all(|at| *at < ops.len());
        fits.then_some(Self { ops, outputs })
    }

    /// Number of values it gives.
    pub fn n_outputs(&self) -> usize {
        self.outputs.len()
    }

    /// Evaluates all outputs at `inputs`.
    pub fn evaluate<T: Scalar>(&self, inputs: &[T], out: &mut [T]) {
        let mut r: Vec<T> = Vec::with_capacity(self.ops.len());
        for op in &self.ops {
            r.push(apply(*op, inputs, &r));
        }
        for (out, at) in out.iter_mut().zip(&self.outputs) {
            *out = r[*at];
        }
    }
}

fn apply<T: Scalar>(op: Op, inputs: &[T], r: &[T]) -> T {
    let value = |a: usize| r[a].value();
    let truth = |yes: bool| T::constant(f64::from(u8::from(yes)));
    match op {
        Op::Input(i) => inputs[i],
        Op::Constant(value) => T::constant(value),
        Op::Add(a, b) => r[a] + r[b],
        Op::Sub(a, b) => r[a] - r[b],
        Op::Mul(a, b) => r[a] * r[b],
        Op::Div(a, b) => r[a] / r[b],
        Op::Power(a, b) => power(r[a], r[b]),
        Op::PowerInteger(a, n) => integer_power(r[a], n),
        Op::Negate(a) => -r[a],
        Op::Abs(a) => r[a].abs(),
        Op::Sign(a) => T::constant(if value(a) == 0.0 { 0.0 } else { value(a).signum() }),
        Op::Exp(a) => r[a].exp(),
        Op::Ln(a) => r[a].ln(),
        Op::Sqrt(a) => square_root(r[a]),
        Op::Sin(a) => r[a].apply(value(a).sin(), value(a).cos()),
        Op::Cos(a) => r[a].apply(value(a).cos(), -value(a).sin()),
        Op::Tanh(a) => {
            let t = value(a).tanh();
            r[a].apply(t, 1.0 - t * t)
        }
        Op::Atan(a) => r[a].apply(value(a).atan(), 1.0 / (1.0 + value(a) * value(a))),
        Op::Min(a, b) => r[if value(b) < value(a) { b } else { a }],
        Op::Max(a, b) => r[if value(b) > value(a) { b } else { a }],
        Op::Less(a, b) => truth(value(a) < value(b)),
        Op::LessEqual(a, b) => truth(value(a) <= value(b)),
        Op::Select(a, b, c) => r[if value(a) != 0.0 { b } else { c }],
    }
}

/// a^b for a > 0.
#[inline]
fn power<T: Scalar>(a: T, b: T) -> T {
    if a.value() == 0.0 {
        // 0^b has no derivative over b, and one over the base only for b > 1, where it is zero
        T::constant(0.0_f64.powf(b.value()))
    } else {
        (b * a.ln()).exp()
    }
}

/// a^n.
#[inline]
fn integer_power<T: Scalar>(a: T, n: i32) -> T {
    let x = a.value();
    let slope = if n == 0 { 0.0 } else { f64::from(n) * x.powi(n - 1) };
    a.apply(x.powi(n), slope)
}

/// Square root, with derivative zero at 0, where it has none.
#[inline]
fn square_root<T: Scalar>(a: T) -> T {
    let root = a.value().sqrt();
    a.apply(root, if root > 0.0 { 0.5 / root } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::super::dual::Dual;
    use super::*;

    #[test]
    fn a_recorded_formula_has_its_derivatives() {
        // x tanh(y) / (1 + |x|) where x < y, else x^3 - y^1.5
        let ops = vec![
            Op::Input(0),
            Op::Input(1),
            Op::Tanh(1),
            Op::Mul(0, 2),
            Op::Abs(0),
            Op::Constant(1.0),
            Op::Add(4, 5),
            Op::Div(3, 6),
            Op::PowerInteger(0, 3),
            Op::Constant(1.5),
            Op::Power(1, 9),
            Op::Sub(8, 10),
            Op::Less(0, 1),
            Op::Select(12, 7, 11),
        ];
        let tape = Tape::new(ops, vec![13], 2).unwrap();
        for (x, y) in [(-0.4, 0.7), (1.3, 0.2)] {
            let at = |x: f64, y: f64| {
                let mut out = [0.0];
                tape.evaluate(&[x, y], &mut out);
                out[0]
            };
            let mut out = [Dual::<2>::constant(0.0)];
            tape.evaluate(&[Dual::variable(x, 0), Dual::variable(y, 1)], &mut out);
            let h = 1e-6;
            assert_eq!(out[0].re, at(x, y));
            assert!((out[0].eps[0] - (at(x + h, y) - at(x - h, y)) / (2.0 * h)).abs() < 1e-8);
            assert!((out[0].eps[1] - (at(x, y + h) - at(x, y - h)) / (2.0 * h)).abs() < 1e-8);
        }
    }

    #[test]
    fn a_tape_that_looks_ahead_is_refused() {
        assert!(Tape::new(vec![Op::Negate(0)], vec![0], 1).is_none());
        assert!(Tape::new(vec![Op::Input(1)], vec![0], 1).is_none());
        assert!(Tape::new(vec![Op::Input(0)], vec![1], 1).is_none());
    }
}
