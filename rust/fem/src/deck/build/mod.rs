//! A deck into a [`Mesh`]: coordinates in the basic system, defaults applied, references checked, one SPC and one MPC
//! set chosen.

mod beams;
mod constraints;
mod direct;
mod elements;
mod laminates;
mod masses;
mod materials;
mod nodes;
mod properties;
mod springs;

use super::card::CardRef;
use super::coord::{Coords, Positions, V3};
use super::index::Space;
use super::{Deck, Result};
use crate::mesh::{Id, Mesh, Node, NodeComponent, Options, Rotation, SCALAR_COMPONENT};

/// Which set of constraints to take.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Choice {
    /// The one case control selects; none if it selects none.
    #[default]
    CaseControl,
    /// None.
    Nothing,
    /// This one.
    Set(Id),
}

/// Choice of the constraint sets.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Selection {
    /// SPC, SPC1, SPCADD.
    pub spc: Choice,
    /// MPC, MPCADD.
    pub mpc: Choice,
}

/// What the parts of the build share.
struct Builder<'d> {
    deck: &'d Deck,
    coords: Coords<'d>,
    mesh: Mesh,
}

/// Turns the deck into a model description. Nodes are ascending by id, everything else in the order of the deck.
///
/// # Errors
/// Fields that cannot be read, references to what is not defined, values that make no sense, set selections that
/// select nothing.
pub fn build(deck: &Deck, selection: &Selection) -> Result<Mesh> {
    build_moved(deck, selection, &Positions::new())
}

/// As [`build`], with nodes at other positions than their GRID says: everything that follows from a position (frames of
/// curved systems, offsets of masses given by place) follows.
///
/// # Errors
/// As [`build`], and for a moved node that a coordinate system stands on (CORD1).
pub fn build_moved(deck: &Deck, selection: &Selection, moved: &Positions) -> Result<Mesh> {
    let grdset = deck.cards("GRDSET").next();
    let cp = grdset.map_or(Ok(None), |card| card.opt_id(3))?;
    let mut builder = Builder { deck, coords: Coords::new(deck, cp).with(moved), mesh: Mesh::default() };
    builder.mesh.options = options(deck)?;
    builder.nodes()?;
    builder.properties()?;
    builder.beams()?;
    builder.rods()?;
    builder.springs()?;
    builder.masses()?;
    builder.shells_and_solids()?;
    builder.rigid()?;
    builder.direct()?;
    builder.constraints(selection)?;
    Ok(builder.mesh)
}

fn options(deck: &Deck) -> Result<Options> {
    let mut options = Options::default();
    let wrong = |name: &str, value: &str| {
        deck.selection_error(format!(
            "PARAM {name} in case control has the value '{value}', which is not a number"
        ))
    };
    for (name, value) in deck.content.case.params() {
        let number = super::number::parse_real(value.as_bytes());
        match name.as_str() {
            "COUPMASS" => options.coupled_mass = number.ok_or_else(|| wrong(name, value))? > 0.0,
            "WTMASS" => options.wtmass = number.ok_or_else(|| wrong(name, value))?,
            "G" => options.g = number.ok_or_else(|| wrong(name, value))?,
            _ => {}
        }
    }
    for card in deck.cards("PARAM") {
        match card.word(2).as_str() {
            "COUPMASS" => {
                options.coupled_mass = matches!(card.word(3).as_str(), "YES")
                    || (card.word(3) != "NO" && card.real(3, "value")? > 0.0)
            }
            "WTMASS" => options.wtmass = card.real(3, "value")?,
            "G" => options.g = card.real(3, "value")?,
            _ => {}
        }
    }
    if options.wtmass <= 0.0 {
        return Err(deck.selection_error(format!(
            "PARAM WTMASS = {}, which takes the mass of the whole model away; give a number above 0 (1 leaves masses as they are)",
            options.wtmass
        )));
    }
    Ok(options)
}

