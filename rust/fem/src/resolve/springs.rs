//! Springs, dashpots and bushes of the mesh into elements ready to be evaluated.

use super::{Resolver, Table};
use crate::element::bush::BushElement;
use crate::element::scalar_element::ScalarElement;
use crate::element::{Data, Element, node_rows};
use crate::error::FemError;
use crate::mesh::{Bush, BushFrame, DamperSource, Id, NodeComponent, Rotation, SpringSource};
use crate::small::{add3, frame_from, norm3, scale3, sub3};

impl Resolver<'_> {
    pub(super) fn scalars(&self, out: &mut Vec<Element>) -> Result<(), FemError> {
        let springs = Table::new("spring property", &self.mesh.spring_properties, |p| p.id)?;
        for s in &self.mesh.springs {
            let (card, property, k, eta) = match &s.source {
                SpringSource::Property(p) => {
                    let values = springs.find(*p, "CELAS1", s.id)?;
                    ("CELAS1", Some(*p), values.k, values.ge)
                }
                SpringSource::Inline { k, ge } => ("CELAS2", None, *k, *ge),
            };
            out.push(self.scalar(s.id, card, property, &s.ends, [k, eta, 0.0])?);
        }
        let dampers = Table::new("damper property", &self.mesh.damper_properties, |p| p.id)?;
        for d in &self.mesh.dampers {
            let (card, property, c) = match &d.source {
                DamperSource::Property(p) => ("CDAMP1", Some(*p), dampers.find(*p, "CDAMP1", d.id)?.c),
                DamperSource::Inline(c) => ("CDAMP2", None, *c),
            };
            out.push(self.scalar(d.id, card, property, &d.ends, [0.0, 0.0, c])?);
        }
        Ok(())
    }

    fn scalar(
        &self,
        id: Id,
        card: &'static str,
        property: Option<Id>,
        ends: &[Option<NodeComponent>; 2],
        [k, eta, c]: [f64; 3],
    ) -> Result<Element, FemError> {
        let (mut nodes, mut rows) = (Vec::new(), Vec::new());
        for end in ends.iter().flatten() {
            if !(1..=6).contains(&end.component) {
                let why = format!("component {} of node {} must be 1 to 6", end.component, end.node);
                return Err(FemError::Element { what: card.to_owned(), id, why });
            }
            let node = self.nodes.find(end.node, card, id)?;
            nodes.push(node);
            rows.push(6 * node + end.component as usize - 1);
        }
        if rows.is_empty() || (rows.len() == 2 && rows[0] == rows[1]) {
            let why = "both ends are ground or the same DOF; connect two different ones".to_owned();
            return Err(FemError::Element { what: card.to_owned(), id, why });
        }
        let data = Data::Scalar(ScalarElement { k, eta, c, n: rows.len() });
        Ok(Element { id, card, property, materials: vec![], nodes, rows, in_displacement_frames: true, data })
    }

    pub(super) fn bushes(&self, out: &mut Vec<Element>) -> Result<(), FemError> {
        let properties = Table::new("bush property", &self.mesh.bush_properties, |p| p.id)?;
        for b in &self.mesh.bushes {
            let property = properties.find(b.property, "CBUSH", b.id)?;
            let mut nodes = Vec::new();
            for id in b.nodes.iter().flatten() {
                nodes.push(self.nodes.find(*id, "CBUSH", b.id)?);
            }
            if nodes.is_empty() || (nodes.len() == 2 && nodes[0] == nodes[1]) {
                let why = "needs a first node and, if any, a different second one".to_owned();
                return Err(FemError::Element { what: "CBUSH".to_owned(), id: b.id, why });
            }
            let position: Vec<_> = nodes.iter().map(|&n| self.nodes.xyz(n)).collect();
            let frame = self.bush_frame(b, &position, &property.k)?;
            let point = match b.offset {
                Some(offset) => add3(position[0], offset),
                None if position.len() == 2 => {
                    add3(position[0], scale3(b.location, sub3(position[1], position[0])))
                }
                None => position[0],
            };
            let arms: Vec<_> = position.iter().map(|&p| sub3(point, p)).collect();
            let map = BushElement::relative_motion(&frame, &arms);
            out.push(Element {
                id: b.id,
                card: "CBUSH",
                property: Some(b.property),
                materials: vec![],
                rows: node_rows(&nodes, 6),
                nodes,
                in_displacement_frames: false,
                data: Data::Bush(BushElement { property: property.clone(), map }),
            });
        }
        Ok(())
    }

    fn bush_frame(&self, b: &Bush, position: &[[f64; 3]], k: &[f64; 6]) -> Result<Rotation, FemError> {
        let orientation = || FemError::Orientation { what: "CBUSH".to_owned(), id: b.id };
        let axis = || match position {
            [a, b] if norm3(sub3(*b, *a)) > 0.0 => Ok(sub3(*b, *a)),
            _ => Err(orientation()),
        };
        match &b.frame {
            BushFrame::Fixed(frame) => Ok(*frame),
            BushFrame::Oriented(o) => {
                let v = self.orientation(o, position[0], "CBUSH", b.id)?;
                frame_from(axis()?, v).ok_or_else(orientation)
            }
            BushFrame::Axial => {
                if k.iter().enumerate().any(|(i, v)| i % 3 != 0 && *v != 0.0) {
                    let why = "has lateral stiffness but neither orientation nor CID; give one".to_owned();
                    return Err(FemError::Element { what: "CBUSH".to_owned(), id: b.id, why });
                }
                let x = axis()?;
                // any second axis serves: only the axial components act
                let least = (0..3).min_by(|&i, &j| x[i].abs().total_cmp(&x[j].abs())).unwrap_or(0);
                let mut v = [0.0; 3];
                v[least] = 1.0;
                frame_from(x, v).ok_or_else(orientation)
            }
        }
    }
}
