//! Four-node shell (CQUAD4), flat or warped, thick or thin: strains of the flat quadrilateral.
//!
//! Membrane with four incompatible modes (QM6: Taylor, Beresford and Wilson 1976), bending and transverse shear of
//! Mindlin's theory with the assumed shear strains of MITC4 (Bathe and Dvorkin, Int. J. Numer. Meth. Engng 21 (1985)
//! 367), so that thin plates do not lock. Corner thicknesses are averaged.

use super::plane_point::{MAX, PlanePoint};
use crate::mesh::Rotation;
use crate::scalar::Scalar;
use crate::small::{add3, cross3, dot3, frame_from, scale3, sub3};

/// Transverse shear stiffness over D / area of an element without MID3, which has no shear flexibility: large enough
/// that the flexibility left is below 0.1 % of an element's bending, small enough for the digits of the solver.
pub(crate) const RIGID_SHEAR: f64 = 1e4;

/// Axes of the mean plane, flat corners and heights of the nodes above it; `None` when the corners lie on a line.
#[must_use]
#[allow(clippy::type_complexity)]
pub fn flatten(x: &[[f64; 3]; 4]) -> Option<(Rotation, [[f64; 2]; 4], [f64; 4])> {
    let centre = scale3(0.25, x.iter().fold([0.0; 3], |s, p| add3(s, *p)));
    let normal = cross3(sub3(x[2], x[0]), sub3(x[3], x[1]));
    let along = sub3(add3(x[1], x[2]), add3(x[0], x[3]));
    // frame_from takes x and a vector in the x-y plane; here z is known
    let [ez, ex, ey] = frame_from(normal, along)?;
    let frame = [ex, ey, ez];
    let local = |p: &[f64; 3]| frame.map(|axis| dot3(axis, sub3(*p, centre)));
    let all = [local(&x[0]), local(&x[1]), local(&x[2]), local(&x[3])];
    Some((frame, all.map(|p| [p[0], p[1]]), all.map(|p| p[2])))
}

/// Jacobian determinant at the four corners.
#[must_use]
pub fn corner_jacobians(xy: &[[f64; 2]; 4]) -> [f64; 4] {
    [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[r, s]| Plane::new(xy, r, s).det)
}

/// The four integration points.
pub(crate) fn points<S: Scalar>(xy: &[[f64; 2]; 4]) -> Vec<PlanePoint<S>> {
    let x = 1.0 / 3.0_f64.sqrt();
    let centre = Plane::new(xy, 0.0, 0.0);
    let tying = Tying::new(xy);
    [(-x, -x), (x, -x), (x, x), (-x, x)].map(|(r, s)| point(xy, &centre, &tying, r, s)).into()
}

fn point<S: Scalar>(xy: &[[f64; 2]; 4], centre: &Plane, tying: &Tying, r: f64, s: f64) -> PlanePoint<S> {
    let p = Plane::new(xy, r, s);
    let mut b = [[0.0; MAX]; 8];
    for a in 0..4 {
        let [gx, gy] = p.grad[a];
        let at = 6 * a;
        membrane(&mut b, at, gx, gy);
        // kappa_x = theta_y,x; kappa_y = -theta_x,y; kappa_xy = theta_y,y - theta_x,x
        b[3][at + 4] = gx;
        b[4][at + 3] = -gy;
        b[5][at + 4] = gy;
        b[5][at + 3] = -gx;
    }
    for (i, q) in [r, s].into_iter().enumerate() {
        // gradients of 1 - r², 1 - s² through the Jacobian of the centre integrate to zero
        let [gx, gy] = [0, 1].map(|c| -2.0 * q * centre.det / p.det * centre.inverse[c][i]);
        membrane(&mut b, 24 + 2 * i, gx, gy);
    }
    let shear = tying.strains(&p, r, s);
    for c in 0..2 {
        for a in 0..4 {
            for i in 0..3 {
                b[6 + c][6 * a + 2 + i] = shear[c][3 * a + i];
            }
        }
    }
    PlanePoint { w: p.det, n: p.n, grad: p.grad, strains: b.map(|row| row.map(S::c)) }
}

fn membrane(b: &mut [[f64; MAX]; 8], at: usize, gx: f64, gy: f64) {
    b[0][at] = gx;
    b[1][at + 1] = gy;
    b[2][at] = gy;
    b[2][at + 1] = gx;
}

/// Covariant shear strains over (w, theta_x, theta_y) at MITC4's tying points, the middles of the edges.
struct Tying {
    along_r: [[f64; 12]; 2],
    along_s: [[f64; 12]; 2],
}

impl Tying {
    fn new(xy: &[[f64; 2]; 4]) -> Self {
        let covariant = |r: f64, s: f64, axis: usize| {
            let q = Plane::new(xy, r, s);
            let mut row = [0.0; 12];
            for a in 0..4 {
                row[3 * a] = q.parent[a][axis];
                row[3 * a + 1] = -q.jacobian[axis][1] * q.n[a];
                row[3 * a + 2] = q.jacobian[axis][0] * q.n[a];
            }
            row
        };
        Self {
            along_r: [covariant(0.0, -1.0, 0), covariant(0.0, 1.0, 0)],
            along_s: [covariant(-1.0, 0.0, 1), covariant(1.0, 0.0, 1)],
        }
    }

    /// Rows gamma_xz and gamma_yz.
    fn strains(&self, p: &Plane, r: f64, s: f64) -> [[f64; 12]; 2] {
        let mut out = [[0.0; 12]; 2];
        for i in 0..12 {
            let gr = 0.5 * ((1.0 - s) * self.along_r[0][i] + (1.0 + s) * self.along_r[1][i]);
            let gs = 0.5 * ((1.0 - r) * self.along_s[0][i] + (1.0 + r) * self.along_s[1][i]);
            for c in 0..2 {
                out[c][i] = p.inverse[c][0] * gr + p.inverse[c][1] * gs;
            }
        }
        out
    }
}

/// Bilinear shapes and their gradients at one parent point.
struct Plane {
    n: [f64; 4],
    /// Derivatives with respect to r and s.
    parent: [[f64; 2]; 4],
    /// Rows r, s; columns x, y.
    jacobian: [[f64; 2]; 2],
    inverse: [[f64; 2]; 2],
    det: f64,
    grad: [[f64; 2]; 4],
}

impl Plane {
    fn new(xy: &[[f64; 2]; 4], r: f64, s: f64) -> Self {
        let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        let n = corners.map(|[a, b]| 0.25 * (1.0 + a * r) * (1.0 + b * s));
        let parent = corners.map(|[a, b]| [0.25 * a * (1.0 + b * s), 0.25 * b * (1.0 + a * r)]);
        let mut j = [[0.0; 2]; 2];
        for (d, x) in parent.iter().zip(xy) {
            for i in 0..2 {
                for c in 0..2 {
                    j[i][c] += d[i] * x[c];
                }
            }
        }
        let det = j[0][0] * j[1][1] - j[0][1] * j[1][0];
        let inverse = [[j[1][1] / det, -j[0][1] / det], [-j[1][0] / det, j[0][0] / det]];
        let grad = parent.map(|d| [0, 1].map(|c| inverse[c][0] * d[0] + inverse[c][1] * d[1]));
        Self { n, parent, jacobian: j, inverse, det, grad }
    }
}
