//! Solids (CTETRA, CPENTA, CHEXA) of isotropic material.
//!
//! The 8-node hexahedron has nine incompatible modes (Taylor, Beresford and Wilson, Int. J. Numer. Meth. Engng 10
//! (1976) 1211), so that it neither locks in bending nor near incompressibility, and passes the patch test. The
//! other shapes are displacement elements: 4-node tetrahedra and 6-node wedges are stiff in bending. Lumped mass:
//! row sums for linear shapes, diagonal scaling (Hinton, Rock and Zienkiewicz 1976) for quadratic ones.

use super::solid_shape::{Station, stations};
use super::{Matrices, lossy};
use crate::mesh::{Material, SolidKind};
use crate::parameter::Factors;
use crate::scalar::Scalar;
use crate::small::{Mat, condense_tail};

/// A solid.
#[derive(Debug, Clone)]
pub struct SolidElement {
    /// Shape.
    pub kind: SolidKind,
    /// Nodes, basic coordinates.
    pub xyz: Vec<[f64; 3]>,
    /// Material.
    pub material: Material,
    /// Consistent mass?
    pub coupled_mass: bool,
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
        let el = f.elastic(0, &self.material);
        let lambda = el.e * el.nu / ((S::c(1.0) + el.nu) * (S::c(1.0) - el.nu * 2.0));
        let mu = el.e / ((S::c(1.0) + el.nu) * 2.0);
        let n = self.xyz.len();
        let (size, g) = self.gradient_products();
        let mut k = Mat::zeros(3 * size, 3 * size);
        for a in 0..size {
            for b in 0..size {
                let block = &g[a * size + b];
                let trace = block[0][0] + block[1][1] + block[2][2];
                for i in 0..3 {
                    for j in 0..3 {
                        let shear = block[j][i] + if i == j { trace } else { 0.0 };
                        k[(3 * a + i, 3 * b + j)] = lambda * block[i][j] + mu * shear;
                    }
                }
            }
        }
        if size > n {
            let stuck = Mat { rows: 3 * n, cols: 3 * n, data: vec![S::c(f64::NAN); 9 * n * n] };
            k = condense_tail(&k, 3 * n).unwrap_or(stuck);
        }
        let mut m = Mat::zeros(3 * n, 3 * n);
        for (p, value) in self.unit_mass().iter().enumerate() {
            for c in 0..3 {
                m[(3 * (p / n) + c, 3 * (p % n) + c)] = el.rho * *value;
            }
        }
        Matrices { h: lossy(&k, el.eta), k: Some(k), m: Some(m), c: None }
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

    /// Integrals of gradient products of all shapes, internal ones last: `G_ab[i][j] = int N_a,i N_b,j dV`.
    fn gradient_products(&self) -> (usize, Vec<Jacobian>) {
        let table = stations(self.kind);
        let n = self.xyz.len();
        let internal = if self.kind == SolidKind::Hexa8 { 3 } else { 0 };
        let size = n + internal;
        let centre = self.jacobian(&table.centre);
        let (inverse0, det0) = (inverse(&centre), determinant(&centre));
        let mut g = vec![[[0.0; 3]; 3]; size * size];
        let mut grad = vec![[0.0; 3]; size];
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
            let w = s.w * det;
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
        }
        for a in 0..size {
            for b in 0..a {
                let upper = g[b * size + a];
                g[a * size + b] = std::array::from_fn(|i| std::array::from_fn(|k| upper[k][i]));
            }
        }
        (size, g)
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
        let linear = matches!(self.kind, SolidKind::Tetra4 | SolidKind::Penta6 | SolidKind::Hexa8);
        let mut lumped = vec![0.0; n * n];
        for a in 0..n {
            lumped[a * n + a] =
                if linear { m[a * n..(a + 1) * n].iter().sum() } else { m[a * n + a] * total / trace };
        }
        lumped
    }
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
