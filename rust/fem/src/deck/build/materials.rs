//! MAT1, MAT2, MAT8, MAT9, and references to them.

use super::Builder;
use crate::deck::index::Space;
use crate::deck::{CardRef, Result};
use crate::mesh::{Id, Material, PlaneLaw, PlaneMaterial, Rotation, SolidMaterial};

/// Materials of shells.
const SHELL: [&str; 3] = ["MAT1", "MAT2", "MAT8"];

impl<'d> Builder<'d> {
    pub(super) fn materials(&mut self) -> Result<()> {
        for card in self.deck.cards("MAT1") {
            self.mesh.materials.push(mat1(card)?);
        }
        for card in self.deck.cards("MAT2") {
            self.mesh.plane_materials.push(mat2(card)?);
        }
        for card in self.deck.cards("MAT8") {
            self.mesh.plane_materials.push(mat8(card)?);
        }
        for card in self.deck.cards("MAT9") {
            self.mesh.solid_materials.push(mat9(card)?);
        }
        Ok(())
    }

    /// Isotropic material that `field` must name.
    pub(super) fn material(&self, card: CardRef<'d>, field: usize) -> Result<Id> {
        self.material_among(card, field, &["MAT1"])
    }

    /// Material that `field` must name, on one of `cards`.
    pub(super) fn material_among(
        &self,
        card: CardRef<'d>,
        field: usize,
        cards: &[&'static str],
    ) -> Result<Id> {
        let id = card.id(field, "a material")?;
        self.known_material(card, field, id, cards)
    }

    /// Material of a shell that `field` may name.
    pub(super) fn opt_shell_material(&self, card: CardRef<'d>, field: usize) -> Result<Option<Id>> {
        card.opt_id(field)?.map(|id| self.known_material(card, field, id, &SHELL)).transpose()
    }

    fn known_material(&self, card: CardRef<'d>, field: usize, id: Id, cards: &[&'static str]) -> Result<Id> {
        let kind = if let [only] = cards { *only } else { "material" };
        let entry = self.deck.index.get(Space::Material, id).ok_or_else(|| card.missing(field, kind, id))?;
        let name = self.deck.card(entry.card as usize).name();
        if cards.contains(&name) {
            return Ok(id);
        }
        Err(card.value_error(format!(
            "field {field}: material {id} is a {name}; {} needs {}",
            card.name(),
            cards.join(" or ")
        )))
    }

    /// Axes of a PSOLID's anisotropic material from CORDM (field 4), `None` for an isotropic one or the basic system.
    pub(super) fn material_frame(&mut self, card: CardRef<'d>, material: Id) -> Result<Option<Rotation>> {
        if self.mesh.solid_materials.iter().all(|m| m.id != material) {
            return Ok(None);
        }
        if card.opt_int(4)? == Some(-1) {
            return Err(card.value_error(
                "CORDM = -1 (axes of the element) is not supported for MAT9; give a rectangular system",
            ));
        }
        let Some(id) = card.opt_id(4)? else { return Ok(None) };
        let coord = self.coords.get(id, card, 4)?;
        if !coord.is_rectangular() {
            return Err(card.value_error(format!(
                "CORDM {id} is a curved system, which is not supported for MAT9; give a rectangular one"
            )));
        }
        Ok(Some(coord.frame([0.0; 3])))
    }
}

fn mat1(card: CardRef<'_>) -> Result<Material> {
    let material = Material {
        id: card.id(2, "the material id")?,
        e: card.opt_real(3)?,
        g: card.opt_real(4)?,
        nu: card.opt_real(5)?,
        rho: card.real_or(6, 0.0)?,
        ge: card.real_or(9, 0.0)?,
    };
    if material.e.is_none() && material.g.is_none() {
        return Err(card.value_error("E and G (fields 3 and 4) are both blank; give at least one"));
    }
    Ok(material)
}

fn mat2(card: CardRef<'_>) -> Result<PlaneMaterial> {
    let g = |k: usize| card.real_or(3 + k, 0.0);
    let (g11, g12, g13, g22, g23, g33) = (g(0)?, g(1)?, g(2)?, g(3)?, g(4)?, g(5)?);
    Ok(PlaneMaterial {
        id: card.id(2, "the material id")?,
        law: PlaneLaw::Anisotropic([[g11, g12, g13], [g12, g22, g23], [g13, g23, g33]]),
        rho: card.real_or(9, 0.0)?,
        ge: card.real_or(16, 0.0)?,
    })
}

fn mat8(card: CardRef<'_>) -> Result<PlaneMaterial> {
    Ok(PlaneMaterial {
        id: card.id(2, "the material id")?,
        law: PlaneLaw::Orthotropic {
            e1: card.real(3, "E1")?,
            e2: card.real(4, "E2")?,
            nu12: card.real_or(5, 0.0)?,
            g12: card.real_or(6, 0.0)?,
            gz: [card.real_or(7, 0.0)?, card.real_or(8, 0.0)?],
        },
        rho: card.real_or(9, 0.0)?,
        ge: card.real_or(22, 0.0)?,
    })
}

/// The upper triangle, row by row, from field 3 on.
fn mat9(card: CardRef<'_>) -> Result<SolidMaterial> {
    let mut fields = (3..=9).chain(12..=19).chain(22..=27);
    let mut stiffness = [[0.0; 6]; 6];
    for i in 0..6 {
        for j in i..6 {
            let value = fields.next().map_or(Ok(0.0), |field| card.real_or(field, 0.0))?;
            stiffness[i][j] = value;
            stiffness[j][i] = value;
        }
    }
    let (rho, ge) = (card.real_or(28, 0.0)?, card.real_or(38, 0.0)?);
    Ok(SolidMaterial { id: card.id(2, "the material id")?, stiffness, rho, ge })
}
