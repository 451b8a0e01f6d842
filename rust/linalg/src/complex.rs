//! L D Lᵀ of complex symmetric matrices (no conjugation), such as damped dynamic stiffness K + i H + s C + s² M.

use std::sync::Arc;

use num_complex::Complex64;

use crate::factor::{DETOUR, Kind, PIVOT_TOLERANCE, PROBE_TOLERANCE, ZeroPivot, uneven};
use crate::numeric::Store;
use crate::pattern::Pattern;
use crate::{LinalgError, Symbolic};

/// Probe residual above which solutions are refined.
const REFINE_FROM: f64 = 1e-13;

/// Steps of refinement at most.
const STEPS: usize = 4;

/// A factor of a complex symmetric matrix.
#[derive(Debug)]
pub struct ComplexFactor {
    symbolic: Arc<Symbolic>,
    store: Store<Complex64>,
    values: Vec<Complex64>,
    probe: f64,
    refine: bool,
}

impl ComplexFactor {
    /// Factorises the matrix with these values, in the order of the symbolic factor's pattern.
    ///
    /// # Errors
    /// [`LinalgError::Singular`] naming DOFs, [`LinalgError::Probe`], [`LinalgError::Memory`], [`LinalgError::Shape`].
    pub fn new(symbolic: Arc<Symbolic>, values: &[Complex64]) -> Result<Self, LinalgError> {
        let store = Store::new(&symbolic, Kind::Indefinite)?;
        let mut factor = Self { symbolic, store, values: vec![], probe: 0.0, refine: false };
        factor.refresh(values)?;
        Ok(factor)
    }

    /// Factorises again with new values, in the same memory.
    ///
    /// # Errors
    /// As [`ComplexFactor::new`]; the factor must not be used after an error.
    pub fn refresh(&mut self, values: &[Complex64]) -> Result<(), LinalgError> {
        let symbolic = self.symbolic.clone();
        let pattern = symbolic.pattern();
        let (n, expected) = (pattern.n(), pattern.nnz());
        if values.len() != expected {
            return Err(LinalgError::Shape { what: "values", found: values.len(), expected });
        }
        self.values.clear();
        self.values.extend_from_slice(values);
        self.refine = false;
        self.store.factorise(&symbolic, values, Kind::Indefinite)?;
        let scale = scale(pattern, values);
        let zero = self.zero_pivots(&scale);
        let mut b: Vec<Complex64> = uneven(n).map(Complex64::from).collect();
        if zero.is_empty() {
            b = multiply(pattern, values, &b);
        } else {
            // a pivot may vanish although the matrix has an inverse; an imaginary change of the diagonal leads around it,
            // and refinement of a load outside the range of a singular matrix fails
            let mut moved = values.to_vec();
            for (j, d) in scale.iter().enumerate() {
                let Some(k) = pattern.position(j, j) else {
                    return Err(LinalgError::Singular { pivots: zero });
                };
                moved[k] += Complex64::new(0.0, DETOUR * d);
            }
            self.store.factorise(&symbolic, &moved, Kind::Indefinite)?;
            self.refine = true;
        }
        self.probe = self.residual(&b);
        if zero.is_empty() && (self.probe.is_nan() || self.probe > REFINE_FROM) {
            self.refine = true;
            self.probe = self.residual(&b);
        }
        match (self.probe <= PROBE_TOLERANCE, zero.is_empty()) {
            (true, _) => Ok(()),
            (false, true) => Err(LinalgError::Probe { residual: self.probe, tolerance: PROBE_TOLERANCE }),
            (false, false) => Err(LinalgError::Singular { pivots: zero }),
        }
    }

    /// Pivots that vanish beside `scale` (n).
    fn zero_pivots(&self, scale: &[f64]) -> Vec<ZeroPivot> {
        let mut zero = Vec::new();
        for node in self.symbolic.supernodes() {
            let (first, height) = (node.columns.start, node.height());
            let diagonal = |j: usize| self.store.values[node.panel.start + j * height + j];
            let mut take = |j: usize, pivot: f64| {
                let place = first + self.store.perm[first + j] as usize;
                let dof = self.symbolic.permutation().forward[place] as usize;
                let ratio = if scale[dof] > 0.0 { pivot / scale[dof] } else { 0.0 };
                if ratio.is_nan() || ratio <= PIVOT_TOLERANCE {
                    zero.push(ZeroPivot { dof, ratio });
                }
            };
            let mut j = 0;
            while j < node.width() {
                let c = self.store.subdiag[first + j];
                if c == Complex64::ZERO {
                    take(j, diagonal(j).norm());
                    j += 1;
                } else {
                    let (a, b) = (diagonal(j), diagonal(j + 1));
                    let large = a.norm().max(b.norm()).max(c.norm());
                    take(j, large);
                    take(j + 1, (a * b - c * c).norm() / large);
                    j += 2;
                }
            }
        }
        zero
    }

    /// Relative residual of the solution for a load.
    fn residual(&self, b: &[Complex64]) -> f64 {
        let mut x = b.to_vec();
        self.solve_in_place(&mut x);
        let back = multiply(self.symbolic.pattern(), &self.values, &x);
        let norm = |v: &mut dyn Iterator<Item = Complex64>| v.map(|a| a.norm_sqr()).sum::<f64>().sqrt();
        let size = norm(&mut b.iter().copied());
        if size == 0.0 { 0.0 } else { norm(&mut back.iter().zip(b).map(|(a, b)| a - b)) / size }
    }

    /// Solves A X = B in place; `b` is (n, k) column-major.
    ///
    /// # Panics
    /// When the length of B is not a multiple of n.
    pub fn solve_in_place(&self, b: &mut [Complex64]) {
        let n = self.symbolic.pattern().n();
        assert!(n == 0 || b.len().is_multiple_of(n));
        let solve = |b: &mut [Complex64]| self.store.substitute(&self.symbolic, Kind::Indefinite, b);
        if !self.refine {
            return solve(b);
        }
        let rhs = b.to_vec();
        solve(b);
        for _ in 0..STEPS {
            let mut change = Vec::with_capacity(b.len());
            for (x, rhs) in b.chunks_exact(n).zip(rhs.chunks_exact(n)) {
                let product = multiply(self.symbolic.pattern(), &self.values, x);
                change.extend(rhs.iter().zip(product).map(|(b, p)| b - p));
            }
            solve(&mut change);
            b.iter_mut().zip(change).for_each(|(x, d)| *x += d);
        }
    }

    /// Relative residual of the probe.
    pub fn probe(&self) -> f64 {
        self.probe
    }

    /// The symbolic factor.
    pub fn symbolic(&self) -> &Arc<Symbolic> {
        &self.symbolic
    }
}

/// A x for one vector.
fn multiply(pattern: &Pattern, values: &[Complex64], x: &[Complex64]) -> Vec<Complex64> {
    let row = |i: usize| pattern.range(i).map(|k| values[k] * x[pattern.row_idx()[k] as usize]).sum();
    (0..pattern.n()).map(row).collect()
}

/// Magnitude of the diagonal, or of the largest entry of the row where the diagonal is zero.
fn scale(pattern: &Pattern, values: &[Complex64]) -> Vec<f64> {
    let largest = |j: usize| values[pattern.range(j)].iter().fold(0.0, |m: f64, v| m.max(v.norm()));
    (0..pattern.n())
        .map(|j| match pattern.position(j, j).map_or(0.0, |k| values[k].norm()) {
            0.0 => largest(j),
            d => d,
        })
        .collect()
}
