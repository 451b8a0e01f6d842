//! Memory that modes take, told before the first factorisation.

use femend_linalg::{Symbolic, free_memory};

use super::options::{ModeOptions, SMALL};
use crate::DynamicsError;

/// Columns of a Lanczos block: as many modes may coincide without a second start.
pub(super) fn block(n_modes: Option<usize>) -> usize {
    if n_modes.is_some_and(|n| n < 8) { 4 } else { 8 }
}

/// Columns that the basis may be expected to have in the end: 184 for 20 modes and 584 for 150 of a cubic net, whose modes
/// coincide in threes, 328 for 100 of tetrahedra.
pub(super) fn room(n_modes: Option<usize>) -> usize {
    n_modes.map_or(64, |n| n.saturating_mul(4).saturating_add(16 * block(n_modes)))
}

/// Bytes beside what is in use when modes are asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ModesMemory {
    /// K - σM factorised, and once more at the upper end for the count, with the work of the second.
    pub factors: usize,
    /// Lanczos basis, Ritz vectors with their products, blocks in work.
    pub vectors: usize,
    /// Values of K - σM, the mass without its zeros.
    pub matrices: usize,
}

impl ModesMemory {
    /// All of it.
    pub fn total(&self) -> usize {
        self.factors.saturating_add(self.vectors).saturating_add(self.matrices)
    }

    /// Of `n_modes` of a pattern, or of the least that a band takes; `unchecked` leaves out the second factor.
    pub fn of(symbolic: &Symbolic, n_modes: Option<usize>, unchecked: bool) -> Self {
        let (n, pattern) = (symbolic.pattern().n(), symbolic.pattern());
        let values = 8 * pattern.nnz();
        let once = symbolic.memory();
        if n <= SMALL {
            // full K, M, their Cholesky factor, two halves, C and its eigenvectors
            return Self { factors: once.numeric(8), vectors: 8 * 7 * n * n, matrices: values };
        }
        let second = if unchecked { 0 } else { once.factor };
        // Ritz vectors with K φ and M φ before and after their turn, four beyond the wanted ones
        let ritz = n_modes.map_or(0, |m| m.saturating_add(4).saturating_mul(6));
        let basis = room(n_modes);
        let columns = basis.saturating_add(ritz).saturating_add(8 * block(n_modes));
        // the projected problem with its vectors, and what solving it takes
        let projected = basis.saturating_mul(basis).saturating_mul(8 * 8);
        Self {
            factors: once.numeric(8).saturating_add(second),
            vectors: columns.saturating_mul(8 * n).saturating_add(projected),
            matrices: 2 * values + values / 2,
        }
    }

    fn refused(self, what: String, free: Option<usize>) -> Result<(), DynamicsError> {
        match free {
            Some(free) if self.total() > free => Err(DynamicsError::Memory { what, need: self, free }),
            _ => Ok(()),
        }
    }
}

/// Refuses modes that do not fit into what is free.
pub(super) fn fits(symbolic: &Symbolic, options: &ModeOptions) -> Result<(), DynamicsError> {
    let n = symbolic.pattern().n();
    let what = match (options.n_modes, options.f_max) {
        (Some(modes), _) => format!("{modes} modes of {n} DOFs"),
        (None, Some(f)) => format!("modes up to {f} Hz of {n} DOFs, however few they are,"),
        (None, None) => format!("modes of {n} DOFs"),
    };
    ModesMemory::of(symbolic, options.n_modes, options.unchecked).refused(what, free_memory())
}

/// Refuses `more` vectors of `n` DOFs beside the `now` there are.
pub(super) fn vectors_fit(n: usize, now: usize, more: usize) -> Result<(), DynamicsError> {
    let need = ModesMemory { vectors: more.saturating_mul(8 * n), ..Default::default() };
    need.refused(format!("{more} Lanczos vectors of {n} DOFs after the first {now}"), free_memory())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_fit_is_refused_with_all_numbers() {
        let need = ModesMemory { factors: 3_000_000_000, vectors: 900_000_000, matrices: 100_000_000 };
        assert_eq!(need.refused(String::new(), Some(4_000_000_000)), Ok(()));
        assert_eq!(need.refused(String::new(), None), Ok(()));
        let text =
            need.refused("20 modes of 95232 DOFs".into(), Some(1_250_000_000)).unwrap_err().to_string();
        let said = "20 modes of 95232 DOFs need 4.00 GB of memory beside what is in use (3.00 GB of it for factors, 0.90 GB \
                    for vectors), 1.25 GB are free; ask for fewer modes";
        assert!(text.starts_with(said), "{text}");
    }

    #[test]
    fn no_number_of_vectors_overflows() {
        assert_eq!(vectors_fit(usize::MAX / 16, 1, usize::MAX).is_err(), free_memory().is_some());
    }
}
