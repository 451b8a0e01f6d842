//! Tall columns against rows of eight right-hand sides, one in each lane of a register.
//!
//! A general product reads a tall panel a few rows at a time down hundreds of columns, which no prefetcher follows, or packs
//! it first; here eight columns are streamed from top to bottom, and each value is used for all right-hand sides at once.

use num_complex::Complex64;
use pulp::Simd;

use crate::scalar::Scalar;

/// Right-hand sides of a row: one AVX-512 register.
pub(crate) const LANES: usize = 8;

/// A number with its rows of right-hand sides and the registers that hold them.
pub(crate) trait Lanes: Scalar {
    /// One row of eight right-hand sides.
    type Row: Copy + Send + Sync + std::fmt::Debug;
    /// As many of them as the processor takes at once.
    type Register<S: Simd>: Copy;
    const EMPTY: Self::Row;
    /// Columns that may be worked on together without running out of registers.
    const TOGETHER: usize;

    fn get(row: &Self::Row, lane: usize) -> Self;
    fn set(row: &mut Self::Row, lane: usize, value: Self);
    fn zero<S: Simd>(simd: S) -> Self::Register<S>;
    fn load<S: Simd>(row: &Self::Row, lane: usize) -> Self::Register<S>;
    fn store<S: Simd>(row: &mut Self::Row, lane: usize, x: Self::Register<S>);
    /// a x.
    fn times<S: Simd>(simd: S, a: Self, x: Self::Register<S>) -> Self::Register<S>;
    /// y + a x, in one operation where the processor has it.
    fn plus_times<S: Simd>(simd: S, a: Self, x: Self::Register<S>, y: Self::Register<S>)
    -> Self::Register<S>;
}

/// One row of eight columns, in one line of the cache.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C, align(64))]
pub struct Eight(pub [f64; LANES]);

impl Eight {
    /// Zeros.
    pub const EMPTY: Self = Self([0.0; LANES]);

    #[inline(always)]
    fn load<S: Simd>(&self, lane: usize) -> S::f64s {
        S::as_simd_f64s(&self.0[lane..lane + S::F64_LANES]).0[0]
    }

    #[inline(always)]
    fn store<S: Simd>(&mut self, lane: usize, x: S::f64s) {
        S::as_mut_simd_f64s(&mut self.0[lane..lane + S::F64_LANES]).0[0] = x;
    }
}

impl Lanes for f64 {
    type Row = Eight;
    type Register<S: Simd> = S::f64s;
    const EMPTY: Eight = Eight::EMPTY;
    const TOGETHER: usize = 8;

    #[inline(always)]
    fn get(row: &Self::Row, lane: usize) -> Self {
        row.0[lane]
    }

    #[inline(always)]
    fn set(row: &mut Self::Row, lane: usize, value: Self) {
        row.0[lane] = value;
    }

    #[inline(always)]
    fn zero<S: Simd>(simd: S) -> S::f64s {
        simd.splat_f64s(0.0)
    }

    #[inline(always)]
    fn load<S: Simd>(row: &Self::Row, lane: usize) -> S::f64s {
        row.load::<S>(lane)
    }

    #[inline(always)]
    fn store<S: Simd>(row: &mut Self::Row, lane: usize, x: S::f64s) {
        row.store::<S>(lane, x);
    }

    #[inline(always)]
    fn times<S: Simd>(simd: S, a: f64, x: S::f64s) -> S::f64s {
        simd.mul_f64s(simd.splat_f64s(a), x)
    }

    #[inline(always)]
    fn plus_times<S: Simd>(simd: S, a: f64, x: S::f64s, y: S::f64s) -> S::f64s {
        simd.mul_add_e_f64s(simd.splat_f64s(a), x, y)
    }
}

impl Lanes for Complex64 {
    /// Real parts and imaginary parts.
    type Row = [Eight; 2];
    type Register<S: Simd> = [S::f64s; 2];
    const EMPTY: [Eight; 2] = [Eight::EMPTY; 2];
    const TOGETHER: usize = 4;

