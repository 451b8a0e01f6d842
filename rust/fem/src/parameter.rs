//! What may be updated: factors on the deck's values of materials, properties, elements and masses.

use crate::error::FemError;
use crate::mesh::{Id, Material};
use crate::scalar::Scalar;

/// A physical quantity a factor can multiply.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Quantity {
    /// Young's modulus. A blank G follows it.
    E,
    /// Shear modulus, given or following from E and nu.
    G,
    /// Poisson's ratio. A blank G follows it.
    Nu,
    /// Density.
    Rho,
    /// Loss factor: GE of the material, spring or bush.
    Eta,
    /// Area of a beam or rod.
    A,
    /// Bending inertia, plane 1.
    I1,
    /// Bending inertia, plane 2.
    I2,
    /// Torsion constant.
    J,
    /// Shell thickness.
    T,
    /// Spring stiffness, component 0..=5 of a bush; a scalar spring is component 0.
    K(u8),
    /// Dashpot, component 0..=5 of a bush; a scalar dashpot is component 0.
    C(u8),
    /// Mass of a CONM2 (its inertia about the centre of gravity stays), or the whole matrix of a CONM1.
    M,
}

impl Quantity {
    /// Quantity by its name in a study: `E G nu rho eta A I1 I2 J t k1..k6 c1..c6 m`; `k` and `c` are `k1` and `c1`.
    #[must_use]
    pub fn parse(text: &str) -> Option<Self> {
        let component = |rest: &str| match rest {
            "" => Some(0),
            "1" | "2" | "3" | "4" | "5" | "6" => Some(rest.as_bytes()[0] - b'1'),
            _ => None,
        };
        Some(match text {
            "E" => Self::E,
            "G" => Self::G,
            "nu" => Self::Nu,
            "rho" => Self::Rho,
            "eta" => Self::Eta,
            "A" => Self::A,
            "I1" => Self::I1,
            "I2" => Self::I2,
            "J" => Self::J,
            "t" => Self::T,
            "m" => Self::M,
            _ if text.starts_with('k') => Self::K(component(&text[1..])?),
            _ if text.starts_with('c') => Self::C(component(&text[1..])?),
            _ => return None,
        })
    }

    /// Does the quantity belong to a material?
    #[must_use]
    pub fn of_material(self) -> bool {
        matches!(self, Self::E | Self::G | Self::Nu | Self::Rho | Self::Eta)
    }
}

/// What a parameter acts on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Target {
    /// Every element of one of these materials.
    Material(Vec<Id>),
    /// Every element of one of these properties.
    Property(Vec<Id>),
    /// These elements.
    Elements(Vec<Id>),
    /// These mass elements.
    Mass(Vec<Id>),
}

impl Target {
    /// Target by the name of its kind: `material`, `property_id`, `elements` or `mass`.
    #[must_use]
    pub fn parse(kind: &str, ids: Vec<Id>) -> Option<Self> {
        Some(match kind {
            "material" => Self::Material(ids),
            "property_id" => Self::Property(ids),
            "elements" => Self::Elements(ids),
            "mass" => Self::Mass(ids),
            _ => return None,
        })
    }

    /// Ids and the noun for messages.
    #[must_use]
    pub fn ids(&self) -> (&'static str, &[Id]) {
        match self {
            Self::Material(ids) => ("material", ids),
            Self::Property(ids) => ("property", ids),
            Self::Elements(ids) => ("element", ids),
            Self::Mass(ids) => ("mass element", ids),
        }
    }
}

/// One uncertain quantity: a factor, 1 = the deck's value.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Name.
    pub name: String,
    /// Quantity.
    pub quantity: Quantity,
    /// Where.
    pub target: Target,
}

impl Parameter {
    /// Parameter from the words of a study.
    ///
    /// # Errors
    /// [`FemError::Parameter`] for an unknown property or target kind, an empty target, or a material target with a
    /// quantity that materials do not have.
    pub fn parse(name: &str, property: &str, kind: &str, ids: Vec<Id>) -> Result<Self, FemError> {
        let fail = |why: String| Err(FemError::Parameter { name: name.to_owned(), why });
        let Some(quantity) = Quantity::parse(property) else {
            return fail(format!(
                "property \"{property}\" is unknown; use E, G, nu, rho, eta, A, I1, I2, J, t, k1..k6, c1..c6 or m"
            ));
        };
        let Some(target) = Target::parse(kind, ids) else {
            return fail(format!(
                "target \"{kind}\" is unknown; use material, property_id, elements or mass"
            ));
        };
        if target.ids().1.is_empty() {
            return fail(format!("target \"{kind}\" names nothing; give at least one id"));
        }
        if matches!(target, Target::Material(_)) && !quantity.of_material() {
            return fail(format!("a material has no \"{property}\"; use property_id or elements as target"));
        }
        if matches!(target, Target::Mass(_)) && quantity != Quantity::M {
            return fail(format!("a mass element has no \"{property}\"; use property = \"m\""));
        }
        Ok(Self { name: name.to_owned(), quantity, target })
    }
}

/// Number of materials one element can have (PSHELL: membrane, bending, shear, coupling; a laminate: its distinct ones).
pub const N_SLOTS: usize = 8;

/// Factors on one element's values; all one for the deck as it is.
#[derive(Debug, Clone)]
pub struct Factors<S> {
    material: [[S; 5]; N_SLOTS],
    section: [S; 5],
    k: [S; 6],
    c: [S; 6],
    m: S,
    eta: S,
}

