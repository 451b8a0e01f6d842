//! GRID, with GRDSET's defaults.

use super::Builder;
use crate::deck::index::Space;
use crate::deck::{CardRef, Result};
use crate::mesh::{Components, Node, Rotation, Spc};

const IDENTITY: Rotation = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

impl<'d> Builder<'d> {
    /// Positions, displacement frames and permanent constraints of all nodes, ascending by id.
    pub(super) fn nodes(&mut self) -> Result<()> {
        let grdset = self.deck.cards("GRDSET").next();
        let default_ps = grdset.map_or(Ok(Components::default()), |card| card.components(8))?;
        let deck = self.deck;
        self.mesh.nodes.reserve(deck.ids(Space::Node).len());
        for entry in deck.ids(Space::Node) {
            let grid = deck.card(entry.card as usize);
            let xyz = self.coords.position(grid)?;
            let frame = self.displacement_frame(grid, grdset, xyz)?;
            self.mesh.nodes.push(Node { id: entry.id, xyz, frame });
            let components = if grid.blank(8) { default_ps } else { grid.components(8)? };
            if !components.is_empty() {
                self.mesh.spc.push(Spc { id: 0, node: entry.id, components });
            }
        }
        Ok(())
    }

    fn displacement_frame(
        &mut self,
        grid: CardRef<'d>,
        grdset: Option<CardRef<'d>>,
        xyz: [f64; 3],
    ) -> Result<Option<Rotation>> {
        let card = match grdset {
            Some(grdset) if grid.blank(7) => grdset,
            _ => grid,
        };
        if card.opt_int(7)? == Some(-1) {
            return Err(
                grid.value_error("CD = -1 makes it a fluid point, which is not supported; remove the fluid")
            );
        }
        let Some(id) = card.opt_id(7)? else { return Ok(None) };
        let frame = self.coords.get(id, card, 7)?.frame(xyz);
        Ok((frame != IDENTITY).then_some(frame))
    }
}
