//! Four-node shell (CQUAD4), flat or warped, thick or thin.
//!
//! Membrane with four incompatible modes (QM6: Taylor, Beresford and Wilson 1976), bending and transverse shear of
//! Mindlin's theory with the assumed shear strains of MITC4 (Bathe and Dvorkin, Int. J. Numer. Meth. Engng 21 (1985)
//! 367), so that thin plates do not lock. The rotation about the normal is tied to the membrane's by
//! `1e-4 G t int (theta_z - omega_z)² dA`: enough for a regular stiffness, rigid motion stays free. A warped element
//! is the flat one through its mean plane, joined to the nodes by rigid arms along the normal; so is ZOFFS.
//! Corner thicknesses are averaged. Consistent mass has rotary inertia rho t³/12; lumped mass has none.

use super::Matrices;
use crate::mesh::{Material, Rotation};
use crate::parameter::{Elastic, Factors, Quantity};
use crate::scalar::Scalar;
use crate::small::{
    Mat, add3, condense_tail, cross3, dot3, frame_from, matmul, rigid, rotations, scale3, sub3,
};

/// Ratio of the drilling stiffness to G t.
const DRILLING: f64 = 1e-4;
/// Transverse shear stiffness over D / area of an element without MID3, which has no shear flexibility: large enough
/// that the flexibility left is below 0.1 % of an element's bending, small enough for the digits of the solver.
const RIGID_SHEAR: f64 = 1e4;

/// A four-node shell.
#[derive(Debug, Clone)]
pub struct Quad4Element {
    /// Corners in the mean plane's axes, origin in the middle.
    pub xy: [[f64; 2]; 4],
    /// Axes of the mean plane.
    pub frame: Rotation,
    /// From each node to its corner of the reference plane, basic coordinates.
    pub arms: [[f64; 3]; 4],
    /// Thickness.
    pub t: f64,
    /// Membrane, bending and shear material.
    pub materials: [Option<Material>; 3],
    /// 12 I / T³.
    pub bending_ratio: f64,
    /// TS / T.
    pub shear_ratio: f64,
    /// Non-structural mass per area.
    pub nsm: f64,
    /// Consistent mass?
    pub coupled_mass: bool,
}

/// Geometry of one flat quadrilateral, integrated: everything but the material.
struct Integrals {
    /// Plane-stress parts of the membrane (8 + 4 internal): normal, Poisson, shear.
    membrane: [Mat<f64>; 3],
    /// The same of bending (w, theta_x, theta_y per node).
    bending: [Mat<f64>; 3],
    /// Transverse shear.
    shear: Mat<f64>,
    /// Drilling over (u, v, theta_z).
    drilling: Mat<f64>,
    /// Mass of one component.
    mass: Mat<f64>,
    area: f64,
}

impl Quad4Element {
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
    pub fn corner_jacobians(&self) -> [f64; 4] {
        [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[r, s]| Plane::new(&self.xy, r, s).det)
    }

