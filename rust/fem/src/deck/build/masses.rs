//! CONM1, CONM2, and CMASS1 to 4.

use super::Builder;
use crate::deck::coord::{sub, tensor_to_basic, to_basic};
use crate::deck::index::Space;
use crate::deck::{CardRef, Result};
use crate::mesh::{DirectKind, DirectMatrix, Id, Mass, MassKind, Rotation};

impl<'d> Builder<'d> {
    pub(super) fn masses(&mut self) -> Result<()> {
        for card in self.deck.cards("CONM2") {
            let mass = self.conm2(card)?;
            self.mesh.masses.push(mass);
        }
        for card in self.deck.cards("CONM1") {
            let mass = self.conm1(card)?;
            self.mesh.masses.push(mass);
        }
        for (name, scalar) in [("CMASS1", false), ("CMASS3", true)] {
            for card in self.deck.cards(name) {
                let id = self.property(card, 3, Space::ScalarMass, &["PMASS"])?;
                let (property, shift) = self.deck.find("PMASS", id)?;
                self.scalar_mass(card, property.real(3 + shift, "mass")?, scalar)?;
            }
        }
        for (name, scalar) in [("CMASS2", false), ("CMASS4", true)] {
            for card in self.deck.cards(name) {
                self.scalar_mass(card, card.real(3, "mass")?, scalar)?;
            }
        }
        Ok(())
    }

    fn conm2(&mut self, card: CardRef<'d>) -> Result<Mass> {
        let (id, node) = (card.id(2, "the element id")?, self.node(card, 3)?);
        let m = card.real_or(5, 0.0)?;
        let x = card.vector([6, 7, 8])?;
        let absolute = card.opt_int(4)? == Some(-1);
        let frame = if absolute { None } else { Some(self.frame_at(card, 4, node)?) };
        let offset = match &frame {
            Some(frame) => to_basic(frame, x),
            None => sub(x, self.node_data(card, 3, node)?.xyz),
        };
        let mut i = [0.0; 6];
        for (k, value) in i.iter_mut().enumerate() {
            *value = card.real_or(12 + k, 0.0)?;
        }
        let [i11, i21, i22, i31, i32, i33] = i;
        let tensor = [[i11, -i21, -i31], [-i21, i22, -i32], [-i31, -i32, i33]];
        let inertia = frame.map_or(tensor, |frame| tensor_to_basic(&frame, &tensor));
        Ok(Mass { id, node, kind: MassKind::Conm2 { m, offset, inertia } })
    }

    fn conm1(&mut self, card: CardRef<'d>) -> Result<Mass> {
        let (id, node) = (card.id(2, "the element id")?, self.node(card, 3)?);
        let frame = self.frame_at(card, 4, node)?;
        let mut m = [[0.0; 6]; 6];
        let mut fields = (5..=9).chain(12..=19).chain(22..=29);
        for i in 0..6 {
            for j in 0..=i {
                let value = fields.next().map_or(Ok(0.0), |field| card.real_or(field, 0.0))?;
                m[i][j] = value;
                m[j][i] = value;
            }
        }
        Ok(Mass { id, node, kind: MassKind::Conm1(blocks_to_basic(&frame, &m)) })
    }

    /// A mass that moves with one DOF, or with the difference of two.
    fn scalar_mass(&mut self, card: CardRef<'d>, m: f64, scalar: bool) -> Result<()> {
        let id: Id = card.id(2, "the element id")?;
        let end = match self.ends(card, scalar)? {
            [Some(a), Some(b)] => {
                // direct mass is in displacement frames too, but PARAM,WTMASS leaves it as it is
                let m = m * self.mesh.options.wtmass;
                let terms = vec![(a, a, m), (a, b, -m), (b, b, m)];
                let name = format!("{} {id}", card.name());
                self.mesh.direct.push(DirectMatrix { name, kind: DirectKind::M, terms });
                return Ok(());
            }
            [Some(end), None] | [None, Some(end)] => end,
            [None, None] => return Ok(()),
        };
        let mut matrix = [[0.0; 6]; 6];
        let k = usize::from(end.component) - 1;
        matrix[k][k] = m;
        let matrix = match &self.node_data(card, 4, end.node)?.frame {
            Some(frame) => blocks_to_basic(frame, &matrix),
            None => matrix,
        };
        self.mesh.masses.push(Mass { id, node: end.node, kind: MassKind::Conm1(matrix) });
        Ok(())
    }
}

/// A 6 x 6 matrix of translations and rotations, from the axes of `frame` to basic axes.
fn blocks_to_basic(frame: &Rotation, m: &[[f64; 6]; 6]) -> [[f64; 6]; 6] {
    let mut out = [[0.0; 6]; 6];
    for (bi, bj) in [(0, 0), (0, 3), (3, 0), (3, 3)] {
        let block = std::array::from_fn(|i| std::array::from_fn(|j| m[bi + i][bj + j]));
        let block = tensor_to_basic(frame, &block);
        for i in 0..3 {
            for j in 0..3 {
                out[bi + i][bj + j] = block[i][j];
            }
        }
    }
    out
}