    #[inline(always)]
    fn get(row: &Self::Row, lane: usize) -> Self {
        Self::new(row[0].0[lane], row[1].0[lane])
    }

    #[inline(always)]
    fn set(row: &mut Self::Row, lane: usize, value: Self) {
        (row[0].0[lane], row[1].0[lane]) = (value.re, value.im);
    }

    #[inline(always)]
    fn zero<S: Simd>(simd: S) -> [S::f64s; 2] {
        [simd.splat_f64s(0.0); 2]
    }

    #[inline(always)]
    fn load<S: Simd>(row: &Self::Row, lane: usize) -> [S::f64s; 2] {
        [row[0].load::<S>(lane), row[1].load::<S>(lane)]
    }

    #[inline(always)]
    fn store<S: Simd>(row: &mut Self::Row, lane: usize, x: [S::f64s; 2]) {
        row[0].store::<S>(lane, x[0]);
        row[1].store::<S>(lane, x[1]);
    }

    #[inline(always)]
    fn times<S: Simd>(simd: S, a: Self, [re, im]: [S::f64s; 2]) -> [S::f64s; 2] {
        let (ar, ai) = (simd.splat_f64s(a.re), simd.splat_f64s(a.im));
        let minus = simd.splat_f64s(-a.im);
        [
            simd.mul_add_e_f64s(minus, im, simd.mul_f64s(ar, re)),
            simd.mul_add_e_f64s(ai, re, simd.mul_f64s(ar, im)),
        ]
    }

    #[inline(always)]
    fn plus_times<S: Simd>(simd: S, a: Self, [re, im]: [S::f64s; 2], y: [S::f64s; 2]) -> [S::f64s; 2] {
        let (ar, ai) = (simd.splat_f64s(a.re), simd.splat_f64s(a.im));
        let minus = simd.splat_f64s(-a.im);
        [
            simd.mul_add_e_f64s(minus, im, simd.mul_add_e_f64s(ar, re, y[0])),
            simd.mul_add_e_f64s(ai, re, simd.mul_add_e_f64s(ar, im, y[1])),
        ]
    }
}

/// The columns of a supernode, (height, width) column-major, its triangle on top.
#[derive(Clone, Copy)]
pub(crate) struct Columns<'a, T> {
    pub(crate) values: &'a [T],
    pub(crate) height: usize,
    /// The diagonal is one, and something else stands there.
    pub(crate) unit: bool,
}

impl<'a, T: Lanes> Columns<'a, T> {
    fn width(&self) -> usize {
        self.values.len() / self.height.max(1)
    }

    #[inline(always)]
    fn block<const W: usize>(&self, first: usize) -> [&'a [T]; W] {
        std::array::from_fn(|c| &self.values[(first + c) * self.height..][..self.height])
    }

    /// L⁻¹ to the rows of the columns' own, and what they take from the rows below.
    #[inline(always)]
    pub(crate) fn forward<S: Simd>(self, simd: S, rows: &mut [T::Row]) {
        let (mut first, width) = (0, self.width());
        while first < width {
            let left = width - first;
            if left >= 8 && T::TOGETHER >= 8 {
                self.forward_block::<S, 8>(simd, first, rows);
                first += 8;
            } else if left >= 4 {
                self.forward_block::<S, 4>(simd, first, rows);
                first += 4;
            } else if left >= 2 {
                self.forward_block::<S, 2>(simd, first, rows);
                first += 2;
            } else {
                self.forward_block::<S, 1>(simd, first, rows);
                first += 1;
            }
        }
    }