impl<'d> Builder<'d> {
    /// Node that `field` names, if any; it must exist.
    fn opt_node(&self, card: CardRef<'d>, field: usize) -> Result<Option<Id>> {
        let Some(id) = card.opt_id(field)? else { return Ok(None) };
        self.known_node(card, field, id).map(Some)
    }

    /// Node that `field` must name.
    fn node(&self, card: CardRef<'d>, field: usize) -> Result<Id> {
        let id = card.id(field, "a node")?;
        self.known_node(card, field, id)
    }

    fn known_node(&self, card: CardRef<'d>, field: usize, id: Id) -> Result<Id> {
        match self.deck.index.get(Space::Node, id) {
            Some(entry) if entry.scalar => Err(card.value_error(format!(
                "field {field}: {id} is a scalar point, which has no place in space; give a GRID"
            ))),
            Some(_) => Ok(id),
            None => Err(card.missing(field, "GRID", id)),
        }
    }

    /// Is this node of the deck a scalar point? Error where it is neither GRID nor SPOINT.
    fn is_scalar(&self, card: CardRef<'d>, field: usize, id: Id) -> Result<bool> {
        let entry = self.deck.index.get(Space::Node, id);
        entry.map(|entry| entry.scalar).ok_or_else(|| card.missing(field, "GRID or SPOINT", id))
    }

    /// The DOF of node and component in `field` and the one behind; `None` where no node is given. A scalar point has
    /// component 0, blank or 1.
    fn opt_dof(&self, card: CardRef<'d>, field: usize) -> Result<Option<NodeComponent>> {
        let Some(node) = card.opt_id(field)? else { return Ok(None) };
        let scalar = self.is_scalar(card, field, node)?;
        let component = match (scalar, card.component(field + 1)?) {
            (true, None | Some(1)) => SCALAR_COMPONENT,
            (true, Some(c)) => {
                return Err(card.value_error(format!(
                    "field {}: scalar point {node} has no component {c}; give 0",
                    field + 1
                )));
            }
            (false, Some(component)) => component,
            (false, None) => {
                return Err(
                    card.value_error(format!("field {}: node {node} needs a component 1 to 6", field + 1))
                );
            }
        };
        Ok(Some(NodeComponent { node, component }))
    }

    /// The node as built; `id` was checked.
    fn node_data(&self, card: CardRef<'d>, field: usize, id: Id) -> Result<&Node> {
        let found = self.deck.index.position(Space::Node, id).and_then(|i| self.mesh.nodes.get(i));
        found.ok_or_else(|| card.missing(field, "GRID", id))
    }

    /// A vector given in a node's displacement frame, in basic coordinates.
    fn node_frame_to_basic(&self, card: CardRef<'d>, field: usize, node: Id, v: V3) -> Result<V3> {
        let frame = &self.node_data(card, field, node)?.frame;
        Ok(frame.as_ref().map_or(v, |frame| super::coord::to_basic(frame, v)))
    }

    /// Frame of the coordinate system that `field` names, at a node.
    fn frame_at(&mut self, card: CardRef<'d>, field: usize, node: Id) -> Result<Rotation> {
        let at = self.node_data(card, field, node)?.xyz;
        Ok(self.coords.of(card, field)?.frame(at))
    }

    /// Property that `field` names, blank meaning the element's own id. It must be one of `cards`.
    fn property(&self, card: CardRef<'d>, field: usize, space: Space, cards: &[&str]) -> Result<Id> {
        let id = match card.opt_id(field)? {
            Some(id) => id,
            None => card.id(2, "the id")?,
        };
        self.check_property(card, field, id, space, cards)
    }

    fn check_property(
        &self,
        card: CardRef<'d>,
        field: usize,
        id: Id,
        space: Space,
        cards: &[&str],
    ) -> Result<Id> {
        let entry = self.deck.index.get(space, id).ok_or_else(|| card.missing(field, "property", id))?;
        let name = self.deck.card(entry.card as usize).name();
        if cards.contains(&name) {
            return Ok(id);
        }
        Err(card.value_error(format!(
            "property {id} is a {name}; {} needs {}",
            card.name(),
            cards.join(" or ")
        )))
    }
}
