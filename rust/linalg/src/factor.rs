//! Numeric factors of symmetric matrices on a symbolic factor that is reused.

use std::sync::Arc;

use crate::numeric::Store;
use crate::sparse::times_values;
use crate::{Dense, LinalgError, Pattern, Symbolic};

/// A pivot below this fraction of its DOF's own diagonal entry counts as zero. Elimination leaves rounding of a few
/// units in the last place of the diagonal where the exact pivot is zero; 512 units leave room for long models, while
/// the legitimate decay of a beam of N elements is N⁻³ only.
pub const PIVOT_TOLERANCE: f64 = 512.0 * f64::EPSILON;

/// Largest relative residual a factor may leave on its probe.
pub const PROBE_TOLERANCE: f64 = 1e-8;

/// Diagonal change, relative to the diagonal, by which elimination is led around a pivot that vanishes although the
/// matrix has an inverse (pivots are sought inside supernodes only). Refinement takes the change out of solutions.
pub(crate) const DETOUR: f64 = 1e-10;

/// How a matrix is factorised.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// L Lᵀ, positive definite matrices only.
    Cholesky,
    /// L B Lᵀ with 1x1 and 2x2 pivots (Bunch-Kaufman inside supernodes), any symmetric matrix.
    Indefinite,
}

/// Signs of the pivots: by Sylvester's law the signs of the eigenvalues.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Inertia {
    /// Negative eigenvalues.
    pub negative: usize,
    /// Positive eigenvalues.
    pub positive: usize,
}

/// A pivot that is zero to working precision.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ZeroPivot {
    /// Row of the matrix, from 0.
    pub dof: usize,
    /// Pivot relative to the diagonal of that row.
    pub ratio: f64,
}

/// A numeric factor.
#[derive(Debug)]
pub struct Factor {
    symbolic: Arc<Symbolic>,
    kind: Kind,
    store: Store<f64>,
    inertia: Inertia,
    probe: f64,
    /// The exact values where the factor is that of a slightly changed diagonal.
    detour: Option<Vec<f64>>,
}

impl Factor {
    /// Factorises the matrix with these values on the symbolic factor's pattern.
    ///
    /// `scale`, if given, replaces the magnitude of the diagonal (n) against which a pivot is zero.
    ///
    /// # Errors
    /// [`LinalgError::NotPositiveDefinite`] (Cholesky), [`LinalgError::Singular`] naming DOFs, [`LinalgError::Probe`],
    /// [`LinalgError::Memory`].
    pub fn new(
        symbolic: Arc<Symbolic>,
        values: &[f64],
        kind: Kind,
        scale: Option<&[f64]>,
    ) -> Result<Self, LinalgError> {
        let n = symbolic.pattern().n();
        let store = Store::new(&symbolic, kind)?;
        let mut factor = Self {
            symbolic,
            kind,
            store,
            inertia: Inertia { negative: 0, positive: n },
            probe: 0.0,
            detour: None,
        };
        factor.refresh(values, scale)?;
        Ok(factor)
    }

    /// Factorises again with new values, in the same memory.
    ///
    /// # Errors
    /// As [`Factor::new`]; the factor must not be used after an error.
    pub fn refresh(&mut self, values: &[f64], scale: Option<&[f64]>) -> Result<(), LinalgError> {
        let symbolic = self.symbolic.clone();
        let pattern = symbolic.pattern();
        if values.len() != pattern.nnz() {
            return Err(LinalgError::Shape { what: "values", found: values.len(), expected: pattern.nnz() });
        }
        if pattern.n() == 0 {
            return Ok(());
        }
        let diagonal = scale.map_or_else(|| diagonal_scale(pattern, values), <[f64]>::to_vec);
        self.detour = None;
        self.store.factorise(&symbolic, values, self.kind)?;
        let (inertia, zero) = self.pivots(&diagonal);
        self.inertia = inertia;
        if !zero.is_empty() {
            self.lead_around(&symbolic, values, &diagonal, zero)?;
        }
        self.probe = self.probe_residual(values);
        if self.probe.is_nan() || self.probe > PROBE_TOLERANCE {
            return Err(LinalgError::Probe { residual: self.probe, tolerance: PROBE_TOLERANCE });
        }
        Ok(())
    }

    /// Decides whether zero pivots mean a singular matrix: then the signs differ for a diagonal raised and lowered a
    /// little. If they agree the matrix has an inverse, and the lowered factor with refinement serves.
    fn lead_around(
        &mut self,
        symbolic: &Symbolic,
        values: &[f64],
        diagonal: &[f64],
        zero: Vec<ZeroPivot>,
    ) -> Result<(), LinalgError> {
        // what follows a vanished pivot is not a number and says nothing about its own DOF
        let finite: Vec<ZeroPivot> = zero.iter().copied().filter(|p| p.ratio.is_finite()).collect();
        let singular = LinalgError::Singular { pivots: if finite.is_empty() { zero } else { finite } };
        if self.kind == Kind::Cholesky {
            return Err(singular);
        }
        let mut counts = [Inertia { negative: 0, positive: 0 }; 2];
        for (count, sign) in counts.iter_mut().zip([1.0, -1.0]) {
            let mut moved = values.to_vec();
            for (j, d) in diagonal.iter().enumerate() {
                match symbolic.pattern().position(j, j) {
                    Some(k) => moved[k] += sign * DETOUR * d,
                    None => return Err(singular),
                }
            }
            self.store.factorise(symbolic, &moved, self.kind)?;
            let (inertia, zero) = self.pivots(diagonal);
            if !zero.is_empty() {
                return Err(singular);
            }
            *count = inertia;
        }
        if counts[0] != counts[1] {
            return Err(singular);
        }
        self.inertia = counts[1];
        self.detour = Some(values.to_vec());
        Ok(())
    }

