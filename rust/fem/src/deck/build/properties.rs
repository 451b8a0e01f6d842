//! PBAR, PBARL, PBEAM, PBEAML, PROD, PSHELL, PSOLID, PBUSH, PELAS, PDAMP.

use super::Builder;
use crate::deck::card::field_number;
use crate::deck::index::Space;
use crate::deck::section::{Shape, Values};
use crate::deck::{CardRef, Result};
use crate::mesh::{
    BeamProperty, BeamSection, BushProperty, DamperProperty, Id, RodProperty, RodSection, ShellProperty,
    SolidProperty, SpringProperty,
};

impl<'d> Builder<'d> {
    pub(super) fn properties(&mut self) -> Result<()> {
        self.materials()?;
        self.laminates()?;
        for name in ["PBAR", "PBARL", "PBEAM", "PBEAML"] {
            for card in self.deck.cards(name) {
                let property = match name {
                    "PBAR" => self.pbar(card),
                    "PBARL" => self.pbarl(card),
                    "PBEAM" => self.pbeam(card),
                    _ => self.pbeaml(card),
                }?;
                self.mesh.beam_properties.push(property);
            }
        }
        for card in self.deck.cards("PROD") {
            let (id, material) = (card.id(2, "the property id")?, self.material(card, 3)?);
            let (a, j, nsm) = (card.real_or(4, 0.0)?, card.real_or(5, 0.0)?, card.real_or(7, 0.0)?);
            self.mesh.rod_properties.push(RodProperty { id, section: RodSection { material, a, j, nsm } });
        }
        for card in self.deck.cards("PSHELL") {
            let property = self.pshell(card)?;
            self.mesh.shell_properties.push(property);
        }
        for card in self.deck.cards("PSOLID") {
            if card.word(8) == "PFLUID" {
                return Err(card.value_error("fluid solids (PFLUID) are not supported; remove the fluid"));
            }
            let id = card.id(2, "the property id")?;
            let material = self.material_among(card, 3, &["MAT1", "MAT9"])?;
            let frame = self.material_frame(card, material)?;
            self.mesh.solid_properties.push(SolidProperty { id, material, frame });
        }
        self.spring_properties()
    }

    fn spring_properties(&mut self) -> Result<()> {
        for card in self.deck.cards("PBUSH") {
            let property = pbush(card)?;
            self.mesh.bush_properties.push(property);
        }
        for entry in self.deck.ids(Space::Spring) {
            let (card, shift) = (self.deck.card(entry.card as usize), 4 * usize::from(entry.slot));
            let (k, ge) = (card.real(3 + shift, "stiffness")?, card.real_or(4 + shift, 0.0)?);
            self.mesh.spring_properties.push(SpringProperty { id: entry.id, k, ge });
        }
        for entry in self.deck.ids(Space::Damper) {
            let (card, shift) = (self.deck.card(entry.card as usize), 2 * usize::from(entry.slot));
            let c = card.real(3 + shift, "damping coefficient")?;
            self.mesh.damper_properties.push(DamperProperty { id: entry.id, c });
        }
        Ok(())
    }

    fn pbar(&self, card: CardRef<'d>) -> Result<BeamProperty> {
        let a = BeamSection {
            a: card.real_or(4, 0.0)?,
            i1: card.real_or(5, 0.0)?,
            i2: card.real_or(6, 0.0)?,
            i12: card.real_or(24, 0.0)?,
            j: card.real_or(7, 0.0)?,
            nsm: card.real_or(8, 0.0)?,
            neutral_axis: [0.0; 2],
            nsm_offset: [0.0; 2],
        };
        Ok(BeamProperty {
            id: card.id(2, "the property id")?,
            material: self.material(card, 3)?,
            a,
            b: None,
            k1: card.real_or(22, 0.0)?,
            k2: card.real_or(23, 0.0)?,
        })
    }

    fn pbarl(&self, card: CardRef<'d>) -> Result<BeamProperty> {
        let shape = self.shape(card)?;
        let values = shape_values(card, &shape, 0, None)?;
        let nsm = card.real_or(field_number(8 + shape.n_dims()), 0.0)?;
        Ok(BeamProperty {
            id: card.id(2, "the property id")?,
            material: self.material(card, 3)?,
            a: section(&values.1, nsm, [0.0; 2]),
            b: None,
            k1: values.1.k1,
            k2: values.1.k2,
        })
    }

