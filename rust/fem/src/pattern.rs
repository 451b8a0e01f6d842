//! The fixed symmetric pattern of K, M and C, and where each element's entries go.

use rayon::prelude::*;

/// Full symmetric compressed-column pattern (both triangles, rows ascending, diagonal present); read as rows it is
/// the same matrix.
#[derive(Debug, Clone, Default)]
pub struct Pattern {
    /// Start of each column, n + 1 entries.
    pub indptr: Vec<usize>,
    /// Row of each entry.
    pub indices: Vec<u32>,
    /// Position of the transposed entry.
    mirror: Vec<u32>,
}

impl Pattern {
    /// Pattern of `n` DOFs in which all DOFs of one element (`elements[e]`, ascending) couple.
    #[must_use]
    pub fn new(n: usize, elements: &[Vec<u32>]) -> Self {
        let mut start = vec![0_usize; n + 1];
        for dof in elements.iter().flatten() {
            start[*dof as usize + 1] += 1;
        }
        for i in 0..n {
            start[i + 1] += start[i];
        }
        let mut fill = start.clone();
        let mut touching = vec![0_u32; start[n]];
        for (e, dofs) in elements.iter().enumerate() {
            for &dof in dofs {
                touching[fill[dof as usize]] = e as u32;
                fill[dof as usize] += 1;
            }
        }
        let columns: Vec<Vec<u32>> = (0..n)
            .into_par_iter()
            .with_min_len(256)
            .map(|j| {
                let mut rows: Vec<u32> = vec![j as u32];
                for &e in &touching[start[j]..start[j + 1]] {
                    rows.extend_from_slice(&elements[e as usize]);
                }
                rows.sort_unstable();
                rows.dedup();
                rows
            })
            .collect();
        let mut indptr = vec![0_usize; n + 1];
        for (j, rows) in columns.iter().enumerate() {
            indptr[j + 1] = indptr[j] + rows.len();
        }
        let mut pattern = Self { indptr, indices: columns.concat(), mirror: Vec::new() };
        pattern.mirror = pattern.transposed_positions();
        pattern
    }

    /// Order of the matrix.
    #[must_use]
    pub fn n(&self) -> usize {
        self.indptr.len().saturating_sub(1)
    }

    /// Number of entries, both triangles.
    #[must_use]
    pub fn nnz(&self) -> usize {
        self.indices.len()
    }

    /// Position of entry (row, column); the entry must be in the pattern.
    #[must_use]
    pub fn position(&self, row: u32, column: u32) -> Option<usize> {
        let (a, b) = (self.indptr[column as usize], self.indptr[column as usize + 1]);
        self.indices[a..b].binary_search(&row).ok().map(|p| a + p)
    }

    fn transposed_positions(&self) -> Vec<u32> {
        let n = self.n();
        let mut next = self.indptr.clone();
        let mut mirror = vec![0_u32; self.nnz()];
        for j in 0..n {
            for p in self.indptr[j]..self.indptr[j + 1] {
                let i = self.indices[p] as usize;
                // columns are visited ascending, so the entries (j, i) of column i come in order
                mirror[p] = next[i] as u32;
                next[i] += 1;
            }
        }
        mirror
    }

    /// Copies the lower triangle onto the upper one.
    pub fn symmetrise(&self, values: &mut [f64]) {
        for j in 0..self.n() {
            for p in self.indptr[j]..self.indptr[j + 1] {
                if (self.indices[p] as usize) < j {
                    values[p] = values[self.mirror[p] as usize];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pattern_is_sorted_symmetric_and_mirrors() {
        let p = Pattern::new(5, &[vec![0, 3], vec![1, 3, 4], vec![0, 1]]);
        assert_eq!(p.indices[p.indptr[3]..p.indptr[4]], [0, 1, 3, 4]);
        assert_eq!(p.indices[p.indptr[2]..p.indptr[3]], [2]);
        for j in 0..5_u32 {
            for i in 0..5_u32 {
                assert_eq!(p.position(i, j).map(|q| p.mirror[q] as usize), p.position(j, i));
            }
        }
    }
}
