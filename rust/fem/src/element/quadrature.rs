//! Integration points of lines, triangles, tetrahedra and their products.

/// Gauss-Legendre points and weights on [-1, 1], `n` in 1..=4 (exact to degree 2 n - 1).
#[must_use]
pub fn gauss(n: usize) -> Vec<(f64, f64)> {
    match n {
        1 => vec![(0.0, 2.0)],
        2 => {
            let x = 1.0 / 3.0_f64.sqrt();
            vec![(-x, 1.0), (x, 1.0)]
        }
        3 => {
            let x = 0.6_f64.sqrt();
            vec![(-x, 5.0 / 9.0), (0.0, 8.0 / 9.0), (x, 5.0 / 9.0)]
        }
        _ => {
            let root = 2.0 / 7.0 * 1.2_f64.sqrt();
            let (a, b) = ((3.0 / 7.0 - root).sqrt(), (3.0 / 7.0 + root).sqrt());
            let (wa, wb) = ((18.0 + 30.0_f64.sqrt()) / 36.0, (18.0 - 30.0_f64.sqrt()) / 36.0);
            vec![(-b, wb), (-a, wa), (a, wa), (b, wb)]
        }
    }
}

/// A point in three parent coordinates and its weight.
pub type Point = ([f64; 3], f64);

/// `n` Gauss points each way on the cube [-1, 1]³.
#[must_use]
pub fn cube(n: usize) -> Vec<Point> {
    let g = gauss(n);
    let mut out = Vec::new();
    for &(z, wz) in &g {
        for &(y, wy) in &g {
            for &(x, wx) in &g {
                out.push(([x, y, z], wx * wy * wz));
            }
        }
    }
    out
}

/// Points on the unit triangle (area 1/2): three interior ones (degree 2) for `n < 3`, else the collapsed square of
/// `n` Gauss points each way (degree 2 n - 2).
#[must_use]
pub fn triangle(n: usize) -> Vec<([f64; 2], f64)> {
    if n < 3 {
        let (a, b) = (1.0 / 6.0, 2.0 / 3.0);
        return [[a, a], [b, a], [a, b]].map(|p| (p, 1.0 / 6.0)).to_vec();
    }
    let mut out = Vec::new();
    for (a, wa) in gauss(n) {
        let x = 0.5 * (1.0 + a);
        for (b, wb) in gauss(n) {
            out.push(([x, 0.5 * (1.0 + b) * (1.0 - x)], 0.25 * wa * wb * (1.0 - x)));
        }
    }
    out
}

/// Triangle times line: `n` as in [`triangle`], `m` Gauss points along the third coordinate.
#[must_use]
pub fn wedge(n: usize, m: usize) -> Vec<Point> {
    let mut out = Vec::new();
    for (z, wz) in gauss(m) {
        for ([x, y], w) in triangle(n) {
            out.push(([x, y, z], w * wz));
        }
    }
    out
}

/// Points on the pyramid over the square [-1, 1]² with its apex at z = 1 (volume 4/3): the collapsed cube of `n` Gauss
/// points each way (degree 2 n - 3).
#[must_use]
pub fn pyramid(n: usize) -> Vec<Point> {
    let mut out = Vec::new();
    for (c, wc) in gauss(n) {
        let z = 0.5 * (1.0 + c);
        let side = 1.0 - z;
        for (b, wb) in gauss(n) {
            for (a, wa) in gauss(n) {
                out.push(([a * side, b * side, z], 0.5 * wa * wb * wc * side * side));
            }
        }
    }
    out
}

/// Points on the unit tetrahedron (volume 1/6): one (degree 1), four (degree 2), eight (degree 3) or, for `n >= 4`, the
/// collapsed cube of `n` Gauss points each way (degree 2 n - 3). The first three treat all corners alike.
#[must_use]
pub fn tetrahedron(n: usize) -> Vec<Point> {
    match n {
        1 => vec![([0.25; 3], 1.0 / 6.0)],
        2 => {
            let b = (5.0 - 5.0_f64.sqrt()) / 20.0;
            let a = 1.0 - 3.0 * b;
            [[b, b, b], [a, b, b], [b, a, b], [b, b, a]].map(|p| (p, 1.0 / 24.0)).to_vec()
        }
        3 => eight(),
        _ => {
            let mut out = Vec::new();
            for (a, wa) in gauss(n) {
                let x = 0.5 * (1.0 + a);
                for ([y, z], w) in triangle(n) {
                    let s = 1.0 - x;
                    out.push(([x, y * s, z * s], 0.5 * wa * w * s * s));
                }
            }
            out
        }
    }
}

