//! The symbolic factor: computed once per pattern, used for every set of values.

use std::sync::Arc;

use faer::Side;
use faer::perm::PermRef;
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
};

use crate::{LinalgError, Ordering, Pattern, Permutation, order};

/// Ordering and supernodes of a pattern.
#[derive(Debug)]
pub struct Symbolic {
    pattern: Arc<Pattern>,
    permutation: Permutation,
    inner: SymbolicCholesky<u32>,
}

impl Symbolic {
    /// Orders a pattern and finds the supernodes of its factor.
    ///
    /// # Errors
    /// [`LinalgError::Library`] or [`LinalgError::Memory`].
    pub fn new(pattern: Arc<Pattern>, ordering: Ordering) -> Result<Self, LinalgError> {
        let permutation = order(&pattern, ordering)?;
        let inner = {
            let n = pattern.n();
            let matrix =
                SymbolicSparseColMatRef::new_checked(n, n, pattern.col_ptr(), None, pattern.row_idx());
            let perm = PermRef::new_checked(&permutation.forward, &permutation.inverse, n);
            let params = CholeskySymbolicParams {
                // the pivoted factorisation exists in supernodal form only
                supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
                ..Default::default()
            };
            factorize_symbolic_cholesky(matrix, Side::Lower, SymmetricOrdering::Custom(perm), params)
                .map_err(|e| match e {
                    faer::sparse::FaerError::OutOfMemory => {
                        LinalgError::Memory { bytes: 8 * permutation.nnz as usize }
                    }
                    other => LinalgError::Library(format!("symbolic factorisation failed: {other:?}")),
                })?
        };
        Ok(Self { pattern, permutation, inner })
    }

    /// The pattern.
    pub fn pattern(&self) -> &Arc<Pattern> {
        &self.pattern
    }

    /// The order of elimination with its cost.
    pub fn permutation(&self) -> &Permutation {
        &self.permutation
    }

    /// Stored values of the factor, relaxation zeros included.
    pub fn nnz(&self) -> usize {
        self.inner.len_val()
    }

    /// Multiplications and additions of the factorisation.
    pub fn flops(&self) -> f64 {
        self.permutation.flops
    }

    pub(crate) fn inner(&self) -> &SymbolicCholesky<u32> {
        &self.inner
    }

    pub(crate) fn supernodes(&self) -> Option<&SymbolicSupernodalCholesky<u32>> {
        match self.inner.raw() {
            SymbolicCholeskyRaw::Supernodal(s) => Some(s),
            SymbolicCholeskyRaw::Simplicial(_) => None,
        }
    }
}
