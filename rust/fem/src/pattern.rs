//! The fixed symmetric pattern of K, M and C: rows that elements couple, and the mirror of every entry.

use femend_linalg::{LinalgError, Pattern};
use rayon::prelude::*;

/// Pattern of `n` DOFs in which all DOFs of one element (`elements[e]`, ascending) couple; the diagonal is present.
///
/// # Errors
/// [`LinalgError::Pattern`] for a matrix too large for 32-bit indices.
pub fn element_pattern(n: usize, elements: &[Vec<u32>]) -> Result<Pattern, LinalgError> {
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
    let nnz: usize = columns.iter().map(Vec::len).sum();
    if nnz > u32::MAX as usize {
        let text = format!("{nnz} entries exceed the limit {}; the mesh is too fine for one model", u32::MAX);
        return Err(LinalgError::Pattern(text));
    }
    let mut col_ptr = vec![0_u32; n + 1];
    for (j, rows) in columns.iter().enumerate() {
        col_ptr[j + 1] = col_ptr[j] + rows.len() as u32;
    }
    Pattern::new(n, col_ptr, columns.concat())
}

/// Position of the transposed entry of every entry.
#[must_use]
pub fn mirror(pattern: &Pattern) -> Vec<u32> {
    let mut next = pattern.col_ptr().to_vec();
    let mut out = vec![0_u32; pattern.nnz()];
    for j in 0..pattern.n() {
        for p in pattern.range(j) {
            let i = pattern.row_idx()[p] as usize;
            // columns are visited ascending, so the entries (j, i) of column i come in order
            out[p] = next[i];
            next[i] += 1;
        }
    }
    out
}

/// Copies the lower triangle onto the upper one.
pub fn symmetrise(pattern: &Pattern, mirror: &[u32], values: &mut [f64]) {
    for j in 0..pattern.n() {
        for p in pattern.range(j) {
            if (pattern.row_idx()[p] as usize) < j {
                values[p] = values[mirror[p] as usize];
            }
        }
    }
}

/// Copies the lower triangle onto the upper one with the other sign.
pub fn antisymmetrise(pattern: &Pattern, mirror: &[u32], values: &mut [f64]) {
    for j in 0..pattern.n() {
        for p in pattern.range(j) {
            if (pattern.row_idx()[p] as usize) < j {
                values[p] = -values[mirror[p] as usize];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pattern_is_sorted_symmetric_and_mirrors() {
        let p = element_pattern(5, &[vec![0, 3], vec![1, 3, 4], vec![0, 1]]).unwrap();
        assert_eq!(p.column(3), [0, 1, 3, 4]);
        assert_eq!(p.column(2), [2]);
        let m = mirror(&p);
        for j in 0..5 {
            for i in 0..5 {
                assert_eq!(p.position(i, j).map(|q| m[q] as usize), p.position(j, i));
            }
        }
    }
}
