//! Sparse complex LU: the referee for damped dynamic stiffness.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::linalg::lu::{LuRef, NumericLu, SymbolicLu, factorize_symbolic_lu};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par};
use num_complex::Complex64;

use crate::{LinalgError, Pattern};

/// The symbolic part of an LU factorisation on a pattern, for any number of complex matrices with that pattern.
#[derive(Debug)]
pub struct ComplexLu {
    n: usize,
    col_ptr: Vec<u32>,
    row_idx: Vec<u32>,
    symbolic: SymbolicLu<u32>,
}

impl ComplexLu {
    /// Orders the pattern.
    ///
    /// # Errors
    /// [`LinalgError::Library`].
    pub fn new(pattern: &Pattern) -> Result<Self, LinalgError> {
        let (n, col_ptr, row_idx) = (pattern.n(), pattern.col_ptr().to_vec(), pattern.row_idx().to_vec());
        let matrix = SymbolicSparseColMatRef::new_checked(n, n, &col_ptr, None, &row_idx);
        let symbolic = factorize_symbolic_lu(matrix, Default::default())
            .map_err(|e| LinalgError::Library(format!("symbolic LU failed: {e:?}")))?;
        Ok(Self { n, col_ptr, row_idx, symbolic })
    }

    /// Factorises one matrix and solves A X = B in place; `b` is (n, k) column-major.
    ///
    /// # Errors
    /// [`LinalgError::Library`] for a singular matrix, [`LinalgError::Memory`].
    pub fn solve_in_place(&self, values: &[Complex64], b: &mut [Complex64]) -> Result<(), LinalgError> {
        let n = self.n;
        let matrix = SparseColMatRef::new(
            SymbolicSparseColMatRef::new_checked(n, n, &self.col_ptr, None, &self.row_idx),
            values,
        );
        let k = b.len() / n.max(1);
        let need = self.symbolic.factorize_numeric_lu_scratch::<Complex64>(Par::Seq, Default::default());
        let need = need.or(self.symbolic.solve_in_place_scratch::<Complex64>(k, Par::Seq));
        let bytes = need.size_bytes();
        let mut memory = MemBuffer::try_new(need).map_err(|_| LinalgError::Memory { bytes })?;
        let mut numeric = NumericLu::new();
        self.symbolic
            .factorize_numeric_lu(
                &mut numeric,
                matrix,
                Par::Seq,
                MemStack::new(&mut memory),
                Default::default(),
            )
            .map_err(|e| LinalgError::Library(format!("dynamic stiffness is singular: {e:?}")))?;
        let factor = LuRef::new_unchecked(&self.symbolic, &numeric);
        let rhs = MatMut::from_column_major_slice_mut(b, n, k);
        factor.solve_in_place_with_conj(Conj::No, rhs, Par::Seq, MemStack::new(&mut memory));
        if b.iter().all(|v| v.re.is_finite() && v.im.is_finite()) {
            Ok(())
        } else {
            Err(LinalgError::Library("dynamic stiffness is singular".into()))
        }
    }
}
