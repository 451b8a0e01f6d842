//! What three- and four-node shells have in common: section, offset, drilling, mass, stress stiffness.
//!
//! The element is flat; a warped quadrilateral is the flat one through its mean plane, joined to the nodes by rigid
//! arms along the normal, and so are ZOFFS and the eccentricity of a laminate. The rotation about the normal is tied to
//! the membrane's by `1e-4 A66 int (theta_z - omega_z)² dA`: enough for a regular stiffness, rigid motion stays free.
//! Consistent mass has the density's second moment as rotary inertia (and the first one of an unsymmetric laminate);
//! lumped mass has neither. Stress stiffness of the membrane forces N: `int grad(u_i)ᵀ N grad(u_i) dA` of all three
//! displacements (Cook et al., Concepts and Applications of FEA, 4th ed. 2002, §18.4).

use super::plane_point::{MAX, PlanePoint};
use super::shell_section::{Resultants, Section, SectionValues};
use super::{Matrices, quad4, tria3};
use crate::mesh::Rotation;
use crate::parameter::Factors;
use crate::scalar::Scalar;
use crate::small::{Mat, inverse_spd, matmul, rigid, rotations};

/// Ratio of the drilling stiffness to A66.
const DRILLING: f64 = 1e-4;

/// Corners in the plane's axes, origin in the middle.
#[derive(Debug, Clone, PartialEq)]
pub enum Corners {
    /// CQUAD4.
    Quad([[f64; 2]; 4]),
    /// CTRIA3.
    Tria([[f64; 2]; 3]),
}

/// A shell.
#[derive(Debug, Clone, PartialEq)]
pub struct ShellElement {
    /// Corners.
    pub corners: Corners,
    /// Axes of the plane.
    pub frame: Rotation,
    /// From each node to its corner of the middle plane, basic coordinates.
    pub arms: Vec<[f64; 3]>,
    /// Section.
    pub section: Section,
    /// Angle of the section's axis from the plane's x, rad.
    pub angle: f64,
    /// Non-structural mass per area.
    pub nsm: f64,
    /// Consistent mass?
    pub coupled_mass: bool,
}

/// Sums of one element before condensation.
struct Sums<S> {
    k: Mat<S>,
    h: Option<Mat<S>>,
}

impl ShellElement {
    fn n(&self) -> usize {
        self.arms.len()
    }

    fn points<S: Scalar>(&self, v: &SectionValues<S>) -> Vec<PlanePoint<S>> {
        match &self.corners {
            Corners::Quad(xy) => quad4::points(xy),
            Corners::Tria(xy) => tria3::points(xy, v),
        }
    }

    /// K, M and the loss matrix in basic axes.
    #[must_use]
    pub fn matrices<S: Scalar>(&self, f: &Factors<S>) -> Matrices<S> {
        let v = self.section.values(f, self.angle);
        let points = self.points(&v);
        let m = 6 * self.n();
        let map = self.map();
        let sums = self.sums(&v, &points);
        let (k, h) = match condense(&sums, m) {
            Some((k, h, _)) => (k, h),
            None => (Mat { rows: m, cols: m, data: vec![S::c(f64::NAN); m * m] }, None),
        };
        Matrices {
            k: Some(k.congruence(&map)),
            m: Some(self.mass(&v, &points).congruence(&map)),
            c: None,
            h: h.map(|h| h.congruence(&map)),
        }
    }

    fn sums<S: Scalar>(&self, v: &SectionValues<S>, points: &[PlanePoint<S>]) -> Sums<S> {
        let m = 6 * self.n();
        let internal = if v.membrane && matches!(self.corners, Corners::Quad(_)) { MAX - m } else { 0 };
        let size = m + internal;
        let area: f64 = points.iter().map(|p| p.w).sum();
        let (stiff, loss) = self.with_shear(v, area);
        let mut sums = Sums { k: Mat::zeros(size, size), h: loss.is_some().then(|| Mat::zeros(size, size)) };
        for p in points {
            add_point(&mut sums.k, &stiff, p);
            self.add_drilling(&mut sums.k, stiff.a[2][2], p);
            if let (Some(h), Some(loss)) = (&mut sums.h, &loss) {
                add_point(h, loss, p);
                self.add_drilling(h, loss.a[2][2], p);
            }
        }
        for a in std::iter::once(&mut sums.k).chain(sums.h.as_mut()) {
            for i in 0..size {
                for j in 0..i {
                    a[(i, j)] = a[(j, i)];
                }
            }
        }
        sums
    }

