//! Solids (CTETRA, CPENTA, CHEXA, CPYRAM) of isotropic (MAT1) or anisotropic (MAT9) material.
//!
//! The 8-node hexahedron has nine incompatible modes (Taylor, Beresford and Wilson, Int. J. Numer. Meth. Engng 10
//! (1976) 1211), so that it neither locks in bending nor near incompressibility, and passes the patch test. The
//! other shapes are displacement elements: 4-node tetrahedra, 6-node wedges and 5-node pyramids are stiff in bending. Those
//! with nodes inside edges pass the patch test with bowed edges too: their stations integrate the stress of a constant
//! strain exactly. Lumped mass:
//! row sums for linear shapes, diagonal scaling (Hinton, Rock and Zienkiewicz 1976) for quadratic ones.

use super::solid_shape::{Station, stations};
use super::{Matrices, lossy};
use crate::mesh::{Material, Rotation, SolidKind, SolidMaterial};
use crate::parameter::{Factors, Quantity};
use crate::scalar::Scalar;
use crate::small::{Mat, condense_tail, inverse_spd};

/// A solid.
#[derive(Debug, Clone, PartialEq)]
pub struct SolidElement {
    /// Shape.
    pub kind: SolidKind,
    /// Nodes, basic coordinates.
    pub xyz: Vec<[f64; 3]>,
    /// Material.
    pub law: SolidLaw,
    /// Consistent mass?
    pub coupled_mass: bool,
}

/// Elasticity of a solid.
#[derive(Debug, Clone, PartialEq)]
pub enum SolidLaw {
    /// MAT1.
    Isotropic(Material),
    /// MAT9 in basic axes.
    Anisotropic {
        /// Stiffness `C_ijkl`.
        stiffness: Box<Tensor<f64>>,
        /// Density.
        rho: f64,
        /// Loss factor.
        ge: f64,
    },
}

/// Fourth-order tensor.
pub type Tensor<S> = [[[[S; 3]; 3]; 3]; 3];

/// Place of the pair (i, j) in a vector of six strains: xx, yy, zz, xy, yz, zx.
const VOIGT: [[usize; 3]; 3] = [[0, 3, 5], [3, 1, 4], [5, 4, 2]];

