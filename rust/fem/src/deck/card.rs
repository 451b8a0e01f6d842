//! A card of a deck and its fields, by Nastran's field numbers.
//!
//! Field 1 is the name, 2 to 9 the data of the first line, 12 to 19 of the second, 22 to 29 of the third, and so on,
//! whatever the format; 10, 11, 20, 21 ... are continuation marks.

use super::Deck;
use super::content::Card;
use super::error::{At, DeckError, Place, Result};
use super::lex::{Cell, Format};
use super::number::{parse_int, parse_real};
use crate::mesh::{Components, Id};

/// Data position (from 0) of field number `field`; `None` for names and continuation marks.
#[must_use]
pub fn position(field: usize) -> Option<usize> {
    let (row, column) = (field.checked_sub(1)? / 10, (field - 1) % 10);
    (1..=8).contains(&column).then(|| 8 * row + column - 1)
}

/// Field number of data position `position` (from 0).
#[must_use]
pub fn field_number(position: usize) -> usize {
    10 * (position / 8) + position % 8 + 2
}

/// A card in its deck.
#[derive(Clone, Copy)]
pub struct CardRef<'d> {
    pub(super) deck: &'d Deck,
    pub(super) card: &'d Card,
}

impl<'d> CardRef<'d> {
    /// Name in capitals.
    #[must_use]
    pub fn name(&self) -> &'static str {
        self.deck.content.names.text(self.card.name)
    }

    /// Cell of a field; absent when the card is shorter.
    #[must_use]
    pub fn cell(&self, field: usize) -> Cell {
        let cell = position(field).filter(|&p| p < self.card.n as usize);
        cell.map_or(Cell::ABSENT, |p| self.deck.content.cells[self.card.first as usize + p])
    }

    /// Trimmed text of a field; empty when blank.
    #[must_use]
    pub fn text(&self, field: usize) -> &'d [u8] {
        let cell = self.cell(field);
        let start = cell.start as usize;
        &self.deck.content.files[usize::from(self.card.file)].text[start..start + usize::from(cell.len)]
    }

    /// Is the field blank?
    #[must_use]
    pub fn blank(&self, field: usize) -> bool {
        self.cell(field).len == 0
    }

    /// Field numbers that follow `from` (included) up to the last one that is on the card.
    pub fn fields_from(&self, from: usize) -> impl Iterator<Item = usize> + use<> {
        let n = self.card.n as usize;
        (position(from).unwrap_or(n)..n).map(field_number)
    }

    /// File and line of the card's first line.
    #[must_use]
    pub fn place(&self) -> Place {
        self.deck.content.files[usize::from(self.card.file)].place(self.card.pos as usize)
    }

    /// Path of the file the card stands in.
    #[must_use]
    pub fn file_index(&self) -> usize {
        usize::from(self.card.file)
    }

    /// Name and the text of field 2, with the place of the card.
    #[must_use]
    pub fn at(&self) -> Box<At> {
        let id = String::from_utf8_lossy(self.text(2));
        let card = if id.is_empty() { self.name().to_owned() } else { format!("{} {id}", self.name()) };
        Box::new(At { place: self.place(), card })
    }

    /// As [`Self::at`], with the line of the field.
    #[must_use]
    pub fn at_field(&self, field: usize) -> Box<At> {
        let mut at = self.at();
        let cell = self.cell(field);
        if cell.format != Format::Absent {
            at.place = self.deck.content.files[usize::from(self.card.file)].place(cell.start as usize);
        }
        at
    }

    /// Error: the field's text is not `expected`.
    #[must_use]
    pub fn wrong(&self, field: usize, expected: &'static str) -> DeckError {
        let text = String::from_utf8_lossy(self.text(field)).into_owned();
        DeckError::Field { at: self.at_field(field), field, text, expected }
    }

    /// Error about the card as a whole.
    #[must_use]
    pub fn value_error(&self, what: impl Into<String>) -> DeckError {
        DeckError::Value { at: self.at(), what: what.into() }
    }

    /// Error: field refers to something that is not there.
    #[must_use]
    pub fn missing(&self, field: usize, kind: &'static str, id: Id) -> DeckError {
        DeckError::MissingReference { at: self.at_field(field), field, kind, id }
    }

    fn required<T>(
        &self,
        value: Option<T>,
        field: usize,
        what: &'static str,
        expected: &'static str,
    ) -> Result<T> {
        value.ok_or_else(|| DeckError::MissingField { at: self.at(), field, what, expected })
    }

    /// Is the field written as an integer?
    #[must_use]
    pub fn is_int(&self, field: usize) -> bool {
        parse_int(self.text(field)).is_some()
    }

    /// Integer, `None` when blank.
    pub fn opt_int(&self, field: usize) -> Result<Option<i64>> {
        let text = self.text(field);
        if text.is_empty() {
            return Ok(None);
        }
        parse_int(text).map(Some).ok_or_else(|| self.wrong(field, "an integer"))
    }

    /// Id: positive integer; `None` when blank or 0.
    pub fn opt_id(&self, field: usize) -> Result<Option<Id>> {
        match self.opt_int(field)? {
            None | Some(0) => Ok(None),
            Some(value) => match Id::try_from(value) {
                Ok(id) if id <= 2_147_483_647 => Ok(Some(id)),
                _ => Err(self.wrong(field, "an id (a positive integer up to 2147483647)")),
            },
        }
    }

    /// Id that must be there.
    pub fn id(&self, field: usize, what: &'static str) -> Result<Id> {
        if self.opt_int(field)? == Some(0) {
            return Err(self.wrong(field, "a positive integer"));
        }
        let id = self.opt_id(field)?;
        self.required(id, field, what, "a positive integer")
    }

    /// Real, `None` when blank.
    pub fn opt_real(&self, field: usize) -> Result<Option<f64>> {
        let text = self.text(field);
        if text.is_empty() {
            return Ok(None);
        }
        parse_real(text).map(Some).ok_or_else(|| self.wrong(field, "a number"))
    }

    /// Real with a default for blank.
    pub fn real_or(&self, field: usize, default: f64) -> Result<f64> {
        Ok(self.opt_real(field)?.unwrap_or(default))
    }

    /// Real that must be there.
    pub fn real(&self, field: usize, what: &'static str) -> Result<f64> {
        let value = self.opt_real(field)?;
        self.required(value, field, what, "a number")
    }

    /// Three reals, blank = 0.
    pub fn vector(&self, fields: [usize; 3]) -> Result<[f64; 3]> {
        Ok([self.real_or(fields[0], 0.0)?, self.real_or(fields[1], 0.0)?, self.real_or(fields[2], 0.0)?])
    }

    /// Word in capitals; empty when blank.
    #[must_use]
    pub fn word(&self, field: usize) -> String {
        String::from_utf8_lossy(self.text(field)).to_ascii_uppercase()
    }

    /// Components such as `1246`; empty when blank (or `0`).
    pub fn components(&self, field: usize) -> Result<Components> {
        let text = self.text(field);
        if text == b"0" {
            return Ok(Components::default());
        }
        let digit = |c: &u8| (b'1'..=b'6').contains(c).then(|| c - b'0');
        let list: Option<Vec<u8>> = text.iter().map(digit).collect();
        list.map(|list| Components::from_list(&list))
            .ok_or_else(|| self.wrong(field, "a list of components 1 to 6"))
    }

    /// One component 1 to 6; 0 and blank give `None` (the scalar component).
    pub fn component(&self, field: usize) -> Result<Option<u8>> {
        match self.opt_int(field)? {
            None | Some(0) => Ok(None),
            Some(c @ 1..=6) => Ok(Some(c as u8)),
            Some(_) => Err(self.wrong(field, "a component 1 to 6")),
        }
    }

    /// Ids from field `from` to the end of the card as ranges (first, last): `5 THRU 9` is one, `5` is (5, 5).
    pub fn id_ranges(&self, from: usize) -> Result<Vec<(Id, Id)>> {
        let mut fields = self.fields_from(from).filter(|&field| !self.blank(field)).peekable();
        let mut ranges = Vec::new();
        while let Some(field) = fields.next() {
            let first = self.id(field, "an id")?;
            let mut last = first;
            if fields.next_if(|&f| self.text(f).eq_ignore_ascii_case(b"THRU")).is_some() {
                let end = fields
                    .next()
                    .ok_or_else(|| self.value_error("THRU without the id that ends the range"))?;
                last = self.id(end, "end of the THRU range")?;
                if last < first {
                    return Err(self.value_error(format!("range {first} THRU {last} runs backwards")));
                }
            }
            ranges.push((first, last));
        }
        Ok(ranges)
    }

    /// Node ids from field `from` to the end of the card, each with its field. `THRU` (and `BY`) stand for the nodes
    /// of the range that exist; an id that stands alone is returned whether it exists or not. With `real_ends` a real
    /// behind the ids ends the list, and ranges pass over scalar points: so it is where nodes are bound rigidly.
    pub fn node_list(&self, from: usize, real_ends: bool) -> Result<Vec<(usize, Id)>> {
        let fields: Vec<usize> = self.fields_from(from).filter(|&field| !self.blank(field)).collect();
        let mut list = Vec::with_capacity(fields.len());
        let mut i = 0;
        while i < fields.len() {
            let text = self.text(fields[i]);
            if real_ends && i > 0 && parse_int(text).is_none() && parse_real(text).is_some() {
                break;
            }
            let first = self.id(fields[i], "an id")?;
            if i + 1 < fields.len() && self.text(fields[i + 1]).eq_ignore_ascii_case(b"THRU") {
                let end = fields
                    .get(i + 2)
                    .ok_or_else(|| self.value_error("THRU without the id that ends the range"))?;
                let last = self.id(*end, "end of the THRU range")?;
                if last < first {
                    return Err(self.value_error(format!("range {first} THRU {last} runs backwards")));
                }
                i += 3;
                let mut step = 1;
                if i + 1 < fields.len() && self.text(fields[i]).eq_ignore_ascii_case(b"BY") {
                    step = self.id(fields[i + 1], "step of the THRU range")?;
                    i += 2;
                }
                let met =
                    self.deck.index.nodes_between(first, last).filter(|entry| {
                        (entry.id - first).is_multiple_of(step) && !(real_ends && entry.scalar)
                    });
                list.extend(met.map(|entry| (*end, entry.id)));
            } else {
                list.push((fields[i], first));
                i += 1;
            }
        }
        Ok(list)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn field_numbers_skip_the_continuation_marks() {
        assert_eq!(
            [1, 2, 9, 10, 11, 12, 19, 22].map(position),
            [None, Some(0), Some(7), None, None, Some(8), Some(15), Some(16)]
        );
        for p in 0..100 {
            assert_eq!(position(field_number(p)), Some(p));
        }
    }
}
