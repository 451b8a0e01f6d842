//! From the mesh's entities to elements ready to be evaluated: references found, geometry checked.

use crate::dof::NodeTable;
use crate::element::bush::BushElement;
use crate::element::mass::MassElement;
use crate::element::rod::RodElement;
use crate::element::scalar_element::ScalarElement;
use crate::element::{Data, Element, beam, node_rows};
use crate::error::FemError;
use crate::mesh::{
    Beam, BeamKind, Bush, BushFrame, DamperSource, Id, Mass, MassKind, Material, Mesh, NodeComponent,
    Orientation, Rod, RodSource, Rotation, SpringSource,
};
use crate::small::{add3, frame_from, matmul, norm3, rigid, rotations, scale3, sub3};
use std::collections::HashMap;

/// Entities of one kind by id.
pub(crate) struct Table<'a, T> {
    kind: &'static str,
    by_id: HashMap<Id, &'a T>,
}

impl<'a, T> Table<'a, T> {
    pub(crate) fn new(kind: &'static str, items: &'a [T], id: impl Fn(&T) -> Id) -> Result<Self, FemError> {
        let mut by_id = HashMap::with_capacity(items.len());
        for item in items {
            if by_id.insert(id(item), item).is_some() {
                let count = items.iter().filter(|other| id(other) == id(item)).count();
                return Err(FemError::Duplicate { what: kind, id: id(item), count });
            }
        }
        Ok(Self { kind, by_id })
    }

    pub(crate) fn find(&self, target: Id, what: &str, id: Id) -> Result<&'a T, FemError> {
        self.by_id.get(&target).copied().ok_or_else(|| FemError::UnknownReference {
            what: what.to_owned(),
            id,
            kind: self.kind,
            target,
        })
    }
}

/// Everything elements refer to.
pub(crate) struct Resolver<'a> {
    pub(crate) mesh: &'a Mesh,
    pub(crate) nodes: &'a NodeTable,
    pub(crate) materials: Table<'a, Material>,
}

/// All elements of the mesh, in the order beams, rods, springs, dampers, bushes, masses, shells, solids, direct
/// matrices, then masses added by a configuration (id 0).
///
/// # Errors
/// A [`FemError`] naming the element that cannot be used.
pub fn resolve(mesh: &Mesh, nodes: &NodeTable, added_mass: &[(Id, f64)]) -> Result<Vec<Element>, FemError> {
    for m in &mesh.materials {
        check_material(m)?;
    }
    let materials = Table::new("material", &mesh.materials, |m| m.id)?;
    let r = Resolver { mesh, nodes, materials };
    let mut out = Vec::new();
    r.beams(&mut out)?;
    r.rods(&mut out)?;
    r.scalars(&mut out)?;
    r.bushes(&mut out)?;
    for mass in &mesh.masses {
        out.push(r.mass(mass)?);
    }
    r.shells(&mut out)?;
    r.solids(&mut out)?;
    r.direct(&mut out)?;
    for &(node, m) in added_mass {
        out.push(r.added_mass(node, m)?);
    }
    let mut seen = HashMap::new();
    for e in out.iter().filter(|e| e.id != 0) {
        // masses have ids of their own
        let count = seen.entry((e.is_mass(), e.id)).or_insert(0_usize);
        *count += 1;
        if *count > 1 {
            let count = out.iter().filter(|o| o.id == e.id && o.is_mass() == e.is_mass()).count();
            return Err(FemError::Duplicate { what: "element", id: e.id, count });
        }
    }
    Ok(out)
}