impl SolidLaw {
    /// Anisotropic law given in `frame` (rows: its axes in basic coordinates).
    #[must_use]
    pub fn anisotropic(m: &SolidMaterial, frame: Option<&Rotation>) -> Self {
        let r = frame.copied().unwrap_or([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
        let local = |a: usize, b: usize, c: usize, d: usize| m.stiffness[VOIGT[a][b]][VOIGT[c][d]];
        let mut stiffness = Box::new([[[[0.0; 3]; 3]; 3]; 3]);
        for (i, j, k, l) in indices() {
            for (a, b, c, d) in indices() {
                stiffness[i][j][k][l] += r[a][i] * r[b][j] * r[c][k] * r[d][l] * local(a, b, c, d);
            }
        }
        Self::Anisotropic { stiffness, rho: m.rho, ge: m.ge }
    }

    /// Stiffness with factors; `E` multiplies all of an anisotropic one.
    fn tensor<S: Scalar>(&self, f: &Factors<S>) -> Tensor<S> {
        match self {
            Self::Isotropic(m) => {
                let (lambda, mu) = lame(f, m);
                let mut c = [[[[S::zero(); 3]; 3]; 3]; 3];
                for i in 0..3 {
                    for j in 0..3 {
                        c[i][i][j][j] += lambda;
                        c[i][j][i][j] += mu;
                        c[i][j][j][i] += mu;
                    }
                }
                c
            }
            Self::Anisotropic { stiffness, .. } => {
                let e = f.of_slot(0, Quantity::E);
                stiffness.map(|a| a.map(|b| b.map(|c| c.map(|x| e * x))))
            }
        }
    }

    /// Density and loss factor.
    fn density<S: Scalar>(&self, f: &Factors<S>) -> (S, S) {
        let (rho, ge) = match self {
            Self::Isotropic(m) => (m.rho, m.ge),
            Self::Anisotropic { rho, ge, .. } => (*rho, *ge),
        };
        (f.of_slot(0, Quantity::Rho) * rho, f.of_slot(0, Quantity::Eta) * ge)
    }
}

fn indices() -> impl Iterator<Item = (usize, usize, usize, usize)> {
    (0..81).map(|n| (n / 27, n / 9 % 3, n / 3 % 3, n % 3))
}

fn lame<S: Scalar>(f: &Factors<S>, m: &Material) -> (S, S) {
    let el = f.elastic(0, m);
    let one = S::c(1.0);
    (el.e * el.nu / ((one + el.nu) * (one - el.nu * 2.0)), el.e / ((one + el.nu) * 2.0))
}

type Jacobian = [[f64; 3]; 3];

impl SolidElement {
    /// Determinant and corner (index) of the smallest Jacobian over corners and integration points, relative to
    /// the largest; `None` when all are positive.
    #[must_use]
    pub fn folded(&self) -> Option<(f64, usize)> {
        let table = stations(self.kind);
        let at = |s: &Station| determinant(&self.jacobian(s));
        let corners: Vec<f64> = table.corners.iter().map(at).collect();
        let inside: Vec<f64> = table.stiffness.iter().chain(&table.mass).map(at).collect();
        let largest = corners.iter().chain(&inside).fold(0.0_f64, |m, d| m.max(d.abs()));
        let positive = |d: &f64| *d > 1e-10 * largest;
        if let Some(i) = corners.iter().position(|d| !positive(d)) {
            return Some((corners[i], i));
        }
        let low = inside.into_iter().find(|d| !positive(d))?;
        let nearest = (0..corners.len()).min_by(|&i, &j| corners[i].total_cmp(&corners[j])).unwrap_or(0);
        Some((low, nearest))
    }

    /// K, M and the loss matrix in basic axes, three components per node.
    #[must_use]
    pub fn matrices<S: Scalar>(&self, f: &Factors<S>) -> Matrices<S> {
        let n = self.xyz.len();
        let k = self.full_stiffness(f);
        let stuck = || Mat { rows: 3 * n, cols: 3 * n, data: vec![S::c(f64::NAN); 9 * n * n] };
        let k = if k.rows > 3 * n { condense_tail(&k, 3 * n).unwrap_or_else(stuck) } else { k };
        let (rho, eta) = self.law.density(f);
        let mut m = Mat::zeros(3 * n, 3 * n);
        for (p, value) in self.unit_mass().iter().enumerate() {
            for c in 0..3 {
                m[(3 * (p / n) + c, 3 * (p % n) + c)] = rho * *value;
            }
        }
        Matrices { h: lossy(&k, eta), k: Some(k), m: Some(m), c: None }
    }

    /// Stiffness over the nodes' three components, internal modes last.
    fn full_stiffness<S: Scalar>(&self, f: &Factors<S>) -> Mat<S> {
        let (size, g) = self.gradient_products();
        let mut k = Mat::zeros(3 * size, 3 * size);
        if let SolidLaw::Isotropic(m) = &self.law {
            let (lambda, mu) = lame(f, m);
            for (p, block) in g.iter().enumerate() {
                let trace = block[0][0] + block[1][1] + block[2][2];
                for i in 0..3 {
                    for j in 0..3 {
                        let shear = block[j][i] + if i == j { trace } else { 0.0 };
                        k[(3 * (p / size) + i, 3 * (p % size) + j)] = lambda * block[i][j] + mu * shear;
                    }
                }
            }
            return k;
        }
        let c = self.law.tensor(f);
        for (p, block) in g.iter().enumerate() {
            for (i, r, j, s) in indices() {
                k[(3 * (p / size) + i, 3 * (p % size) + j)] += c[i][r][j][s] * block[r][s];
            }
        }
        k
    }

    fn jacobian(&self, s: &Station) -> Jacobian {
        let mut j = [[0.0; 3]; 3];
        for (d, x) in s.d.iter().zip(&self.xyz) {
            for r in 0..3 {
                for c in 0..3 {
                    j[r][c] += d[r] * x[c];
                }
            }
        }
        j
    }

    /// Calls `point(weight, gradients)` at every integration point; internal shapes last.
    fn gradients(&self, mut point: impl FnMut(f64, &[[f64; 3]])) {
        let table = stations(self.kind);
        let n = self.xyz.len();
        let internal = if self.kind == SolidKind::Hexa8 { 3 } else { 0 };
        let centre = self.jacobian(&table.centre);
        let (inverse0, det0) = (inverse(&centre), determinant(&centre));
        let mut grad = vec![[0.0; 3]; n + internal];
        for s in &table.stiffness {
            let j = self.jacobian(s);
            let (inv, det) = (inverse(&j), determinant(&j));
            for (a, d) in s.d.iter().enumerate() {
                grad[a] = std::array::from_fn(|i| (0..3).map(|r| inv[i][r] * d[r]).sum());
            }
            for r in 0..internal {
                // gradient of 1 - xi_r² through the Jacobian of the centre: integrates to zero, hence the patch test
                let w = -2.0 * s.p[r] * det0 / det;
                grad[n + r] = std::array::from_fn(|i| w * inverse0[i][r]);
            }
            point(s.w * det, &grad);
        }
    }

    /// Integrals of gradient products of all shapes, internal ones last: `G_ab[i][j] = int N_a,i N_b,j dV`.
    fn gradient_products(&self) -> (usize, Vec<Jacobian>) {
        let size = self.xyz.len() + if self.kind == SolidKind::Hexa8 { 3 } else { 0 };
        let mut g = vec![[[0.0; 3]; 3]; size * size];
        self.gradients(|w, grad| {
            for a in 0..size {
                for b in a..size {
                    let block = &mut g[a * size + b];
                    for i in 0..3 {
                        for k in 0..3 {
                            block[i][k] += w * grad[a][i] * grad[b][k];
                        }
                    }
                }
            }
        });
        for a in 0..size {
            for b in 0..a {
                let upper = g[b * size + a];
                g[a * size + b] = std::array::from_fn(|i| std::array::from_fn(|k| upper[k][i]));
            }
        }
        (size, g)
    }

    /// Stress stiffness `int grad(u_i)ᵀ sigma grad(u_i) dV` in basic axes of the stresses that nodal displacements `u`
    /// make.
    #[must_use]
    pub fn stress_stiffness(&self, f: &Factors<f64>, u: &[f64]) -> Option<Mat<f64>> {
        let n = self.xyz.len();
        let k = self.full_stiffness(f);
        let mut q = u.to_vec();
        q.extend(internal_motion(&k, u)?);
        let c = self.law.tensor(f);
        let mut out = Mat::zeros(3 * n, 3 * n);
        self.gradients(|w, grad| {
            let mut sigma = [[0.0; 3]; 3];
            for (i, j, k, l) in indices() {
                sigma[i][j] +=
                    c[i][j][k][l] * grad.iter().zip(q.chunks(3)).map(|(g, u)| g[l] * u[k]).sum::<f64>();
            }
            for a in 0..n {
                let flux: [f64; 3] = std::array::from_fn(|i| crate::small::dot3(sigma[i], grad[a]));
                for b in 0..n {
                    let value = w * crate::small::dot3(flux, grad[b]);
                    for c in 0..3 {
                        out[(3 * a + c, 3 * b + c)] += value;
                    }
                }
            }
        });
        Some(out)
    }

    /// Mass matrix of one component for unit density, n x n.
    fn unit_mass(&self) -> Vec<f64> {
        let n = self.xyz.len();
        let mut m = vec![0.0; n * n];
        for s in &stations(self.kind).mass {
            let w = s.w * determinant(&self.jacobian(s));
            for a in 0..n {
                for b in 0..n {
                    m[a * n + b] += w * s.n[a] * s.n[b];
                }
            }
        }
        if self.coupled_mass {
            return m;
        }
        let total: f64 = m.iter().sum();
        let trace: f64 = (0..n).map(|a| m[a * n + a]).sum();
        let linear = self.kind.n_nodes() <= 8;
        let mut lumped = vec![0.0; n * n];
        for a in 0..n {
            lumped[a * n + a] =
                if linear { m[a * n..(a + 1) * n].iter().sum() } else { m[a * n + a] * total / trace };
        }
        lumped
    }
}

/// Internal coordinates that follow displacements `u`; empty without any.
fn internal_motion(k: &Mat<f64>, u: &[f64]) -> Option<Vec<f64>> {
    let (m, n) = (u.len(), k.rows - u.len());
    let inner = Mat { rows: n, cols: n, data: (0..n * n).map(|p| k[(m + p / n, m + p % n)]).collect() };
    let inverse = inverse_spd(&inner)?;
    let force: Vec<f64> = (0..n).map(|i| (0..m).map(|j| k[(m + i, j)] * u[j]).sum()).collect();
    Some((0..n).map(|i| -(0..n).map(|j| inverse[(i, j)] * force[j]).sum::<f64>()).collect())
}

fn determinant(j: &Jacobian) -> f64 {
    crate::small::dot3(j[0], crate::small::cross3(j[1], j[2]))
}

fn inverse(j: &Jacobian) -> Jacobian {
    let d = 1.0 / determinant(j);
    let columns = [
        crate::small::cross3(j[1], j[2]),
        crate::small::cross3(j[2], j[0]),
        crate::small::cross3(j[0], j[1]),
    ];
    std::array::from_fn(|i| std::array::from_fn(|r| d * columns[r][i]))
}
