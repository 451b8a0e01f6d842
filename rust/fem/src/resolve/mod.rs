//! From the mesh's entities to elements ready to be evaluated: references found, geometry checked.

mod beams;
mod direct;
mod masses;
mod shells;
mod solids;
mod springs;

use crate::dof::NodeTable;
use crate::element::Element;
use crate::error::FemError;
use crate::mesh::{Id, Material, Mesh, Orientation};
use crate::small::sub3;
use std::collections::HashMap;

/// Entities of one kind by id.
struct Table<'a, T> {
    kind: &'static str,
    by_id: HashMap<Id, &'a T>,
}

impl<'a, T> Table<'a, T> {
    fn new(kind: &'static str, items: &'a [T], id: impl Fn(&T) -> Id) -> Result<Self, FemError> {
        let mut by_id = HashMap::with_capacity(items.len());
        for item in items {
            if by_id.insert(id(item), item).is_some() {
                let count = items.iter().filter(|other| id(other) == id(item)).count();
                return Err(FemError::Duplicate { what: kind, id: id(item), count });
            }
        }
        Ok(Self { kind, by_id })
    }

    fn find(&self, target: Id, what: &str, id: Id) -> Result<&'a T, FemError> {
        self.by_id.get(&target).copied().ok_or_else(|| FemError::UnknownReference {
            what: what.to_owned(),
            id,
            kind: self.kind,
            target,
        })
    }
}

/// Everything elements refer to.
struct Resolver<'a> {
    mesh: &'a Mesh,
    nodes: &'a NodeTable,
    materials: Table<'a, Material>,
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
}
