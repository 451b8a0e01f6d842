//! Tables of a deck for display and pairing: positions, elements with their nodes.

use super::build::{Choice, Selection, build};
use super::coord::Coords;
use super::{CardRef, Deck, Result, Space};
use crate::mesh::{BeamKind, DamperSource, Id, NodeComponent, RodSource, SolidKind, SpringSource};

/// One element.
#[derive(Debug, Clone, PartialEq)]
pub struct ElementRow {
    /// Element id.
    pub id: Id,
    /// Card name.
    pub card: &'static str,
    /// Property id; `None` where the card carries its values itself.
    pub property: Option<Id>,
    /// Nodes in card order; ground left out. For RBE2 the independent node first, for RBE3 the reference node.
    pub nodes: Vec<Id>,
}

fn ends(ends: &[Option<NodeComponent>; 2]) -> Vec<Id> {
    ends.iter().flatten().map(|end| end.node).collect()
}

impl Deck {
    /// Positions of all GRIDs in basic coordinates, ascending by id.
    ///
    /// # Errors
    /// As [`build`], for GRID and CORDi.
    pub fn positions(&self) -> Result<Vec<[f64; 3]>> {
        let default_cp = self.cards("GRDSET").next().map_or(Ok(None), |card| card.opt_id(3))?;
        let mut coords = Coords::new(self, default_cp);
        let grids = self.ids(Space::Node).iter().filter(|entry| !entry.scalar);
        grids.map(|entry| coords.position(self.card(entry.card as usize))).collect()
    }

    /// Coordinates of basic points in the system that the GRID of the same position in `ids` is given in, as its fields
    /// 4 to 6 hold them.
    ///
    /// # Errors
    /// As [`build`], for GRID and CORDi; [`super::DeckError::Selection`] for an id without GRID.
    pub fn grid_coordinates(&self, ids: &[Id], xyz: &[[f64; 3]]) -> Result<Vec<[f64; 3]>> {
        let default_cp = self.cards("GRDSET").next().map_or(Ok(None), |card| card.opt_id(3))?;
        let mut coords = Coords::new(self, default_cp);
        let at = |(id, x): (&Id, &[f64; 3])| coords.coordinates(self.find("GRID", *id)?.0, *x);
        ids.iter().zip(xyz).map(at).collect()
    }

    /// Third axis, in basic coordinates, of the coordinate system that `field` of `card` names (blank or 0: the basic one).
    ///
    /// # Errors
    /// As [`build`], for CORDi.
    pub fn third_axis(&self, card: CardRef<'_>, field: usize) -> Result<[f64; 3]> {
        let default_cp = self.cards("GRDSET").next().map_or(Ok(None), |card| card.opt_id(3))?;
        Ok(Coords::new(self, default_cp).of(card, field)?.third_axis())
    }

    /// All elements: beams, rods, springs, dampers, bushes, masses, shells, solids, rigid elements.
    ///
    /// # Errors
    /// As [`build`].
    pub fn elements(&self) -> Result<Vec<ElementRow>> {
        let mesh = build(self, &Selection { spc: Choice::Nothing, mpc: Choice::Nothing })?;
        let mut rows = Vec::new();
        let mut push = |id, card, property, nodes| rows.push(ElementRow { id, card, property, nodes });
        for e in &mesh.beams {
            let card = if e.kind == BeamKind::Bar { "CBAR" } else { "CBEAM" };
            push(e.id, card, Some(e.property), e.nodes.to_vec());
        }
        for e in &mesh.rods {
            match e.source {
                RodSource::Property(id) => push(e.id, "CROD", Some(id), e.nodes.to_vec()),
                RodSource::Inline(_) => push(e.id, "CONROD", None, e.nodes.to_vec()),
            }
        }
        let name = |space, id, otherwise| {
            self.index.get(space, id).map_or(otherwise, |entry| self.card(entry.card as usize).name())
        };
        for e in &mesh.springs {
            let property = if let SpringSource::Property(id) = e.source { Some(id) } else { None };
            push(e.id, name(Space::Element, e.id, "CELAS2"), property, ends(&e.ends));
        }
        for e in &mesh.dampers {
            let property = if let DamperSource::Property(id) = e.source { Some(id) } else { None };
            push(e.id, name(Space::Element, e.id, "CDAMP2"), property, ends(&e.ends));
        }
        for e in &mesh.bushes {
            push(e.id, "CBUSH", Some(e.property), e.nodes.iter().flatten().copied().collect());
        }
        for e in &mesh.quads {
            push(e.id, "CQUAD4", Some(e.property), e.nodes.to_vec());
        }
        for e in &mesh.trias {
            push(e.id, "CTRIA3", Some(e.property), e.nodes.to_vec());
        }
        for e in &mesh.solids {
            push(e.id, solid_card(e.kind), Some(e.property), e.nodes.clone());
        }
        for e in &mesh.masses {
            push(e.id, name(Space::Mass, e.id, "CONM2"), None, vec![e.node]);
        }
        for e in &mesh.rbe2 {
            push(
                e.id,
                "RBE2",
                None,
                std::iter::once(e.independent).chain(e.dependent.iter().copied()).collect(),
            );
        }
        for e in &mesh.rbar {
            push(e.id, "RBAR", None, e.nodes.to_vec());
        }
        for e in &mesh.rbe3 {
            let others = e.groups.iter().flat_map(|group| group.nodes.iter().copied());
            push(e.id, "RBE3", None, std::iter::once(e.reference).chain(others).collect());
        }
        Ok(rows)
    }
}

fn solid_card(kind: SolidKind) -> &'static str {
    match kind {
        SolidKind::Tetra4 | SolidKind::Tetra10 => "CTETRA",
        SolidKind::Penta6 | SolidKind::Penta15 => "CPENTA",
        SolidKind::Hexa8 | SolidKind::Hexa20 => "CHEXA",
        SolidKind::Pyramid5 | SolidKind::Pyramid13 => "CPYRAM",
    }
}