    /// The section with shear stiffness: none without bending, a penalty where a quadrilateral is rigid in shear.
    fn with_shear<S: Scalar>(
        &self,
        v: &SectionValues<S>,
        area: f64,
    ) -> (Resultants<S>, Option<Resultants<S>>) {
        let (mut k, mut h) = (v.stiffness, v.loss);
        let zero = [[S::zero(); 2]; 2];
        if !v.bending {
            k.s = zero;
            h.iter_mut().for_each(|h| h.s = zero);
        } else if v.rigid_shear {
            // the triangle has no shear strain then
            let penalty = match self.corners {
                Corners::Quad(_) => quad4::RIGID_SHEAR / area,
                Corners::Tria(_) => 0.0,
            };
            for r in std::iter::once(&mut k).chain(h.as_mut()) {
                let s = r.d[0][0] * penalty;
                r.s = [[s, S::zero()], [S::zero(), s]];
            }
        }
        (k, h)
    }

    fn add_drilling<S: Scalar>(&self, k: &mut Mat<S>, a66: S, p: &PlanePoint<S>) {
        let n = self.n();
        let mut rows = [(0, 0.0); 12];
        for a in 0..n {
            let [gx, gy] = p.grad[a];
            // theta_z - (v,x - u,y) / 2
            rows[3 * a] = (6 * a, 0.5 * gy);
            rows[3 * a + 1] = (6 * a + 1, -0.5 * gx);
            rows[3 * a + 2] = (6 * a + 5, p.n[a]);
        }
        let w = a66 * (DRILLING * p.w);
        for &(i, x) in &rows[..3 * n] {
            for &(j, y) in &rows[..3 * n] {
                if j >= i {
                    k[(i, j)] += w * (x * y);
                }
            }
        }
    }

    fn mass<S: Scalar>(&self, v: &SectionValues<S>, points: &[PlanePoint<S>]) -> Mat<S> {
        let n = self.n();
        let per_area = v.mass[0] + S::c(self.nsm);
        let [_, first, second] = v.mass;
        let mut m = Mat::zeros(6 * n, 6 * n);
        for p in points {
            for a in 0..n {
                for b in 0..n {
                    let w = p.w * p.n[a] * p.n[b];
                    if !self.coupled_mass {
                        for c in 0..3 {
                            m[(6 * a + c, 6 * a + c)] += per_area * w;
                        }
                        continue;
                    }
                    for c in 0..5 {
                        m[(6 * a + c, 6 * b + c)] += if c < 3 { per_area * w } else { second * w };
                    }
                    if !first.is_zero() {
                        // u + z theta_y, v - z theta_x
                        for (i, j, sign) in [(0, 4, 1.0), (4, 0, 1.0), (1, 3, -1.0), (3, 1, -1.0)] {
                            m[(6 * a + i, 6 * b + j)] += first * (sign * w);
                        }
                    }
                }
            }
        }
        m
    }

    /// Mass between the corners of one component (n x n), and the map of [`Self::map`].
    pub(crate) fn plane_mass(&self, f: &Factors<f64>) -> (Mat<f64>, Mat<f64>) {
        let v = self.section.values(f, self.angle);
        let full = self.mass(&v, &self.points(&v));
        let n = self.n();
        let mut m = Mat::zeros(n, n);
        for a in 0..n {
            for b in 0..n {
                m[(a, b)] = full[(6 * a, 6 * b)];
            }
        }
        (m, self.map())
    }

    /// Corner displacements in the plane's axes from nodal displacements in basic axes.
    fn map(&self) -> Mat<f64> {
        let turn = rotations(&self.frame, 2);
        let n = 6 * self.n();
        let mut out = Mat::zeros(n, n);
        for (a, arm) in self.arms.iter().enumerate() {
            let part = matmul(&turn, &rigid(*arm));
            for i in 0..6 {
                for j in 0..6 {
                    out[(6 * a + i, 6 * a + j)] = part[(i, j)];
                }
            }
        }
        out
    }

