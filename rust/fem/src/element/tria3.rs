//! Three-node shell (CTRIA3), thick or thin: strains of the flat triangle.
//!
//! Bending and transverse shear by discrete Kirchhoff-Mindlin constraints along the sides (DKMT: Katili, Int. J. Numer.
//! Meth. Engng 36 (1993) 1859): without shear flexibility it is the DKT of Batoz, Bathe and Ho (1980), so it does not
//! lock, and it holds thick plates as well. The ratio of bending to shear flexibility of a side is taken with the
//! section's stiffness along that side, so that it serves anisotropic sections. The membrane is the constant-strain
//! triangle. Corner thicknesses are averaged.

use super::plane_point::{MAX, PlanePoint};
use super::shell_section::SectionValues;
use crate::mesh::Rotation;
use crate::scalar::Scalar;
use crate::small::{add3, cross3, dot3, frame_from, scale3, sub3};

/// Corners of the sides.
const SIDES: [[usize; 2]; 3] = [[0, 1], [1, 2], [2, 0]];

/// Axes (x along the first side) and flat corners; `None` when the corners lie on a line.
#[must_use]
pub fn flatten(x: &[[f64; 3]; 3]) -> Option<(Rotation, [[f64; 2]; 3])> {
    let centre = scale3(1.0 / 3.0, add3(add3(x[0], x[1]), x[2]));
    let along = sub3(x[1], x[0]);
    let normal = cross3(along, sub3(x[2], x[0]));
    let [ez, ex, ey] = frame_from(normal, along)?;
    let frame = [ex, ey, ez];
    Some((frame, x.map(|p| [0, 1].map(|i| dot3(frame[i], sub3(p, centre))))))
}

/// Twice the area.
#[must_use]
pub fn jacobian(xy: &[[f64; 2]; 3]) -> f64 {
    let [a, b, c] = xy;
    (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])
}

/// Rotation of a side beyond the linear one, over the 18 DOFs, and what it makes of the shear strain along the side.
struct Side<S> {
    cos: f64,
    sin: f64,
    bulge: [S; MAX],
    shear: [S; MAX],
}

impl<S: Scalar> Side<S> {
    fn new(xy: &[[f64; 2]; 3], v: &SectionValues<S>, [i, j]: [usize; 2]) -> Self {
        let (dx, dy) = (xy[j][0] - xy[i][0], xy[j][1] - xy[i][1]);
        let l = dx.hypot(dy);
        let (cos, sin) = (dx / l, dy / l);
        let phi = if v.rigid_shear || !v.bending {
            S::zero()
        } else {
            v.stiffness.bending_along(cos, sin) * (12.0 / (l * l)) / v.stiffness.shear_along(cos, sin)
        };
        // w_j - w_i + L (b_i + b_j) / 2 + 2/3 L (1 + phi) bulge = 0 with the rotation b = c theta_y - s theta_x
        let w = S::c(-1.5) / (S::c(1.0) + phi);
        let mut bulge = [S::zero(); MAX];
        bulge[6 * i + 2] = w * (-1.0 / l);
        bulge[6 * j + 2] = w * (1.0 / l);
        for a in [i, j] {
            bulge[6 * a + 3] = w * (-0.5 * sin);
            bulge[6 * a + 4] = w * (0.5 * cos);
        }
        let shear = bulge.map(|x| phi * x * (-2.0 / 3.0));
        Self { cos, sin, bulge, shear }
    }
}

/// The three integration points.
pub(crate) fn points<S: Scalar>(xy: &[[f64; 2]; 3], v: &SectionValues<S>) -> Vec<PlanePoint<S>> {
    let det = jacobian(xy);
    let grad: [[f64; 2]; 3] = std::array::from_fn(|a| {
        let (b, c) = (xy[(a + 1) % 3], xy[(a + 2) % 3]);
        [(b[1] - c[1]) / det, (c[0] - b[0]) / det]
    });
    let sides = SIDES.map(|side| Side::new(xy, v, side));
    let corner = corner_shears(&sides);
    let (near, far) = (2.0 / 3.0, 1.0 / 6.0);
    [[near, far, far], [far, near, far], [far, far, near]]
        .map(|n| {
            let mut b = [[S::zero(); MAX]; 8];
            for a in 0..3 {
                let [gx, gy] = grad[a].map(S::c);
                let at = 6 * a;
                b[0][at] = gx;
                b[1][at + 1] = gy;
                b[2][at] = gy;
                b[2][at + 1] = gx;
                b[3][at + 4] = gx;
                b[4][at + 3] = -gy;
                b[5][at + 4] = gy;
                b[5][at + 3] = -gx;
            }
            for (side, [i, j]) in sides.iter().zip(SIDES) {
                // gradient of 4 n_i n_j
                let [px, py] = [0, 1].map(|c| 4.0 * (grad[i][c] * n[j] + n[i] * grad[j][c]));
                for k in 0..18 {
                    b[3][k] += side.bulge[k] * (px * side.cos);
                    b[4][k] += side.bulge[k] * (py * side.sin);
                    b[5][k] += side.bulge[k] * (py * side.cos + px * side.sin);
                }
            }
            for (weight, gamma) in n.iter().zip(&corner) {
                for k in 0..18 {
                    b[6][k] += gamma[0][k] * *weight;
                    b[7][k] += gamma[1][k] * *weight;
                }
            }
            let mut shapes = [0.0; 4];
            shapes[..3].copy_from_slice(&n);
            let mut gradients = [[0.0; 2]; 4];
            gradients[..3].copy_from_slice(&grad);
            PlanePoint { w: det / 6.0, n: shapes, grad: gradients, strains: b }
        })
        .into()
}

/// Shear strains (xz, yz) of each corner from those along its two sides.
fn corner_shears<S: Scalar>(sides: &[Side<S>; 3]) -> [[[S; MAX]; 2]; 3] {
    std::array::from_fn(|a| {
        let (p, q) = (&sides[a], &sides[(a + 2) % 3]);
        let det = p.cos * q.sin - q.cos * p.sin;
        let mut out = [[S::zero(); MAX]; 2];
        for k in 0..18 {
            out[0][k] = p.shear[k] * (q.sin / det) - q.shear[k] * (p.sin / det);
            out[1][k] = q.shear[k] * (p.cos / det) - p.shear[k] * (q.cos / det);
        }
        out
    })
}