    fn shape(&self, card: CardRef<'d>) -> Result<Shape> {
        let word = card.word(5);
        Shape::from_name(&word).ok_or_else(|| {
            card.value_error(format!(
                "section '{word}' is not supported; known are {}; give its values with {}",
                Shape::names(),
                card.name().trim_end_matches('L')
            ))
        })
    }

    /// Section at A, then stations of (SO, X/XB, dimensions, NSM), one field after the other.
    fn pbeaml(&self, card: CardRef<'d>) -> Result<BeamProperty> {
        let shape = self.shape(card)?;
        let n = shape.n_dims();
        let (dims, first) = shape_values(card, &shape, 0, None)?;
        let centre = first.neutral_axis.ok_or_else(|| {
            card.value_error(format!(
                "the shear centre of section {} is not known here; give its values with PBEAM",
                card.word(5)
            ))
        })?;
        let a = section(&first, card.real_or(field_number(8 + n), 0.0)?, centre);
        let mut b = None;
        let mut start = n + 1;
        while (start..start + n + 3).any(|k| !card.blank(field_number(8 + k))) {
            let x = card.real_or(field_number(8 + start + 1), 1.0)?;
            let (_, values) = shape_values(card, &shape, start + 2, Some(&dims))?;
            let nsm = card.real_or(field_number(8 + start + 2 + n), a.nsm)?;
            if x == 1.0 {
                b = Some(section(&values, nsm, values.neutral_axis.unwrap_or_default()));
            } else if b.is_none() && values != first {
                return Err(card.value_error(format!(
                    "an intermediate station at x/L = {x} with a section of its own is not supported; split the element there"
                )));
            }
            start += n + 3;
        }
        Ok(BeamProperty {
            id: card.id(2, "the property id")?,
            material: self.material(card, 3)?,
            b: b.filter(|b| *b != a),
            a,
            k1: first.k1,
            k2: first.k2,
        })
    }

    fn pshell(&self, card: CardRef<'d>) -> Result<ShellProperty> {
        if card.opt_int(5)? == Some(-1) {
            return Err(card.value_error(
                "MID2 = -1 (plane strain) is not supported; give a bending material or leave it blank",
            ));
        }
        Ok(ShellProperty {
            id: card.id(2, "the property id")?,
            mid1: self.opt_shell_material(card, 3)?,
            t: card.opt_real(4)?,
            mid2: self.opt_shell_material(card, 5)?,
            bending_ratio: card.real_or(6, 1.0)?,
            mid3: self.opt_shell_material(card, 7)?,
            shear_ratio: card.real_or(8, 0.833_333)?,
            mid4: self.opt_shell_material(card, 14)?,
            nsm: card.real_or(9, 0.0)?,
        })
    }

    fn pbeam(&self, card: CardRef<'d>) -> Result<BeamProperty> {
        let id: Id = card.id(2, "the property id")?;
        let material = self.material(card, 3)?;
        let mut a = pbeam_station(card, 4, None)?;
        let rows = card.fields_from(2).last().map_or(0, |field| field / 10 + 1);
        let is_station = |row: usize| matches!(card.word(10 * row + 2).as_str(), "YES" | "YESA" | "NO");
        // stress points of end A come first unless a station follows at once
        let mut row = if rows > 1 && !is_station(1) { 2 } else { 1 };
        let mut stations = Vec::new();
        while row < rows && is_station(row) {
            let first = 10 * row + 2;
            stations.push((card.real_or(first + 1, 1.0)?, first));
            row += if card.word(first) == "YES" { 2 } else { 1 };
        }
        let end = stations.iter().find(|(x, _)| *x == 1.0);
        let mut b = end.map(|(_, field)| pbeam_station(card, field + 2, Some(&a))).transpose()?;
        for &(x, field) in &stations {
            check_station(card, x, field + 2, &a, b.as_ref().unwrap_or(&a))?;
        }
        let (shear, last) = (10 * row + 2, 10 * (row + 1) + 2);
        let unsupported = [("S1", 2), ("S2", 3), ("NSI(A)", 4), ("NSI(B)", 5)];
        for (name, k) in unsupported {
            if card.real_or(shear + k, 0.0)? != 0.0 {
                return Err(card
                    .value_error(format!("{name} (field {}) is not supported; leave it blank", shear + k)));
            }
        }
        a.nsm_offset = [card.real_or(last, 0.0)?, card.real_or(last + 1, 0.0)?];
        let mass_b = [card.real_or(last + 2, a.nsm_offset[0])?, card.real_or(last + 3, a.nsm_offset[1])?];
        a.neutral_axis = [card.real_or(last + 4, 0.0)?, card.real_or(last + 5, 0.0)?];
        let at_b = [card.real_or(last + 6, a.neutral_axis[0])?, card.real_or(last + 7, a.neutral_axis[1])?];
        if b.is_none() && (at_b != a.neutral_axis || mass_b != a.nsm_offset) {
            b = Some(a.clone());
        }
        if let Some(b) = &mut b {
            (b.neutral_axis, b.nsm_offset) = (at_b, mass_b);
        }
        let (k1, k2) = (card.real_or(shear, 1.0)?, card.real_or(shear + 1, 1.0)?);
        Ok(BeamProperty { id, material, b: b.filter(|b| *b != a), a, k1, k2 })
    }
}

