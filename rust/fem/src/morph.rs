//! The model with some of its nodes elsewhere: what that changes in K, M, C and structural damping, on one pattern.
//!
//! Only the elements whose matrices or constraints depend on a node that may move are evaluated again; they are found
//! once, by comparing the model with itself at a probe position. The a-set stays: which DOFs are free follows from the
//! constraints' ids, and which of them nothing resists must not depend on the position.

use crate::assembly::Placement;
use crate::constraint::{Elimination, eliminate};
use crate::dof::NodeTable;
use crate::element::{Data, Element, Matrices};
use crate::error::FemError;
use crate::mesh::{Id, Mesh};
use crate::model::{BATCH, Model, drop_free, unheld};
use crate::resolve::resolve;
use crate::scalar::Dual;
use crate::small::{Mat, dot3};
use crate::system::{Parts, System};
use rayon::prelude::*;

/// What moving nodes reaches.
#[derive(Debug)]
pub(crate) struct Reach {
    /// Elements to evaluate again, ascending.
    elements: Vec<usize>,
    /// Free DOFs that are held since nothing resists them.
    held: Vec<usize>,
    /// Do rigid elements move, and with them T?
    constraints: bool,
    added_mass: Vec<(Id, f64)>,
}

/// What is known of a model before its pattern is made.
pub(crate) struct Built<'a> {
    pub(crate) nodes: &'a NodeTable,
    pub(crate) elements: &'a [Element],
    pub(crate) held: &'a [usize],
    pub(crate) elimination: &'a Elimination,
}

/// The elements that moving nodes reaches, with their nodes where they are now.
#[derive(Debug)]
pub struct Moved {
    elements: Vec<Element>,
    placements: Vec<Placement>,
}

impl Reach {
    /// Finds what differs at the `probe`, and widens the `placements` of these elements to the DOFs they have there too.
    pub(crate) fn new(
        built: &Built<'_>,
        probe: &Mesh,
        added_mass: &[(Id, f64)],
        placements: &mut [Placement],
    ) -> Result<Self, FemError> {
        let nodes = NodeTable::new(&probe.nodes)?;
        let elements = resolve(probe, &nodes, added_mass)?;
        let elimination = eliminate(probe, &nodes)?;
        let held = unheld(&nodes, &elements, &elimination);
        same_held(&nodes, &elimination, built.held, &held)?;
        let (_, here) = drop_free(built.elimination, built.held);
        let (_, there) = drop_free(&elimination, &held);
        let moves = |n: usize| {
            nodes.xyz(n) != built.nodes.xyz(n)
                && probe.scalar_points.binary_search(&nodes.nodes[n].id).is_err()
        };
        let found: Vec<Option<Vec<u32>>> = (0..elements.len())
            .into_par_iter()
            .map(|e| {
                let (old, new) = (&built.elements[e], &elements[e]);
                let placement = Placement::new(new, &nodes, &there);
                let differs = old.nodes.iter().any(|&n| moves(n)) || placement != placements[e] || old != new;
                differs.then(|| {
                    let mut dofs = [&placement.dofs[..], &placements[e].dofs[..]].concat();
                    dofs.sort_unstable();
                    dofs.dedup();
                    dofs
                })
            })
            .collect();
        for (e, dofs) in found.iter().enumerate() {
            if let Some(wider) = dofs.as_ref().and_then(|d| placements[e].on(d, built.elements[e].rows.len()))
            {
                placements[e] = wider;
            }
        }
        Ok(Self {
            elements: (0..found.len()).filter(|&e| found[e].is_some()).collect(),
            held: held.clone(),
            constraints: here != there,
            added_mass: added_mass.to_vec(),
        })
    }
}

impl Model {
    /// Elements that moving nodes reaches, by index, ascending; none where the model was not made for it.
    #[must_use]
    pub fn reached(&self) -> &[usize] {
        self.reach.as_ref().map_or(&[], |reach| &reach.elements)
    }