    /// Counts signs and collects pivots that vanish beside `scale` (n).
    fn pivots(&self, scale: &[f64]) -> (Inertia, Vec<ZeroPivot>) {
        let mut count = Inertia { negative: 0, positive: 0 };
        let mut zero = Vec::new();
        let forward = &self.symbolic.permutation().forward;
        let mut take = |position: usize, pivot: f64| {
            let dof = forward[position] as usize;
            let ratio = if scale[dof] > 0.0 { pivot / scale[dof] } else { 0.0 };
            if ratio.is_nan() || ratio.abs() <= PIVOT_TOLERANCE {
                zero.push(ZeroPivot { dof, ratio });
            }
            if pivot < 0.0 { count.negative += 1 } else { count.positive += 1 }
        };
        for node in self.symbolic.supernodes() {
            let (first, height) = (node.columns.start, node.height());
            let panel = &self.store.values[node.panel.clone()];
            let diagonal = |j: usize| panel[j * height + j];
            let mut j = 0;
            while j < node.width() {
                if self.kind == Kind::Cholesky {
                    take(first + j, diagonal(j) * diagonal(j));
                    j += 1;
                    continue;
                }
                let (c, perm) = (self.store.subdiag[first + j], &self.store.perm[first..]);
                if c == 0.0 {
                    take(first + perm[j] as usize, diagonal(j));
                    j += 1;
                } else {
                    let (a, b) = (diagonal(j), diagonal(j + 1));
                    let (mean, radius) = (0.5 * (a + b), (0.5 * (a - b)).hypot(c));
                    let large = mean + radius.copysign(mean);
                    // the small eigenvalue from the determinant, free of cancellation
                    let small = if large == 0.0 { 0.0 } else { (a * b - c * c) / large };
                    take(first + perm[j] as usize, large);
                    take(first + perm[j + 1] as usize, small);
                    j += 2;
                }
            }
        }
        (count, zero)
    }

    /// Relative residual of A x = b for b = A times a fixed uneven vector.
    fn probe_residual(&self, values: &[f64]) -> f64 {
        let n = self.n();
        let exact: Vec<f64> = uneven(n).collect();
        let pattern = self.symbolic.pattern();
        let b = times_values(pattern, values, &Dense::from_vec(n, 1, exact));
        let mut x = b.clone();
        self.solve_in_place(&mut x);
        let back = times_values(pattern, values, &x);
        let norm = |v: &[f64]| v.iter().map(|a| a * a).sum::<f64>().sqrt();
        let difference: Vec<f64> = back.data().iter().zip(b.data()).map(|(a, b)| a - b).collect();
        let largest: f64 = values.iter().fold(0.0, |m, v| m.max(v.abs()));
        // a matrix nearly annihilates the probe of a free structure: measure against |A| |x| as well
        norm(&difference) / norm(b.data()).max(1e-4 * largest * norm(x.data())).max(f64::MIN_POSITIVE)
    }

    /// Solves A X = B in place for a block (n, k); columns in parallel.
    ///
    /// # Panics
    /// When B has another number of rows.
    pub fn solve_in_place(&self, b: &mut Dense) {
        let Some(values) = &self.detour else { return self.substitute(b) };
        let rhs = b.clone();
        self.substitute(b);
        for _ in 0..3 {
            let mut change = times_values(self.symbolic.pattern(), values, b);
            change.data_mut().iter_mut().zip(rhs.data()).for_each(|(r, b)| *r = b - *r);
            self.substitute(&mut change);
            b.data_mut().iter_mut().zip(change.data()).for_each(|(x, d)| *x += d);
        }
    }

    fn substitute(&self, b: &mut Dense) {
        assert_eq!(b.nrows(), self.n());
        self.store.substitute(&self.symbolic, self.kind, b.data_mut());
    }

    /// Solves A X = B.
    pub fn solve(&self, b: &Dense) -> Dense {
        let mut x = b.clone();
        self.solve_in_place(&mut x);
        x
    }

    /// Number of rows.
    pub fn n(&self) -> usize {
        self.symbolic.pattern().n()
    }

    /// Signs of the eigenvalues.
    pub fn inertia(&self) -> Inertia {
        self.inertia
    }

    /// Relative residual of the probe.
    pub fn probe(&self) -> f64 {
        self.probe
    }

    /// How it was factorised.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// The symbolic factor.
    pub fn symbolic(&self) -> &Arc<Symbolic> {
        &self.symbolic
    }
}

/// The vector that factors are probed with.
pub(crate) fn uneven(n: usize) -> impl Iterator<Item = f64> {
    (0..n).map(|i| 1.0 + (i as f64 * 0.754_877_666).fract())
}

/// Magnitude of the diagonal, or of the largest entry of the row where the diagonal is zero.
fn diagonal_scale(pattern: &Pattern, values: &[f64]) -> Vec<f64> {
    let mut scale = pattern.diagonal(values);
    for (j, s) in scale.iter_mut().enumerate() {
        *s = s.abs();
        if *s == 0.0 {
            *s = values[pattern.range(j)].iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        }
    }
    scale
}
