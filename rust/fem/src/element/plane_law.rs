//! Plane-stress elasticity of shell materials (MAT1, MAT2, MAT8) with factors, in turned axes.

use crate::mesh::{Id, Material, PlaneLaw, PlaneMaterial};
use crate::parameter::{Factors, Quantity};
use crate::scalar::Scalar;

/// Symmetric matrix of three strains (xx, yy, engineering xy).
pub type Plane<S> = [[S; 3]; 3];
/// Symmetric matrix of two transverse shear strains (xz, yz).
pub type Shear<S> = [[S; 2]; 2];

/// A material that a shell can have.
#[derive(Debug, Clone, PartialEq)]
pub enum ShellMaterial {
    /// MAT1.
    Isotropic(Material),
    /// MAT2, MAT8.
    Plane(PlaneMaterial),
}

/// Values of a shell material in its own axes.
#[derive(Debug, Clone, Copy)]
pub struct PlaneValues<S> {
    /// Plane stress.
    pub q: Plane<S>,
    /// Transverse shear; `None` = rigid.
    pub g: Option<Shear<S>>,
    /// Density.
    pub rho: S,
    /// Loss factor.
    pub eta: S,
}

impl ShellMaterial {
    /// Material id.
    #[must_use]
    pub fn id(&self) -> Id {
        match self {
            Self::Isotropic(m) => m.id,
            Self::Plane(m) => m.id,
        }
    }

    /// Elasticity, density and loss factor with the factors of `slot`. `E` multiplies every modulus of a MAT2 and both
    /// of a MAT8; `G` all shear moduli and `nu` NU12 of a MAT8.
    #[must_use]
    pub fn values<S: Scalar>(&self, f: &Factors<S>, slot: usize) -> PlaneValues<S> {
        let zero = S::zero();
        match self {
            Self::Isotropic(m) => {
                let el = f.elastic(slot, m);
                let normal = el.e / (S::c(1.0) - el.nu * el.nu);
                let cross = normal * el.nu;
                let shear = el.e / ((S::c(1.0) + el.nu) * 2.0);
                let q = [[normal, cross, zero], [cross, normal, zero], [zero, zero, shear]];
                let g = (el.g.value() > 0.0).then_some([[el.g, zero], [zero, el.g]]);
                PlaneValues { q, g, rho: el.rho, eta: el.eta }
            }
            Self::Plane(m) => {
                let of = |quantity| f.of_slot(slot, quantity);
                let (q, g) = match &m.law {
                    PlaneLaw::Orthotropic { e1, e2, nu12, g12, gz } => {
                        let (e1, e2) = (of(Quantity::E) * *e1, of(Quantity::E) * *e2);
                        let nu12 = of(Quantity::Nu) * *nu12;
                        let nu21 = nu12 * e2 / e1;
                        let d = S::c(1.0) - nu12 * nu21;
                        let cross = nu12 * e2 / d;
                        let shear = of(Quantity::G) * *g12;
                        let q = [[e1 / d, cross, zero], [cross, e2 / d, zero], [zero, zero, shear]];
                        let g = gz.map(|g| of(Quantity::G) * g);
                        (q, (gz.iter().all(|g| *g > 0.0)).then_some([[g[0], zero], [zero, g[1]]]))
                    }
                    PlaneLaw::Anisotropic(c) => {
                        let q: Plane<S> = c.map(|row| row.map(|x| of(Quantity::E) * x));
                        (q, Some([[q[0][0], q[0][1]], [q[1][0], q[1][1]]]))
                    }
                };
                let rho = of(Quantity::Rho) * m.rho;
                PlaneValues { q, g, rho, eta: of(Quantity::Eta) * m.ge }
            }
        }
    }

    /// What is wrong with its elasticity, if anything.
    #[must_use]
    pub fn fault(&self) -> Option<String> {
        let Self::Plane(m) = self else { return None };
        let v = self.values(&Factors::<f64>::ones(), 0).q;
        let second = v[0][0] * v[1][1] - v[0][1] * v[1][0];
        let det = v[2][2] * second - v[1][2] * (v[0][0] * v[2][1] - v[0][1] * v[2][0])
            + v[0][2] * (v[1][0] * v[2][1] - v[1][1] * v[2][0]);
        // as MID3 a MAT2 has its first two rows alone
        let shear_only = matches!(&m.law, PlaneLaw::Anisotropic(c) if c[2] == [0.0; 3]);
        let ok = v[0][0] > 0.0 && second > 0.0 && (det > 0.0 || shear_only);
        (!ok).then(|| "its plane-stress stiffness is not positive definite; correct the moduli".to_owned())
    }
}

/// `q` given in axes turned by `angle` (rad), in the axes it is turned from.
#[must_use]
pub fn turned<S: Scalar>(q: &Plane<S>, angle: f64) -> Plane<S> {
    if angle == 0.0 {
        return *q;
    }
    let (s, c) = angle.sin_cos();
    // strains in the turned axes from those in the axes turned from
    let t = [[c * c, s * s, c * s], [s * s, c * c, -c * s], [-2.0 * c * s, 2.0 * c * s, c * c - s * s]];
    congruent(q, &t)
}

/// As [`turned`], of transverse shear.
#[must_use]
pub fn turned_shear<S: Scalar>(g: &Shear<S>, angle: f64) -> Shear<S> {
    if angle == 0.0 {
        return *g;
    }
    let (s, c) = angle.sin_cos();
    congruent(g, &[[c, s], [-s, c]])
}

/// `tᵀ a t`, kept symmetric to the last digit.
fn congruent<S: Scalar, const N: usize>(a: &[[S; N]; N], t: &[[f64; N]; N]) -> [[S; N]; N] {
    let mut out = [[S::zero(); N]; N];
    for i in 0..N {
        for j in i..N {
            for k in 0..N {
                for l in 0..N {
                    out[i][j] += a[k][l] * (t[k][i] * t[l][j]);
                }
            }
            out[j][i] = out[i][j];
        }
    }
    out
}
