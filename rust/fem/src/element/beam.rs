//! Timoshenko beam (CBAR, CBEAM): shear by K1/K2, product of inertia, linear taper, offsets, releases, neutral axis and
//! non-structural mass off the shear centre.
//!
//! The ends are at the shear centre: it carries shear and torsion, while axial force and bending act at the neutral axis
//! (y_n, z_n), whose axial motion is `u + z_n theta_y - y_n theta_z`; structural mass moves with the neutral axis.
//! Stiffness from the flexibility of the cantilever held at end A, which is exact for a prismatic beam and takes
//! taper by quadrature (Przemieniecki, Theory of Matrix Structural Analysis, 1968, §5.6 and §6.9).
//! Consistent mass with the Timoshenko shape functions of the mean section (Friedman and Kosmatka, Computers &
//! Structures 47 (1993) 473, eqs 14-16) and with rotary inertia rho I of the section and rho (I1 + I2) about the
//! axis. Lumped mass: half the mass in each end's translations and half of rho (I1 + I2) L about the axis; no rotary inertia of bending. Non-structural mass has no rotary inertia.

use super::{Matrices, lossy};
use crate::error::FemError;
use crate::mesh::{BeamSection, Components, Material, Rotation};
use crate::parameter::{Elastic, Factors, Quantity};
use crate::scalar::Scalar;
use crate::small::{Mat, inverse_spd, matmul, rigid};

