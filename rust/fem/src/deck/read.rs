//! One pass over the bytes of a deck and the files it includes.

use std::path::Path;
use std::sync::Arc;

use super::content::{Card, Content};
use super::continuation::{Continuations, Open};
use super::error::{At, DeckError, Place, Result};
use super::files::{SourceFile, include_name, open_included};
use super::lex::{Line, cut};
use super::names::{NameId, Names, Role};

#[derive(Clone, Copy, PartialEq, Eq)]
enum Section {
    /// Before the first line that says something.
    Start,
    Executive,
    Case,
    Bulk,
}

struct Reader {
    content: Content,
    section: Section,
    /// Files being read, outermost first.
    stack: Vec<u16>,
    open: Open,
    continuations: Continuations,
    refused: Vec<(NameId, u16, u32)>,
    line: Line,
    /// Name found last: most lines repeat it.
    last: ([u8; 8], NameId),
}

/// Reads `path` and everything it includes. Unknown and unsupported cards are errors.
pub fn read(path: &Path) -> Result<Content> {
    let main = SourceFile::open(path)
        .map_err(|reason| DeckError::Open { file: path.display().to_string(), reason })?;
    let names = Names::new();
    let ignored = vec![0; names.count()];
    let mut reader = Reader {
        section: if has_sections(&main.text) { Section::Start } else { Section::Bulk },
        content: Content { files: vec![main], names, ignored, ..Content::default() },
        stack: Vec::new(),
        open: Open::Nothing,
        continuations: Continuations::default(),
        refused: Vec::new(),
        line: Line::default(),
        last: ([0; 8], 0),
    };
    reader.file(0)?;
    reader.close();
    if reader.content.cards.is_empty()
        && reader.refused.is_empty()
        && reader.content.ignored.iter().all(|&n| n == 0)
    {
        let what = "no bulk data: not one card stands in the deck".to_owned();
        return Err(DeckError::Line { place: reader.place(0, 0), what });
    }
    std::mem::take(&mut reader.continuations).resolve(&mut reader.content)?;
    reader.refuse()?;
    Ok(reader.content)
}

/// Does the main file have more than bulk data? So it is when a line begins one of the other sections or bulk data, or
/// when it begins with an INCLUDE, which may hold them.
fn has_sections(text: &[u8]) -> bool {
    let mut lines = text
        .split(|&c| c == b'\n')
        .map(|line| strip(line).trim_ascii_start())
        .filter(|line| !line.is_empty());
    let begins =
        |line: &[u8], word: &[u8]| line.len() >= word.len() && line[..word.len()].eq_ignore_ascii_case(word);
    let first_is_include = lines.clone().next().is_some_and(|line| include_name(line).is_some());
    first_is_include
        || lines.any(|line| begins(line, b"BEGIN") || begins(line, b"CEND") || begins(line, b"SOL "))
}

/// Bytes up to a comment, without blanks at the end.
fn strip(line: &[u8]) -> &[u8] {
    let end = line.iter().position(|&c| c == b'$').unwrap_or(line.len());
    line[..end].trim_ascii_end()
}

impl Reader {
    /// Returns whether reading goes on behind this file (false once ENDDATA was met).
    fn file(&mut self, file: u16) -> Result<bool> {
        self.stack.push(file);
        let text = Arc::clone(&self.content.files[usize::from(file)].text);
        let mut start = 0;
        let mut goes_on = true;
        while start < text.len() && goes_on {
            let mut end = text[start..].iter().position(|&c| c == b'\n').map_or(text.len(), |n| start + n);
            let line = strip(&text[start..end]);
            if line.is_empty() {
                start = end + 1;
                continue;
            }
            if let Some(name) = include_name(&text[start..]) {
                let (name, length) =
                    name.map_err(|what| DeckError::Line { place: self.place(file, start), what })?;
                end = start + length;
                goes_on = self.include(&name, file, start)?;
            } else {
                goes_on = self.statement(line, file, start)?;
            }
            start = end + 1;
        }
        self.stack.pop();
        Ok(goes_on)
    }

    fn place(&self, file: u16, offset: usize) -> Place {
        self.content.files[usize::from(file)].place(offset)
    }

    fn include(&mut self, name: &str, file: u16, start: usize) -> Result<bool> {
        self.close();
        let place = || self.place(file, start);
        let (including, main) = (&self.content.files[usize::from(file)].path, &self.content.files[0].path);
        let opened = open_included(name, including, main).map_err(|reason| DeckError::Include {
            place: place(),
            file: name.to_owned(),
            reason,
        })?;
        let known = self.content.files.iter().position(|f| f.canonical == opened.canonical);
        if let Some(at) = self.stack.iter().position(|&f| Some(usize::from(f)) == known) {
            let inner = self.stack[at..]
                .iter()
                .map(|&f| self.content.files[usize::from(f)].path.display().to_string());
            let chain = inner.chain([opened.path.display().to_string()]).collect::<Vec<_>>().join(" -> ");
            return Err(DeckError::CircularInclude { place: place(), file: name.to_owned(), chain });
        }
        let index = known.unwrap_or(self.content.files.len());
        let index = u16::try_from(index).map_err(|_| DeckError::Line {
            place: place(),
            what: "more than 65535 files in one deck".to_owned(),
        })?;
        if self.stack.len() > 200 {
            return Err(DeckError::Line {
                place: place(),
                what: "INCLUDE nested more than 200 deep".to_owned(),
            });
        }
        if known.is_none() {
            self.content.files.push(opened);
        }
        let goes_on = self.file(index)?;
        self.close();
        Ok(goes_on)
    }

