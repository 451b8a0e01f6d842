//! Shells of the mesh into elements ready to be evaluated: section, plane, material axis, offset.

use super::{Resolver, Table};
use crate::element::plane_law::ShellMaterial;
use crate::element::shell::{Corners, ShellElement};
use crate::element::shell_section::{Section, SectionPly};
use crate::element::{Data, Element, node_rows, quad4, tria3};
use crate::error::FemError;
use crate::mesh::{Id, Laminate, MaterialAxis, PlaneMaterial, Rotation, Shell, ShellProperty};
use crate::parameter::N_SLOTS;
use crate::small::{cross3, dot3, norm3, scale3, sub3};

/// What shells refer to.
struct Sections<'a> {
    homogeneous: Table<'a, ShellProperty>,
    laminates: Table<'a, Laminate>,
    planes: Table<'a, PlaneMaterial>,
}

/// A section with what belongs to it: material ids by slot, eccentricity of its middle plane, non-structural mass.
struct Found {
    section: Section,
    materials: Vec<Id>,
    eccentricity: f64,
    nsm: f64,
}

/// A shell's plane: axes, corners, heights of the nodes above it.
type Flat = (Rotation, Corners, Vec<f64>);

impl Resolver<'_> {
    pub(super) fn shells(&self, out: &mut Vec<Element>) -> Result<(), FemError> {
        let sections = Sections {
            homogeneous: Table::new("shell property", &self.mesh.shell_properties, |p| p.id)?,
            laminates: Table::new("shell property", &self.mesh.laminates, |p| p.id)?,
            planes: Table::new("material", &self.mesh.plane_materials, |p| p.id)?,
        };
        for shell in &self.mesh.quads {
            out.push(self.shell("CQUAD4", shell, &sections, |x| {
                let (frame, xy, heights) = quad4::flatten(x)?;
                Some((frame, Corners::Quad(xy), heights.to_vec()))
            })?);
        }
        for shell in &self.mesh.trias {
            out.push(self.shell("CTRIA3", shell, &sections, |x| {
                let (frame, xy) = tria3::flatten(x)?;
                Some((frame, Corners::Tria(xy), vec![0.0; 3]))
            })?);
        }
        Ok(())
    }

    fn shell<const N: usize>(
        &self,
        card: &'static str,
        shell: &Shell<N>,
        sections: &Sections,
        flatten: impl Fn(&[[f64; 3]; N]) -> Option<Flat>,
    ) -> Result<Element, FemError> {
        let fail = |why: &str| FemError::Element { what: card.to_owned(), id: shell.id, why: why.to_owned() };
        let mut nodes = [0; N];
        for (index, id) in nodes.iter_mut().zip(&shell.nodes) {
            *index = self.nodes.find(*id, card, shell.id)?;
        }
        let x = nodes.map(|n| self.nodes.xyz(n));
        let Some((frame, corners, heights)) = flatten(&x) else {
            return Err(fail("its corners lie on a line or its sides cross over; check the node order"));
        };
        check_corners(card, shell, &corners)?;
        let found = self.section(card, shell, sections)?;
        let angle = material_angle(&shell.axis, &frame, sub3(x[1], x[0]))
            .ok_or_else(|| fail("its material axis stands upright on it; give another MCID or an angle"))?;
        let offset = shell.zoffset + found.eccentricity;
        let element = ShellElement {
            corners,
            frame,
            arms: heights.iter().map(|h| scale3(offset - h, frame[2])).collect(),
            section: found.section,
            angle,
            nsm: found.nsm,
            coupled_mass: self.mesh.options.coupled_mass,
        };
        Ok(Element {
            id: shell.id,
            card,
            property: Some(shell.property),
            materials: found.materials,
            nodes: nodes.to_vec(),
            rows: node_rows(&nodes, 6),
            in_displacement_frames: false,
            data: Data::Shell(Box::new(element)),
        })
    }

    fn shell_material(
        &self,
        card: &str,
        shell: Id,
        id: Id,
        planes: &Table<PlaneMaterial>,
        coupling: bool,
    ) -> Result<ShellMaterial, FemError> {
        match planes.find(id, card, shell) {
            Ok(plane) => {
                let material = ShellMaterial::Plane(plane.clone());
                // coupling alone need not be positive
                match material.fault().filter(|_| !coupling) {
                    Some(why) => Err(FemError::Material { id, why }),
                    None => Ok(material),
                }
            }
            Err(_) => Ok(ShellMaterial::Isotropic(self.materials.find(id, card, shell)?.clone())),
        }
    }

    fn section<const N: usize>(
        &self,
        card: &str,
        shell: &Shell<N>,
        sections: &Sections,
    ) -> Result<Found, FemError> {
        if let Ok(laminate) = sections.laminates.find(shell.property, card, shell.id) {
            return self.laminate(card, shell.id, laminate, sections);
        }
        let p = sections.homogeneous.find(shell.property, card, shell.id)?;
        if p.mid4.is_some() && (p.mid1.is_none() || p.mid2.is_none()) {
            let why = format!("property {} has MID4 but not both MID1 and MID2; give them", p.id);
            return Err(FemError::Element { what: card.to_owned(), id: shell.id, why });
        }
        let mut materials = [None, None, None, None];
        let mut ids = Vec::new();
        for (slot, id) in [p.mid1, p.mid2, p.mid3, p.mid4].into_iter().enumerate() {
            // id 0 stands for a part without material; no card can have it
            ids.push(id.unwrap_or(0));
            materials[slot] = id
                .map(|id| self.shell_material(card, shell.id, id, &sections.planes, slot == 3))
                .transpose()?;
        }
        let section = Section::Homogeneous {
            t: thickness(card, shell, p)?,
            materials: Box::new(materials),
            bending_ratio: p.bending_ratio,
            shear_ratio: p.shear_ratio,
        };
        Ok(Found { section, materials: ids, eccentricity: 0.0, nsm: p.nsm })
    }

    fn laminate(&self, card: &str, shell: Id, p: &Laminate, sections: &Sections) -> Result<Found, FemError> {
        let fail = |why: String| FemError::Element { what: "PCOMP".to_owned(), id: p.id, why };
        let mut ids: Vec<Id> = Vec::new();
        let mut plies = Vec::with_capacity(p.plies.len());
        for (i, ply) in p.plies.iter().enumerate() {
            if !(ply.t > 0.0 && ply.t.is_finite()) {
                let why = format!("ply {} has thickness {}; give a positive one", i + 1, ply.t);
                return Err(fail(why));
            }
            let slot = ids.iter().position(|id| *id == ply.material).unwrap_or_else(|| {
                ids.push(ply.material);
                ids.len() - 1
            });
            plies.push(SectionPly { slot, t: ply.t, angle: ply.angle });
        }
        if plies.is_empty() {
            return Err(fail("has no plies; give at least one".to_owned()));
        }
        if ids.len() > N_SLOTS {
            return Err(fail(format!(
                "has {} different materials, {N_SLOTS} are possible; merge some",
                ids.len()
            )));
        }
        let mut materials = Vec::new();
        for id in &ids {
            materials.push(self.shell_material(card, shell, *id, &sections.planes, false)?);
        }
        let section = Section::Laminate { materials, plies, ge: p.ge, parts: p.parts };
        let t = section.thickness();
        let eccentricity = p.z0.map_or(0.0, |z0| z0 + 0.5 * t);
        Ok(Found { section, materials: ids, eccentricity, nsm: p.nsm })
    }
}

