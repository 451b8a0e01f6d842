//! What a pass over a deck found: its files and its cards, as places in their text.

use std::path::PathBuf;

use super::case::CaseControl;
use super::files::SourceFile;
use super::lex::Cell;
use super::names::{NameId, Names};

/// One card: its name, where it begins, and which cells are its fields.
#[derive(Debug, Clone, Copy)]
pub struct Card {
    /// First cell in [`Content::cells`].
    pub first: u32,
    /// Number of cells.
    pub n: u32,
    /// Offset of its first line in the file.
    pub pos: u32,
    /// Name.
    pub name: NameId,
    /// File.
    pub file: u16,
}

/// Everything the pass found.
#[derive(Default)]
pub struct Content {
    /// Files, the main one first.
    pub files: Vec<SourceFile>,
    /// Known card names.
    pub names: Names,
    /// Cards that are used, in order.
    pub cards: Vec<Card>,
    /// Fields of all cards.
    pub cells: Vec<Cell>,
    /// Per name: how many cards were left out as irrelevant.
    pub ignored: Vec<usize>,
    /// Executive and case control.
    pub case: CaseControl,
    /// File and offset of the line with ENDDATA.
    pub end: Option<(u16, u32)>,
}

impl Content {
    /// Paths of all files, the main one first.
    #[must_use]
    pub fn paths(&self) -> Vec<PathBuf> {
        self.files.iter().map(|file| file.path.clone()).collect()
    }
}
