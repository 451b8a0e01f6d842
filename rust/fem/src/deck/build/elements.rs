//! CQUAD4, CTRIA3, CHEXA, CPENTA, CTETRA, CPYRAM.

use super::Builder;
use crate::deck::index::Space;
use crate::deck::{CardRef, Result};
use crate::mesh::{Id, MaterialAxis, Shell, Solid, SolidKind};

impl<'d> Builder<'d> {
    pub(super) fn shells_and_solids(&mut self) -> Result<()> {
        for card in self.deck.cards("CQUAD4") {
            let shell = self.shell::<4>(card)?;
            self.mesh.quads.push(shell);
        }
        for card in self.deck.cards("CTRIA3") {
            let shell = self.shell::<3>(card)?;
            self.mesh.trias.push(shell);
        }
        let kinds = [
            ("CTETRA", [SolidKind::Tetra4, SolidKind::Tetra10]),
            ("CPENTA", [SolidKind::Penta6, SolidKind::Penta15]),
            ("CHEXA", [SolidKind::Hexa8, SolidKind::Hexa20]),
            ("CPYRAM", [SolidKind::Pyramid5, SolidKind::Pyramid13]),
        ];
        for (name, kinds) in kinds {
            for card in self.deck.cards(name) {
                let solid = self.solid(card, kinds)?;
                self.mesh.solids.push(solid);
            }
        }
        Ok(())
    }

    fn shell<const N: usize>(&mut self, card: CardRef<'d>) -> Result<Shell<N>> {
        let id = card.id(2, "the element id")?;
        let property = self.property(card, 3, Space::Property, &["PSHELL", "PCOMP", "PCOMPG"])?;
        let mut nodes = [0; N];
        for (k, node) in nodes.iter_mut().enumerate() {
            *node = self.node(card, 4 + k)?;
        }
        let zoffset = card.real_or(5 + N, 0.0)?;
        let relative = card.opt_int(13)? == Some(1);
        let mut thickness = [None; N];
        for (k, t) in thickness.iter_mut().enumerate() {
            *t = card.opt_real(14 + k)?;
        }
        let axis = self.material_axis(card, 4 + N, &nodes)?;
        let layered = self.deck.find("PSHELL", property).is_err();
        if layered {
            // the plies have the thickness
            thickness = [None; N];
        }
        if relative && thickness.iter().any(Option::is_some) {
            // with TFLAG = 1 the corners give fractions of the property's thickness
            let t = self
                .deck
                .find("PSHELL", property)?
                .0
                .real(4, "thickness (the element gives fractions of it)")?;
            thickness = thickness.map(|fraction| Some(fraction.unwrap_or(1.0) * t));
        }
        Ok(Shell { id, property, nodes, axis, zoffset, thickness })
    }

    /// THETA (a real, degrees) or MCID (an integer): the x-axis of that system at the middle of the element.
    fn material_axis(&mut self, card: CardRef<'d>, field: usize, nodes: &[Id]) -> Result<MaterialAxis> {
        if card.blank(field) || !card.is_int(field) {
            return Ok(MaterialAxis::Angle(card.real_or(field, 0.0)?.to_radians()));
        }
        let mut centre = [0.0; 3];
        for (k, node) in nodes.iter().enumerate() {
            let xyz = self.node_data(card, 4 + k, *node)?.xyz;
            centre = std::array::from_fn(|i| centre[i] + xyz[i] / nodes.len() as f64);
        }
        Ok(MaterialAxis::Along(self.coords.of(card, field)?.frame(centre)[0]))
    }

    fn solid(&self, card: CardRef<'d>, [linear, quadratic]: [SolidKind; 2]) -> Result<Solid> {
        let id = card.id(2, "the element id")?;
        let property = self.property(card, 3, Space::Property, &["PSOLID"])?;
        let fields: Vec<usize> = card.fields_from(4).take(quadratic.n_nodes()).collect();
        let midside = fields.get(linear.n_nodes()..).unwrap_or_default();
        let given = midside.iter().filter(|&&field| !card.blank(field)).count();
        let all = quadratic.n_nodes() - linear.n_nodes();
        let kind = match given {
            0 => linear,
            n if n == all => quadratic,
            n => {
                return Err(card.value_error(format!(
                    "{n} of {all} mid-side nodes are given; give all of them or none"
                )));
            }
        };
        let numbered = (0..kind.n_nodes()).map(|k| crate::deck::card::field_number(2 + k));
        let nodes: Vec<Id> = numbered.map(|field| self.node(card, field)).collect::<Result<_>>()?;
        Ok(Solid { id, property, kind, nodes })
    }
}
