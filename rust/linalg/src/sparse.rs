//! Symmetric sparse matrices: one shared pattern, values of their own.

use std::sync::Arc;

use crate::{Dense, Eight, LinalgError, Pattern, SparseRows};

/// A symmetric matrix: shared [`Pattern`] (both triangles) and values in the same order.
#[derive(Debug, Clone)]
pub struct SymmetricCsc {
    pattern: Arc<Pattern>,
    values: Vec<f64>,
}

impl SymmetricCsc {
    /// Takes over values on a pattern.
    ///
    /// # Errors
    /// [`LinalgError::Shape`], [`LinalgError::NotFinite`], or [`LinalgError::NotSymmetric`] where a mirror pair differs by
    /// more than 1e-8 of the larger diagonal scale.
    pub fn new(pattern: Arc<Pattern>, values: Vec<f64>, what: &'static str) -> Result<Self, LinalgError> {
        if values.len() != pattern.nnz() {
            return Err(LinalgError::Shape { what, found: values.len(), expected: pattern.nnz() });
        }
        let matrix = Self { pattern, values };
        matrix.check(what)?;
        Ok(matrix)
    }

    fn check(&self, what: &'static str) -> Result<(), LinalgError> {
        let p = &self.pattern;
        let mut next: Vec<u32> = p.col_ptr()[..p.n()].to_vec();
        for j in 0..p.n() {
            for k in p.range(j) {
                let (i, a) = (p.row_idx()[k] as usize, self.values[k]);
                if !a.is_finite() {
                    return Err(LinalgError::NotFinite { what, row: i, column: j, value: a });
                }
                let b = self.values[next[i] as usize];
                next[i] += 1;
                if a == b {
                    continue;
                }
                let scale = |d: usize| p.position(d, d).map_or(0.0, |k| self.values[k].abs());
                if (a - b).abs() > 1e-8 * (scale(i) * scale(j)).sqrt().max(a.abs()).max(b.abs()) {
                    return Err(LinalgError::NotSymmetric { row: i, column: j, a, b });
                }
            }
        }
        Ok(())
    }

    /// The pattern.
    pub fn pattern(&self) -> &Arc<Pattern> {
        &self.pattern
    }

    /// Values in pattern order.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Number of rows.
    pub fn n(&self) -> usize {
        self.pattern.n()
    }

    /// Diagonal, n.
    pub fn diagonal(&self) -> Vec<f64> {
        self.pattern.diagonal(&self.values)
    }

    /// `self + factor * other` on the common pattern.
    ///
    /// # Panics
    /// When the patterns differ: the callers share one.
    pub fn plus(&self, factor: f64, other: &Self) -> Self {
        assert!(Arc::ptr_eq(&self.pattern, &other.pattern) || self.pattern == other.pattern);
        let values = self.values.iter().zip(&other.values).map(|(a, b)| a + factor * b).collect();
        Self { pattern: self.pattern.clone(), values }
    }

    /// Y = A X for a block X (n, k).
    pub fn times(&self, x: &Dense) -> Dense {
        times_values(&self.pattern, &self.values, x)
    }
}

/// Y = A X for values on a symmetric pattern: column j is read as row j.
///
/// # Panics
/// When X has another number of rows.
pub(crate) fn times_values(pattern: &Pattern, values: &[f64], x: &Dense) -> Dense {
    let a = SparseRows { start: pattern.col_ptr(), index: pattern.row_idx(), values };
    a.times(x, &mut vec![Eight::EMPTY; pattern.n()])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chain(n: usize) -> SymmetricCsc {
        let p = Arc::new(Pattern::from_entries(n, (1..n).map(|i| (i, i - 1))).unwrap());
        let values = (0..n)
            .flat_map(|j| {
                p.column(j).iter().map(move |&i| if i as usize == j { 2.0 } else { -1.0 }).collect::<Vec<_>>()
            })
            .collect();
        SymmetricCsc::new(p, values, "K").unwrap()
    }

    #[test]
    fn product_with_a_linear_field_is_zero_inside() {
        let n = 5000;
        let k = chain(n);
        let mut x = Dense::zeros(n, 11);
        for c in 0..11 {
            for i in 0..n {
                x[(i, c)] = (i * (c + 1)) as f64;
            }
        }
        let y = k.times(&x);
        for c in 0..11 {
            assert!((1..n - 1).all(|i| y[(i, c)] == 0.0));
            assert_eq!(y[(n - 1, c)], (n * (c + 1)) as f64);
        }
    }

    #[test]
    fn refuses_nan_and_asymmetry() {
        let k = chain(4);
        let mut v = k.values().to_vec();
        v[1] = f64::NAN;
        assert!(matches!(
            SymmetricCsc::new(k.pattern().clone(), v, "K"),
            Err(LinalgError::NotFinite { row: 1, column: 0, .. })
        ));
        let mut v = k.values().to_vec();
        v[1] = -1.1;
        assert!(matches!(
            SymmetricCsc::new(k.pattern().clone(), v, "K"),
            Err(LinalgError::NotSymmetric { .. })
        ));
    }
}
