//! PCOMP, PCOMPG.

use super::Builder;
use crate::deck::card::field_number;
use crate::deck::{CardRef, Result};
use crate::mesh::{Laminate, LaminateParts, Ply};

impl<'d> Builder<'d> {
    pub(super) fn laminates(&mut self) -> Result<()> {
        for card in self.deck.cards("PCOMP") {
            // four fields a ply: MID, T, THETA, SOUT
            let laminate = self.laminate(card, |k| field_number(8 + 4 * k))?;
            self.mesh.laminates.push(laminate);
        }
        for card in self.deck.cards("PCOMPG") {
            // a line a ply: GPLYID, MID, T, THETA, SOUT
            let laminate = self.laminate(card, |k| field_number(9 + 8 * k))?;
            self.mesh.laminates.push(laminate);
        }
        Ok(())
    }

    /// `first` is the field of ply `k`'s material; blank material and thickness are the ply's before.
    fn laminate(&self, card: CardRef<'d>, first: impl Fn(usize) -> usize) -> Result<Laminate> {
        let last = card.fields_from(2).last().unwrap_or(0);
        let mut plies: Vec<Ply> = Vec::new();
        for field in (0..).map(&first).take_while(|&field| field <= last) {
            if (field..field + 4).all(|field| card.blank(field)) {
                continue;
            }
            let before = plies.last();
            let material = match (self.opt_shell_material(card, field)?, before) {
                (Some(material), _) => material,
                (None, Some(before)) => before.material,
                (None, None) => card.id(field, "material of the first ply")?,
            };
            let t = match (card.opt_real(field + 1)?, before) {
                (Some(t), _) => t,
                (None, Some(before)) => before.t,
                (None, None) => card.real(field + 1, "thickness of the first ply")?,
            };
            let angle = card.real_or(field + 2, 0.0)?.to_radians();
            plies.push(Ply { material, t, angle });
        }
        let parts = match card.word(9).as_str() {
            "" => LaminateParts::All,
            "SYM" => {
                plies.extend(plies.clone().into_iter().rev());
                LaminateParts::All
            }
            "MEM" => LaminateParts::Membrane,
            "BEND" => LaminateParts::Bending,
            word => {
                return Err(card.value_error(format!(
                    "LAM = {word} is not supported; use blank, SYM, MEM or BEND, or a PSHELL with equivalent values"
                )));
            }
        };
        Ok(Laminate {
            id: card.id(2, "the property id")?,
            plies,
            z0: card.opt_real(3)?,
            nsm: card.real_or(4, 0.0)?,
            ge: card.opt_real(8)?,
            parts,
        })
    }
}
