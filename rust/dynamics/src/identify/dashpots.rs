//! Dashpots that a model has itself, by their rows and the user's parameters that are factors on them.

use super::{IdentifyError, expect};
use femend_linalg::Dense;

/// Dashpots of a reduced model.
#[derive(Debug, Clone)]
pub struct Dashpots {
    /// Rows of the basis (n, r), each of 1 N s/m.
    pub rows: Dense,
    /// The user parameter that is a factor on each (n), if one is.
    pub of: Vec<Option<usize>>,
}

impl Dashpots {
    /// None.
    #[must_use]
    pub fn none() -> Self {
        Self { rows: Dense::zeros(0, 0), of: Vec::new() }
    }

    /// Number of them.
    #[must_use]
    pub fn len(&self) -> usize {
        self.rows.nrows()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    pub(crate) fn check(&self, r: usize, n_par: usize) -> Result<(), IdentifyError> {
        expect("parameters of dashpots", self.of.len(), self.len())?;
        if !self.is_empty() {
            expect("dashpots", self.rows.ncols(), r)?;
        }
        match self.of.iter().flatten().find(|i| **i >= n_par) {
            Some(i) => Err(IdentifyError::Shape { what: "parameters", found: n_par, expected: i + 1 }),
            None => Ok(()),
        }
    }

    /// Those that parameters are factors on: number and parameter.
    pub(super) fn moved(&self) -> impl Iterator<Item = (usize, usize)> {
        self.of.iter().enumerate().filter_map(|(i, of)| of.map(|of| (i, of)))
    }
}