    /// K, M and the loss matrix in basic axes.
    #[must_use]
    pub fn matrices<S: Scalar>(&self, f: &Factors<S>) -> Matrices<S> {
        let t = f.of(Quantity::T) * self.t;
        let elastic = |i: usize| self.materials[i].as_ref().map(|m| f.elastic(i, m));
        let (membrane, bending, shear) = (elastic(0), elastic(1), elastic(2));
        let g = self.integrals();
        let mut k = Mat::zeros(24, 24);
        let mut h = Mat::zeros(24, 24);
        let mut lossy = false;
        let mut put = |part: &Mat<S>, rows: &[usize], eta: S| {
            lossy |= !eta.is_zero();
            for i in 0..part.rows {
                for j in 0..part.cols {
                    k[(rows[i], rows[j])] += part[(i, j)];
                    h[(rows[i], rows[j])] += eta * part[(i, j)];
                }
            }
        };
        if let Some(el) = membrane {
            let stuck = Mat { rows: 8, cols: 8, data: vec![S::c(f64::NAN); 64] };
            let part = condense_tail(&plane_stress(&g.membrane, &el, t), 8).unwrap_or(stuck);
            put(&part, &rows_of(&[0, 1]), el.eta);
            let tie = Mat::lift(&g.drilling).scaled(el.e * t * (0.5 * DRILLING) / (S::c(1.0) + el.nu));
            put(&tie, &rows_of(&[0, 1, 5]), el.eta);
        }
        if let Some(el) = bending {
            let i = t * t * t * (self.bending_ratio / 12.0);
            put(&plane_stress(&g.bending, &el, i), &rows_of(&[2, 3, 4]), el.eta);
            let (stiffness, eta) = match shear {
                Some(s) => (s.g * t * self.shear_ratio, s.eta),
                None => {
                    let d = el.e * i / (S::c(1.0) - el.nu * el.nu);
                    (d * (RIGID_SHEAR / g.area), el.eta)
                }
            };
            put(&Mat::lift(&g.shear).scaled(stiffness), &rows_of(&[2, 3, 4]), eta);
        }
        let rho = membrane.or(bending).map_or(S::zero(), |el| el.rho);
        let m = self.mass(&g, rho * t + S::c(self.nsm), rho * t * t * t * (1.0 / 12.0));
        let map = self.map();
        Matrices {
            k: Some(k.congruence(&map)),
            m: Some(m.congruence(&map)),
            c: None,
            h: lossy.then(|| h.congruence(&map)),
        }
    }

    fn mass<S: Scalar>(&self, g: &Integrals, per_area: S, rotary: S) -> Mat<S> {
        let mut m = Mat::zeros(24, 24);
        for a in 0..4 {
            if !self.coupled_mass {
                let share: f64 = (0..4).map(|b| g.mass[(a, b)]).sum();
                for c in 0..3 {
                    m[(6 * a + c, 6 * a + c)] = per_area * share;
                }
                continue;
            }
            for b in 0..4 {
                for c in 0..5 {
                    let weight = if c < 3 { per_area } else { rotary };
                    m[(6 * a + c, 6 * b + c)] = weight * g.mass[(a, b)];
                }
            }
        }
        m
    }

    /// Corner displacements in the plane's axes (24) from nodal displacements in basic axes (24).
    fn map(&self) -> Mat<f64> {
        let turn = rotations(&self.frame, 2);
        let mut out = Mat::zeros(24, 24);
        for a in 0..4 {
            let part = matmul(&turn, &rigid(self.arms[a]));
            for i in 0..6 {
                for j in 0..6 {
                    out[(6 * a + i, 6 * a + j)] = part[(i, j)];
                }
            }
        }
        out
    }

