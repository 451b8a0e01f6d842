//! Forces of a spinning part that are linear in its vibration: gyroscopic matrix per rad/s and softening per (rad/s)².
//!
//! Rotating axes: a point of mass m at displacement u has `m (u'' + 2 W x u' + W x (W x u))`; a rigid inertia J whose
//! principal axis is the spin axis a has `W (J A + A J - [J a]x)` and `W² (A J A - [J a]x A)` on its small rotations,
//! A = [a]x, from Euler's equations. Fixed axes: a symmetric part has `-W Jp [a]x` alone, Jp its polar inertia
//! (Genta, Dynamics of Rotating Systems 2005, §2.5 and §4.4).

use super::beam::{BeamElement, GAUSS4, carried, congruence_full, shapes};
use super::mass::MassElement;
use super::shell::ShellElement;
use super::{Data, Element};
use crate::mesh::{MassKind, Rotation};
use crate::parameter::Factors;
use crate::small::{Mat, cross3, dot3, norm3, rigid};

/// Axes in which vibration is described.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SpinAxes {
    /// Axes at rest; the part must be symmetric about the spin axis.
    Fixed,
    /// Axes that turn with the part.
    Rotating,
}

/// Gyroscopic (antisymmetric) and softening (symmetric) matrix of an element.
pub type SpinMatrices = (Mat<f64>, Mat<f64>);

/// `[a]x`: `[a]x b = a x b`.
fn skew(a: [f64; 3]) -> Rotation {
    [[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]]
}

fn product(a: &Rotation, b: &Rotation) -> Rotation {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

fn combine(parts: &[(f64, Rotation)]) -> Rotation {
    std::array::from_fn(|i| std::array::from_fn(|j| parts.iter().map(|(w, m)| w * m[i][j]).sum()))
}

fn apply(a: &Rotation, v: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| dot3(a[i], v))
}

/// Gyroscopic and softening blocks of the rotations of an inertia tensor.
fn inertia_blocks(j: &Rotation, a: [f64; 3], axes: SpinAxes) -> (Rotation, Rotation) {
    let s = skew(a);
    if axes == SpinAxes::Fixed {
        let polar = dot3(a, apply(j, a));
        return (combine(&[(-polar, s)]), [[0.0; 3]; 3]);
    }
    let h = skew(apply(j, a));
    let g = combine(&[(1.0, product(j, &s)), (1.0, product(&s, j)), (-1.0, h)]);
    let k = combine(&[(1.0, product(&s, &product(j, &s))), (-1.0, product(&h, &s))]);
    (g, k)
}

impl Element {
    /// Matrices of this element spinning about the direction `a` (unit vector), in basic axes; `None` when it has none.
    ///
    /// # Errors
    /// The reason as text: a part that cannot be described in fixed axes.
    pub fn spin(
        &self,
        f: &Factors<f64>,
        a: [f64; 3],
        axes: SpinAxes,
    ) -> Result<Option<SpinMatrices>, String> {
        match &self.data {
            Data::Scalar(_) | Data::Bush(_) | Data::Direct(_) => Ok(None),
            Data::Mass(e) => Ok(e.spin(f, a, axes)),
            Data::Beam(e) => e.spin(f, a, axes),
            Data::Rod(_) if axes == SpinAxes::Fixed => Ok(None),
            Data::Shell(_) | Data::Solid(_) if axes == SpinAxes::Fixed => Err(
                "has no gyroscopic matrix in fixed axes; use rotating axes, or beams and concentrated masses"
                    .to_owned(),
            ),
            Data::Shell(e) => Ok(Some(e.spin(f, a))),
            Data::Rod(_) | Data::Solid(_) => {
                Ok(self.matrices(f).m.map(|m| of_points(&m, a, self.rows.len())))
            }
        }
    }
}

/// Matrices of a mass matrix that is a number times the unit matrix between the translations of every two nodes.
fn of_points(m: &Mat<f64>, a: [f64; 3], n: usize) -> SpinMatrices {
    let width = if n.is_multiple_of(6) && m[(3, 3)] == 0.0 { 6 } else { 3 };
    let (s, s2) = (skew(a), product(&skew(a), &skew(a)));
    let (mut g, mut k) = (Mat::zeros(n, n), Mat::zeros(n, n));
    for p in (0..n).step_by(width) {
        for q in (0..n).step_by(width) {
            add_block(&mut g, p, q, 2.0 * m[(p, q)], &s);
            add_block(&mut k, p, q, m[(p, q)], &s2);
        }
    }
    (g, k)
}

fn add_block(out: &mut Mat<f64>, p: usize, q: usize, w: f64, block: &Rotation) {
    for i in 0..3 {
        for j in 0..3 {
            out[(p + i, q + j)] += w * block[i][j];
        }
    }
}