    /// L⁻ᵀ to the rows of the columns' own, with the rows below known.
    #[inline(always)]
    pub(crate) fn backward<S: Simd>(self, simd: S, rows: &mut [T::Row]) {
        // the blocks of the way forward, from the last to the first
        let mut end = self.width();
        let whole = |size: usize| end - end % size;
        let (eights, fours, twos) = (if T::TOGETHER >= 8 { whole(8) } else { 0 }, whole(4), whole(2));
        while end > 0 {
            if end > twos {
                self.backward_block::<S, 1>(simd, end - 1, rows);
                end -= 1;
            } else if end > fours {
                self.backward_block::<S, 2>(simd, end - 2, rows);
                end -= 2;
            } else if end > eights {
                self.backward_block::<S, 4>(simd, end - 4, rows);
                end -= 4;
            } else {
                self.backward_block::<S, 8>(simd, end - 8, rows);
                end -= 8;
            }
        }
    }

    #[inline(always)]
    fn forward_block<S: Simd, const W: usize>(&self, simd: S, first: usize, rows: &mut [T::Row]) {
        let columns = self.block::<W>(first);
        let (top, below) = rows[..self.height].split_at_mut(first + W);
        let top = &mut top[first..];
        for lane in (0..LANES).step_by(S::F64_LANES) {
            let mut own: [T::Register<S>; W] = std::array::from_fn(|c| T::load(&top[c], lane));
            for c in 0..W {
                if !self.unit {
                    own[c] = T::times(simd, T::ONE / columns[c][first + c], own[c]);
                }
                for r in c + 1..W {
                    own[r] = T::plus_times(simd, -columns[c][first + r], own[c], own[r]);
                }
                T::store(&mut top[c], lane, own[c]);
            }
            // minus the own rows once, instead of minus every value
            let minus = own.map(|x| T::times(simd, -T::ONE, x));
            spread(simd, columns.map(|column| &column[first + W..]), minus, below, lane);
        }
    }

    #[inline(always)]
    fn backward_block<S: Simd, const W: usize>(&self, simd: S, first: usize, rows: &mut [T::Row]) {
        let columns = self.block::<W>(first);
        let (top, below) = rows[..self.height].split_at_mut(first + W);
        let top = &mut top[first..];
        for lane in (0..LANES).step_by(S::F64_LANES) {
            let taken = collect::<S, T, W>(simd, columns.map(|column| &column[first + W..]), below, lane);
            let mut own: [T::Register<S>; W] =
                std::array::from_fn(|c| T::plus_times(simd, -T::ONE, taken[c], T::load(&top[c], lane)));
            for c in (0..W).rev() {
                for r in c + 1..W {
                    own[c] = T::plus_times(simd, -columns[c][first + r], own[r], own[c]);
                }
                if !self.unit {
                    own[c] = T::times(simd, T::ONE / columns[c][first + c], own[c]);
                }
                T::store(&mut top[c], lane, own[c]);
            }
        }
    }
}

/// rows += Σ column x, in the lanes from `lane` on.
#[inline(always)]
pub(crate) fn spread<S: Simd, T: Lanes, const W: usize>(
    simd: S,
    columns: [&[T]; W],
    x: [T::Register<S>; W],
    rows: &mut [T::Row],
    lane: usize,
) {
    // once here, so that it need not be asked for every value
    assert!(columns.iter().all(|column| column.len() == rows.len()));
    for (r, row) in rows.iter_mut().enumerate() {
        let mut sum = T::load(row, lane);
        for c in 0..W {
            sum = T::plus_times(simd, columns[c][r], x[c], sum);
        }
        T::store(row, lane, sum);
    }
}

/// Σ value row down each column, in the lanes from `lane` on.
#[inline(always)]
pub(crate) fn collect<S: Simd, T: Lanes, const W: usize>(
    simd: S,
    columns: [&[T]; W],
    rows: &[T::Row],
    lane: usize,
) -> [T::Register<S>; W] {
    assert!(columns.iter().all(|column| column.len() == rows.len()));
    let mut sums = [T::zero(simd); W];
    for (r, row) in rows.iter().enumerate() {
        let x = T::load(row, lane);
        for c in 0..W {
            sums[c] = T::plus_times(simd, columns[c][r], x, sums[c]);
        }
    }
    sums
}