/// Eight points of equal weight, all inside, exact to degree 3: the five-point rule of that degree has a negative weight.
///
/// A point at the share s of the way from the centre to a corner, and its like at the other corners, integrate the
/// elementary symmetric polynomials of the volume coordinates to (3 - 3 s²) / 8 and (1 - 3 s² + 2 s³) / 16; exact are
/// 3/10 and 1/30. Two such sets of half the volume each need s² + t² = 2/5 and s³ + t³ = 2/15.
fn eight() -> Vec<Point> {
    // p = s + t is the root of p³ - 6 p / 5 + 4/15 = 0 for which both lie inside, by the cosine of three times an angle
    let r = 1.6_f64.sqrt();
    let p = r * (((-16.0 / (15.0 * r.powi(3))).acos() + 2.0 * std::f64::consts::TAU) / 3.0).cos();
    let root = (0.8 - p * p).sqrt();
    let mut out = Vec::with_capacity(8);
    for s in [0.5 * (p + root), 0.5 * (p - root)] {
        let (a, b) = (0.25 * (1.0 + 3.0 * s), 0.25 * (1.0 - s));
        out.extend([[b, b, b], [a, b, b], [b, a, b], [b, b, a]].map(|x| (x, 1.0 / 48.0)));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn factorial(n: u32) -> f64 {
        (1..=n).map(f64::from).product()
    }

    #[test]
    fn rules_integrate_their_degree_exactly() {
        for (n, degree) in [(1, 1), (2, 2), (3, 3), (4, 5)] {
            for (i, j, k) in (0..=degree)
                .flat_map(|i| (0..=degree).flat_map(move |j| (0..=degree).map(move |k| (i, j, k))))
            {
                if i + j + k > degree {
                    continue;
                }
                let f = |p: [f64; 3]| p[0].powi(i) * p[1].powi(j) * p[2].powi(k);
                let sum: f64 = tetrahedron(n).iter().map(|(p, w)| w * f(*p)).sum();
                let (a, b, c) = (i as u32, j as u32, k as u32);
                let exact = factorial(a) * factorial(b) * factorial(c) / factorial(a + b + c + 3);
                assert!((sum - exact).abs() < 1e-14, "tetrahedron {n}: {i} {j} {k}");
            }
        }
        for (p, w) in [1, 2, 3, 4].into_iter().flat_map(tetrahedron) {
            assert!(w > 0.0 && p.iter().all(|&x| x > 0.0) && p.iter().sum::<f64>() < 1.0, "{p:?} {w}");
        }
        for (n, degree) in [(1, 2), (3, 4), (4, 6)] {
            for (i, j) in (0..=degree).flat_map(|i| (0..=degree - i).map(move |j| (i, j))) {
                let sum: f64 = triangle(n).iter().map(|([x, y], w)| w * x.powi(i) * y.powi(j)).sum();
                let exact = factorial(i as u32) * factorial(j as u32) / factorial((i + j + 2) as u32);
                assert!((sum - exact).abs() < 1e-14, "triangle {n}: {i} {j}");
            }
        }
        for n in 2..=4 {
            // int x² (1 - z)^k: 4/3 / (k + 5)
            for k in 0..2 * n as i32 - 4 {
                let sum: f64 = pyramid(n).iter().map(|(p, w)| w * p[0] * p[0] * (1.0 - p[2]).powi(k)).sum();
                assert!((sum - 4.0 / 3.0 / f64::from(k + 5)).abs() < 1e-14, "pyramid {n}: {k} {sum}");
            }
            let volume: f64 = pyramid(n).iter().map(|p| p.1).sum();
            assert!((volume - 4.0 / 3.0).abs() < 1e-14);
        }
        for n in 1..=4 {
            for i in 0..2 * n as i32 {
                let sum: f64 = gauss(n).iter().map(|(x, w)| w * x.powi(i)).sum();
                let exact = if i % 2 == 0 { 2.0 / f64::from(i + 1) } else { 0.0 };
                assert!((sum - exact).abs() < 1e-14);
            }
        }
    }
}