    fn integrals(&self) -> Integrals {
        let zeros = |n| Mat::zeros(n, n);
        let mut g = Integrals {
            membrane: [zeros(12), zeros(12), zeros(12)],
            bending: [zeros(12), zeros(12), zeros(12)],
            shear: zeros(12),
            drilling: zeros(12),
            mass: zeros(4),
            area: 0.0,
        };
        let x = 1.0 / 3.0_f64.sqrt();
        let centre = Plane::new(&self.xy, 0.0, 0.0);
        for (r, s) in [(-x, -x), (x, -x), (x, x), (-x, x)] {
            let p = Plane::new(&self.xy, r, s);
            let w = p.det;
            g.area += w;
            g.mass.add_outer(w, &p.n, &p.n);
            let mut grad = [[0.0; 2]; 6];
            grad[..4].copy_from_slice(&p.grad);
            // gradients of 1 - r², 1 - s² through the Jacobian of the centre integrate to zero
            for (i, q) in [r, s].into_iter().enumerate() {
                grad[4 + i] = [0, 1].map(|c| -2.0 * q * centre.det / p.det * centre.inverse[c][i]);
            }
            let mut membrane = [[0.0; 12]; 3];
            for (a, [gx, gy]) in grad.into_iter().enumerate() {
                membrane[0][2 * a] = gx;
                membrane[1][2 * a + 1] = gy;
                membrane[2][2 * a] = gy;
                membrane[2][2 * a + 1] = gx;
            }
            add_plane(&mut g.membrane, &membrane, w);
            let mut curvature = [[0.0; 12]; 3];
            let mut spin = [0.0; 12];
            for a in 0..4 {
                let [gx, gy] = p.grad[a];
                // w, theta_x, theta_y: kappa_x = theta_y,x; kappa_y = -theta_x,y; kappa_xy = theta_y,y - theta_x,x
                curvature[0][3 * a + 2] = gx;
                curvature[1][3 * a + 1] = -gy;
                curvature[2][3 * a + 2] = gy;
                curvature[2][3 * a + 1] = -gx;
                // u, v, theta_z: theta_z - (v,x - u,y) / 2
                spin[3 * a] = 0.5 * gy;
                spin[3 * a + 1] = -0.5 * gx;
                spin[3 * a + 2] = p.n[a];
            }
            add_plane(&mut g.bending, &curvature, w);
            g.drilling.add_outer(w, &spin, &spin);
            for row in self.shear_strains(&p, r, s) {
                g.shear.add_outer(w, &row, &row);
            }
        }
        g
    }

    /// Rows gamma_xz and gamma_yz over (w, theta_x, theta_y) with MITC4's tying points at the middles of the edges.
    fn shear_strains(&self, p: &Plane, r: f64, s: f64) -> [[f64; 12]; 2] {
        let covariant = |r: f64, s: f64, axis: usize| {
            let q = Plane::new(&self.xy, r, s);
            let mut row = [0.0; 12];
            for a in 0..4 {
                row[3 * a] = q.parent[a][axis];
                row[3 * a + 1] = -q.jacobian[axis][1] * q.n[a];
                row[3 * a + 2] = q.jacobian[axis][0] * q.n[a];
            }
            row
        };
        let (low, high) = (covariant(0.0, -1.0, 0), covariant(0.0, 1.0, 0));
        let (left, right) = (covariant(-1.0, 0.0, 1), covariant(1.0, 0.0, 1));
        let mut out = [[0.0; 12]; 2];
        for i in 0..12 {
            let gr = 0.5 * ((1.0 - s) * low[i] + (1.0 + s) * high[i]);
            let gs = 0.5 * ((1.0 - r) * left[i] + (1.0 + r) * right[i]);
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

/// Adds the three isotropic parts of `bᵀ D b`: both normal strains, their product, shear.
fn add_plane(parts: &mut [Mat<f64>; 3], b: &[[f64; 12]; 3], w: f64) {
    parts[0].add_outer(w, &b[0], &b[0]);
    parts[0].add_outer(w, &b[1], &b[1]);
    parts[1].add_outer(2.0 * w, &b[0], &b[1]);
    parts[2].add_outer(w, &b[2], &b[2]);
}

/// Plane-stress stiffness with thickness (or inertia) `t`.
fn plane_stress<S: Scalar>(parts: &[Mat<f64>; 3], el: &Elastic<S>, t: S) -> Mat<S> {
    let normal = el.e * t / (S::c(1.0) - el.nu * el.nu);
    let shear = el.e * t / ((S::c(1.0) + el.nu) * 2.0);
    let mut out = Mat::lift(&parts[0]).scaled(normal);
    out.add_scaled(normal * el.nu, &Mat::lift(&parts[1]));
    out.add_scaled(shear, &Mat::lift(&parts[2]));
    out
}

/// Rows of some components of the four nodes in the 24.
fn rows_of(components: &[usize]) -> Vec<usize> {
    (0..4).flat_map(|a| components.iter().map(move |c| 6 * a + c)).collect()
}
