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
        let mut behind: BTreeMap<(usize, usize), Behind<'_>> = BTreeMap::new();
        for change in changes {
            let (card, shift) = self.find(&change.card, change.id)?;
            let field = change.field + shift;
            if let Some(end) = self.line_end(card, field) {
                let entry = behind.entry((card.file_index(), end.at));
                entry.or_insert_with(|| (card, end, Vec::new())).2.push((field, change));
                continue;
            }
            let edit = self.edit(card, change, field)?;
            edits.entry(card.file_index()).or_default().push(edit);
        }
        for ((file, _), (card, end, mut fields)) in behind {
            fields.sort_by_key(|f| f.0);
            let edit = self.append(card, &end, &fields)?;
            edits.entry(file).or_default().push(edit);
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

    /// Where the line of a GRID ends, if the coordinate `field` would stand behind its end and can: free or small fields
    /// without tabs. A coordinate left off is 0, and a node that moves has to have it.
    fn line_end(&self, card: CardRef<'_>, field: usize) -> Option<LineEnd> {
        let there = |f: usize| card.cell(f).format != Format::Absent;
        if card.name() != "GRID" || !(4..=6).contains(&field) || (field..=9).any(there) || there(12) {
            return None;
        }
        let last = (2..field).rev().find(|&f| there(f))?;
        let cell = card.cell(last);
        let start = cell.start as usize - usize::from(cell.lead);
        let at = start + usize::from(cell.width);
        let text = &self.content.files[card.file_index()].text;
        let line = text[..at].iter().rposition(|&c| c == b'\n').map_or(0, |n| n + 1);
        let format = cell.format;
        let fits = format == Format::Free || (format == Format::Small && !text[line..at].contains(&b'\t'));
        fits.then_some(LineEnd { last, at, format, width: usize::from(cell.width) })
    }

    /// Values of fields (ascending) that the line of a card ends before.
    fn append(&self, card: CardRef<'_>, end: &LineEnd, fields: &[(usize, &Change)]) -> Result<Edit> {
        let most = if end.format == Format::Free { FREE } else { 8 };
        let (mut text, mut done) = (String::new(), end.last);
        if end.format == Format::Small {
            text.push_str(&" ".repeat(8 - end.width.min(8)));
        }
        for &(field, change) in fields {
            let place = card.at().place;
            let error = |what: String| {
                let what =
                    format!("line {}: {} {} field {field}: {what}", place.line, card.name(), change.id);
                DeckError::Patch { file: place.file.clone(), what }
            };
            if field == done {
                return Err(error("the same field is changed twice".to_owned()));
            }
            let number = format_real(change.value, most)
                .ok_or_else(|| error(format!("{} does not fit into {most} columns", change.value)))?;
            if end.format == Format::Free {
                text.push_str(&",".repeat(field - done));
            } else {
                let columns = 8 * (field - end.last - 1) + 8 - end.width.min(8);
                text.push_str(&" ".repeat(columns.saturating_sub(text.len())));
            }
            text.push_str(&number);
            done = field;
        }
        // what stands behind stays where it is as long as there are blanks to write over
        let source = &self.content.files[card.file_index()].text;
        let blanks = source[end.at..].iter().take(text.len()).take_while(|&&c| c == b' ').count();
        Ok(Edit { start: end.at, end: end.at + blanks, text })
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

/// What to put behind the line of a card: values by field.
type Behind<'a> = (CardRef<'a>, LineEnd, Vec<(usize, &'a Change)>);

/// The end of a card's first line: its last field, where that ends, how it is written, its bytes.
struct LineEnd {
    last: usize,
    at: usize,
    format: Format,
    width: usize,
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
