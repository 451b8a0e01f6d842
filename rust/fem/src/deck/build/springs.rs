//! CELAS1 to 4, CDAMP1 to 4, CBUSH.

use super::Builder;
use crate::deck::coord::to_basic;
use crate::deck::index::Space;
use crate::deck::{CardRef, Result};
use crate::mesh::{
    Bush, BushFrame, Damper, DamperSource, NodeComponent, SCALAR_COMPONENT, Spring, SpringSource,
};

impl<'d> Builder<'d> {
    pub(super) fn springs(&mut self) -> Result<()> {
        for (name, scalar) in [("CELAS1", false), ("CELAS3", true)] {
            for card in self.deck.cards(name) {
                let source = SpringSource::Property(self.property(card, 3, Space::Spring, &["PELAS"])?);
                self.spring(card, source, scalar)?;
            }
        }
        for (name, scalar) in [("CELAS2", false), ("CELAS4", true)] {
            for card in self.deck.cards(name) {
                let ge = if scalar { 0.0 } else { card.real_or(8, 0.0)? };
                self.spring(card, SpringSource::Inline { k: card.real(3, "stiffness")?, ge }, scalar)?;
            }
        }
        for (name, scalar) in [("CDAMP1", false), ("CDAMP3", true)] {
            for card in self.deck.cards(name) {
                let source = DamperSource::Property(self.property(card, 3, Space::Damper, &["PDAMP"])?);
                self.damper(card, source, scalar)?;
            }
        }
        for (name, scalar) in [("CDAMP2", false), ("CDAMP4", true)] {
            for card in self.deck.cards(name) {
                self.damper(card, DamperSource::Inline(card.real(3, "damping coefficient")?), scalar)?;
            }
        }
        for card in self.deck.cards("CBUSH") {
            let bush = self.bush(card)?;
            self.mesh.bushes.push(bush);
        }
        Ok(())
    }

    fn spring(&mut self, card: CardRef<'d>, source: SpringSource, scalar: bool) -> Result<()> {
        let ends = self.ends(card, scalar)?;
        self.mesh.springs.push(Spring { id: card.id(2, "the element id")?, source, ends });
        Ok(())
    }

    fn damper(&mut self, card: CardRef<'d>, source: DamperSource, scalar: bool) -> Result<()> {
        let ends = self.ends(card, scalar)?;
        self.mesh.dampers.push(Damper { id: card.id(2, "the element id")?, source, ends });
        Ok(())
    }

    /// Ends of a scalar element, `scalar` one between scalar points alone: node and component in fields 4, 5 and 6, 7, or
    /// points in fields 4 and 5; none = ground.
    pub(super) fn ends(&self, card: CardRef<'d>, scalar: bool) -> Result<[Option<NodeComponent>; 2]> {
        if scalar {
            return self.scalar_ends(card);
        }
        let ends = [self.opt_dof(card, 4)?, self.opt_dof(card, 6)?];
        if ends == [None, None] {
            return Err(card.value_error("both ends are ground; give at least one node"));
        }
        Ok(ends)
    }

    fn scalar_ends(&self, card: CardRef<'d>) -> Result<[Option<NodeComponent>; 2]> {
        let mut ends = [None, None];
        for (end, field) in [4, 5].into_iter().enumerate() {
            let Some(node) = card.opt_id(field)? else { continue };
            if !self.is_scalar(card, field, node)? {
                return Err(card.value_error(format!(
                    "field {field}: {node} is a GRID; {} connects scalar points",
                    card.name()
                )));
            }
            ends[end] = Some(NodeComponent { node, component: SCALAR_COMPONENT });
        }
        if ends == [None, None] {
            return Err(card.value_error("both ends are ground; give at least one scalar point"));
        }
        Ok(ends)
    }

    fn bush(&mut self, card: CardRef<'d>) -> Result<Bush> {
        let id = card.id(2, "the element id")?;
        let property = self.property(card, 3, Space::Bush, &["PBUSH"])?;
        let (a, b) = (self.opt_node(card, 4)?, self.opt_node(card, 5)?);
        // a spring to ground may name its node at either end
        let (first, second) = match (a, b) {
            (Some(a), b) => (a, b),
            (None, Some(b)) => (b, None),
            (None, None) => return Err(card.value_error("no node in fields 4 and 5; give at least one")),
        };
        let frame = if !card.blank(9) {
            BushFrame::Fixed(self.frame_at(card, 9, first)?)
        } else if second.is_none() {
            return Err(card
                .value_error("a spring to ground needs a coordinate system in field 9; 0 is the basic one"));
        } else if (6..=8).any(|field| !card.blank(field)) {
            BushFrame::Oriented(self.orientation(card, card, first, false)?)
        } else {
            BushFrame::Axial
        };
        let location = card.real_or(12, 0.5)?;
        let offset = match card.opt_int(13)? {
            None | Some(-1) => None,
            Some(_) => {
                let rotation = self.frame_at(card, 13, first)?;
                Some(to_basic(&rotation, card.vector([14, 15, 16])?))
            }
        };
        Ok(Bush { id, property, nodes: [Some(first), second], frame, location, offset })
    }
}
