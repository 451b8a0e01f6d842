//! DMIG, as case control selects it (K2GG, M2GG, B2GG, K42GG, and K2PP, M2PP, B2PP).

use super::Builder;
use crate::deck::number::parse_real;
use crate::deck::{CardRef, Result};
use crate::mesh::{DirectKind, DirectMatrix, NodeComponent};
use std::collections::BTreeMap;

const COMMANDS: [(&str, DirectKind); 7] = [
    ("K2GG", DirectKind::K),
    ("M2GG", DirectKind::M),
    ("B2GG", DirectKind::C),
    ("K42GG", DirectKind::H),
    ("K2PP", DirectKind::K),
    ("M2PP", DirectKind::M),
    ("B2PP", DirectKind::C),
];

/// A matrix on the cards.
struct Header {
    name: String,
    /// IFO: 1 square, 6 symmetric, others rectangular.
    form: i64,
    /// TIN: 1 and 2 real.
    real: bool,
}

impl<'d> Builder<'d> {
    pub(super) fn direct(&mut self) -> Result<()> {
        let headers = self.headers()?;
        let mut used = Vec::new();
        for (command, kind) in COMMANDS {
            let Some(text) = self.deck.case_control().get(command) else { continue };
            for word in text.split(',').map(str::trim).filter(|word| !word.is_empty()) {
                let (factor, name) = self.factor(command, word)?;
                let Some(header) = headers.iter().find(|h| h.name == name) else {
                    return Err(self.deck.selection_error(format!(
                        "case control: {command} = {name}, but the deck has no DMIG {name}"
                    )));
                };
                let mut terms = self.terms(header)?;
                terms.iter_mut().for_each(|t| t.2 *= factor);
                used.push(name.clone());
                self.mesh.direct.push(DirectMatrix { name, kind, terms });
            }
        }
        match headers.iter().find(|h| matches!(h.form, 1 | 6) && !used.contains(&h.name)) {
            None => Ok(()),
            Some(h) => Err(self.deck.selection_error(format!(
                "DMIG {} is a square matrix that case control does not select; select it by K2GG, M2GG, B2GG or K42GG, or remove it",
                h.name
            ))),
        }
    }

    /// `1.25*NAME` or `NAME`.
    fn factor(&self, command: &str, word: &str) -> Result<(f64, String)> {
        let Some((factor, name)) = word.split_once('*') else { return Ok((1.0, word.to_ascii_uppercase())) };
        match parse_real(factor.trim().as_bytes()) {
            Some(value) => Ok((value, name.trim().to_ascii_uppercase())),
            None => Err(self
                .deck
                .selection_error(format!("case control: {command}: '{factor}' before '*' is not a number"))),
        }
    }

    fn headers(&self) -> Result<Vec<Header>> {
        let mut out = Vec::new();
        for card in self.deck.cards("DMIG").filter(|card| is_header(*card)) {
            let form = card.opt_int(4)?.unwrap_or(0);
            let real = matches!(card.opt_int(5)?, Some(1 | 2));
            out.push(Header { name: card.word(2), form, real });
        }
        Ok(out)
    }

    fn terms(&self, header: &Header) -> Result<Vec<(NodeComponent, NodeComponent, f64)>> {
        let mut found: BTreeMap<(NodeComponent, NodeComponent), f64> = BTreeMap::new();
        let cards = || self.deck.cards("DMIG").filter(|card| card.word(2) == header.name);
        for card in cards().filter(|card| !is_header(*card)) {
            let column = self.dof(card, 3)?;
            for first in [6].into_iter().chain((1..).flat_map(|row| [10 * row + 2, 10 * row + 6])) {
                if card.fields_from(first).next().is_none() {
                    break;
                }
                if card.blank(first) {
                    continue;
                }
                let value = card.real(first + 2, "the term")?;
                found.insert((self.dof(card, first)?, column), value);
            }
        }
        let Some(card) = cards().next() else { return Ok(Vec::new()) };
        if !header.real {
            return Err(
                card.value_error("a complex matrix is not supported; give real ones by K2GG and K42GG")
            );
        }
        if header.form == 6 {
            let both = found.iter().find(|((a, b), _)| a != b && found.contains_key(&(*b, *a)));
            if let Some(((a, b), _)) = both {
                return Err(card.value_error(format!(
                    "the term between {}:{} and {}:{} stands twice in a symmetric matrix; give it once",
                    a.node, a.component, b.node, b.component
                )));
            }
        } else {
            let largest = found.values().fold(0.0_f64, |m, v| m.max(v.abs()));
            for ((a, b), value) in &found {
                let other = found.get(&(*b, *a)).copied().unwrap_or(0.0);
                if (value - other).abs() > 1e-6 * largest {
                    return Err(card.value_error(format!(
                        "not symmetric: {value} and {other} between {}:{} and {}:{}; only symmetric matrices are supported",
                        a.node, a.component, b.node, b.component
                    )));
                }
            }
            // the smaller DOF as the row, each pair once
            found.retain(|(a, b), _| a <= b);
        }
        Ok(found.into_iter().map(|((a, b), v)| (a, b, v)).collect())
    }

    fn dof(&self, card: CardRef<'d>, field: usize) -> Result<NodeComponent> {
        card.id(field, "a node")?;
        self.opt_dof(card, field)?.ok_or_else(|| card.wrong(field, "a node"))
    }
}

/// The card that says what the matrix is has 0 where others have a node.
fn is_header(card: CardRef<'_>) -> bool {
    card.text(3) == b"0"
}
