//! New values written where the old ones stand; everything else stays byte for byte.

use std::collections::BTreeMap;
use std::path::PathBuf;

use super::card::CardRef;
use super::error::{DeckError, Result};
use super::lex::{Cell, Format};
use super::number::format_real;
use super::{Deck, Space};
use crate::mesh::Id;

/// A new value for one field.
#[derive(Debug, Clone, PartialEq)]
pub struct Change {
    /// Card name.
    pub card: String,
    /// Its id (field 2, or the id inside a card that defines several things).
    pub id: Id,
    /// Nastran field number, e.g. 3 for E of MAT1; of a card with several definitions that of the first.
    pub field: usize,
    /// The value.
    pub value: f64,
}

struct Edit {
    start: usize,
    end: usize,
    text: String,
}

impl Deck {
    /// Bytes of the files that differ once `changes` are made and the lines of `additions` are put before ENDDATA
    /// (at the end if there is none). Numbers are written as least as their field allows.
    ///
    /// # Errors
    /// [`DeckError::Selection`] for a card that is not there, [`DeckError::Patch`] for a field that is not on the card
    /// or too narrow for the value.
    pub fn patched(&self, changes: &[Change], additions: &[String]) -> Result<BTreeMap<PathBuf, Vec<u8>>> {
        let mut edits: BTreeMap<usize, Vec<Edit>> = BTreeMap::new();
        for change in changes {
            let (card, shift) = self.find(&change.card, change.id)?;
            let edit = self.edit(card, change, change.field + shift)?;
            edits.entry(card.file_index()).or_default().push(edit);
        }
        if !additions.is_empty() {
            let (file, edit) = self.addition(additions)?;
            edits.entry(file).or_default().push(edit);
        }
        let mut files = BTreeMap::new();
        for (file, mut edits) in edits {
            edits.sort_by_key(|edit| edit.start);
            files.insert(self.content.files[file].path.clone(), self.apply(file, &edits)?);
        }
        Ok(files)
    }

    fn apply(&self, file: usize, edits: &[Edit]) -> Result<Vec<u8>> {
        let source = &self.content.files[file];
        let mut out = Vec::with_capacity(source.text.len() + 32 * edits.len());
        let mut done = 0;
        for edit in edits {
            if edit.start < done {
                let what = format!("line {}: the same field is changed twice", source.line_of(edit.start));
                return Err(DeckError::Patch { file: source.path.display().to_string(), what });
            }
            out.extend_from_slice(&source.text[done..edit.start]);
            out.extend_from_slice(edit.text.as_bytes());
            done = edit.end;
        }
        out.extend_from_slice(&source.text[done..]);
        Ok(out)
    }

    fn edit(&self, card: CardRef<'_>, change: &Change, field: usize) -> Result<Edit> {
        let place = card.at_field(field).place;
        let error = |what: String| {
            let what = format!("line {}: {} {} field {field}: {what}", place.line, card.name(), change.id);
            DeckError::Patch { file: place.file.clone(), what }
        };
        let cell = card.cell(field);
        if cell.format == Format::Absent {
            return Err(error(
                "is not written on the card, so it has no place for a new value; write its value there first"
                    .to_owned(),
            ));
        }
        let text = &self.content.files[card.file_index()].text;
        let room = Room::of(&cell, text);
        let number = format_real(change.value, room.most)
            .ok_or_else(|| error(format!("{} does not fit into {} columns", change.value, room.most)))?;
        Ok(room.write(&number))
    }

    /// Lines to add, with the line end of the main file, and where they go.
    fn addition(&self, lines: &[String]) -> Result<(usize, Edit)> {
        let (file, start) = match self.content.end {
            Some((file, start)) => (usize::from(file), start as usize),
            None => (0, self.content.files[0].text.len()),
        };
        let source = &self.content.files[file];
        let newline = if source.text.windows(2).any(|pair| pair == b"\r\n") { "\r\n" } else { "\n" };
        let mut text = String::new();
        if start > 0 && source.text[start - 1] != b'\n' {
            text.push_str(newline);
        }
        for line in lines {
            if line.contains(['\n', '\r']) {
                let what = format!("added line {line:?} contains a line end; give each line on its own");
                return Err(DeckError::Patch { file: source.path.display().to_string(), what });
            }
            text.push_str(line);
            text.push_str(newline);
        }
        Ok((file, Edit { start, end: start, text }))
    }

    /// Smallest id above all ids of a space, 1 if there are none.
    #[must_use]
    pub fn next_id(&self, space: Space) -> Id {
        self.ids(space).last().map_or(1, |entry| entry.id.saturating_add(1))
    }
}

/// The columns a field may use.
struct Room {
    start: usize,
    end: usize,
    /// Blanks to keep before the number.
    lead: usize,
    /// Longest number.
    most: usize,
    /// Columns the cell must have afterwards at least, so that what stands behind it stays where it is.
    least: usize,
}

/// Longest number in a free field: enough for every bit of a double.
const FREE: usize = 24;

impl Room {
    fn of(cell: &Cell, text: &[u8]) -> Self {
        let start = cell.start as usize - usize::from(cell.lead);
        let end = start + usize::from(cell.width);
        let columns: usize = match cell.format {
            Format::Small => 8,
            Format::Large => 16,
            Format::Free | Format::Absent => {
                let start = cell.start as usize;
                return Self { start, end: start + usize::from(cell.len), lead: 0, most: FREE, least: 0 };
            }
        };
        // blanks before a comment or the line's end belong to the cell's columns too
        let blanks =
            text[end..].iter().take(columns.saturating_sub(end - start)).take_while(|&&c| c == b' ').count();
        let (end, lead) = (end + blanks, usize::from(cell.lead));
        let taken = end - start;
        match text.get(end) {
            // a tab that ends the cell takes the rest of its own eight columns
            Some(b'\t') if taken < columns => {
                let stop = (taken / 8 + 1) * 8;
                Self { start, end, lead: 0, most: stop - 1, least: stop - 8 }
            }
            None | Some(b'\r' | b'\n') if taken < columns && blanks == 0 => {
                Self { start, end, lead, most: columns, least: 0 }
            }
            _ => Self { start, end, lead, most: columns, least: taken.min(columns) },
        }
    }

    fn write(&self, number: &str) -> Edit {
        let width = self.least.max(number.len());
        let lead = self.lead.min(self.most.saturating_sub(number.len()));
        let padded = format!("{:lead$}{number}", "");
        // a number that stood at the right edge stays there, any other stays where it began
        let text = format!("{padded:<width$}");
        Edit { start: self.start, end: self.end, text }
    }
}
