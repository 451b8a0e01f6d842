//! Sections of shells: PSHELL with its four materials, PCOMP with its plies.
//!
//! Membrane forces N and moments M per length follow from membrane strains and curvatures (classical lamination theory:
//! Jones, Mechanics of Composite Materials, 2nd ed. 1999, eqs 4.22-4.24): `N = A eps + B kappa`, `M = B eps + D kappa`
//! with strain `eps + z kappa`. MID4 is written for curvatures of the other sign: `B = -T² G4`. Transverse shear of a
//! laminate from the energy of the shear stresses that balance the bending stresses of each direction (Whitney,
//! J. Appl. Mech. 40 (1973) 302): 5/6 G t for one ply.

use super::plane_law::{Plane, Shear, ShellMaterial, turned, turned_shear};
use super::quadrature::gauss;
use crate::mesh::LaminateParts;
use crate::parameter::{Factors, Quantity};
use crate::scalar::Scalar;

/// One ply; its material by slot.
#[derive(Debug, Clone, PartialEq)]
pub struct SectionPly {
    /// Index of its material.
    pub slot: usize,
    /// Thickness.
    pub t: f64,
    /// Angle from the section's axis, rad.
    pub angle: f64,
}

/// What a shell is made of, through its thickness.
#[derive(Debug, Clone, PartialEq)]
pub enum Section {
    /// PSHELL.
    Homogeneous {
        /// Thickness.
        t: f64,
        /// Membrane, bending, shear and coupling material.
        materials: Box<[Option<ShellMaterial>; 4]>,
        /// 12 I / T³.
        bending_ratio: f64,
        /// TS / T.
        shear_ratio: f64,
    },
    /// PCOMP.
    Laminate {
        /// Distinct materials, by slot.
        materials: Vec<ShellMaterial>,
        /// Plies, bottom first.
        plies: Vec<SectionPly>,
        /// Loss factor of the whole; `None` = the materials'.
        ge: Option<f64>,
        /// Parts of the stiffness.
        parts: LaminateParts,
    },
}

/// Stiffness per length of the middle plane in the element's axes.
#[derive(Debug, Clone, Copy)]
pub struct Resultants<S> {
    /// Membrane.
    pub a: Plane<S>,
    /// Coupling.
    pub b: Plane<S>,
    /// Bending.
    pub d: Plane<S>,
    /// Transverse shear; without meaning when the section is rigid in shear.
    pub s: Shear<S>,
}

impl<S: Scalar> Resultants<S> {
    fn zero() -> Self {
        let z = S::zero();
        Self { a: [[z; 3]; 3], b: [[z; 3]; 3], d: [[z; 3]; 3], s: [[z; 2]; 2] }
    }

    fn scaled(&self, w: S) -> Self {
        let by = |m: &Plane<S>| m.map(|row| row.map(|x| w * x));
        Self { a: by(&self.a), b: by(&self.b), d: by(&self.d), s: self.s.map(|row| row.map(|x| w * x)) }
    }

    /// In axes from which these are turned by `angle` (rad).
    fn turned(&self, angle: f64) -> Self {
        Self {
            a: turned(&self.a, angle),
            b: turned(&self.b, angle),
            d: turned(&self.d, angle),
            s: turned_shear(&self.s, angle),
        }
    }

    /// Adds `w q` to the membrane part (`power` 0 of z), the coupling (1) or the bending part (2).
    fn add(&mut self, power: usize, w: S, q: &Plane<S>) {
        let part = match power {
            0 => &mut self.a,
            1 => &mut self.b,
            _ => &mut self.d,
        };
        for i in 0..3 {
            for j in 0..3 {
                part[i][j] += w * q[i][j];
            }
        }
    }

    /// Bending stiffness along (c, s) while the membrane is free of force in that direction.
    #[must_use]
    pub fn bending_along(&self, c: f64, s: f64) -> S {
        let v = [c * c, s * s, 2.0 * c * s];
        let form = |m: &Plane<S>| {
            let mut sum = S::zero();
            for i in 0..3 {
                for j in 0..3 {
                    sum += m[i][j] * (v[i] * v[j]);
                }
            }
            sum
        };
        let (a, b, d) = (form(&self.a), form(&self.b), form(&self.d));
        if a.value() > 0.0 { d - b * b / a } else { d }
    }

    /// Transverse shear stiffness along (c, s).
    #[must_use]
    pub fn shear_along(&self, c: f64, s: f64) -> S {
        self.s[0][0] * (c * c) + self.s[1][1] * (s * s) + self.s[0][1] * (2.0 * c * s)
    }
}

