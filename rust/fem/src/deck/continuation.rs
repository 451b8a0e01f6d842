//! Joining continuation lines to their cards: those that follow, and named ones that stand elsewhere.

use std::collections::{HashMap, HashSet};

use super::content::Content;
use super::error::{At, DeckError, Result};
use super::lex::{Cell, Line};

/// Fields of a card being read and where its next line's fields go.
#[derive(Debug, Clone, Copy)]
pub struct Growing {
    first: u32,
    /// Data fields the lines so far stand for, whether written or not.
    fields: u32,
}

/// What the next continuation line belongs to.
#[derive(Debug, Default)]
pub enum Open {
    /// No card yet in this file.
    #[default]
    Nothing,
    /// A card that is not kept.
    Skipped {
        /// Continuation name at its end.
        tail: Vec<u8>,
    },
    /// The card read last.
    Card {
        /// Index of the card.
        card: usize,
        /// Its fields.
        growing: Growing,
        /// Continuation name at its end.
        tail: Vec<u8>,
    },
    /// A continuation that stands apart from its card.
    Stray {
        /// Index in the list of strays.
        stray: usize,
        /// Its fields.
        growing: Growing,
        /// Continuation name at its end.
        tail: Vec<u8>,
    },
}

struct Stray {
    head: Vec<u8>,
    tail: Vec<u8>,
    file: u16,
    pos: u32,
    first: u32,
    n: u32,
    large: bool,
}

/// Cards and strays whose last line names a continuation that did not follow.
#[derive(Default)]
pub struct Continuations {
    /// Name to card; `None` for a card that is not kept.
    waiting: HashMap<Vec<u8>, Option<(usize, Growing)>>,
    strays: Vec<Stray>,
    /// Names at the end of strays.
    promised: HashSet<Vec<u8>>,
}

impl Growing {
    /// Appends the cells of `line`, blank fields in between made up.
    fn add(&mut self, cells: &mut Vec<Cell>, line_cells: &[Cell], large: bool) {
        let per_line = if large { 4 } else { 8 };
        if !large {
            self.fields = self.fields.next_multiple_of(8);
        }
        let want = (self.first + self.fields) as usize;
        cells.resize(want.max(cells.len()), Cell::ABSENT);
        cells.extend_from_slice(line_cells);
        self.fields += (line_cells.len() as u32).max(1).next_multiple_of(per_line);
    }
}

fn span(content: &Content, file: u16, at: (u32, u8)) -> Vec<u8> {
    let (start, len) = (at.0 as usize, usize::from(at.1));
    content.files[usize::from(file)].text[start..start + len].to_ascii_uppercase()
}

impl Continuations {
    /// Continuation name at the end of `line`; empty for most lines.
    pub fn tail_text(&self, content: &Content, line: &Line, file: u16) -> Vec<u8> {
        if line.tail.1 == 0 { Vec::new() } else { span(content, file, line.tail) }
    }

    /// Takes the first line of the card pushed last.
    pub fn first_line(&self, content: &mut Content, line: &Line, tail: Vec<u8>) -> Open {
        let card = content.cards.len() - 1;
        let mut growing = Growing { first: content.cards[card].first, fields: 0 };
        growing.add(&mut content.cells, &line.cells, line.large);
        content.cards[card].n = content.cells.len() as u32 - growing.first;
        Open::Card { card, growing, tail }
    }

    /// Gives a continuation line to the open card, or keeps it as a stray if it bears another name.
    pub fn continue_card(
        &mut self,
        content: &mut Content,
        open: &mut Open,
        line: &Line,
        file: u16,
        start: usize,
    ) -> std::result::Result<(), String> {
        let head = if line.head.1 == 0 { Vec::new() } else { span(content, file, line.head) };
        let new_tail = self.tail_text(content, line, file);
        let fits = |tail: &[u8]| head.is_empty() || tail == head || (tail.is_empty() && !self.awaited(&head));
        match open {
            Open::Card { card, growing, tail } if fits(tail) => {
                growing.add(&mut content.cells, &line.cells, line.large);
                content.cards[*card].n = content.cells.len() as u32 - growing.first;
                *tail = new_tail;
            }
            Open::Stray { stray, growing, tail } if fits(tail) => {
                growing.add(&mut content.cells, &line.cells, line.large);
                self.strays[*stray].n = content.cells.len() as u32 - growing.first;
                self.strays[*stray].tail.clone_from(&new_tail);
                *tail = new_tail;
            }
            Open::Skipped { tail } if fits(tail) => *tail = new_tail,
            Open::Nothing if head.is_empty() => {
                return Err("a continuation line without a card before it".to_owned());
            }
            _ => {
                self.close(std::mem::take(open));
                *open = self.stray(content, line, (head, new_tail), file, start);
            }
        }
        Ok(())
    }