/// A corner of 180 degrees is the limit: beyond it the element folds.
fn check_corners<const N: usize>(card: &str, shell: &Shell<N>, corners: &Corners) -> Result<(), FemError> {
    let Corners::Quad(xy) = corners else { return Ok(()) };
    let det = quad4::corner_jacobians(xy);
    let largest = det.iter().fold(0.0_f64, |m, d| m.max(d.abs()));
    match det.iter().position(|d| d.is_nan() || *d <= 1e-8 * largest) {
        None => Ok(()),
        Some(i) => Err(FemError::Jacobian {
            what: card.to_owned(),
            id: shell.id,
            det: det[i],
            corner: shell.nodes[i] as usize,
        }),
    }
}

/// Mean of the corner thicknesses; the property's where a corner has none.
fn thickness<const N: usize>(card: &str, shell: &Shell<N>, p: &ShellProperty) -> Result<f64, FemError> {
    let at = |t: Option<f64>| t.or(p.t).unwrap_or(0.0);
    let t = shell.thickness.iter().map(|t| at(*t)).sum::<f64>() / N as f64;
    if t > 0.0 && t.is_finite() && shell.thickness.iter().all(|t| at(*t) > 0.0) {
        Ok(t)
    } else {
        Err(FemError::Thickness { what: card.to_owned(), id: shell.id, t })
    }
}

/// Angle of material axis 1 from the plane's x, rad; `None` when the axis is normal to the plane.
fn material_angle(axis: &MaterialAxis, frame: &Rotation, side: [f64; 3]) -> Option<f64> {
    let direction = |v: [f64; 3]| {
        let (x, y) = (dot3(frame[0], v), dot3(frame[1], v));
        (x.hypot(y) > 1e-6 * norm3(v)).then(|| y.atan2(x))
    };
    match axis {
        MaterialAxis::Angle(theta) => Some(direction(side)? + theta),
        MaterialAxis::Along(v) if norm3(cross3(*v, frame[2])) > 0.0 => direction(*v),
        MaterialAxis::Along(_) => None,
    }
}