    /// One line that is neither blank nor a comment nor an INCLUDE.
    fn statement(&mut self, line: &[u8], file: u16, start: usize) -> Result<bool> {
        if self.section != Section::Bulk {
            let words = String::from_utf8_lossy(line);
            let upper = words.trim_start().to_ascii_uppercase();
            if upper.starts_with("BEGIN") && !upper.contains('=') {
                self.section = Section::Bulk;
                return Ok(true);
            }
            if !self.begins_bulk(line) {
                self.control(&words, &upper);
                return Ok(true);
            }
            self.section = Section::Bulk;
        }
        if line.len() >= 7 && line[..7].eq_ignore_ascii_case(b"ENDDATA") {
            // the file is smaller than 4 GiB
            self.content.end = Some((file, start as u32));
            return Ok(false);
        }
        self.bulk(line, file, start)
    }

    fn control(&mut self, words: &str, upper: &str) {
        match self.section {
            Section::Case => self.content.case.case(words),
            _ if upper.starts_with("CEND") => self.section = Section::Case,
            _ => {
                self.section = Section::Executive;
                self.content.case.executive(words);
            }
        }
    }

    /// Does bulk data begin here though no BEGIN BULK said so? SPC, MPC and PARAM are commands as well as cards:
    /// they begin bulk data only at the head of the deck.
    fn begins_bulk(&self, line: &[u8]) -> bool {
        let mut cells = Line::default();
        if line.contains(&b'=') || cut(line, 0, &mut cells).is_err() || cells.continues {
            return false;
        }
        let Some(name) = self.content.names.find(&cells.name) else { return false };
        let command = matches!(
            self.content.names.text(name),
            "SPC" | "MPC" | "PARAM" | "LOAD" | "DLOAD" | "GUST" | "TRIM"
        );
        match self.section {
            Section::Start => true,
            Section::Executive | Section::Case => self.content.names.role(name) == Role::Used && !command,
            Section::Bulk => true,
        }
    }

    fn bulk(&mut self, text: &[u8], file: u16, start: usize) -> Result<bool> {
        let mut line = std::mem::take(&mut self.line);
        let wrong = |reader: &Self, what| DeckError::Line { place: reader.place(file, start), what };
        cut(text, start, &mut line).map_err(|what| wrong(self, what))?;
        if line.continues {
            let done =
                self.continuations.continue_card(&mut self.content, &mut self.open, &line, file, start);
            done.map_err(|what| wrong(self, what))?;
        } else {
            self.close();
            self.head(&line, text, file, start)?;
        }
        self.line = line;
        Ok(true)
    }

    fn head(&mut self, line: &Line, text: &[u8], file: u16, start: usize) -> Result<()> {
        if line.name != self.last.0 {
            let found = self.content.names.find(&line.name);
            self.last = (line.name, found.ok_or_else(|| self.unknown(line, text, file, start))?);
        }
        let name = self.last.1;
        let tail = self.continuations.tail_text(&self.content, line, file);
        self.open = match self.content.names.role(name) {
            Role::Used => {
                let card =
                    Card { first: self.content.cells.len() as u32, n: 0, pos: start as u32, name, file };
                self.content.cards.push(card);
                self.continuations.first_line(&mut self.content, line, tail)
            }
            Role::Ignored => {
                self.content.ignored[usize::from(name)] += 1;
                Open::Skipped { tail }
            }
            Role::Refused(_) => {
                self.refused.push((name, file, start as u32));
                Open::Skipped { tail }
            }
        };
        Ok(())
    }

    fn close(&mut self) {
        let open = std::mem::take(&mut self.open);
        self.continuations.close(open);
    }

    fn unknown(&self, line: &Line, text: &[u8], file: u16, start: usize) -> DeckError {
        let card = String::from_utf8_lossy(&line.name).trim_end_matches('\0').to_owned();
        let place = self.place(file, start);
        if text.len() >= 5 && text[..5].eq_ignore_ascii_case(b"BEGIN") {
            let what = "a second BEGIN (superelements, auxiliary models) is not supported; give one plain bulk-data section";
            return DeckError::Line { place, what: what.to_owned() };
        }
        let hint =
            self.content.names.nearest(&card).map_or(String::new(), |name| format!("; did you mean {name}?"));
        DeckError::UnknownCard { at: Box::new(At { place, card }), hint }
    }

    /// One error for all unsupported cards: the first in full, the others by name, count and place.
    fn refuse(&self) -> Result<()> {
        let Some(&(first, file, pos)) = self.refused.first() else { return Ok(()) };
        let names = &self.content.names;
        let Role::Refused(why) = names.role(first) else { return Ok(()) };
        let mut others: Vec<(NameId, usize, String)> = Vec::new();
        for &(name, file, pos) in &self.refused {
            match others.iter_mut().find(|other| other.0 == name) {
                Some(other) => other.1 += 1,
                None => others.push((name, 1, self.place(file, pos as usize).to_string())),
            }
        }
        let list: Vec<String> = others
            .iter()
            .filter(|(name, n, _)| *name != first || *n > 1)
            .map(|(name, n, place)| match (*name == first, *n) {
                (true, n) => format!("{} more {}", n - 1, names.text(*name)),
                (false, 1) => format!("{} at {place}", names.text(*name)),
                (false, n) => format!("{n} {} from {place}", names.text(*name)),
            })
            .collect();
        let others =
            if list.is_empty() { String::new() } else { format!(" (unsupported too: {})", list.join(", ")) };
        let at = At { place: self.place(file, pos as usize), card: names.text(first).to_owned() };
        Err(DeckError::Unsupported { at: Box::new(at), why: why.to_owned(), others })
    }
}
