//! Masses of the mesh, and those that a configuration adds, into elements ready to be evaluated.

use super::Resolver;
use crate::element::mass::MassElement;
use crate::element::{Data, Element, node_rows};
use crate::error::FemError;
use crate::mesh::{Id, Mass, MassKind};

impl Resolver<'_> {
    pub(super) fn mass(&self, mass: &Mass) -> Result<Element, FemError> {
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

    pub(super) fn added_mass(&self, node: Id, m: f64) -> Result<Element, FemError> {
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
