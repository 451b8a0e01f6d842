//! Shells and solids of the mesh into elements ready to be evaluated.

use crate::element::quad4::Quad4Element;
use crate::element::solid::SolidElement;
use crate::element::{Data, Element, node_rows};
use crate::error::FemError;
use crate::mesh::{Id, Shell, ShellProperty, Solid, SolidKind};
use crate::resolve::{Resolver, Table};
use crate::small::{scale3, sub3};

impl Resolver<'_> {
    pub(crate) fn shells(&self, out: &mut Vec<Element>) -> Result<(), FemError> {
        if let Some(s) = self.mesh.trias.first() {
            let missing = "three-node shells are not in this version; use CQUAD4";
            return Err(FemError::Unsupported { what: "CTRIA3".to_owned(), id: s.id, missing });
        }
        let properties = Table::new("shell property", &self.mesh.shell_properties, |p| p.id)?;
        for quad in &self.mesh.quads {
            out.push(self.quad(quad, properties.find(quad.property, "CQUAD4", quad.id)?)?);
        }
        Ok(())
    }

    fn quad(&self, quad: &Shell<4>, p: &ShellProperty) -> Result<Element, FemError> {
        let what = || "CQUAD4".to_owned();
        let fail = |why: String| FemError::Element { what: what(), id: quad.id, why };
        let mut nodes = [0; 4];
        for (index, id) in nodes.iter_mut().zip(&quad.nodes) {
            *index = self.nodes.find(*id, "CQUAD4", quad.id)?;
        }
        if p.mid4.is_some() {
            let missing = "membrane-bending coupling by MID4 is not in this version; use ZOFFS or no MID4";
            return Err(FemError::Unsupported { what: what(), id: quad.id, missing });
        }
        let x = nodes.map(|n| self.nodes.xyz(n));
        let Some((frame, xy, heights)) = Quad4Element::flatten(&x) else {
            return Err(fail(
                "its corners lie on a line or its sides cross over; check the node order".to_owned(),
            ));
        };
        let t = self.thickness(quad, p)?;
        let mut ids = Vec::new();
        let mut materials = [None, None, None];
        for (slot, id) in [p.mid1, p.mid2, p.mid3].into_iter().enumerate() {
            // id 0 stands for a part without material; no card can have it
            ids.push(id.unwrap_or(0));
            materials[slot] = id.map(|id| self.materials.find(id, "CQUAD4", quad.id).cloned()).transpose()?;
        }
        let element = Quad4Element {
            xy,
            frame,
            arms: heights.map(|h| scale3(quad.zoffset - h, frame[2])),
            t,
            materials,
            bending_ratio: p.bending_ratio,
            shear_ratio: p.shear_ratio,
            nsm: p.nsm,
            coupled_mass: self.mesh.options.coupled_mass,
        };
        let det = element.corner_jacobians();
        let largest = det.iter().fold(0.0_f64, |m, d| m.max(d.abs()));
        // a corner of 180 degrees is the limit: beyond it the element folds
        if let Some(i) = det.iter().position(|d| d.is_nan() || *d <= 1e-8 * largest) {
            return Err(FemError::Jacobian {
                what: what(),
                id: quad.id,
                det: det[i],
                corner: quad.nodes[i] as usize,
            });
        }
        Ok(Element {
            id: quad.id,
            card: "CQUAD4",
            property: Some(quad.property),
            materials: ids,
            nodes: nodes.to_vec(),
            rows: node_rows(&nodes, 6),
            in_displacement_frames: false,
            data: Data::Quad4(Box::new(element)),
        })
    }

    /// Mean of the corner thicknesses; the property's where a corner has none.
    fn thickness(&self, quad: &Shell<4>, p: &ShellProperty) -> Result<f64, FemError> {
        let at = |t: Option<f64>| t.or(p.t).unwrap_or(0.0);
        let t = quad.thickness.iter().map(|t| at(*t)).sum::<f64>() / 4.0;
        if t > 0.0 && t.is_finite() && quad.thickness.iter().all(|t| at(*t) > 0.0) {
            Ok(t)
        } else {
            Err(FemError::Thickness { what: "CQUAD4".to_owned(), id: quad.id, t })
        }
    }

    pub(crate) fn solids(&self, out: &mut Vec<Element>) -> Result<(), FemError> {
        let properties = Table::new("solid property", &self.mesh.solid_properties, |p| p.id)?;
        for s in &self.mesh.solids {
            let card = card(s.kind);
            let p = properties.find(s.property, card, s.id)?;
            out.push(self.solid(s, card, p.material)?);
        }
        Ok(())
    }

    fn solid(&self, s: &Solid, card: &'static str, material: Id) -> Result<Element, FemError> {
        let fail = |why: String| FemError::Element { what: card.to_owned(), id: s.id, why };
        if s.nodes.len() != s.kind.n_nodes() {
            return Err(fail(format!(
                "has {} nodes, {:?} needs {}",
                s.nodes.len(),
                s.kind,
                s.kind.n_nodes()
            )));
        }
        let mut nodes = Vec::with_capacity(s.nodes.len());
        for id in &s.nodes {
            nodes.push(self.nodes.find(*id, card, s.id)?);
        }
        let found = self.materials.find(material, card, s.id)?;
        let elastic = crate::parameter::Factors::<f64>::ones().elastic(0, found);
        if !(elastic.e > 0.0 && elastic.nu > -1.0 && elastic.nu < 0.5) {
            let (e, nu) = (elastic.e, elastic.nu);
            return Err(fail(format!(
                "material {material} has E = {e} and nu = {nu}; a solid needs E > 0 and nu < 0.5"
            )));
        }
        // coordinates from the first node keep the digits of small elements far from the origin
        let origin = self.nodes.xyz(nodes[0]);
        let element = SolidElement {
            kind: s.kind,
            xyz: nodes.iter().map(|&n| sub3(self.nodes.xyz(n), origin)).collect(),
            material: found.clone(),
            coupled_mass: self.mesh.options.coupled_mass,
        };
        if let Some((det, corner)) = element.folded() {
            return Err(FemError::Jacobian {
                what: card.to_owned(),
                id: s.id,
                det,
                corner: s.nodes[corner] as usize,
            });
        }
        Ok(Element {
            id: s.id,
            card,
            property: Some(s.property),
            materials: vec![material],
            rows: node_rows(&nodes, 3),
            nodes,
            in_displacement_frames: false,
            data: Data::Solid(element),
        })
    }
}

fn card(kind: SolidKind) -> &'static str {
    match kind {
        SolidKind::Tetra4 | SolidKind::Tetra10 => "CTETRA",
        SolidKind::Penta6 | SolidKind::Penta15 => "CPENTA",
        SolidKind::Hexa8 | SolidKind::Hexa20 => "CHEXA",
    }
}