impl<S: Scalar> Factors<S> {
    /// All one.
    #[must_use]
    pub fn ones() -> Self {
        let one = S::c(1.0);
        Self { material: [[one; 5]; N_SLOTS], section: [one; 5], k: [one; 6], c: [one; 6], m: one, eta: one }
    }

    /// Multiplies a quantity by `factor`; of a material only in the slots of `slots` (bit i = slot i).
    pub fn multiply(&mut self, quantity: Quantity, slots: u8, factor: S) {
        let place = match quantity {
            Quantity::E | Quantity::G | Quantity::Nu | Quantity::Rho | Quantity::Eta => {
                let i = material_index(quantity);
                for slot in (0..N_SLOTS).filter(|s| slots & (1 << s) != 0) {
                    self.material[slot][i] = self.material[slot][i] * factor;
                }
                if quantity != Quantity::Eta {
                    return;
                }
                &mut self.eta
            }
            Quantity::A => &mut self.section[0],
            Quantity::I1 => &mut self.section[1],
            Quantity::I2 => &mut self.section[2],
            Quantity::J => &mut self.section[3],
            Quantity::T => &mut self.section[4],
            Quantity::K(i) => &mut self.k[i as usize],
            Quantity::C(i) => &mut self.c[i as usize],
            Quantity::M => &mut self.m,
        };
        *place = *place * factor;
    }

    /// Factor of a section quantity, spring, dashpot, mass, or of the loss factor of a spring or bush.
    #[must_use]
    pub fn of(&self, quantity: Quantity) -> S {
        match quantity {
            Quantity::A => self.section[0],
            Quantity::I1 => self.section[1],
            Quantity::I2 => self.section[2],
            Quantity::J => self.section[3],
            Quantity::T => self.section[4],
            Quantity::K(i) => self.k[i as usize],
            Quantity::C(i) => self.c[i as usize],
            Quantity::M => self.m,
            Quantity::Eta => self.eta,
            Quantity::E | Quantity::G | Quantity::Nu | Quantity::Rho => {
                self.material[0][material_index(quantity)]
            }
        }
    }

    /// Factor of a quantity of the material in `slot`.
    #[must_use]
    pub fn of_slot(&self, slot: usize, quantity: Quantity) -> S {
        self.material[slot][material_index(quantity)]
    }

    /// Elastic constants of the material in `slot` with its factors.
    #[must_use]
    pub fn elastic(&self, slot: usize, material: &Material) -> Elastic<S> {
        let f = &self.material[slot];
        let two = S::c(2.0);
        let one = S::c(1.0);
        let nu_given = material.nu.map(|v| f[2] * v);
        let e = match (material.e, material.g, nu_given) {
            (Some(e), _, _) => f[0] * e,
            (None, Some(g), Some(nu)) => f[0] * f[1] * two * (one + nu) * g,
            _ => S::zero(),
        };
        let g = match (material.g, nu_given) {
            (Some(g), _) => f[1] * g,
            (None, Some(nu)) => f[1] * e / (two * (one + nu)),
            (None, None) => S::zero(),
        };
        let nu = match nu_given {
            Some(nu) => nu,
            None if !g.is_zero() && !e.is_zero() => f[2] * (e / (two * g) - one),
            None => S::zero(),
        };
        Elastic { e, g, nu, rho: f[3] * material.rho, eta: f[4] * material.ge }
    }
}

fn material_index(quantity: Quantity) -> usize {
    match quantity {
        Quantity::E => 0,
        Quantity::G => 1,
        Quantity::Nu => 2,
        Quantity::Rho => 3,
        _ => 4,
    }
}

/// Constants of an isotropic material.
#[derive(Debug, Clone, Copy)]
pub struct Elastic<S> {
    /// Young's modulus.
    pub e: S,
    /// Shear modulus.
    pub g: S,
    /// Poisson's ratio.
    pub nu: S,
    /// Density.
    pub rho: S,
    /// Loss factor.
    pub eta: S,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn steel(g: Option<f64>, nu: Option<f64>) -> Material {
        Material { id: 1, e: Some(200.0), g, nu, rho: 8.0, ge: 0.01 }
    }

    #[test]
    fn a_blank_shear_modulus_follows_e_and_a_given_one_does_not() {
        let mut f = Factors::<f64>::ones();
        f.multiply(Quantity::E, 1, 2.0);
        let follows = f.elastic(0, &steel(None, Some(0.25)));
        assert!((follows.g - 160.0).abs() < 1e-12);
        let given = f.elastic(0, &steel(Some(77.0), Some(0.25)));
        assert!((given.g - 77.0).abs() < 1e-12);
        assert!((given.e - 400.0).abs() < 1e-12);
        let other_slot = f.elastic(1, &steel(None, Some(0.25)));
        assert!((other_slot.e - 200.0).abs() < 1e-12);
    }

    #[test]
    fn words_that_mean_nothing_are_refused() {
        assert!(Parameter::parse("p", "Q", "material", vec![1]).is_err());
        assert!(Parameter::parse("p", "E", "group", vec![1]).is_err());
        assert!(Parameter::parse("p", "E", "material", vec![]).is_err());
        assert!(Parameter::parse("p", "A", "material", vec![1]).is_err());
        assert!(Parameter::parse("p", "k7", "property_id", vec![1]).is_err());
        assert_eq!(Parameter::parse("p", "k3", "property_id", vec![1]).unwrap().quantity, Quantity::K(2));
    }
}