    /// g-set rows whose row of T the nodes of `mesh` change.
    ///
    /// # Errors
    /// As [`Model::moved`].
    pub fn moved_rows(&self, mesh: &Mesh) -> Result<Vec<usize>, FemError> {
        let Some(reach) = self.reach.as_ref().filter(|reach| reach.constraints) else { return Ok(vec![]) };
        let there = rows_of_t(mesh, &NodeTable::new(&mesh.nodes)?, &reach.held)?;
        Ok((0..there.len()).filter(|&g| there[g] != self.t_rows[g]).collect())
    }

    /// The elements that moving nodes reaches, at the positions of `mesh`: that of the model with other positions.
    ///
    /// # Errors
    /// A [`FemError`] naming the element that has no shape there or turns inside out; [`FemError::NotMade`] for nodes
    /// that were not to move.
    pub fn moved(&self, mesh: &Mesh) -> Result<Moved, FemError> {
        let reach = self.reach.as_ref().ok_or_else(|| FemError::NotMade("at all".to_owned()))?;
        let nodes = NodeTable::new(&mesh.nodes)?;
        let mut all = resolve(mesh, &nodes, &reach.added_mass)?.into_iter().map(Some).collect::<Vec<_>>();
        let elements: Vec<Element> = reach.elements.iter().filter_map(|&e| all[e].take()).collect();
        for (&e, element) in reach.elements.iter().zip(&elements) {
            turned(&self.elements[e], element)?;
        }
        let other;
        let rows = if reach.constraints {
            other = rows_of_t(mesh, &nodes, &reach.held)?;
            &other
        } else {
            &self.t_rows
        };
        let place = |(&e, element): (&usize, &Element)| {
            let own = Placement::new(element, &nodes, rows);
            own.on(&self.scatter.placements[e].dofs, element.rows.len()).ok_or_else(|| {
                FemError::NotMade(format!("that {} {} hangs on in this way", element.card, element.id))
            })
        };
        let placements = reach.elements.par_iter().zip(&elements).map(place).collect::<Result<_, _>>()?;
        Ok(Moved { elements, placements })
    }

    /// What the new positions add to K, M, C and structural damping at the given factors.
    ///
    /// # Errors
    /// As [`Model::assemble`].
    pub fn change(&self, moved: &Moved, factors: &[f64]) -> Result<System, FemError> {
        self.check_factors(factors)?;
        let pairs: Vec<_> = self.here(moved).collect();
        self.difference(&pairs, |e, element| self.evaluate_as(e, element, |i| factors[i]))
    }

    /// K, M, C and structural damping at the positions `a` less those at `b`. Elements that are the same at both take no
    /// part, so that nothing large cancels.
    ///
    /// # Errors
    /// As [`Model::assemble`].
    pub fn between(&self, a: &Moved, b: &Moved, factors: &[f64]) -> Result<System, FemError> {
        self.check_factors(factors)?;
        let pairs: Vec<_> = (0..a.elements.len())
            .map(|r| Pair { e: self.reached()[r], new: a.at(r), old: b.at(r) })
            .filter(|p| p.new != p.old)
            .collect();
        self.difference(&pairs, |e, element| self.evaluate_as(e, element, |i| factors[i]))
    }

    /// What the new positions add to the derivatives with respect to factor `i`.
    ///
    /// # Errors
    /// As [`Model::derivative`].
    pub fn derivative_change(&self, moved: &Moved, i: usize, factors: &[f64]) -> Result<System, FemError> {
        self.check_factors(factors)?;
        let Some(touched) = self.touched.get(i) else {
            return Err(FemError::FactorCount { count: i + 1, expected: self.parameters.len() });
        };
        let pairs: Vec<_> = self.here(moved).filter(|p| touched.binary_search(&p.e).is_ok()).collect();
        let part =
            |a: Mat<Dual>| Mat { rows: a.rows, cols: a.cols, data: a.data.iter().map(|x| x.d).collect() };
        self.difference(&pairs, |e, element| {
            let at = |j: usize| Dual { v: factors[j], d: f64::from(u8::from(j == i)) };
            let Matrices { k, m, c, h } = self.evaluate_as(e, element, at);
            Matrices { k: k.map(part), m: m.map(part), c: c.map(part), h: h.map(part) }
        })
    }