    fn stray(
        &mut self,
        content: &mut Content,
        line: &Line,
        names: (Vec<u8>, Vec<u8>),
        file: u16,
        start: usize,
    ) -> Open {
        let (head, tail) = names;
        let mut growing = Growing { first: content.cells.len() as u32, fields: 0 };
        growing.add(&mut content.cells, &line.cells, line.large);
        let n = content.cells.len() as u32 - growing.first;
        let large = line.large;
        self.strays.push(Stray {
            head,
            tail: tail.clone(),
            file,
            pos: start as u32,
            first: growing.first,
            n,
            large,
        });
        Open::Stray { stray: self.strays.len() - 1, growing, tail }
    }

    /// The open card gets no further line here; if it names a continuation, that may stand elsewhere.
    pub fn close(&mut self, open: Open) {
        match open {
            Open::Card { card, growing, tail } if !tail.is_empty() => {
                self.waiting.insert(tail, Some((card, growing)));
            }
            Open::Skipped { tail } if !tail.is_empty() => {
                self.waiting.insert(tail, None);
            }
            Open::Stray { tail, .. } if !tail.is_empty() => {
                self.promised.insert(tail);
            }
            _ => {}
        }
    }

    /// Is `name` the continuation of something that stands elsewhere?
    fn awaited(&self, name: &[u8]) -> bool {
        self.waiting.contains_key(name) || self.promised.contains(name)
    }

    /// Joins the strays to their cards; a stray that belongs to none is an error.
    pub fn resolve(mut self, content: &mut Content) -> Result<()> {
        while !self.strays.is_empty() {
            let before = self.strays.len();
            for stray in std::mem::take(&mut self.strays) {
                match self.waiting.remove(&stray.head) {
                    None => self.strays.push(stray),
                    Some(None) => {
                        self.waiting.insert(stray.tail, None);
                    }
                    Some(Some((card, growing))) => {
                        let growing = join(content, card, growing, &stray)?;
                        self.waiting.insert(stray.tail, Some((card, growing)));
                    }
                }
            }
            if self.strays.len() == before {
                let stray = &self.strays[0];
                let what = format!(
                    "continuation '{}' belongs to no card: no card's last field bears this name",
                    String::from_utf8_lossy(&stray.head)
                );
                let place = content.files[usize::from(stray.file)].place(stray.pos as usize);
                return Err(DeckError::Line { place, what });
            }
        }
        Ok(())
    }
}

/// Moves the card's cells to the end of the list and puts those of the stray behind them.
fn join(content: &mut Content, card: usize, growing: Growing, stray: &Stray) -> Result<Growing> {
    let old = content.cards[card];
    if old.file != stray.file {
        let place = content.files[usize::from(stray.file)].place(stray.pos as usize);
        let card = content.names.text(old.name).to_owned();
        let what = "its continuation stands in another file; put both into one file".to_owned();
        return Err(DeckError::Value { at: Box::new(At { place, card }), what });
    }
    let mut growing = Growing { first: content.cells.len() as u32, ..growing };
    content.cells.extend_from_within(old.first as usize..(old.first + old.n) as usize);
    let cells = content.cells[stray.first as usize..(stray.first + stray.n) as usize].to_vec();
    growing.add(&mut content.cells, &cells, stray.large);
    content.cards[card].first = growing.first;
    content.cards[card].n = content.cells.len() as u32 - growing.first;
    Ok(growing)
}
