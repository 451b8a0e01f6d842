//! Where each id is defined; two definitions of one id are an error.

use super::card::CardRef;
use super::content::Content;
use super::error::{DeckError, Result};
use super::number::parse_int;
use crate::mesh::Id;
use std::collections::HashSet;

/// Kinds of things that have ids of their own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Space {
    /// GRID, SPOINT.
    Node,
    /// CORDi.
    Coord,
    /// Elements with stiffness or damping.
    Element,
    /// CONMi, CMASSi.
    Mass,
    /// RBEi.
    Rigid,
    /// Properties of bars, beams, rods, shells and solids.
    Property,
    /// PBUSH.
    Bush,
    /// PELAS.
    Spring,
    /// PDAMP.
    Damper,
    /// PMASS.
    ScalarMass,
    /// MATi.
    Material,
}

const N_SPACES: usize = Space::Material as usize + 1;

/// Where one id stands.
#[derive(Debug, Clone, Copy)]
pub struct Entry {
    /// The id.
    pub id: Id,
    /// Index of the card.
    pub card: u32,
    /// Which of the several things the card defines: their fields are shifted by `slot * stride`.
    pub slot: u8,
    /// Is it a scalar point?
    pub scalar: bool,
}

/// More scalar points than a reduced model has: a range that nobody meant.
const MAX_SCALAR_POINTS: usize = 1_000_000;

/// Ids of every space, ascending.
#[derive(Default)]
pub struct Index {
    spaces: [Vec<Entry>; N_SPACES],
}

/// Space of a card, and the distance in fields between the things it defines (0: only one).
#[must_use]
pub fn space_of(name: &str) -> Option<(Space, usize)> {
    Some(match name {
        "GRID" => (Space::Node, 0),
        "CORD1R" | "CORD1C" | "CORD1S" => (Space::Coord, 4),
        "CORD2R" | "CORD2C" | "CORD2S" => (Space::Coord, 0),
        "CONM1" | "CONM2" | "CMASS1" | "CMASS2" | "CMASS3" | "CMASS4" => (Space::Mass, 0),
        "RBAR" | "RBE2" | "RBE3" => (Space::Rigid, 0),
        "PBAR" | "PBARL" | "PBEAM" | "PBEAML" | "PROD" | "PSHELL" | "PCOMP" | "PCOMPG" | "PSOLID" => {
            (Space::Property, 0)
        }
        "PBUSH" => (Space::Bush, 0),
        "PELAS" => (Space::Spring, 4),
        "PDAMP" => (Space::Damper, 2),
        "PMASS" => (Space::ScalarMass, 2),
        "MAT1" | "MAT2" | "MAT8" | "MAT9" => (Space::Material, 0),
        _ if name.starts_with('C') => (Space::Element, 0),
        _ => return None,
    })
}

impl Index {
    /// Collects the ids of all cards. `card` gives a card by its index.
    pub fn new<'d>(content: &'d Content, card: impl Fn(usize) -> CardRef<'d>) -> Result<Self> {
        let spaces: Vec<_> =
            (0..content.names.count()).map(|id| space_of(content.names.text(id as u16))).collect();
        let mut index = Self::default();
        for (i, raw) in content.cards.iter().enumerate() {
            let Some((space, stride)) = spaces[usize::from(raw.name)] else { continue };
            let entries = &mut index.spaces[space as usize];
            let this = card(i);
            let slots = 8_usize.checked_div(stride).unwrap_or(1);
            for slot in 0..slots {
                let field = 2 + slot * stride;
                if slot > 0 && this.blank(field) {
                    continue;
                }
                let id = match parse_int(this.text(field)) {
                    Some(id @ 1..=2_147_483_647) => id as Id,
                    _ => this.id(field, "the id")?,
                };
                entries.push(Entry { id, card: i as u32, slot: slot as u8, scalar: false });
            }
        }
        index.scalar_points(content, &card)?;
        for entries in &mut index.spaces {
            if !entries.is_sorted_by_key(|entry| entry.id) {
                entries.sort_by_key(|entry| entry.id);
            }
            entries.shrink_to_fit();
            if let Some(pair) = entries.windows(2).find(|pair| pair[0].id == pair[1].id) {
                let (at, other) = (card(pair[1].card as usize), card(pair[0].card as usize));
                return Err(DeckError::Duplicate { at: at.at_field(2), other: other.at_field(2) });
            }
        }
        Ok(index)
    }

    /// Adds the scalar points: those of SPOINT, and those that CELAS3, CELAS4, CDAMP3, CDAMP4, CMASS3 and CMASS4 name,
    /// each once however often it is named (Nastran asks for SPOINT only where no such card names the point).
    fn scalar_points<'d>(
        &mut self,
        content: &'d Content,
        card: &impl Fn(usize) -> CardRef<'d>,
    ) -> Result<()> {
        let mut points: Vec<Entry> = Vec::new();
        for i in 0..content.cards.len() {
            let this = card(i);
            let ranges = match this.name() {
                "SPOINT" => this.id_ranges(2)?,
                "CELAS3" | "CELAS4" | "CDAMP3" | "CDAMP4" | "CMASS3" | "CMASS4" => {
                    let ends = [this.opt_id(4)?, this.opt_id(5)?];
                    ends.into_iter().flatten().map(|id| (id, id)).collect()
                }
                _ => continue,
            };
            for (first, last) in ranges {
                if points.len() + (last - first) as usize >= MAX_SCALAR_POINTS {
                    return Err(this.value_error(format!(
                        "more than {MAX_SCALAR_POINTS} scalar points; correct the range {first} THRU {last}"
                    )));
                }
                points.extend((first..=last).map(|id| Entry { id, card: i as u32, slot: 0, scalar: true }));
            }
        }
        points.sort_by_key(|entry| entry.id);
        points.dedup_by_key(|entry| entry.id);
        if !points.is_empty() {
            // an element between scalar points that names a GRID is told when it is built; SPOINT is a second definition
            let grids: HashSet<Id> = self.spaces[Space::Node as usize].iter().map(|entry| entry.id).collect();
            points.retain(|entry| card(entry.card as usize).name() == "SPOINT" || !grids.contains(&entry.id));
        }
        self.spaces[Space::Node as usize].append(&mut points);
        Ok(())
    }

    /// Entry of `id`.
    #[must_use]
    pub fn get(&self, space: Space, id: Id) -> Option<Entry> {
        self.position(space, id).map(|i| self.spaces[space as usize][i])
    }

    /// Rank of `id` among the ids of its space.
    #[must_use]
    pub fn position(&self, space: Space, id: Id) -> Option<usize> {
        self.spaces[space as usize].binary_search_by_key(&id, |entry| entry.id).ok()
    }

    /// All ids of a space, ascending.
    #[must_use]
    pub fn all(&self, space: Space) -> &[Entry] {
        &self.spaces[space as usize]
    }

    /// Nodes with an id in `first..=last`, ascending.
    pub fn nodes_between(&self, first: Id, last: Id) -> impl Iterator<Item = &Entry> {
        let nodes = &self.spaces[Space::Node as usize];
        let start = nodes.partition_point(|entry| entry.id < first);
        nodes[start..].iter().take_while(move |entry| entry.id <= last)
    }
}