    /// Stress stiffness in basic axes of the membrane forces that nodal displacements `u` (basic axes) make.
    #[must_use]
    pub fn stress_stiffness(&self, f: &Factors<f64>, u: &[f64]) -> Option<Mat<f64>> {
        let v = self.section.values(f, self.angle);
        if !v.membrane {
            return None;
        }
        let points = self.points(&v);
        let (m, map) = (6 * self.n(), self.map());
        let (_, _, internal) = condense(&self.sums(&v, &points), m)?;
        let mut q: Vec<f64> = (0..m).map(|i| (0..m).map(|j| map[(i, j)] * u[j]).sum()).collect();
        let inner: Vec<f64> =
            (0..internal.rows).map(|i| -(0..m).map(|j| internal[(i, j)] * q[j]).sum::<f64>()).collect();
        q.extend(inner);
        let mut k = Mat::zeros(m, m);
        for p in &points {
            let strain: Vec<f64> =
                p.strains[..6].iter().map(|row| row.iter().zip(&q).map(|(x, y)| x * y).sum()).collect();
            let r = &v.stiffness;
            let force: [f64; 3] = std::array::from_fn(|i| {
                (0..3).map(|j| r.a[i][j] * strain[j] + r.b[i][j] * strain[3 + j]).sum()
            });
            for a in 0..self.n() {
                for b in 0..self.n() {
                    let (g, h) = (p.grad[a], p.grad[b]);
                    let value = force[0] * g[0] * h[0]
                        + force[1] * g[1] * h[1]
                        + force[2] * (g[0] * h[1] + g[1] * h[0]);
                    for c in 0..3 {
                        k[(6 * a + c, 6 * b + c)] += p.w * value;
                    }
                }
            }
        }
        Some(k.congruence(&map))
    }
}

/// Adds the upper triangle of one point's `w Bᵀ C B`.
fn add_point<S: Scalar>(k: &mut Mat<S>, r: &Resultants<S>, p: &PlanePoint<S>) {
    let size = k.rows;
    let mut stress = [[S::zero(); MAX]; 8];
    let mut add = |to: usize, from: usize, c: S| {
        if !c.is_zero() {
            for j in 0..size {
                stress[to][j] += c * p.strains[from][j];
            }
        }
    };
    for i in 0..3 {
        for j in 0..3 {
            add(i, j, r.a[i][j]);
            add(i, 3 + j, r.b[i][j]);
            add(3 + i, j, r.b[i][j]);
            add(3 + i, 3 + j, r.d[i][j]);
        }
    }
    for i in 0..2 {
        for j in 0..2 {
            add(6 + i, 6 + j, r.s[i][j]);
        }
    }
    for (strain, stress) in p.strains.iter().zip(&stress) {
        for i in 0..size {
            if strain[i].is_zero() {
                continue;
            }
            let w = strain[i] * p.w;
            for j in i..size {
                k[(i, j)] += w * stress[j];
            }
        }
    }
}

/// Stiffness and loss without the internal coordinates behind `m`, and these per other coordinate (`u_i = -X u`).
///
/// `None` when the internal part is not positive definite.
#[allow(clippy::type_complexity)]
fn condense<S: Scalar>(sums: &Sums<S>, m: usize) -> Option<(Mat<S>, Option<Mat<S>>, Mat<S>)> {
    let n = sums.k.rows - m;
    let part = |a: &Mat<S>, r0: usize, rows: usize, c0: usize, cols: usize| {
        let mut out = Mat::zeros(rows, cols);
        for i in 0..rows {
            for j in 0..cols {
                out[(i, j)] = a[(r0 + i, c0 + j)];
            }
        }
        out
    };
    if n == 0 {
        return Some((sums.k.clone(), sums.h.clone(), Mat::zeros(0, m)));
    }
    let inverse = inverse_spd(&part(&sums.k, m, n, m, n))?;
    let mut x = Mat::zeros(n, m);
    for i in 0..n {
        for k in 0..n {
            for j in 0..m {
                x[(i, j)] += inverse[(i, k)] * sums.k[(m + k, j)];
            }
        }
    }
    // K_ir = K_ii X, so K_rr - X' K_ir; of another matrix H_rr - X' (H_ir - H_ii X) - H_ri X
    let reduce = |a: &Mat<S>, own: bool| {
        let mut out = part(a, 0, m, 0, m);
        let mut y = part(a, m, n, 0, m);
        if !own {
            for p in 0..n {
                for q in 0..n {
                    for j in 0..m {
                        y[(p, j)] = y[(p, j)] - a[(m + p, m + q)] * x[(q, j)];
                    }
                }
            }
        }
        for i in 0..m {
            for j in i..m {
                let mut sum = S::zero();
                for p in 0..n {
                    sum += x[(p, i)] * y[(p, j)];
                    if !own {
                        sum += a[(m + p, i)] * x[(p, j)];
                    }
                }
                out[(i, j)] = out[(i, j)] - sum;
                out[(j, i)] = out[(i, j)];
            }
        }
        out
    };
    let (k, h) = (reduce(&sums.k, true), sums.h.as_ref().map(|h| reduce(h, false)));
    Some((k, h, x))
}