/// Gauss points and weights on [0, 1], exact to degree 7: products of two cubics and a linear taper.
pub(crate) const GAUSS4: [(f64, f64); 4] = [
    (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
    (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
];

/// A beam between two offset ends.
#[derive(Debug, Clone, PartialEq)]
pub struct BeamElement {
    /// Material.
    pub material: Material,
    /// Sections at both ends.
    pub sections: [BeamSection; 2],
    /// Shear factors; 0 = rigid in shear.
    pub shear: [f64; 2],
    /// Length between the offset ends.
    pub length: f64,
    /// Local axes.
    pub frame: Rotation,
    /// Local end displacements (12) from nodal displacements in basic axes (12): offsets, then rotation.
    pub map: Mat<f64>,
    /// Released components at the ends.
    pub pins: [Components; 2],
    /// Consistent mass?
    pub coupled_mass: bool,
}

/// Section at one station with factors.
pub(crate) struct Station<S> {
    pub(crate) a: S,
    pub(crate) i1: S,
    pub(crate) i2: S,
    i12: S,
    j: S,
    pub(crate) nsm: f64,
    pub(crate) neutral_axis: [f64; 2],
    pub(crate) nsm_offset: [f64; 2],
}

/// Displacements of end B of a cantilever held at A, per force there.
struct Flexibility<S> {
    axial: S,
    twist: S,
    /// Over Fy, Mz, Fz, -My: both planes alike (4 x 4).
    bend: Mat<S>,
}

impl BeamElement {
    /// Checks what evaluation relies on: positive sections, invertible bending, releases that leave no mechanism.
    ///
    /// # Errors
    /// The reason as text.
    pub fn check(&self) -> Result<(), String> {
        for s in &self.sections {
            let negative = [("A", s.a), ("I1", s.i1), ("I2", s.i2), ("J", s.j)]
                .into_iter()
                .find(|(_, v)| v.is_nan() || *v < 0.0);
            if let Some((name, value)) = negative {
                return Err(format!("{name} = {value} is negative or not a number; correct the property"));
            }
            if s.i12 != 0.0 && s.i12 * s.i12 >= s.i1 * s.i2 {
                return Err(format!("I12 = {} is too large: I1 I2 - I12² must be positive", s.i12));
            }
        }
        let [a, b] = &self.sections;
        for (name, va, vb) in [("A", a.a, b.a), ("I1", a.i1, b.i1), ("I2", a.i2, b.i2), ("J", a.j, b.j)] {
            if (va == 0.0) != (vb == 0.0) {
                return Err(format!("{name} is zero at one end only; give it at both or none"));
            }
        }
        if self.released(self.stiffness(&Factors::<f64>::ones())).is_none() {
            return Err("its pin flags leave a part of it that can move freely; release less".to_owned());
        }
        Ok(())
    }

    /// K, M and the loss matrix in basic axes.
    #[must_use]
    pub fn matrices<S: Scalar>(&self, f: &Factors<S>) -> Matrices<S> {
        let k_local = self.stiffness(f);
        let m_local = self.mass(f);
        let (k_local, t) = match self.released(k_local) {
            Some(pair) => pair,
            None => (not_finite(12), None),
        };
        let m_local = match t {
            Some(t) => congruence_full(&m_local, &t),
            None => m_local,
        };
        let k = k_local.congruence(&self.map);
        let h = lossy(&k, f.elastic(0, &self.material).eta);
        Matrices { h, k: Some(k), m: Some(m_local.congruence(&self.map)), c: None }
    }

    pub(crate) fn station<S: Scalar>(&self, f: &Factors<S>, x: f64) -> Station<S> {
        let [a, b] = &self.sections;
        let mix = |p: f64, q: f64| p + x * (q - p);
        Station {
            a: f.of(Quantity::A) * mix(a.a, b.a),
            i1: f.of(Quantity::I1) * mix(a.i1, b.i1),
            i2: f.of(Quantity::I2) * mix(a.i2, b.i2),
            i12: S::c(mix(a.i12, b.i12)),
            j: f.of(Quantity::J) * mix(a.j, b.j),
            nsm: mix(a.nsm, b.nsm),
            neutral_axis: [0, 1].map(|c| mix(a.neutral_axis[c], b.neutral_axis[c])),
            nsm_offset: [0, 1].map(|c| mix(a.nsm_offset[c], b.nsm_offset[c])),
        }
    }

    /// 12 x 12 stiffness in local axes, no releases.
    pub(crate) fn stiffness<S: Scalar>(&self, f: &Factors<S>) -> Mat<S> {
        let k_bb = self.stiffness_at_b(f);
        // deformation = u_B - H u_A
        let h = rigid([self.length, 0.0, 0.0]);
        let mut t = Mat::zeros(6, 12);
        for i in 0..6 {
            for j in 0..6 {
                t[(i, j)] = -h[(i, j)];
            }
            t[(i, 6 + i)] = 1.0;
        }
        if self.sections.iter().all(|s| s.neutral_axis == [0.0; 2]) {
            return k_bb.congruence(&t);
        }
        k_bb.congruence(&matmul(&t, &self.neutral()))
    }

    /// Ends' motion with the axial one at the neutral axis, from that at the shear centre (12 x 12).
    fn neutral(&self) -> Mat<f64> {
        let mut out = Mat::zeros(12, 12);
        for i in 0..12 {
            out[(i, i)] = 1.0;
        }
        for (end, section) in self.sections.iter().enumerate() {
            let [y, z] = section.neutral_axis;
            out[(6 * end, 6 * end + 4)] = z;
            out[(6 * end, 6 * end + 5)] = -y;
        }
        out
    }

    /// 6 x 6 stiffness at end B of the cantilever held at A: inverse of its flexibility, mode by mode.
    fn stiffness_at_b<S: Scalar>(&self, f: &Factors<S>) -> Mat<S> {
        let el = f.elastic(0, &self.material);
        let coupled = self.sections.iter().any(|s| s.i12 != 0.0);
        let Flexibility { axial, twist, bend } = self.flexibility(f, &el, coupled);
        let section = &self.sections[0];
        let mut k = Mat::zeros(6, 6);
        if section.a > 0.0 {
            k[(0, 0)] = S::c(1.0) / axial;
        }
        if section.j > 0.0 && el.g.value() > 0.0 {
            k[(3, 3)] = S::c(1.0) / twist;
        }
        // rows of the bending block in the 6-vector, with the sign of -My
        let place = [(1, 1.0), (5, 1.0), (2, 1.0), (4, -1.0)];
        let mut put = |rows: &[usize]| {
            let inverse = inverse_spd(&bend.principal(rows)).unwrap_or_else(|| not_finite(rows.len()));
            for (i, &a) in rows.iter().enumerate() {
                for (j, &b) in rows.iter().enumerate() {
                    k[(place[a].0, place[b].0)] = inverse[(i, j)] * (place[a].1 * place[b].1);
                }
            }
        };
        if coupled {
            put(&[0, 1, 2, 3]);
        } else {
            let bends = [section.i1 > 0.0, section.i2 > 0.0];
            for p in (0..2).filter(|&p| bends[p]) {
                put(&[2 * p, 2 * p + 1]);
            }
        }
        k
    }

    /// Displacements of end B per force there, end A held; `coupled`: a product of inertia couples the planes.
    fn flexibility<S: Scalar>(&self, f: &Factors<S>, el: &Elastic<S>, coupled: bool) -> Flexibility<S> {
        let (mut axial, mut twist) = (S::zero(), S::zero());
        let mut bend = Mat::zeros(4, 4);
        for (x, w) in GAUSS4 {
            let s = self.station(f, x);
            let wl = S::c(w * self.length);
            axial += wl / (el.e * s.a);
            twist += wl / (el.g * s.j);
            let curvature = bending_flexibility(&s, el.e, coupled);
            // moment at the station per force and per moment at end B
            let moments = [self.length * (1.0 - x), 1.0];
            for p in 0..2 {
                for q in 0..2 {
                    let c = wl * curvature[p][q];
                    for (i, a) in moments.into_iter().enumerate() {
                        for (j, b) in moments.into_iter().enumerate() {
                            bend[(2 * p + i, 2 * q + j)] += c * (a * b);
                        }
                    }
                }
            }
            for p in 0..2 {
                if self.shear[p] > 0.0 && el.g.value() > 0.0 && s.a.value() > 0.0 {
                    bend[(2 * p, 2 * p)] += wl / (el.g * s.a * self.shear[p]);
                }
            }
        }
        Flexibility { axial, twist, bend }
    }

    /// Condenses released components; returns the stiffness and the map from kept to all components.
    pub(crate) fn released<S: Scalar>(&self, k: Mat<S>) -> Option<(Mat<S>, Option<Mat<S>>)> {
        let pinned: Vec<usize> = (0..12).filter(|&i| self.pins[i / 6].contains((i % 6) as u8 + 1)).collect();
        if pinned.is_empty() {
            return Some((k, None));
        }
        // a component without stiffness of its own (say J = 0) is free already
        let stiff: Vec<usize> = pinned.iter().copied().filter(|&i| k[(i, i)].value() > 0.0).collect();
        let inverse = inverse_spd(&k.principal(&stiff))?;
        let mut t = Mat::zeros(12, 12);
        for i in (0..12).filter(|i| !pinned.contains(i)) {
            t[(i, i)] = S::c(1.0);
            for (r, &p) in stiff.iter().enumerate() {
                for (s, &q) in stiff.iter().enumerate() {
                    t[(p, i)] = t[(p, i)] - inverse[(r, s)] * k[(q, i)];
                }
            }
        }
        Some((congruence_full(&k, &t), Some(t)))
    }

    /// 12 x 12 mass in local axes, no releases.
    fn mass<S: Scalar>(&self, f: &Factors<S>) -> Mat<S> {
        let el = f.elastic(0, &self.material);
        let l = self.length;
        let mut m = Mat::zeros(12, 12);
        let mean = self.station(f, 0.5);
        let phi = self.shear_ratios(&mean, el.e, el.g);
        for (x, w) in GAUSS4 {
            let s = self.station(f, x);
            let wl = S::c(w * l);
            let lines = [(el.rho * s.a * wl, s.neutral_axis), (S::c(s.nsm) * wl, s.nsm_offset)];
            let polar = el.rho * (s.i1 + s.i2) * wl;
            if !self.coupled_mass {
                for end in 0..2 {
                    let share = if end == 0 { 1.0 - x } else { x };
                    for (wm, [y, z]) in lines {
                        add_lump(&mut m, 6 * end, wm * share, rigid([0.0, y, z]));
                    }
                    m[(6 * end + 3, 6 * end + 3)] += polar * share;
                }
                continue;
            }
            let mut axial = [S::zero(); 12];
            let mut twist = [S::zero(); 12];
            (axial[0], axial[6]) = (S::c(1.0 - x), S::c(x));
            (twist[3], twist[9]) = (S::c(1.0 - x), S::c(x));
            let (v, dv) = shapes(x, l, phi[0], [1, 5, 7, 11], 1.0);
            let (u, du) = shapes(x, l, phi[1], [2, 4, 8, 10], -1.0);
            for (wm, at) in lines {
                for row in carried(at, [axial, v, u], twist, [dv, du]) {
                    m.add_outer(wm, &row, &row);
                }
            }
            m.add_outer(polar, &twist, &twist);
            m.add_outer(el.rho * s.i1 * wl, &dv, &dv);
            m.add_outer(el.rho * s.i2 * wl, &du, &du);
            if !s.i12.is_zero() {
                m.add_outer(el.rho * s.i12 * wl * 2.0, &dv, &du);
            }
        }
        m
    }

    /// Ratios Phi = 12 E I / (k G A L²) of both planes.
    pub(crate) fn shear_ratios<S: Scalar>(&self, s: &Station<S>, e: S, g: S) -> [S; 2] {
        let ratio = |i: S, k: f64| {
            if k > 0.0 && g.value() > 0.0 && s.a.value() > 0.0 {
                e * i * 12.0 / (g * s.a * (k * self.length * self.length))
            } else {
                S::zero()
            }
        };
        [ratio(s.i1, self.shear[0]), ratio(s.i2, self.shear[1])]
    }
}

/// Adds a mass whose arm from the end is in `arm` (rigid-motion matrix).
fn add_lump<S: Scalar>(m: &mut Mat<S>, at: usize, mass: S, arm: Mat<f64>) {
    for i in 0..6 {
        for j in 0..6 {
            let w: f64 = (0..3).map(|c| arm[(c, i)] * arm[(c, j)]).sum();
            if w != 0.0 {
                m[(at + i, at + j)] += mass * w;
            }
        }
    }
}

/// Displacements (u, v, w) of a line at (y, z) from those of the axis, its twist and the rotations of its sections.
pub(crate) fn carried<S: Scalar>(
    [y, z]: [f64; 2],
    mut rows: [[S; 12]; 3],
    twist: [S; 12],
    [dv, dw]: [[S; 12]; 2],
) -> [[S; 12]; 3] {
    if [y, z] != [0.0; 2] {
        for i in 0..12 {
            rows[0][i] = rows[0][i] - dv[i] * y - dw[i] * z;
            rows[1][i] = rows[1][i] - twist[i] * z;
            rows[2][i] += twist[i] * y;
        }
    }
    rows
}

/// Curvature per moment of both planes, with the product of inertia.
fn bending_flexibility<S: Scalar>(s: &Station<S>, e: S, coupled: bool) -> [[S; 2]; 2] {
    if coupled {
        let det = e * (s.i1 * s.i2 - s.i12 * s.i12);
        return [[s.i2 / det, -s.i12 / det], [-s.i12 / det, s.i1 / det]];
    }
    let inverse = |i: S| if i.value() > 0.0 { S::c(1.0) / (e * i) } else { S::zero() };
    [[inverse(s.i1), S::zero()], [S::zero(), inverse(s.i2)]]
}

/// Deflection and section rotation (deflection's sense) at `x` in [0, 1] from the four end components at `rows`;
/// `sign` is that of the rotation component relative to the slope.
pub(crate) fn shapes<S: Scalar>(x: f64, l: f64, phi: S, rows: [usize; 4], sign: f64) -> ([S; 12], [S; 12]) {
    let mu = S::c(1.0) / (S::c(1.0) + phi);
    let (x2, x3) = (x * x, x * x * x);
    let c = |v: f64| S::c(v);
    let n = [
        c(1.0 - 3.0 * x2 + 2.0 * x3) + phi * (1.0 - x),
        (c(x - 2.0 * x2 + x3) + phi * (0.5 * (x - x2))) * (l * sign),
        c(3.0 * x2 - 2.0 * x3) + phi * x,
        (c(x3 - x2) - phi * (0.5 * (x - x2))) * (l * sign),
    ];
    let d = [
        c(6.0 / l * (x2 - x)),
        (c(1.0 - 4.0 * x + 3.0 * x2) + phi * (1.0 - x)) * sign,
        c(6.0 / l * (x - x2)),
        (c(3.0 * x2 - 2.0 * x) + phi * x) * sign,
    ];
    let (mut deflection, mut rotation) = ([S::zero(); 12], [S::zero(); 12]);
    for i in 0..4 {
        deflection[rows[i]] = mu * n[i];
        rotation[rows[i]] = mu * d[i];
    }
    (deflection, rotation)
}

/// `tᵀ A t` with a `t` that depends on the parameters.
pub(crate) fn congruence_full<S: Scalar>(a: &Mat<S>, t: &Mat<S>) -> Mat<S> {
    let n = a.rows;
    let product = |p: &dyn Fn(usize, usize) -> S, q: &Mat<S>| {
        let mut out = Mat::zeros(n, n);
        for i in 0..n {
            for k in 0..n {
                let w = p(i, k);
                if w.is_zero() {
                    continue;
                }
                for j in 0..n {
                    out[(i, j)] += w * q[(k, j)];
                }
            }
        }
        out
    };
    let at = product(&|i, k| a[(i, k)], t);
    product(&|i, k| t[(k, i)], &at)
}

/// Stands for a matrix that does not exist with the given factors; assembly reports it with the element's id.
fn not_finite<S: Scalar>(n: usize) -> Mat<S> {
    Mat { rows: n, cols: n, data: vec![S::c(f64::NAN); n * n] }
}

/// Error of beam `id` from a reason.
#[must_use]
pub fn beam_error(card: &str, id: u32, why: String) -> FemError {
    FemError::Element { what: card.to_owned(), id, why }
}