    /// The reached elements that are others where the nodes are now, with themselves as built.
    fn here<'a>(&'a self, moved: &'a Moved) -> impl Iterator<Item = Pair<'a>> {
        let pair = |(r, &e): (usize, &usize)| Pair {
            e,
            new: moved.at(r),
            old: (&self.elements[e], &self.scatter.placements[e]),
        };
        self.reached().iter().enumerate().map(pair).filter(|p| p.new != p.old)
    }

    /// Sum over `pairs` of the matrices of the new element less those of the old one.
    fn difference(
        &self,
        pairs: &[Pair<'_>],
        matrices: impl Fn(usize, &Element) -> Matrices<f64> + Sync,
    ) -> Result<System, FemError> {
        let nnz = self.pattern().nnz();
        let mut out = Parts::default();
        for batch in pairs.chunks(BATCH) {
            let both = |p: &Pair<'_>| (matrices(p.e, p.new.0), matrices(p.e, p.old.0));
            let evaluated: Vec<_> = batch.par_iter().with_min_len(32).map(both).collect();
            for (p, (new, old)) in batch.iter().zip(&evaluated) {
                for (Matrices { k, m, c, h }, placement, sign) in [(new, p.new.1, 1.0), (old, p.old.1, -1.0)]
                {
                    for (a, values) in [k, m, c, h].into_iter().zip(&mut out.0) {
                        let Some(a) = a else { continue };
                        if a.data.iter().any(|v| !v.is_finite()) {
                            let (what, id) = (p.new.0.card.to_owned(), p.new.0.id);
                            let why = "has no finite stiffness or mass with its nodes there".to_owned();
                            return Err(FemError::Element { what, id, why });
                        }
                        let values = values.get_or_insert_with(|| vec![0.0; nnz]);
                        self.scatter.add_placed(p.e, placement, &a.scaled(sign), values);
                    }
                }
            }
        }
        for values in out.0.iter_mut().flatten() {
            self.scatter.symmetrise(values);
        }
        Ok(out.into_system(nnz))
    }
}

/// An element at two places, each with its way into the matrices.
struct Pair<'a> {
    e: usize,
    new: (&'a Element, &'a Placement),
    old: (&'a Element, &'a Placement),
}

impl Moved {
    fn at(&self, r: usize) -> (&Element, &Placement) {
        (&self.elements[r], &self.placements[r])
    }
}

type Rows = Vec<Vec<(u32, f64)>>;

fn rows_of_t(mesh: &Mesh, nodes: &NodeTable, held: &[usize]) -> Result<Rows, FemError> {
    Ok(drop_free(&eliminate(mesh, nodes)?, held).1)
}

fn same_held(
    nodes: &NodeTable,
    elimination: &Elimination,
    here: &[usize],
    there: &[usize],
) -> Result<(), FemError> {
    let only = |a: &[usize], b: &[usize]| a.iter().copied().find(|i| b.binary_search(i).is_err());
    let dof = |i: usize| nodes.component(elimination.free[i]);
    match (only(here, there), only(there, here)) {
        (Some(i), _) => Err(FemError::Resistance { dof: dof(i), state: "resisted or loaded" }),
        (_, Some(i)) => Err(FemError::Resistance { dof: dof(i), state: "without stiffness and mass" }),
        _ => Ok(()),
    }
}

/// Beams whose ends have passed each other and shells that show their other face have positive determinants again.
fn turned(old: &Element, new: &Element) -> Result<(), FemError> {
    let (cosine, what) = match (&old.data, &new.data) {
        (Data::Beam(a), Data::Beam(b)) => (dot3(a.frame[0], b.frame[0]), "its axis"),
        (Data::Rod(a), Data::Rod(b)) => (dot3(a.axis, b.axis), "its axis"),
        (Data::Shell(a), Data::Shell(b)) => (dot3(a.frame[2], b.frame[2]), "its normal"),
        _ => return Ok(()),
    };
    if cosine > 0.0 {
        return Ok(());
    }
    let why = format!("{what} has turned by {:.0} degrees", cosine.clamp(-1.0, 1.0).acos().to_degrees());
    Err(FemError::InsideOut { what: new.card.to_owned(), id: new.id, why })
}
