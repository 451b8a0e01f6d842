//! The dynamic stiffness as fixed matrices times scalar functions of the line.

use std::sync::Arc;

use femend_linalg::{ComplexFactor, Dense, Ordering, Symbolic, SymmetricCsc};
use num_complex::Complex64;

use crate::DynamicsError;

/// Z = Σ_t c_t A_t on every line: A_t real symmetric on one pattern. Stiffness 1, mass s², viscous damping s, structural
/// damping i, and a law of frequency-dependent stiffness its complex modulus.
#[derive(Debug, Clone)]
pub struct LineModel<'a> {
    /// A_t. The diagonal of the first sets the units of residuals.
    pub matrices: Vec<&'a SymmetricCsc>,
    /// c_t on every line.
    pub coefficients: Vec<Vec<Complex64>>,
}

impl LineModel<'_> {
    /// Number of lines.
    pub fn n_lines(&self) -> usize {
        self.coefficients.first().map_or(0, Vec::len)
    }

    pub(super) fn check(&self, n_lines: usize, b_out: &Dense, b_in: &Dense) -> Result<(), DynamicsError> {
        let bad = |text: String| Err(DynamicsError::Argument(text));
        let Some(first) = self.matrices.first() else {
            return bad("no matrix is given; pass at least a stiffness".into());
        };
        if let Some(t) = self.matrices.iter().position(|a| a.pattern() != first.pattern()) {
            return bad(format!("matrix {t} (from 0) is not on the pattern of matrix 0"));
        }
        if self.coefficients.len() != self.matrices.len() {
            let (c, m) = (self.coefficients.len(), self.matrices.len());
            return bad(format!(
                "{c} rows of coefficients are given for {m} matrices; give one row for each"
            ));
        }
        for (t, c) in self.coefficients.iter().enumerate() {
            if c.len() != n_lines {
                return bad(format!("matrix {t} has {} coefficients, there are {n_lines} lines", c.len()));
            }
            if let Some(l) = c.iter().position(|v| !(v.re.is_finite() && v.im.is_finite())) {
                return bad(format!("coefficient of matrix {t} on line {l} is {}; it must be finite", c[l]));
            }
        }
        for (what, b) in [("b_out", b_out), ("b_in", b_in)] {
            if b.nrows() != first.n() {
                return bad(format!("{what} has {} rows, the matrices have {}", b.nrows(), first.n()));
            }
        }
        Ok(())
    }

    /// Σ c_t A_t for any coefficients.
    fn combine(&self, coefficient: impl Fn(usize) -> Complex64) -> Vec<Complex64> {
        let mut z = vec![Complex64::ZERO; self.matrices[0].values().len()];
        for (t, a) in self.matrices.iter().enumerate() {
            let c = coefficient(t);
            z.iter_mut().zip(a.values()).for_each(|(z, &a)| *z += c * a);
        }
        z
    }

    /// (Z on the line after - Z on the line before) X, by real products.
    fn slope_times(&self, line: usize, x: &[Complex64]) -> Vec<Complex64> {
        let (before, after) = (line.saturating_sub(1), (line + 1).min(self.n_lines() - 1));
        let n = self.matrices[0].n();
        let k = x.len() / n.max(1);
        let parts = x.iter().map(|v| v.re).chain(x.iter().map(|v| v.im)).collect();
        let parts = Dense::from_vec(n, 2 * k, parts);
        let mut out = vec![Complex64::ZERO; x.len()];
        for (a, c) in self.matrices.iter().zip(&self.coefficients) {
            let c = c[after] - c[before];
            if c == Complex64::ZERO {
                continue;
            }
            let product = a.times(&parts);
            let (re, im) = product.data().split_at(x.len());
            out.iter_mut()
                .zip(re.iter().zip(im))
                .for_each(|(o, (&re, &im))| *o += c * Complex64::new(re, im));
        }
        out
    }
}

/// Direct solution on a line.
pub(super) struct LineSolver {
    symbolic: Arc<Symbolic>,
    /// Of the line before, for its memory.
    factor: Option<ComplexFactor>,
}

impl LineSolver {
    pub fn new(model: &LineModel<'_>) -> Result<Self, DynamicsError> {
        let pattern = model.matrices[0].pattern().clone();
        Ok(Self { symbolic: Arc::new(Symbolic::new(pattern, Ordering::Auto)?), factor: None })
    }

    /// X = Z⁻¹ B and its slope along the lines, up to scale.
    pub fn solve(
        &mut self,
        model: &LineModel<'_>,
        line: usize,
        b: &Dense,
    ) -> Result<[Vec<Complex64>; 2], DynamicsError> {
        let z = model.combine(|t| model.coefficients[t][line]);
        let mut x: Vec<Complex64> = b.data().iter().map(|&v| Complex64::from(v)).collect();
        let factor = match self.factor.take() {
            Some(mut factor) => factor.refresh(&z).map(|()| factor),
            None => ComplexFactor::new(self.symbolic.clone(), &z),
        };
        let factor = self.factor.insert(factor?);
        factor.solve_in_place(&mut x);
        let mut slope = model.slope_times(line, &x);
        if slope.iter().any(|v| *v != Complex64::ZERO) {
            factor.solve_in_place(&mut slope);
        }
        Ok([x, slope])
    }
}
