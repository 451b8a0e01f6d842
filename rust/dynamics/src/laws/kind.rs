//! Laws by name.

use super::own::{self, OwnKind};
use super::{Definition, LawError, Parameter};

macro_rules! laws {
    ($($variant:ident => $definition:ty),+ $(,)?) => {
        /// The laws of the library, and those of one's own.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[allow(missing_docs)]
        pub enum Kind { $($variant),+, Own(OwnKind) }

        impl Kind {
            /// Every law of the library, in the order of the documentation.
            pub const ALL: &'static [Kind] = &[$(Kind::$variant),+];
        }

        /// Calls a generic item of the definition that belongs to a kind, or what an own law does instead.
        macro_rules! with_definition {
            ($kind:expr, $d:ident => $body:expr, $own:pat => $instead:expr) => {
                match $kind { $(Kind::$variant => { type $d = $definition; $body })+ Kind::Own($own) => $instead }
            };
        }
    };
}

laws! {
    Spring => super::spring::Spring,
    Released => super::released::Released,
    Mass => super::mass::Mass,
    Dashpot => super::dashpot::Dashpot,
    Viscoelastic => super::viscoelastic::Viscoelastic,
    Maxwell2 => super::maxwell::Maxwell2,
    Maxwell3 => super::maxwell::Maxwell3,
    Fractional => super::fractional::Fractional,
    Springpot => super::springpot::Springpot,
    BoxSpectrum => super::box_spectrum::BoxSpectrum,
    Absorber => super::absorber::Absorber,
    Structural => super::structural::Structural,
    Linear => super::linear::Linear,
    Cubic => super::cubic::Cubic,
    QuadraticStiffness => super::quadratic_stiffness::QuadraticStiffness,
    Saturating => super::saturating::Saturating,
    Clearance => super::clearance::Clearance,
    Bilinear => super::bilinear::Bilinear,
    Preloaded => super::preloaded::Preloaded,
    Hertz => super::hertz::Hertz,
    Coulomb => super::coulomb::Coulomb,
    PlayFriction => super::play_friction::PlayFriction,
    SlidingFriction => super::sliding_friction::SlidingFriction,
    BoucWen => super::bouc_wen::BoucWen,
    QuadraticDamping => super::quadratic_damping::QuadraticDamping,
    CubicDamping => super::cubic_damping::CubicDamping,
    DisplacementDamping => super::displacement_damping::DisplacementDamping,
    Iwan => super::iwan::Iwan,
    FreeForm => super::free_form::FreeForm,
}
pub(super) use with_definition;

impl Kind {
    /// Name as in study files.
    pub fn name(self) -> &'static str {
        with_definition!(self, D => <D as Definition>::NAME, own => own.name())
    }

    /// Parameters in their order.
    pub fn parameters(self) -> &'static [Parameter] {
        with_definition!(self, D => <D as Definition>::PARAMETERS, own => own.parameters())
    }

    /// Whether the force is a linear functional of the motion.
    pub fn is_linear(self) -> bool {
        with_definition!(self, D => <D as Definition>::LINEAR, _ => false)
    }

    /// Whether the force depends on the acceleration.
    pub fn is_inertial(self) -> bool {
        with_definition!(self, D => <D as Definition>::INERTIAL, _ => false)
    }

    /// Number of internal state variables.
    pub fn n_state(self) -> usize {
        with_definition!(self, D => <D as Definition>::N_STATE, own => own.n_state())
    }

    /// The law of that name; `joint_stiffness` is the spring between the two sides of a joint.
    ///
    /// # Errors
    /// [`LawError::UnknownLaw`] with the nearest name.
    pub fn from_name(name: &str) -> Result<Self, LawError> {
        if name == "joint_stiffness" {
            return Ok(Kind::Spring);
        }
        if let Some(kind) = Self::ALL.iter().find(|kind| kind.name() == name) {
            return Ok(*kind);
        }
        if let Some(own) = own::find(name) {
            return Ok(Kind::Own(own));
        }
        let names: Vec<_> = Self::ALL.iter().map(|kind| kind.name()).chain(own::names()).collect();
        let nearest = names.iter().min_by_key(|known| edits(known, name)).copied().unwrap_or_default();
        Err(LawError::UnknownLaw { name: name.to_owned(), nearest, known: names.join(", ") })
    }

    pub(super) fn known(self) -> String {
        self.parameters().iter().map(|p| p.name).collect::<Vec<_>>().join(", ")
    }
}

/// Levenshtein distance.
fn edits(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let substituted = diagonal + usize::from(x != *y);
            diagonal = row[j + 1];
            row[j + 1] = substituted.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::laws::Law;

    #[test]
    fn unknown_names_tell_the_nearest() {
        let error = Kind::from_name("cubic_stifness").unwrap_err();
        assert!(matches!(error, LawError::UnknownLaw { nearest: "cubic_stiffness", .. }));
    }

    #[test]
    fn values_outside_their_domain_are_refused() {
        let bad = [
            (Kind::Clearance, vec![1.0, -1e-3, 1.0]),
            (Kind::Clearance, vec![1.0, 1e-3, 3.0]),
            (Kind::Viscoelastic, vec![1.0, 1.0, 0.0]),
            (Kind::BoucWen, vec![1.0, 0.1, 1.0, 1.0, 2.0]),
            (Kind::Spring, vec![f64::NAN]),
        ];
        for (kind, p) in bad {
            assert!(matches!(Law::new(kind, &p), Err(LawError::BadValue { .. })), "{kind:?} {p:?}");
        }
        assert!(matches!(Law::new(Kind::Spring, &[]), Err(LawError::WrongCount { .. })));
    }
}
