//! Solids of the mesh into elements ready to be evaluated.

use super::{Resolver, Table};
use crate::element::solid::{SolidElement, SolidLaw};
use crate::element::{Data, Element, node_rows};
use crate::error::FemError;
use crate::mesh::{Solid, SolidKind, SolidMaterial, SolidProperty};
use crate::small::sub3;

impl Resolver<'_> {
    pub(super) fn solids(&self, out: &mut Vec<Element>) -> Result<(), FemError> {
        let properties = Table::new("solid property", &self.mesh.solid_properties, |p| p.id)?;
        let materials = Table::new("material", &self.mesh.solid_materials, |m| m.id)?;
        for m in &self.mesh.solid_materials {
            check_stiffness(m)?;
        }
        for s in &self.mesh.solids {
            let card = card(s.kind);
            let p = properties.find(s.property, card, s.id)?;
            out.push(self.solid(s, card, p, &materials)?);
        }
        Ok(())
    }

    fn solid_law(
        &self,
        s: &Solid,
        card: &str,
        p: &SolidProperty,
        materials: &Table<SolidMaterial>,
    ) -> Result<SolidLaw, FemError> {
        if let Ok(found) = materials.find(p.material, card, s.id) {
            return Ok(SolidLaw::anisotropic(found, p.frame.as_ref()));
        }
        let found = self.materials.find(p.material, card, s.id)?;
        let elastic = crate::parameter::Factors::<f64>::ones().elastic(0, found);
        if elastic.e > 0.0 && elastic.nu > -1.0 && elastic.nu < 0.5 {
            return Ok(SolidLaw::Isotropic(found.clone()));
        }
        let (id, e, nu) = (p.material, elastic.e, elastic.nu);
        let why = format!("material {id} has E = {e} and nu = {nu}; a solid needs E > 0 and nu < 0.5");
        Err(FemError::Element { what: card.to_owned(), id: s.id, why })
    }

    fn solid(
        &self,
        s: &Solid,
        card: &'static str,
        p: &SolidProperty,
        materials: &Table<SolidMaterial>,
    ) -> Result<Element, FemError> {
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
        // coordinates from the first node keep the digits of small elements far from the origin
        let origin = self.nodes.xyz(nodes[0]);
        let element = SolidElement {
            kind: s.kind,
            xyz: nodes.iter().map(|&n| sub3(self.nodes.xyz(n), origin)).collect(),
            law: self.solid_law(s, card, p, materials)?,
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
            materials: vec![p.material],
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
        SolidKind::Pyramid5 | SolidKind::Pyramid13 => "CPYRAM",
    }
}

fn check_stiffness(m: &SolidMaterial) -> Result<(), FemError> {
    let c = nalgebra::Matrix6::from_fn(|i, j| m.stiffness[i][j]);
    let eigen = nalgebra::SymmetricEigen::new(c).eigenvalues;
    if eigen.min() > 1e-12 * eigen.max() {
        return Ok(());
    }
    let why = format!("its stiffness has the eigenvalue {:.3e}; it must be positive definite", eigen.min());
    Err(FemError::Material { id: m.id, why })
}