/// A, I1, I2, I12, J, NSM from field `first` on; blank = as at end A.
fn pbeam_station(card: CardRef<'_>, first: usize, a: Option<&BeamSection>) -> Result<BeamSection> {
    let default = |value: fn(&BeamSection) -> f64| a.map_or(0.0, value);
    Ok(BeamSection {
        a: card.real_or(first, default(|a| a.a))?,
        i1: card.real_or(first + 1, default(|a| a.i1))?,
        i2: card.real_or(first + 2, default(|a| a.i2))?,
        i12: card.real_or(first + 3, default(|a| a.i12))?,
        j: card.real_or(first + 4, default(|a| a.j))?,
        nsm: card.real_or(first + 5, default(|a| a.nsm))?,
        neutral_axis: [0.0; 2],
        nsm_offset: [0.0; 2],
    })
}

/// A station between the ends must lie on the straight line between them (to the digits of a small field).
fn check_station(card: CardRef<'_>, x: f64, first: usize, a: &BeamSection, b: &BeamSection) -> Result<()> {
    let values = |s: &BeamSection| [s.a, s.i1, s.i2, s.i12, s.j, s.nsm];
    for (k, (va, vb)) in values(a).into_iter().zip(values(b)).enumerate() {
        let line = va + x * (vb - va);
        let given = card.real_or(first + k, line)?;
        if (given - line).abs() > 1e-3 * va.abs().max(vb.abs()) {
            return Err(card.value_error(format!(
                "field {}: {given} at x/L = {x} is off the straight line between the ends ({line}); split the element there",
                first + k
            )));
        }
    }
    Ok(())
}

/// Dimensions from data position `8 + start` on (blank = as in `default`) and the section they make.
fn shape_values(
    card: CardRef<'_>,
    shape: &Shape,
    start: usize,
    default: Option<&[f64]>,
) -> Result<(Vec<f64>, Values)> {
    let mut dims = Vec::with_capacity(shape.n_dims());
    for k in 0..shape.n_dims() {
        let field = field_number(8 + start + k);
        dims.push(match default {
            Some(default) => card.real_or(field, default[k])?,
            None => card.real(field, "dimension of the section")?,
        });
    }
    let values =
        shape.values(&dims).map_err(|what| card.value_error(format!("section {}: {what}", card.word(5))))?;
    Ok((dims, values))
}

fn section(values: &Values, nsm: f64, neutral_axis: [f64; 2]) -> BeamSection {
    let Values { a, i1, i2, i12, j, .. } = *values;
    BeamSection { a, i1, i2, i12, j, nsm, neutral_axis, nsm_offset: [0.0; 2] }
}

/// Rows of a flag (K, B, GE, M, RCV) and six values, in any order.
fn pbush(card: CardRef<'_>) -> Result<BushProperty> {
    let mut property =
        BushProperty { id: card.id(2, "the property id")?, k: [0.0; 6], c: [0.0; 6], ge: [0.0; 6] };
    for flag in card.fields_from(3).filter(|field| field % 10 == 3) {
        let mut values = [None; 6];
        let word = card.word(flag);
        if word == "RCV" {
            continue;
        }
        for (k, value) in values.iter_mut().enumerate() {
            *value = card.opt_real(flag + 1 + k)?;
        }
        let filled = values.map(|value| value.unwrap_or(0.0));
        match word.as_str() {
            "K" => property.k = filled,
            "B" => property.c = filled,
            // a single GE counts for all components
            "GE" if values[1..].iter().all(Option::is_none) => property.ge = [filled[0]; 6],
            "GE" => property.ge = filled,
            "M" if filled == [0.0; 6] => {}
            "M" => return Err(card.value_error("mass of a bush (M) is not supported; use CONM2")),
            "" if values == [None; 6] => {}
            _ => return Err(card.wrong(flag, "K, B, GE, M or RCV")),
        }
    }
    Ok(property)
}
