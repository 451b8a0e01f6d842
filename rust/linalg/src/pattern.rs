//! The sparsity pattern of a symmetric matrix, both triangles stored.

use crate::LinalgError;

/// Compressed columns of a structurally symmetric n x n matrix with both triangles stored.
///
/// Invariants, checked on construction: `col_ptr` has n + 1 non-decreasing entries from 0 to nnz; rows are strictly
/// increasing inside a column and below n; (i, j) is present whenever (j, i) is. By symmetry the same arrays are
/// compressed rows.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pattern {
    n: usize,
    col_ptr: Vec<u32>,
    row_idx: Vec<u32>,
}

impl Pattern {
    /// Takes over the arrays of a pattern after checking them.
    ///
    /// # Errors
    /// [`LinalgError::Pattern`] naming the column that breaks an invariant.
    pub fn new(n: usize, col_ptr: Vec<u32>, row_idx: Vec<u32>) -> Result<Self, LinalgError> {
        let bad = |text: String| Err(LinalgError::Pattern(text));
        if n > i32::MAX as usize {
            return bad(format!("{n} rows exceed the limit {}", i32::MAX));
        }
        if col_ptr.len() != n + 1 {
            return bad(format!("column pointer has {} entries, {} expected", col_ptr.len(), n + 1));
        }
        if col_ptr[0] != 0 || col_ptr[n] as usize != row_idx.len() {
            return bad(format!(
                "column pointer runs from {} to {}, the index array has {} entries",
                col_ptr[0],
                col_ptr[n],
                row_idx.len()
            ));
        }
        if let Some(j) = col_ptr.windows(2).position(|w| w[0] > w[1]) {
            return bad(format!("column pointer decreases at column {j}"));
        }
        for j in 0..n {
            let rows = &row_idx[col_ptr[j] as usize..col_ptr[j + 1] as usize];
            if rows.windows(2).any(|w| w[0] >= w[1]) {
                return bad(format!("rows of column {j} are not strictly increasing (sort, sum duplicates)"));
            }
            if rows.last().is_some_and(|&i| i as usize >= n) {
                return bad(format!("column {j} has a row beyond {}", n.saturating_sub(1)));
            }
        }
        let pattern = Self { n, col_ptr, row_idx };
        if let Some((i, j)) = pattern.first_asymmetry() {
            return bad(format!("entry ({i}, {j}) is stored without its mirror ({j}, {i})"));
        }
        Ok(pattern)
    }

    /// Builds a pattern from entries in any order, duplicates allowed; mirrors and the diagonal are added.
    ///
    /// # Errors
    /// [`LinalgError::Pattern`] for an entry outside the matrix.
    pub fn from_entries(
        n: usize,
        entries: impl IntoIterator<Item = (usize, usize)>,
    ) -> Result<Self, LinalgError> {
        let mut rows: Vec<Vec<u32>> = (0..n).map(|i| vec![i as u32]).collect();
        for (i, j) in entries {
            if i >= n || j >= n {
                return Err(LinalgError::Pattern(format!("entry ({i}, {j}) lies outside {n} x {n}")));
            }
            rows[i].push(j as u32);
            rows[j].push(i as u32);
        }
        let mut col_ptr = vec![0u32];
        let mut row_idx = Vec::new();
        for row in &mut rows {
            row.sort_unstable();
            row.dedup();
            row_idx.extend_from_slice(row);
            col_ptr.push(row_idx.len() as u32);
        }
        Self::new(n, col_ptr, row_idx)
    }

    /// Walks both triangles once: column j of the lower triangle must meet row j in order.
    fn first_asymmetry(&self) -> Option<(usize, usize)> {
        let mut next: Vec<u32> = self.col_ptr[..self.n].to_vec();
        for j in 0..self.n {
            for &i in self.column(j) {
                let i = i as usize;
                let at = next[i] as usize;
                if at >= self.col_ptr[i + 1] as usize || self.row_idx[at] as usize != j {
                    return Some((i, j));
                }
                next[i] += 1;
            }
        }
        None
    }

    /// Number of rows.
    pub fn n(&self) -> usize {
        self.n
    }

    /// Number of stored entries, both triangles.
    pub fn nnz(&self) -> usize {
        self.row_idx.len()
    }

    /// Column pointers, n + 1.
    pub fn col_ptr(&self) -> &[u32] {
        &self.col_ptr
    }

    /// Row indices, nnz.
    pub fn row_idx(&self) -> &[u32] {
        &self.row_idx
    }

    /// Rows of column `j`.
    pub fn column(&self, j: usize) -> &[u32] {
        &self.row_idx[self.range(j)]
    }

    /// Positions of column `j` in the value array.
    pub fn range(&self, j: usize) -> std::ops::Range<usize> {
        self.col_ptr[j] as usize..self.col_ptr[j + 1] as usize
    }

    /// Position of entry (i, j) in the value array, if it is stored.
    pub fn position(&self, i: usize, j: usize) -> Option<usize> {
        let range = self.range(j);
        self.row_idx[range.clone()].binary_search(&(i as u32)).ok().map(|k| range.start + k)
    }

    /// Diagonal of the matrix with these values; 0 where the diagonal is not stored.
    pub fn diagonal(&self, values: &[f64]) -> Vec<f64> {
        (0..self.n).map(|j| self.position(j, j).map_or(0.0, |k| values[k])).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn accepts_a_chain_and_finds_positions() {
        let p = Pattern::from_entries(3, [(0, 1), (1, 2), (1, 2)]).unwrap();
        assert_eq!(p.col_ptr(), &[0, 2, 5, 7]);
        assert_eq!(p.position(2, 1), Some(4));
        assert_eq!(p.position(2, 0), None);
    }

    #[test]
    fn refuses_broken_arrays() {
        assert!(Pattern::new(2, vec![0, 1], vec![0]).is_err());
        assert!(Pattern::new(2, vec![0, 2, 1], vec![0]).is_err());
        assert!(Pattern::new(2, vec![0, 2, 3], vec![1, 0, 1]).is_err());
        assert!(Pattern::new(2, vec![0, 1, 2], vec![0, 2]).is_err());
        let one_sided = Pattern::new(2, vec![0, 2, 3], vec![0, 1, 1]).unwrap_err();
        assert!(one_sided.to_string().contains("without its mirror"), "{one_sided}");
    }
}
