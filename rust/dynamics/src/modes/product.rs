//! Products of a sparse symmetric matrix with blocks, free of the zeros that its pattern holds for other matrices.

use femend_linalg::{Dense, Eight, Pattern, Spare, SparseRows, SymmetricCsc};

/// The non-zero entries of a symmetric matrix. A mass matrix of solids on the pattern of K is two thirds zeros.
#[derive(Debug)]
pub(crate) struct Compact {
    start: Vec<u32>,
    index: Vec<u32>,
    values: Vec<f64>,
    /// Rows of the block last multiplied.
    rows: Spare<Eight>,
}

impl Compact {
    pub fn new(a: &SymmetricCsc) -> Self {
        Self::of_values(a.pattern(), a.values())
    }

    /// Of values on a pattern, where row j stands as column j does.
    pub fn of_values(pattern: &Pattern, values: &[f64]) -> Self {
        let count = values.iter().filter(|v| **v != 0.0).count();
        let mut out = Self {
            start: Vec::with_capacity(pattern.n() + 1),
            index: Vec::with_capacity(count),
            values: Vec::with_capacity(count),
            rows: Spare::default(),
        };
        out.start.push(0);
        for j in 0..pattern.n() {
            for k in pattern.range(j) {
                if values[k] != 0.0 {
                    out.index.push(pattern.row_idx()[k]);
                    out.values.push(values[k]);
                }
            }
            out.start.push(out.index.len() as u32);
        }
        out
    }

    /// A diagonal matrix.
    pub fn diagonal(values: &[f64]) -> Self {
        let n = values.len();
        let (start, index) = ((0..=n as u32).collect(), (0..n as u32).collect());
        Self { start, index, values: values.to_vec(), rows: Spare::default() }
    }

    pub fn n(&self) -> usize {
        self.start.len() - 1
    }

    /// Y = A X for a block X (n, k).
    ///
    /// # Panics
    /// When X has another number of rows.
    pub fn times(&self, x: &Dense) -> Dense {
        let mut rows = self.rows.take(self.n(), Eight::EMPTY);
        let a = SparseRows { start: &self.start, index: &self.index, values: &self.values };
        let y = a.times(x, &mut rows);
        self.rows.give(rows);
        y
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;

    #[test]
    fn product_equals_that_on_the_whole_pattern() {
        let n = 5003;
        let pattern =
            Arc::new(Pattern::from_entries(n, (7..n).flat_map(|i| [(i, i - 1), (i, i - 7)])).unwrap());
        let mut values = vec![0.0; pattern.nnz()];
        for j in 0..n {
            for k in pattern.range(j) {
                let i = pattern.row_idx()[k] as usize;
                values[k] = if (i + j).is_multiple_of(3) { 0.0 } else { ((i + j) as f64).sin() };
            }
        }
        let a = SymmetricCsc::new(pattern, values, "A").unwrap();
        for columns in [1, 8, 13] {
            let x = Dense::from_vec(n, columns, (0..n * columns).map(|i| (0.37 * i as f64).cos()).collect());
            let (plain, compact) = (a.times(&x), Compact::new(&a).times(&x));
            assert!(plain.data().iter().zip(compact.data()).all(|(p, q)| (p - q).abs() < 1e-13));
        }
    }
}