impl MassElement {
    fn spin(&self, f: &Factors<f64>, a: [f64; 3], axes: SpinAxes) -> Option<SpinMatrices> {
        let m = self.matrices(f).m?;
        let n = self.width;
        let (mut g, mut k) = (Mat::zeros(n, n), Mat::zeros(n, n));
        let s = skew(a);
        if let MassKind::Conm2 { offset, inertia, .. } = &self.kind {
            if axes == SpinAxes::Rotating {
                add_block(&mut g, 0, 0, 2.0 * m[(0, 0)], &s);
                add_block(&mut k, 0, 0, m[(0, 0)], &product(&s, &s));
            }
            if n == 3 {
                return Some((g, k));
            }
            let (gj, kj) = inertia_blocks(inertia, a, axes);
            add_block(&mut g, 3, 3, 1.0, &gj);
            add_block(&mut k, 3, 3, 1.0, &kj);
            let arm = rigid(*offset);
            return Some((g.congruence(&arm), k.congruence(&arm)));
        }
        let block = |first: usize| -> Rotation {
            std::array::from_fn(|i| std::array::from_fn(|j| m[(first + i, first + j)]))
        };
        if axes == SpinAxes::Rotating {
            let t = block(0);
            add_block(&mut g, 0, 0, 1.0, &combine(&[(1.0, product(&t, &s)), (1.0, product(&s, &t))]));
            add_block(&mut k, 0, 0, 1.0, &product(&s, &product(&t, &s)));
        }
        let (gj, kj) = inertia_blocks(&block(3), a, axes);
        add_block(&mut g, 3, 3, 1.0, &gj);
        add_block(&mut k, 3, 3, 1.0, &kj);
        Some((g, k))
    }
}

impl ShellElement {
    /// Middle plane only: rotary inertia is left out.
    fn spin(&self, f: &Factors<f64>, a: [f64; 3]) -> SpinMatrices {
        let (m, map) = self.plane_mass(f);
        let local = apply(&self.frame, a);
        let (s, s2) = (skew(local), product(&skew(local), &skew(local)));
        let n = 6 * m.rows;
        let (mut g, mut k) = (Mat::zeros(n, n), Mat::zeros(n, n));
        for p in 0..m.rows {
            for q in 0..m.rows {
                add_block(&mut g, 6 * p, 6 * q, 2.0 * m[(p, q)], &s);
                add_block(&mut k, 6 * p, 6 * q, m[(p, q)], &s2);
            }
        }
        (g.congruence(&map), k.congruence(&map))
    }
}

type Rows = [[f64; 12]; 3];

/// Adds `w Rᵀ B R` for three rows R.
fn add_rows(out: &mut Mat<f64>, w: f64, rows: &Rows, block: &Rotation) {
    for i in 0..3 {
        for j in 0..3 {
            let value = w * block[i][j];
            if value == 0.0 {
                continue;
            }
            for p in 0..12 {
                for q in 0..12 {
                    out[(p, q)] += value * rows[i][p] * rows[j][q];
                }
            }
        }
    }
}

impl BeamElement {
    /// With the shape functions of the consistent mass, also where the model lumps it.
    fn spin(&self, f: &Factors<f64>, a: [f64; 3], axes: SpinAxes) -> Result<Option<SpinMatrices>, String> {
        let local = apply(&self.frame, a);
        let parallel = norm3(cross3(local, [1.0, 0.0, 0.0])) < 1e-3;
        if axes == SpinAxes::Fixed && !parallel {
            return Err("is not parallel to the spin axis; use rotating axes".to_owned());
        }
        let el = f.elastic(0, &self.material);
        let l = self.length;
        let phi = self.shear_ratios(&self.station(f, 0.5), el.e, el.g);
        let (s, s2) = (skew(local), product(&skew(local), &skew(local)));
        let (mut g, mut k) = (Mat::zeros(12, 12), Mat::zeros(12, 12));
        for (x, w) in GAUSS4 {
            let section = self.station(f, x);
            let (mut axial, mut twist) = ([0.0; 12], [0.0; 12]);
            (axial[0], axial[6]) = (1.0 - x, x);
            (twist[3], twist[9]) = (1.0 - x, x);
            let (v, dv) = shapes(x, l, phi[0], [1, 5, 7, 11], 1.0);
            let (u, du) = shapes(x, l, phi[1], [2, 4, 8, 10], -1.0);
            if axes == SpinAxes::Rotating {
                let lines = [(el.rho * section.a, section.neutral_axis), (section.nsm, section.nsm_offset)];
                for (line, at) in lines {
                    let rows = carried(at, [axial, v, u], twist, [dv, du]);
                    add_rows(&mut g, 2.0 * line * w * l, &rows, &s);
                    add_rows(&mut k, line * w * l, &rows, &s2);
                }
            }
            if parallel {
                let [i1, i2] = [section.i1, section.i2].map(|i| el.rho * i * w * l);
                let inertia = [[i1 + i2, 0.0, 0.0], [0.0, i2, 0.0], [0.0, 0.0, i1]];
                let (gj, kj) = inertia_blocks(&inertia, local, axes);
                let rotations = [twist, du.map(|x| -x), dv];
                add_rows(&mut g, 1.0, &rotations, &gj);
                add_rows(&mut k, 1.0, &rotations, &kj);
            }
        }
        if let Some((_, Some(t))) = self.released(self.stiffness(f)) {
            (g, k) = (congruence_full(&g, &t), congruence_full(&k, &t));
        }
        Ok(Some((g.congruence(&self.map), k.congruence(&self.map))))
    }
}
