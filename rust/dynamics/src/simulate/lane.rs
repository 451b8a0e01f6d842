//! Numbers of some modes side by side, in the widest registers the machine has.

use pulp::Simd;

/// Modes treated together.
pub(super) const LANES: usize = 8;
/// One number of each.
pub(super) type Lane = [f64; LANES];

/// x y + z
#[inline(always)]
pub(super) fn mul_add<S: Simd>(simd: S, x: &Lane, y: &Lane, z: &Lane) -> Lane {
    let mut out = [0.0; LANES];
    let (to, _) = S::as_mut_simd_f64s(&mut out);
    let ((x, _), (y, _), (z, _)) = (S::as_simd_f64s(x), S::as_simd_f64s(y), S::as_simd_f64s(z));
    for i in 0..to.len() {
        to[i] = simd.mul_add_e_f64s(x[i], y[i], z[i]);
    }
    out
}

/// x y
#[inline(always)]
pub(super) fn mul<S: Simd>(simd: S, x: &Lane, y: &Lane) -> Lane {
    let mut out = [0.0; LANES];
    let (to, _) = S::as_mut_simd_f64s(&mut out);
    let ((x, _), (y, _)) = (S::as_simd_f64s(x), S::as_simd_f64s(y));
    for i in 0..to.len() {
        to[i] = simd.mul_f64s(x[i], y[i]);
    }
    out
}

/// f x + y
#[inline(always)]
pub(super) fn scaled_add<S: Simd>(simd: S, f: f64, x: &Lane, y: &Lane) -> Lane {
    let mut out = [0.0; LANES];
    let (to, _) = S::as_mut_simd_f64s(&mut out);
    let ((x, _), (y, _), f) = (S::as_simd_f64s(x), S::as_simd_f64s(y), simd.splat_f64s(f));
    for i in 0..to.len() {
        to[i] = simd.mul_add_e_f64s(f, x[i], y[i]);
    }
    out
}

/// Sum of all.
#[inline(always)]
pub(super) fn total<S: Simd>(simd: S, x: &Lane) -> f64 {
    let (x, _) = S::as_simd_f64s(x);
    let mut sum = x[0];
    for x in &x[1..] {
        sum = simd.add_f64s(sum, *x);
    }
    simd.reduce_sum_f64s(sum)
}