/// Values of a section with factors.
#[derive(Debug, Clone)]
pub struct SectionValues<S> {
    /// Stiffness.
    pub stiffness: Resultants<S>,
    /// Loss factor times stiffness, part by part; `None` = no loss.
    pub loss: Option<Resultants<S>>,
    /// Has it membrane stiffness?
    pub membrane: bool,
    /// Has it bending stiffness?
    pub bending: bool,
    /// Is it rigid in transverse shear?
    pub rigid_shear: bool,
    /// Moments of the density over the thickness: mass per area, first and second moment.
    pub mass: [S; 3],
}

impl Section {
    /// Thickness of the deck.
    #[must_use]
    pub fn thickness(&self) -> f64 {
        match self {
            Self::Homogeneous { t, .. } => *t,
            Self::Laminate { plies, .. } => plies.iter().map(|p| p.t).sum(),
        }
    }

    /// Values with factors, in axes from which the section's own are turned by `angle` (rad).
    #[must_use]
    pub fn values<S: Scalar>(&self, f: &Factors<S>, angle: f64) -> SectionValues<S> {
        match self {
            Self::Homogeneous { t, materials, bending_ratio, shear_ratio } => {
                homogeneous(f, angle, f.of(Quantity::T) * *t, materials, [*bending_ratio, *shear_ratio])
            }
            Self::Laminate { materials, plies, ge, parts } => {
                let mut out = laminate(f, angle, materials, plies);
                if let Some(ge) = ge {
                    let eta = f.of(Quantity::Eta) * *ge;
                    out.loss = (!eta.is_zero()).then(|| out.stiffness.scaled(eta));
                }
                restrict(&mut out, *parts);
                out
            }
        }
    }
}

fn restrict<S: Scalar>(v: &mut SectionValues<S>, parts: LaminateParts) {
    let none = [[S::zero(); 3]; 3];
    for r in std::iter::once(&mut v.stiffness).chain(v.loss.as_mut()) {
        if parts != LaminateParts::All {
            r.b = none;
        }
        match parts {
            LaminateParts::All => {}
            LaminateParts::Membrane => r.d = none,
            LaminateParts::Bending => r.a = none,
        }
    }
    v.membrane = parts != LaminateParts::Bending;
    v.bending = parts != LaminateParts::Membrane;
}

fn homogeneous<S: Scalar>(
    f: &Factors<S>,
    angle: f64,
    t: S,
    materials: &[Option<ShellMaterial>; 4],
    [bending_ratio, shear_ratio]: [f64; 2],
) -> SectionValues<S> {
    let of = |i: usize| materials[i].as_ref().map(|m| m.values(f, i));
    let [membrane, bending, shear, coupling] = [of(0), of(1), of(2), of(3)];
    let mut k = Resultants::zero();
    let mut h = Resultants::zero();
    let mut lossy = false;
    let mut put = |part: fn(&mut Resultants<S>) -> &mut Plane<S>, q: &Plane<S>, w: S, eta: S| {
        let q = turned(q, angle);
        *part(&mut k) = q.map(|row| row.map(|x| w * x));
        *part(&mut h) = q.map(|row| row.map(|x| w * x * eta));
        lossy |= !eta.is_zero();
    };
    if let Some(v) = &membrane {
        put(|r| &mut r.a, &v.q, t, v.eta);
    }
    if let Some(v) = &bending {
        put(|r| &mut r.d, &v.q, t * t * t * (bending_ratio / 12.0), v.eta);
    }
    if let Some(v) = &coupling {
        put(|r| &mut r.b, &v.q, -(t * t), v.eta);
    }
    let transverse = shear.as_ref().and_then(|v| v.g.map(|g| (g, v.eta)));
    if let Some((g, eta)) = transverse {
        let g = turned_shear(&g, angle);
        k.s = g.map(|row| row.map(|x| t * x * shear_ratio));
        h.s = k.s.map(|row| row.map(|x| eta * x));
        lossy |= !eta.is_zero();
    }
    let rho = membrane.or(bending).map_or(S::zero(), |v| v.rho);
    SectionValues {
        stiffness: k,
        loss: lossy.then_some(h),
        membrane: membrane.is_some(),
        bending: bending.is_some(),
        rigid_shear: transverse.is_none(),
        mass: [rho * t, S::zero(), rho * t * t * t * (1.0 / 12.0)],
    }
}

