//! GRID, with GRDSET's defaults, and SPOINT.

use super::Builder;
use crate::deck::index::Space;
use crate::deck::{CardRef, Result};
use crate::mesh::{Components, Node, Rotation, SCALAR_COMPONENT, Spc};

const IDENTITY: Rotation = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

impl<'d> Builder<'d> {
    /// Positions, displacement frames and permanent constraints of all nodes, ascending by id.
    pub(super) fn nodes(&mut self) -> Result<()> {
        let grdset = self.deck.cards("GRDSET").next();
        let default_ps = grdset.map_or(Ok(Components::default()), |card| card.components(8))?;
        let deck = self.deck;
        self.mesh.nodes.reserve(deck.ids(Space::Node).len());
        let (mut sum, mut n_grids) = ([0.0; 3], 0_usize);
        for entry in deck.ids(Space::Node) {
            if entry.scalar {
                let node = Node { id: entry.id, xyz: [0.0; 3], frame: None };
                self.mesh.nodes.push(node);
                self.mesh.scalar_points.push(entry.id);
                let components = Components(Components::ALL.0 & !(1 << (SCALAR_COMPONENT - 1)));
                self.mesh.spc.push(Spc { id: 0, node: entry.id, components });
                continue;
            }
            let grid = deck.card(entry.card as usize);
            let xyz = self.coords.position(grid)?;
            let frame = self.displacement_frame(grid, grdset, xyz)?;
            n_grids += 1;
            (0..3).for_each(|i| sum[i] += xyz[i]);
            self.mesh.nodes.push(Node { id: entry.id, xyz, frame });
            let components = if grid.blank(8) { default_ps } else { grid.components(8)? };
            if !components.is_empty() {
                self.mesh.spc.push(Spc { id: 0, node: entry.id, components });
            }
        }
        // scalar points have no place; in the middle of the others they leave the model's size as it is
        let middle = sum.map(|x| if n_grids > 0 { x / n_grids as f64 } else { 0.0 });
        let scalar = deck.ids(Space::Node).iter().map(|entry| entry.scalar);
        for (node, _) in self.mesh.nodes.iter_mut().zip(scalar).filter(|(_, scalar)| *scalar) {
            node.xyz = middle;
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