fn check_material(m: &Material) -> Result<(), FemError> {
    let fail = |why: String| Err(FemError::Material { id: m.id, why });
    for (name, value) in [("E", m.e), ("G", m.g)] {
        if let Some(v) = value.filter(|v| !(*v >= 0.0 && v.is_finite())) {
            return fail(format!("{name} = {v} must be a non-negative number"));
        }
    }
    if let Some(nu) = m.nu.filter(|nu| !(*nu > -1.0 && *nu <= 0.5)) {
        return fail(format!("nu = {nu} must lie in (-1, 0.5]"));
    }
    if !(m.rho >= 0.0 && m.rho.is_finite()) {
        return fail(format!("density {} must be a non-negative number", m.rho));
    }
    if m.e.unwrap_or(0.0) == 0.0 && m.g.unwrap_or(0.0) == 0.0 {
        return fail("neither E nor G is given; give E and nu".to_owned());
    }
    Ok(())
}

impl Resolver<'_> {
    fn ends(&self, nodes: [Id; 2], card: &str, id: Id) -> Result<[usize; 2], FemError> {
        Ok([self.nodes.find(nodes[0], card, id)?, self.nodes.find(nodes[1], card, id)?])
    }

    fn orientation(
        &self,
        o: &Orientation,
        origin: [f64; 3],
        card: &str,
        id: Id,
    ) -> Result<[f64; 3], FemError> {
        match o {
            Orientation::Vector(v) => Ok(*v),
            Orientation::Node(node) => Ok(sub3(self.nodes.xyz(self.nodes.find(*node, card, id)?), origin)),
        }
    }

    fn beams(&self, out: &mut Vec<Element>) -> Result<(), FemError> {
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
            let mut offsets = crate::small::Mat::zeros(12, 12);
            for end in 0..2 {
                let h = rigid(b.offsets[end]);
                for i in 0..6 {
                    for j in 0..6 {
                        offsets[(6 * end + i, 6 * end + j)] = h[(i, j)];
                    }
                }
            }
            let element = beam::BeamElement {
                material: self.materials.find(p.material, card, b.id)?.clone(),
                sections: [p.a.clone(), p.b.clone().unwrap_or_else(|| p.a.clone())],
                shear: [p.k1, p.k2],
                length,
                frame,
                map: matmul(&turn, &offsets),
                pins: b.pins,
                coupled_mass: self.mesh.options.coupled_mass,
            };
            element.check().map_err(|why| beam::beam_error(card, b.id, why))?;
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

    fn rods(&self, out: &mut Vec<Element>) -> Result<(), FemError> {
        let properties = Table::new("rod property", &self.mesh.rod_properties, |p| p.id)?;
        for rod in &self.mesh.rods {
            out.push(self.rod(rod, &properties)?);
        }
        Ok(())
    }

    fn rod(&self, rod: &Rod, properties: &Table<crate::mesh::RodProperty>) -> Result<Element, FemError> {
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

    fn scalars(&self, out: &mut Vec<Element>) -> Result<(), FemError> {
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

    fn bushes(&self, out: &mut Vec<Element>) -> Result<(), FemError> {
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

    fn mass(&self, mass: &Mass) -> Result<Element, FemError> {
        let card = match &mass.kind {
            MassKind::Conm1(_) => "CONM1",
            MassKind::Conm2 { .. } => "CONM2",
        };
        let node = self.nodes.find(mass.node, card, mass.id)?;
        let element = MassElement::new(mass.kind.clone());
        let rows = node_rows(&[node], element.width);
        Ok(Element {
            id: mass.id,
            card,
            property: None,
            materials: vec![],
            nodes: vec![node],
            rows,
            in_displacement_frames: false,
            data: Data::Mass(element),
        })
    }

    fn added_mass(&self, node: Id, m: f64) -> Result<Element, FemError> {
        let kind = MassKind::Conm2 { m, offset: [0.0; 3], inertia: [[0.0; 3]; 3] };
        let at = self.nodes.find(node, "added mass at node", node)?;
        if self.mesh.scalar_points.contains(&node) {
            let why = "it is a scalar point, which has no place in space; give a GRID".to_owned();
            return Err(FemError::Element { what: "added mass at node".to_owned(), id: node, why });
        }
        let mut element = self.mass(&Mass { id: 0, node: self.nodes.nodes[at].id, kind })?;
        element.card = "added mass";
        Ok(element)
    }
}