/// A ply with its values in the section's axes.
struct Layer<S> {
    q: Plane<S>,
    /// Transverse shear; zero where the material is rigid in it.
    g: Shear<S>,
    eta: S,
    rho: S,
    /// Bottom and thickness.
    z: S,
    t: S,
}

impl<S: Scalar> Layer<S> {
    /// Integrals of 1, z and z² over the thickness.
    fn moments(&self) -> [S; 3] {
        let t = self.t;
        let middle = self.z + t * 0.5;
        [t, t * middle, t * (middle * middle + t * t * (1.0 / 12.0))]
    }
}

fn laminate<S: Scalar>(
    f: &Factors<S>,
    angle: f64,
    materials: &[ShellMaterial],
    plies: &[SectionPly],
) -> SectionValues<S> {
    let (layers, rigid_shear) = layers(f, materials, plies);
    let (mut k, mut h) = (Resultants::zero(), Resultants::zero());
    let mut mass = [S::zero(); 3];
    for l in &layers {
        for (power, w) in l.moments().into_iter().enumerate() {
            k.add(power, w, &l.q);
            h.add(power, w * l.eta, &l.q);
            mass[power] += w * l.rho;
        }
    }
    if !rigid_shear {
        (k.s, h.s) = transverse(&layers);
    }
    let lossy = layers.iter().any(|l| !l.eta.is_zero());
    SectionValues {
        stiffness: k.turned(angle),
        loss: lossy.then(|| h.turned(angle)),
        membrane: true,
        bending: true,
        rigid_shear,
        mass,
    }
}

/// The plies from the bottom up, and whether one of them is rigid in transverse shear.
fn layers<S: Scalar>(
    f: &Factors<S>,
    materials: &[ShellMaterial],
    plies: &[SectionPly],
) -> (Vec<Layer<S>>, bool) {
    let scale = f.of(Quantity::T);
    let total: f64 = plies.iter().map(|p| p.t).sum();
    let mut z = scale * (-0.5 * total);
    let mut rigid_shear = false;
    let mut layers = Vec::with_capacity(plies.len());
    for p in plies {
        let v = materials[p.slot].values(f, p.slot);
        let t = scale * p.t;
        let q = turned(&v.q, p.angle);
        let g = turned_shear(&v.g.unwrap_or([[S::zero(); 2]; 2]), p.angle);
        rigid_shear |= v.g.is_none();
        layers.push(Layer { q, g, eta: v.eta, rho: v.rho, z, t });
        z += t;
    }
    (layers, rigid_shear)
}

/// Transverse shear stiffness and loss: the sum over the plies, corrected in each direction to the energy of the shear
/// stresses in balance with bending in that direction.
fn transverse<S: Scalar>(layers: &[Layer<S>]) -> (Shear<S>, Shear<S>) {
    let mut sum = [[S::zero(); 2]; 2];
    let mut lost = [[S::zero(); 2]; 2];
    for l in layers {
        for i in 0..2 {
            for j in 0..2 {
                sum[i][j] += l.g[i][j] * l.t;
                lost[i][j] += l.g[i][j] * l.t * l.eta;
            }
        }
    }
    let root: [S; 2] = std::array::from_fn(|i| (energy_stiffness(layers, i) / sum[i][i]).sqrt());
    let correct = |m: Shear<S>| std::array::from_fn(|i| std::array::from_fn(|j| m[i][j] * root[i] * root[j]));
    (correct(sum), correct(lost))
}

/// Transverse shear stiffness of direction `i` by energy.
fn energy_stiffness<S: Scalar>(layers: &[Layer<S>], i: usize) -> S {
    let (mut area, mut first) = (S::zero(), S::zero());
    for l in layers {
        area += l.q[i][i] * l.t;
        first += l.q[i][i] * l.t * (l.z + l.t * 0.5);
    }
    let neutral = first / area;
    let (mut rigidity, mut flow, mut energy) = (S::zero(), S::zero(), S::zero());
    for l in layers {
        let e = l.q[i][i];
        let bottom = l.z - neutral;
        let middle = bottom + l.t * 0.5;
        rigidity += e * l.t * (middle * middle + l.t * l.t * (1.0 / 12.0));
        let at = |z: S| flow - e * (z * z - bottom * bottom) * 0.5;
        for (x, w) in gauss(3) {
            let tau = at(middle + l.t * (0.5 * x));
            energy += l.t * (0.5 * w) * tau * tau / l.g[i][i];
        }
        flow = at(bottom + l.t);
    }
    rigidity * rigidity / energy
}
