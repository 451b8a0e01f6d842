//! CBAR, CBEAM, CROD, CONROD.

use super::Builder;
use crate::deck::coord::{V3, cross, sub, to_basic, unit};
use crate::deck::index::Space;
use crate::deck::{CardRef, Result};
use crate::mesh::{Beam, BeamKind, Id, Orientation, Rod, RodSection, RodSource};

impl<'d> Builder<'d> {
    pub(super) fn beams(&mut self) -> Result<()> {
        let bars = (BeamKind::Bar, "CBAR", "BAROR", ["PBAR", "PBARL"]);
        let beams = (BeamKind::Beam, "CBEAM", "BEAMOR", ["PBEAM", "PBEAML"]);
        for (kind, name, defaults, properties) in [bars, beams] {
            let defaults = self.deck.cards(defaults).next();
            for card in self.deck.cards(name) {
                let beam = self.beam(card, kind, defaults, &properties)?;
                self.mesh.beams.push(beam);
            }
        }
        Ok(())
    }

    fn beam(
        &self,
        card: CardRef<'d>,
        kind: BeamKind,
        defaults: Option<CardRef<'d>>,
        properties: &[&str],
    ) -> Result<Beam> {
        let id = card.id(2, "the element id")?;
        let property = match defaults {
            Some(defaults) if card.blank(3) && !defaults.blank(3) => {
                self.check_property(card, 3, defaults.id(3, "a property")?, Space::Property, properties)?
            }
            _ => self.property(card, 3, Space::Property, properties)?,
        };
        let nodes = [self.node(card, 4)?, self.node(card, 5)?];
        let offt = self.offt(card, defaults)?;
        let given = |card: CardRef<'d>| (6..=8).any(|field| !card.blank(field));
        let source = match defaults {
            Some(defaults) if !given(card) => defaults,
            _ => card,
        };
        if !given(source) {
            return Err(card.value_error(
                "no orientation: give a node in field 6 or a vector in fields 6 to 8 that is not along the beam",
            ));
        }
        let orientation = self.orientation(card, source, nodes[0], offt[0] == b'B')?;
        if (22..=23).any(|field| card.opt_int(field).ok().flatten().unwrap_or(0) != 0) {
            return Err(
                card.value_error("warping points SA, SB (fields 22, 23) are not supported; leave them blank")
            );
        }
        let mut offsets = [[0.0; 3]; 2];
        for (end, fields) in [[14, 15, 16], [17, 18, 19]].into_iter().enumerate() {
            let offset = card.vector(fields)?;
            if offset != [0.0; 3] {
                offsets[end] = match offt[end + 1] {
                    b'O' => self.element_frame_to_basic(card, nodes, &orientation, offset)?,
                    _ => self.node_frame_to_basic(card, 4 + end, nodes[end], offset)?,
                };
            }
        }
        let pins = [card.components(12)?, card.components(13)?];
        Ok(Beam { id, kind, property, nodes, orientation, offsets, pins })
    }

    /// The letters of OFFT: system of the orientation vector (G node's displacement frame, B basic), then of each
    /// offset (G, or O for the element's own).
    fn offt(&self, card: CardRef<'d>, defaults: Option<CardRef<'d>>) -> Result<[u8; 3]> {
        let word = match defaults {
            Some(defaults) if card.blank(9) => defaults.word(9),
            _ => card.word(9),
        };
        match word.as_bytes() {
            [] => Ok(*b"GGG"),
            &[v @ (b'G' | b'B'), a @ (b'G' | b'O'), b @ (b'G' | b'O')] => Ok([v, a, b]),
            _ => Err(card.wrong(9, "an OFFT such as GGG, BGG or GOO")),
        }
    }

    /// Orientation from fields 6 to 8 of `source`: a node if the first is an integer and the others are blank.
    pub(super) fn orientation(
        &self,
        card: CardRef<'d>,
        source: CardRef<'d>,
        end: Id,
        basic: bool,
    ) -> Result<Orientation> {
        if source.is_int(6) && source.blank(7) && source.blank(8) {
            return Ok(Orientation::Node(self.node(source, 6)?));
        }
        let v = source.vector([6, 7, 8])?;
        if v == [0.0; 3] {
            return Err(card.value_error("the orientation vector in fields 6 to 8 is zero"));
        }
        Ok(Orientation::Vector(if basic { v } else { self.node_frame_to_basic(card, 4, end, v)? }))
    }

    /// Offset given along the element: x from A to B, y in plane 1.
    fn element_frame_to_basic(
        &self,
        card: CardRef<'d>,
        nodes: [Id; 2],
        orientation: &Orientation,
        offset: V3,
    ) -> Result<V3> {
        let a = self.node_data(card, 4, nodes[0])?.xyz;
        let b = self.node_data(card, 5, nodes[1])?.xyz;
        let v = match *orientation {
            Orientation::Vector(v) => v,
            Orientation::Node(node) => sub(self.node_data(card, 6, node)?.xyz, a),
        };
        let axes = unit(sub(b, a)).and_then(|x| unit(cross(x, v)).map(|z| [x, cross(z, x), z]));
        let axes = axes.ok_or_else(|| {
            card.value_error("offsets in the element's system (OFFT) need distinct ends and an orientation across the beam")
        })?;
        Ok(to_basic(&axes, offset))
    }

    pub(super) fn rods(&mut self) -> Result<()> {
        for card in self.deck.cards("CROD") {
            let source = RodSource::Property(self.property(card, 3, Space::Property, &["PROD"])?);
            let nodes = [self.node(card, 4)?, self.node(card, 5)?];
            self.mesh.rods.push(Rod { id: card.id(2, "the element id")?, source, nodes });
        }
        for card in self.deck.cards("CONROD") {
            let nodes = [self.node(card, 3)?, self.node(card, 4)?];
            let section = RodSection {
                material: self.material(card, 5)?,
                a: card.real_or(6, 0.0)?,
                j: card.real_or(7, 0.0)?,
                nsm: card.real_or(9, 0.0)?,
            };
            self.mesh.rods.push(Rod {
                id: card.id(2, "the element id")?,
                source: RodSource::Inline(section),
                nodes,
            });
        }
        Ok(())
    }
}
