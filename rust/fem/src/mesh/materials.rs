//! Materials: isotropic, of shells, of solids.

use super::nodes::Id;

/// MAT1: isotropic material, as written on the card (blank = `None`).
#[derive(Debug, Clone, PartialEq)]
pub struct Material {
    /// Material id.
    pub id: Id,
    /// Young's modulus, force/length².
    pub e: Option<f64>,
    /// Shear modulus, force/length². Blank with E and nu given: G = E / (2 (1 + nu)), and G follows E.
    pub g: Option<f64>,
    /// Poisson's ratio. Blank with E and G given: nu = E / (2 G) - 1.
    pub nu: Option<f64>,
    /// Mass density.
    pub rho: f64,
    /// Structural damping coefficient (loss factor) GE.
    pub ge: f64,
}

/// In-plane law of an anisotropic shell material.
#[derive(Debug, Clone, PartialEq)]
pub enum PlaneLaw {
    /// MAT8: orthotropic in material axes.
    Orthotropic {
        /// Young's modulus along material axis 1.
        e1: f64,
        /// Young's modulus along material axis 2.
        e2: f64,
        /// Poisson's ratio: strain along 2 for stress along 1.
        nu12: f64,
        /// Shear modulus in the plane.
        g12: f64,
        /// Transverse shear moduli 1-z and 2-z; 0 = rigid.
        gz: [f64; 2],
    },
    /// MAT2: symmetric (3, 3) stiffness of plane stress in material axes; its upper left (2, 2) part when the material
    /// is that of transverse shear (MID3).
    Anisotropic([[f64; 3]; 3]),
}

/// MAT2, MAT8: anisotropic material of shells.
#[derive(Debug, Clone, PartialEq)]
pub struct PlaneMaterial {
    /// Material id.
    pub id: Id,
    /// Elasticity.
    pub law: PlaneLaw,
    /// Mass density.
    pub rho: f64,
    /// Structural damping coefficient (loss factor) GE.
    pub ge: f64,
}

/// MAT9: anisotropic material of solids.
#[derive(Debug, Clone, PartialEq)]
pub struct SolidMaterial {
    /// Material id.
    pub id: Id,
    /// Symmetric stiffness over (xx, yy, zz, xy, yz, zx) with engineering shear strains, material axes.
    pub stiffness: [[f64; 6]; 6],
    /// Mass density.
    pub rho: f64,
    /// Structural damping coefficient (loss factor) GE.
    pub ge: f64,
}
