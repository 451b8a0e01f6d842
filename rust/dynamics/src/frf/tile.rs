//! The one product under FRF synthesis: 24 columns in SIMD lanes times 8 broadcast rows, summed over modes.
//!
//! On AVX-512 the 8 x 24 sums stay in 24 registers, on AVX2 in pieces of 4 x 12; the instruction set is found at run time.

use pulp::{Simd, WithSimd};

/// Columns of a panel: pairs of DOFs, or outputs.
pub(crate) const WIDE: usize = 24;
/// Rows of a tile: real and imaginary parts of lines.
pub(crate) const NARROW: usize = 8;

/// Sums of a tile, row after row.
pub(crate) type Tile = [[f64; WIDE]; NARROW];

/// Panels of `depth` x 24 values: columns of a matrix grouped for the lanes, zeros beyond the last.
#[derive(Debug, Clone)]
pub(crate) struct Panels {
    values: Vec<[f64; WIDE]>,
    depth: usize,
}

impl Panels {
    /// `column(k, first, lanes)` fills the values of row k for the columns from `first` on.
    pub(crate) fn new(
        depth: usize,
        columns: usize,
        mut column: impl FnMut(usize, usize, &mut [f64]),
    ) -> Self {
        let mut values = vec![[0.0; WIDE]; depth * columns.div_ceil(WIDE)];
        for (p, panel) in values.chunks_exact_mut(depth.max(1)).enumerate() {
            let first = p * WIDE;
            let lanes = WIDE.min(columns - first);
            for (k, row) in panel.iter_mut().enumerate() {
                column(k, first, &mut row[..lanes]);
            }
        }
        Self { values, depth }
    }

    fn panel(&self, p: usize) -> &[[f64; WIDE]] {
        &self.values[p * self.depth..(p + 1) * self.depth]
    }

    fn len(&self) -> usize {
        self.values.len().checked_div(self.depth).unwrap_or(0)
    }
}

/// What becomes of the tiles.
pub(crate) trait Sink {
    /// Sums of group `group` of eight rows for the columns from `first` on.
    fn take(&mut self, group: usize, first: usize, tile: &Tile);
}

/// Multiplies all panels with groups of eight rows, `rows[group * depth + k]`, and hands every tile to the sink.
pub(crate) fn multiply(panels: &Panels, rows: &[[f64; NARROW]], sink: &mut impl Sink) {
    if panels.depth > 0 {
        pulp::Arch::new().dispatch(Product { panels, rows, sink });
    }
}

struct Product<'a, T> {
    panels: &'a Panels,
    rows: &'a [[f64; NARROW]],
    sink: &'a mut T,
}

impl<T: Sink> WithSimd for Product<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let mut tile = [[0.0; WIDE]; NARROW];
        for p in 0..self.panels.len() {
            let panel = self.panels.panel(p);
            for (group, rows) in self.rows.chunks_exact(self.panels.depth).enumerate() {
                if S::F64_LANES >= 8 {
                    product::<S, NARROW>(simd, panel, rows, &mut tile);
                } else {
                    product::<S, { NARROW / 2 }>(simd, panel, rows, &mut tile);
                }
                self.sink.take(group, p * WIDE, &tile);
            }
        }
    }
}

/// One tile in blocks of `N` rows and three registers of columns.
#[inline(always)]
fn product<S: Simd, const N: usize>(simd: S, panel: &[[f64; WIDE]], rows: &[[f64; NARROW]], tile: &mut Tile) {
    let width = 3 * S::F64_LANES;
    for first in (0..NARROW).step_by(N) {
        for lane in (0..WIDE).step_by(width) {
            let mut sums = [[simd.splat_f64s(0.0); 3]; N];
            for (panel, row) in panel.iter().zip(rows) {
                let (v, _) = S::as_simd_f64s(&panel[lane..lane + width]);
                let v = [v[0], v[1], v[2]];
                for (sum, &x) in sums.iter_mut().zip(&row[first..first + N]) {
                    let x = simd.splat_f64s(x);
                    for (sum, v) in sum.iter_mut().zip(v) {
                        *sum = simd.mul_add_f64s(x, v, *sum);
                    }
                }
            }
            for (sum, out) in sums.iter().zip(&mut tile[first..first + N]) {
                let (out, _) = S::as_mut_simd_f64s(&mut out[lane..lane + width]);
                out.copy_from_slice(sum);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Keep(Vec<(usize, usize, Tile)>);
    impl Sink for Keep {
        fn take(&mut self, group: usize, first: usize, tile: &Tile) {
            self.0.push((group, first, *tile));
        }
    }

    #[test]
    fn tiles_equal_plain_sums() {
        let (depth, columns, groups) = (7, 41, 3);
        let value = |k: usize, c: usize| (1.0 + k as f64).sin() * (2.0 + c as f64).cos();
        let panels = Panels::new(depth, columns, |k, first, lanes| {
            lanes.iter_mut().enumerate().for_each(|(c, v)| *v = value(k, first + c));
        });
        let row = |g: usize, k: usize, r: usize| (g * 31 + k * 8 + r) as f64 * 0.1 - 3.0;
        let rows: Vec<[f64; NARROW]> =
            (0..groups * depth).map(|at| std::array::from_fn(|r| row(at / depth, at % depth, r))).collect();
        let mut keep = Keep(Vec::new());
        multiply(&panels, &rows, &mut keep);
        assert_eq!(keep.0.len(), groups * 2);
        for (group, first, tile) in keep.0 {
            for r in 0..NARROW {
                for lane in 0..WIDE {
                    let c = first + lane;
                    let plain: f64 = (0..depth).map(|k| row(group, k, r) * value(k, c)).sum();
                    let expected = if c < columns { plain } else { 0.0 };
                    assert!((tile[r][lane] - expected).abs() < 1e-12);
                }
            }
        }
    }
}
