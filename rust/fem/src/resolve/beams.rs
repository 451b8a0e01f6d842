//! Beams and rods of the mesh into elements ready to be evaluated.

use super::{Resolver, Table};
use crate::element::beam::{BeamElement, beam_error};
use crate::element::rod::RodElement;
use crate::element::{Data, Element, node_rows};
use crate::error::FemError;
use crate::mesh::{Beam, BeamKind, Id, Rod, RodProperty, RodSource, Rotation};
use crate::small::{Mat, add3, frame_from, matmul, norm3, rigid, rotations, scale3, sub3};

impl Resolver<'_> {
    pub(super) fn beams(&self, out: &mut Vec<Element>) -> Result<(), FemError> {
        let properties = Table::new("beam property", &self.mesh.beam_properties, |p| p.id)?;
        for b in &self.mesh.beams {
            let card = match b.kind {
                BeamKind::Bar => "CBAR",
                BeamKind::Beam => "CBEAM",
            };
            let p = properties.find(b.property, card, b.id)?;
            let nodes = self.ends(b.nodes, card, b.id)?;
            let (length, frame) = self.beam_axes(b, nodes, card)?;
            let turn = rotations(&frame, 4);
            let mut offsets = Mat::zeros(12, 12);
            for end in 0..2 {
                let h = rigid(b.offsets[end]);
                for i in 0..6 {
                    for j in 0..6 {
                        offsets[(6 * end + i, 6 * end + j)] = h[(i, j)];
                    }
                }
            }
            let element = BeamElement {
                material: self.materials.find(p.material, card, b.id)?.clone(),
                sections: [p.a.clone(), p.b.clone().unwrap_or_else(|| p.a.clone())],
                shear: [p.k1, p.k2],
                length,
                frame,
                map: matmul(&turn, &offsets),
                pins: b.pins,
                coupled_mass: self.mesh.options.coupled_mass,
            };
            element.check().map_err(|why| beam_error(card, b.id, why))?;
            out.push(Element {
                id: b.id,
                card,
                property: Some(b.property),
                materials: vec![p.material],
                nodes: nodes.to_vec(),
                rows: node_rows(&nodes, 6),
                in_displacement_frames: false,
                data: Data::Beam(element),
            });
        }
        Ok(())
    }

    fn beam_axes(&self, b: &Beam, nodes: [usize; 2], card: &str) -> Result<(f64, Rotation), FemError> {
        let end = |i: usize| add3(self.nodes.xyz(nodes[i]), b.offsets[i]);
        let axis = sub3(end(1), end(0));
        let length = norm3(axis);
        let size = norm3(self.nodes.xyz(nodes[0])).max(norm3(self.nodes.xyz(nodes[1])));
        if length.is_nan() || length <= 1e-12 * size || length == 0.0 {
            return Err(FemError::ZeroLength { what: card.to_owned(), id: b.id, length });
        }
        let v = self.orientation(&b.orientation, self.nodes.xyz(nodes[0]), card, b.id)?;
        let frame =
            frame_from(axis, v).ok_or_else(|| FemError::Orientation { what: card.to_owned(), id: b.id })?;
        Ok((length, frame))
    }

    pub(super) fn rods(&self, out: &mut Vec<Element>) -> Result<(), FemError> {
        let properties = Table::new("rod property", &self.mesh.rod_properties, |p| p.id)?;
        for rod in &self.mesh.rods {
            out.push(self.rod(rod, &properties)?);
        }
        Ok(())
    }

    fn rod(&self, rod: &Rod, properties: &Table<RodProperty>) -> Result<Element, FemError> {
        let (card, property, section) = match &rod.source {
            RodSource::Property(p) => {
                ("CROD", Some(*p), properties.find(*p, "CROD", rod.id)?.section.clone())
            }
            RodSource::Inline(section) => ("CONROD", None, section.clone()),
        };
        let nodes = self.ends(rod.nodes, card, rod.id)?;
        let axis = sub3(self.nodes.xyz(nodes[1]), self.nodes.xyz(nodes[0]));
        let length = norm3(axis);
        if length.is_nan() || length == 0.0 {
            return Err(FemError::ZeroLength { what: card.to_owned(), id: rod.id, length });
        }
        if !(section.a >= 0.0 && section.j >= 0.0) {
            let why = format!("A = {} and J = {} must not be negative", section.a, section.j);
            return Err(FemError::Element { what: card.to_owned(), id: rod.id, why });
        }
        let width = if section.j > 0.0 { 6 } else { 3 };
        Ok(Element {
            id: rod.id,
            card,
            property,
            materials: vec![section.material],
            nodes: nodes.to_vec(),
            rows: node_rows(&nodes, width),
            in_displacement_frames: false,
            data: Data::Rod(RodElement {
                material: self.materials.find(section.material, card, rod.id)?.clone(),
                section,
                length,
                axis: scale3(1.0 / length, axis),
                coupled_mass: self.mesh.options.coupled_mass,
                width,
            }),
        })
    }

    fn ends(&self, nodes: [Id; 2], card: &str, id: Id) -> Result<[usize; 2], FemError> {
        Ok([self.nodes.find(nodes[0], card, id)?, self.nodes.find(nodes[1], card, id)?])
    }
}
