//! Numeric factors of symmetric matrices on a symbolic factor that is reused.

use std::sync::Arc;

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::perm::PermRef;
use faer::sparse::linalg::cholesky::supernodal::{
    SupernodalIntranodeLbltRef, SupernodalLltRef, SupernodeRef,
};
use faer::sparse::linalg::cholesky::{IntranodeLbltRef, LltRef};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};
use rayon::prelude::*;

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
const DETOUR: f64 = 1e-10;

/// Right-hand sides per parallel task.
const BLOCK: usize = 8;

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
    values: Vec<f64>,
    subdiag: Vec<f64>,
    perm: Vec<u32>,
    perm_inverse: Vec<u32>,
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
        let (n, nnz) = (symbolic.pattern().n(), symbolic.nnz());
        let mut store = Vec::new();
        store.try_reserve_exact(nnz).map_err(|_| LinalgError::Memory { bytes: 8 * nnz })?;
        store.resize(nnz, 0.0);
        let pivots = if kind == Kind::Indefinite { n } else { 0 };
        let mut factor = Self {
            symbolic,
            kind,
            values: store,
            subdiag: vec![0.0; pivots],
            perm: vec![0; pivots],
            perm_inverse: vec![0; pivots],
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
        self.factorise(&symbolic, values)?;
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
            self.factorise(symbolic, &moved)?;
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

    fn factorise(&mut self, symbolic: &Symbolic, values: &[f64]) -> Result<(), LinalgError> {
        let (pattern, inner) = (symbolic.pattern(), symbolic.inner());
        let n = pattern.n();
        let matrix = SparseColMatRef::new(
            SymbolicSparseColMatRef::new_checked(n, n, pattern.col_ptr(), None, pattern.row_idx()),
            values,
        );
        match self.kind {
            Kind::Cholesky => {
                let mut memory =
                    scratch(inner.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default()))?;
                let stack = MemStack::new(&mut memory);
                inner
                    .factorize_numeric_llt(
                        &mut self.values,
                        matrix,
                        Side::Lower,
                        Default::default(),
                        Par::Seq,
                        stack,
                        Default::default(),
                    )
                    .map_err(|_| LinalgError::NotPositiveDefinite)?;
            }
            Kind::Indefinite => {
                let mut memory = scratch(
                    inner.factorize_numeric_intranode_lblt_scratch::<f64>(Par::Seq, Default::default()),
                )?;
                let stack = MemStack::new(&mut memory);
                inner.factorize_numeric_intranode_lblt(
                    &mut self.values,
                    &mut self.subdiag,
                    &mut self.perm,
                    &mut self.perm_inverse,
                    matrix,
                    Side::Lower,
                    Par::Seq,
                    stack,
                    Default::default(),
                );
            }
        }
        Ok(())
    }

    /// Counts signs and collects pivots that vanish beside `scale` (n).
    fn pivots(&self, scale: &[f64]) -> (Inertia, Vec<ZeroPivot>) {
        let mut count = Inertia { negative: 0, positive: 0 };
        let mut zero = Vec::new();
        let forward = &self.symbolic.permutation().forward;
        let Some(supernodes) = self.symbolic.supernodes() else { return (count, zero) };
        let mut take = |position: usize, pivot: f64| {
            let dof = forward[position] as usize;
            let ratio = if scale[dof] > 0.0 { pivot / scale[dof] } else { 0.0 };
            if ratio.is_nan() || ratio.abs() <= PIVOT_TOLERANCE {
                zero.push(ZeroPivot { dof, ratio });
            }
            if pivot < 0.0 { count.negative += 1 } else { count.positive += 1 }
        };
        for s in 0..supernodes.n_supernodes() {
            let node = self.supernode(s);
            let (first, block) = (node.start(), node.val());
            let mut j = 0;
            while j < block.ncols() {
                if self.kind == Kind::Cholesky {
                    take(first + j, block[(j, j)] * block[(j, j)]);
                    j += 1;
                } else if self.subdiag[first + j] == 0.0 {
                    take(self.perm[first + j] as usize, block[(j, j)]);
                    j += 1;
                } else {
                    let (a, b, c) = (block[(j, j)], block[(j + 1, j + 1)], self.subdiag[first + j]);
                    let (mean, radius) = (0.5 * (a + b), (0.5 * (a - b)).hypot(c));
                    let large = mean + radius.copysign(mean);
                    // the small eigenvalue from the determinant, free of cancellation
                    let small = if large == 0.0 { 0.0 } else { (a * b - c * c) / large };
                    take(self.perm[first + j] as usize, large);
                    take(self.perm[first + j + 1] as usize, small);
                    j += 2;
                }
            }
        }
        (count, zero)
    }

    fn supernode(&self, s: usize) -> SupernodeRef<'_, u32, f64> {
        let supernodes = self.symbolic.supernodes().expect("the symbolic factor is always supernodal");
        match self.kind {
            Kind::Cholesky => SupernodalLltRef::new(supernodes, &self.values).supernode(s),
            Kind::Indefinite => {
                let perm = PermRef::new_checked(&self.perm, &self.perm_inverse, self.n());
                SupernodalIntranodeLbltRef::new(supernodes, &self.values, &self.subdiag, perm).supernode(s)
            }
        }
    }

    /// Relative residual of A x = b for b = A times a fixed uneven vector.
    fn probe_residual(&self, values: &[f64]) -> f64 {
        let n = self.n();
        let exact: Vec<f64> = (0..n).map(|i| 1.0 + (i as f64 * 0.754_877_666).fract()).collect();
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
        let n = self.n();
        assert_eq!(b.nrows(), n);
        if n == 0 || b.ncols() == 0 {
            return;
        }
        // equal shares for the threads, in blocks that keep the kernels busy
        let share = b.ncols().div_ceil(rayon::current_num_threads()).clamp(1, BLOCK);
        b.data_mut().par_chunks_mut(share * n).for_each(|part| {
            let k = part.len() / n;
            let rhs = MatMut::from_column_major_slice_mut(part, n, k);
            let inner = self.symbolic.inner();
            let need = inner.solve_in_place_scratch::<f64>(k, Par::Seq);
            let mut memory = MemBuffer::new(need);
            let stack = MemStack::new(&mut memory);
            match self.kind {
                Kind::Cholesky => {
                    LltRef::new(inner, &self.values).solve_in_place_with_conj(Conj::No, rhs, Par::Seq, stack);
                }
                Kind::Indefinite => {
                    let perm = PermRef::new_checked(&self.perm, &self.perm_inverse, n);
                    IntranodeLbltRef::new(inner, &self.values, &self.subdiag, perm).solve_in_place_with_conj(
                        Conj::No,
                        rhs,
                        Par::Seq,
                        stack,
                    );
                }
            }
        });
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

fn scratch(need: StackReq) -> Result<MemBuffer, LinalgError> {
    let bytes = need.size_bytes();
    MemBuffer::try_new(need).map_err(|_| LinalgError::Memory { bytes })
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
