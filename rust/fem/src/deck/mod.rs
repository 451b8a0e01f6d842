//! Nastran bulk data: reading, looking up, patching, and turning into a [`crate::mesh::Mesh`].
//!
//! [`Deck::read`] makes one pass over the bytes of the main file and of everything it includes. No field is copied:
//! a field is a span of its file together with the format it is written in, so that messages name file and line,
//! and [`Deck::patched`] writes a new value where the old one stands.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

pub mod build;
pub mod card;
mod case;
mod content;
mod continuation;
mod coord;
pub mod error;
mod files;
mod index;
mod lex;
mod names;
pub mod number;
mod patch;
mod read;
pub mod section;
mod table;

pub use build::{Choice, Selection, build, build_moved};
pub use card::CardRef;
pub use coord::Positions;
pub use error::{At, DeckError, Place, Result};
pub use index::{Entry, Space};
pub use patch::Change;
pub use table::ElementRow;

use content::Content;
use index::{Index, space_of};

use crate::mesh::Id;

/// A deck that was read: cards that make a model, by name and by id.
pub struct Deck {
    content: Content,
    index: Index,
    by_name: Vec<Vec<u32>>,
}

impl Deck {
    /// Reads `path` and the files it includes.
    ///
    /// # Errors
    /// Files that cannot be opened, circular includes, lines that are no bulk data, unknown cards, cards that matter
    /// and are not supported, duplicate ids. Values and references are checked by [`build`].
    pub fn read(path: &Path) -> Result<Self> {
        let content = read::read(path)?;
        let mut by_name = vec![Vec::new(); content.names.count()];
        for (i, card) in content.cards.iter().enumerate() {
            // the number of cards is below the number of cells, which is 32 bit
            by_name[usize::from(card.name)].push(i as u32);
        }
        let mut deck = Self { content, index: Index::default(), by_name };
        deck.index = Index::new(&deck.content, |i| deck.card(i))?;
        Ok(deck)
    }

    /// Paths of all files, the main one first.
    #[must_use]
    pub fn files(&self) -> Vec<PathBuf> {
        self.content.paths()
    }

    /// Path of the main file as text.
    #[must_use]
    pub fn path(&self) -> String {
        self.content.files[0].path.display().to_string()
    }

    /// Card by its index.
    #[must_use]
    pub fn card(&self, i: usize) -> CardRef<'_> {
        CardRef { deck: self, card: &self.content.cards[i] }
    }

    /// Cards with this name, in the order of the deck.
    pub fn cards(&self, name: &str) -> impl Iterator<Item = CardRef<'_>> {
        let list = self.content.names.find_text(name).map_or(&[][..], |id| &self.by_name[usize::from(id)]);
        list.iter().map(|&i| self.card(i as usize))
    }

    /// Number of cards of each name that was read.
    #[must_use]
    pub fn card_counts(&self) -> BTreeMap<&'static str, usize> {
        self.counts(self.by_name.iter().map(Vec::len))
    }

    /// Number of cards of each name that was left out because it has no influence on a modal analysis.
    #[must_use]
    pub fn ignored(&self) -> BTreeMap<&'static str, usize> {
        self.counts(self.content.ignored.iter().copied())
    }

    fn counts(&self, counts: impl Iterator<Item = usize>) -> BTreeMap<&'static str, usize> {
        let named = counts.enumerate().map(|(id, n)| (self.content.names.text(id as u16), n));
        named.filter(|(_, n)| *n > 0).collect()
    }

    /// Executive and case control of the first subcase, names in capitals.
    #[must_use]
    pub fn case_control(&self) -> &BTreeMap<String, String> {
        self.content.case.commands()
    }

    /// Case control of the subcases behind the first, in order, which have no part in the model.
    #[must_use]
    pub fn later_subcases(&self) -> &[(String, String)] {
        self.content.case.later()
    }

    /// PARAM values as written, names in capitals; bulk data wins over case control, the last over the first.
    #[must_use]
    pub fn params(&self) -> BTreeMap<String, String> {
        let mut params: BTreeMap<String, String> = self.content.case.params().iter().cloned().collect();
        for card in self.cards("PARAM") {
            params.insert(card.word(2), String::from_utf8_lossy(card.text(3)).into_owned());
        }
        params
    }

    /// Where each id is defined, ascending by id.
    #[must_use]
    pub fn ids(&self, space: Space) -> &[Entry] {
        self.index.all(space)
    }

    /// The card that defines `id`, and how far its fields stand behind those of the card's first definition.
    ///
    /// # Errors
    /// [`DeckError::Selection`] when there is none.
    pub fn find(&self, name: &str, id: Id) -> Result<(CardRef<'_>, usize)> {
        let upper = name.to_ascii_uppercase();
        let found = match space_of(&upper) {
            Some((space, stride)) => {
                let entry = self.index.get(space, id);
                entry.map(|entry| (self.card(entry.card as usize), usize::from(entry.slot) * stride))
            }
            None => self
                .cards(&upper)
                .find(|card| matches!(card.opt_id(2), Ok(Some(found)) if found == id))
                .map(|card| (card, 0)),
        };
        found.filter(|(card, _)| card.name() == upper).ok_or_else(|| DeckError::Selection {
            file: self.path(),
            what: format!("there is no {upper} {id} in the deck"),
        })
    }

    fn selection_error(&self, what: String) -> DeckError {
        DeckError::Selection { file: self.path(), what }
    }
}
