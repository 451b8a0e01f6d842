//! The model: elements, constraints and parameters on one fixed pattern.

use crate::assembly::{Placement, Scatter, unresisted};
use crate::constraint::{Elimination, eliminate};
use crate::dof::NodeTable;
use crate::element::{Element, Matrices};
use crate::error::FemError;
use crate::mesh::{Id, Mesh, NodeComponent, Options};
use crate::morph::{Built, Reach};
use crate::parameter::{Factors, N_SLOTS, Parameter, Quantity, Target};
use crate::resolve::resolve;
use crate::scalar::Scalar;
use crate::small::Mat;
use crate::system::{Increment, Part, Parts, refill};
use femend_linalg::Pattern;
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::OnceLock;

/// Elements evaluated at once before they are scattered; bounds the memory of element matrices.
pub(crate) const BATCH: usize = 4096;

pub use crate::system::System;

/// One factor acting on one element.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Application {
    parameter: usize,
    quantity: Quantity,
    slots: u8,
}

/// A finite-element model with constraints eliminated.
#[derive(Debug)]
pub struct Model {
    /// Nodes.
    pub nodes: NodeTable,
    /// Ids of the nodes that are scalar points, ascending.
    pub scalar_points: Vec<Id>,
    /// Elements.
    pub elements: Vec<Element>,
    /// Parameters.
    pub parameters: Vec<Parameter>,
    /// DOFs held because nothing resists or loads them.
    pub auto_constrained: Vec<NodeComponent>,
    /// g-set row of every a-set DOF.
    pub a_rows: Vec<usize>,
    /// Rows of T: `u_g = T u_a`, for every g-set row its (a-set DOF, coefficient).
    pub t_rows: Vec<Vec<(u32, f64)>>,
    options: Options,
    pub(crate) applied: Vec<Vec<Application>>,
    pub(crate) scatter: Scatter,
    /// Elements each parameter acts on.
    pub(crate) touched: Vec<Vec<usize>>,
    /// Sum of the elements no parameter acts on.
    pub(crate) fixed: Parts,
    /// Values at factors one and derivatives, when both are all there is to know.
    pub(crate) affine: Option<Affine>,
    /// What moving nodes reaches, where the model was made for it.
    pub(crate) reach: Option<Reach>,
    /// Index of every element by its id, and whether it is a mass: large models are asked element by element.
    by_id: OnceLock<HashMap<(Id, bool), usize>>,
}

/// Matrices that are affine in all factors.
#[derive(Debug)]
pub(crate) struct Affine {
    /// Values at factors one.
    pub(crate) nominal: Parts,
    /// What each factor adds, K, M, C and H.
    pub(crate) derivatives: Vec<[Increment; 4]>,
}

impl Affine {
    /// What one matrix is the sum of at the factors.
    fn terms(&self, part: Part, factors: &[f64]) -> (Option<&[f64]>, Vec<(f64, &Increment)>) {
        let which = part as usize;
        let terms = factors
            .iter()
            .zip(&self.derivatives)
            .filter(|(f, d)| **f != 1.0 && !d[which].is_empty())
            .map(|(f, d)| (f - 1.0, &d[which]))
            .collect();
        (self.nominal.0[which].as_deref(), terms)
    }
}

impl Model {
    /// Builds the model: elements resolved, constraints eliminated, DOFs without K, M and C held, pattern made.
    ///
    /// `added_mass` puts masses (mass units of the deck, before WTMASS) on nodes.
    ///
    /// # Errors
    /// A [`FemError`] naming element, constraint, DOF or parameter.
    pub fn new(mesh: &Mesh, parameters: &[Parameter], added_mass: &[(Id, f64)]) -> Result<Self, FemError> {
        Self::with_probe(mesh, None, parameters, added_mass)
    }

    /// As [`Model::new`], with a pattern that also holds what moving nodes couples: `probe` is the same mesh with all
    /// nodes that may move away from any position in which terms vanish by coincidence.
    ///
    /// # Errors
    /// As [`Model::new`] for both meshes, and [`FemError::Resistance`] where a DOF is resisted in one of them alone.
    pub fn with_probe(
        mesh: &Mesh,
        probe: Option<&Mesh>,
        parameters: &[Parameter],
        added_mass: &[(Id, f64)],
    ) -> Result<Self, FemError> {
        let nodes = NodeTable::new(&mesh.nodes)?;
        let elements = resolve(mesh, &nodes, added_mass)?;
        let elimination = eliminate(mesh, &nodes)?;
        let held = unheld(&nodes, &elements, &elimination);
        let (a_rows, t_rows) = drop_free(&elimination, &held);
        if a_rows.is_empty() {
            let why = format!("{} nodes, all held or without elements", nodes.len());
            return Err(FemError::Empty { why });
        }
        let mut placements: Vec<Placement> =
            elements.par_iter().map(|e| Placement::new(e, &nodes, &t_rows)).collect();
        let reach = match probe {
            Some(probe) => {
                let built =
                    Built { nodes: &nodes, elements: &elements, held: &held, elimination: &elimination };
                Some(Reach::new(&built, probe, added_mass, &mut placements)?)
            }
            None => None,
        };
        let applied = apply(parameters, &elements)?;
        let touched = (0..parameters.len())
            .map(|i| (0..elements.len()).filter(|&e| applied[e].iter().any(|a| a.parameter == i)).collect())
            .collect();
        let mut model = Self {
            auto_constrained: held.iter().map(|&i| nodes.component(elimination.free[i])).collect(),
            scatter: Scatter::new(a_rows.len(), placements)?,
            options: mesh.options.clone(),
            scalar_points: mesh.scalar_points.clone(),
            parameters: parameters.to_vec(),
            fixed: Parts::default(),
            affine: None,
            reach,
            by_id: OnceLock::new(),
            nodes,
            elements,
            a_rows,
            t_rows,
            applied,
            touched,
        };
        model.prepare()?;
        Ok(model)
    }

    /// Number of a-set DOFs.
    #[must_use]
    pub fn n_a(&self) -> usize {
        self.a_rows.len()
    }

    /// The pattern of K, M and C.
    #[must_use]
    pub fn pattern(&self) -> &Pattern {
        &self.scatter.pattern
    }

    /// Are K, M, C and the structural damping matrix affine in all factors jointly?
    #[must_use]
    pub fn is_affine(&self) -> bool {
        self.affine.is_some()
    }

    /// K, M, C and structural damping with the given factors (one per parameter, 1 = as in the deck).
    ///
    /// # Errors
    /// [`FemError::FactorCount`], [`FemError::Factor`], or [`FemError::Element`] when an element has no finite
    /// matrices with these factors.
    pub fn assemble(&self, factors: &[f64]) -> Result<System, FemError> {
        self.check_factors(factors)?;
        let nnz = self.pattern().nnz();
        if let Some(affine) = &self.affine {
            let filled = [Part::K, Part::M, Part::C, Part::H].map(|part| {
                let (base, terms) = affine.terms(part, factors);
                let mut values = vec![0.0; nnz];
                if base.is_some() || !terms.is_empty() {
                    refill(base, &terms, &mut values);
                }
                Some(values)
            });
            return Ok(Parts(filled).into_system(nnz));
        }
        let changing: Vec<usize> =
            (0..self.elements.len()).filter(|&e| !self.applied[e].is_empty()).collect();
        let mut parts = self.add_elements(&changing, factors)?;
        parts.add(&self.fixed);
        Ok(parts.into_system(nnz))
    }

    /// Writes one matrix at the given factors into `out`, in the order of the pattern. Where the model is affine only
    /// what the factors reach is read, so that a new parameter set costs little more than a copy.
    ///
    /// # Errors
    /// As [`Model::assemble`]; [`FemError::Shape`] when `out` has another length than the pattern.
    pub fn refill(&self, part: Part, factors: &[f64], out: &mut [f64]) -> Result<(), FemError> {
        self.check_factors(factors)?;
        if out.len() != self.pattern().nnz() {
            return Err(FemError::Shape {
                what: "the array",
                got: out.len(),
                expected: self.pattern().nnz(),
            });
        }
        match &self.affine {
            Some(affine) => {
                let (base, terms) = affine.terms(part, factors);
                refill(base, &terms, out);
            }
            None => {
                let system = self.assemble(factors)?;
                out.copy_from_slice([&system.k, &system.m, &system.c, &system.h][part as usize]);
            }
        }
        Ok(())
    }

    /// Derivative of K, M, C and structural damping with respect to factor `i`, at the given factors.
    ///
    /// # Errors
    /// As [`Model::assemble`]; [`FemError::FactorCount`] also when there is no parameter `i`.
    pub fn derivative(&self, i: usize, factors: &[f64]) -> Result<System, FemError> {
        self.check_factors(factors)?;
        if i >= self.parameters.len() {
            return Err(FemError::FactorCount { count: i + 1, expected: self.parameters.len() });
        }
        match &self.affine {
            Some(affine) => {
                let [k, m, c, h] = affine.derivatives[i].each_ref().map(|d| d.dense(self.pattern().nnz()));
                Ok(System { k, m, c, h })
            }
            None => Ok(self.evaluate_derivative(i, factors)?.into_system(self.pattern().nnz())),
        }
    }

    /// Matrices of element `index` with factors, PARAM,G and WTMASS included, in displacement frames over its rows.
    ///
    /// # Errors
    /// As [`Model::assemble`].
    pub fn element_matrices(&self, index: usize, factors: &[f64]) -> Result<Matrices<f64>, FemError> {
        self.check_factors(factors)?;
        let element = &self.elements[index];
        let mut out = self.evaluate(index, |i| factors[i]);
        if !element.in_displacement_frames {
            let turn = self.basic_from_frames(element);
            for a in [&mut out.k, &mut out.m, &mut out.c, &mut out.h] {
                *a = a.take().map(|a| a.congruence(&turn));
            }
        }
        Ok(out)
    }

    /// Index of the element with this id; of the mass with this id when there is no other element.
    ///
    /// # Errors
    /// [`FemError::UnknownElement`].
    pub fn element_index(&self, id: Id) -> Result<usize, FemError> {
        let by_id = self.by_id.get_or_init(|| {
            let mut all = HashMap::with_capacity(self.elements.len());
            for (index, e) in self.elements.iter().enumerate().filter(|(_, e)| e.id != 0) {
                all.entry((e.id, e.is_mass())).or_insert(index);
            }
            all
        });
        let find = |mass: bool| by_id.get(&(id, mass)).copied();
        find(false).or_else(|| find(true)).ok_or(FemError::UnknownElement { id })
    }

    /// Mass of the whole structure, held nodes included, from its motion along X.
    #[must_use]
    pub fn total_mass(&self) -> f64 {
        let along_x = |e: usize| {
            let element = &self.elements[e];
            let Some(m) = self.evaluate(e, |_| 1.0).m else { return 0.0 };
            // displacement of a row when the structure moves by one along the basic X
            let shift = |&g: &usize| match self.nodes.frame(g / 6).filter(|_| element.in_displacement_frames)
            {
                _ if g % 6 >= 3 => 0.0,
                Some(frame) => frame[g % 6][0],
                None => f64::from(u8::from(g.is_multiple_of(6))),
            };
            let x: Vec<f64> = element.rows.iter().map(shift).collect();
            let moves: Vec<usize> = (0..x.len()).filter(|&i| x[i] != 0.0).collect();
            moves
                .iter()
                .flat_map(|&i| moves.iter().map(move |&j| (i, j)))
                .map(|p| x[p.0] * m[p] * x[p.1])
                .sum()
        };
        (0..self.elements.len()).map(along_x).sum()
    }

    pub(crate) fn basic_from_frames(&self, element: &Element) -> Mat<f64> {
        let n = element.rows.len();
        let mut t = Mat::zeros(n, n);
        for (i, &g) in element.rows.iter().enumerate() {
            match self.nodes.frame(g / 6) {
                None => t[(i, i)] = 1.0,
                Some(frame) => {
                    for (j, &h) in element.rows.iter().enumerate().filter(|(_, h)| **h / 3 == g / 3) {
                        t[(i, j)] = frame[h % 3][g % 3];
                    }
                }
            }
        }
        t
    }

    pub(crate) fn check_factors(&self, factors: &[f64]) -> Result<(), FemError> {
        if factors.len() != self.parameters.len() {
            return Err(FemError::FactorCount { count: factors.len(), expected: self.parameters.len() });
        }
        for (p, &factor) in self.parameters.iter().zip(factors) {
            if !(factor.is_finite() && factor > 0.0) {
                return Err(FemError::Factor { name: p.name.clone(), factor });
            }
        }
        Ok(())
    }

    /// Factors on the values of element `e`.
    pub(crate) fn element_factors<S: Scalar>(&self, e: usize, factor: impl Fn(usize) -> S) -> Factors<S> {
        let mut f = Factors::<S>::ones();
        for a in &self.applied[e] {
            f.multiply(a.quantity, a.slots, factor(a.parameter));
        }
        f
    }

    /// PARAM,WTMASS.
    pub(crate) fn wtmass(&self) -> f64 {
        self.options.wtmass
    }

    /// Element matrices with PARAM,G and WTMASS, in the element's own rows.
    pub(crate) fn evaluate<S: Scalar>(&self, e: usize, factor: impl Fn(usize) -> S) -> Matrices<S> {
        self.evaluate_as(e, &self.elements[e], factor)
    }

    /// As [`Self::evaluate`], of `element` in the place of element `e`: the same one with its nodes elsewhere.
    pub(crate) fn evaluate_as<S: Scalar>(
        &self,
        e: usize,
        element: &Element,
        factor: impl Fn(usize) -> S,
    ) -> Matrices<S> {
        let mut out = element.matrices(&self.element_factors(e, factor));
        if let Some(m) = out.m.as_mut().filter(|_| self.options.wtmass != 1.0) {
            *m = m.scaled(S::c(self.options.wtmass));
        }
        if let Some(k) = out.k.as_ref().filter(|_| self.options.g != 0.0) {
            let overall = k.scaled(S::c(self.options.g));
            match &mut out.h {
                Some(h) => h.add_scaled(S::c(1.0), &overall),
                None => out.h = Some(overall),
            }
        }
        out
    }
}

/// Free DOFs that no element resists or loads, at factors one.
pub(crate) fn unheld(nodes: &NodeTable, elements: &[Element], elimination: &Elimination) -> Vec<usize> {
    let free: Vec<Placement> =
        elements.par_iter().map(|e| Placement::new(e, nodes, &elimination.rows)).collect();
    let ones = Factors::<f64>::ones();
    unresisted(elimination, &free, |e| {
        let Matrices { k, m, c, .. } = elements[e].matrices(&ones);
        let n = elements[e].rows.len();
        [k, m, c].into_iter().map(|a| a.unwrap_or_else(|| Mat::zeros(n, n))).collect()
    })
}

/// a-set rows and rows of T after holding some of the free DOFs.
pub(crate) fn drop_free(elimination: &Elimination, held: &[usize]) -> (Vec<usize>, Vec<Vec<(u32, f64)>>) {
    let mut number = vec![None; elimination.free.len()];
    let mut a_rows = Vec::new();
    let mut next = held.iter().peekable();
    for (i, &g) in elimination.free.iter().enumerate() {
        if next.peek() == Some(&&i) {
            next.next();
            continue;
        }
        number[i] = Some(a_rows.len() as u32);
        a_rows.push(g);
    }
    let keep =
        |row: &Vec<(u32, f64)>| row.iter().filter_map(|t| number[t.0 as usize].map(|a| (a, t.1))).collect();
    (a_rows, elimination.rows.iter().map(keep).collect())
}

/// Which factors act on which element.
fn apply(parameters: &[Parameter], elements: &[Element]) -> Result<Vec<Vec<Application>>, FemError> {
    let mut applied = vec![Vec::new(); elements.len()];
    for (parameter, p) in parameters.iter().enumerate() {
        let (noun, ids) = p.target.ids();
        let mut met = vec![false; ids.len()];
        for (element, list) in elements.iter().zip(&mut applied) {
            let mut slots = 0_u8;
            for (i, id) in ids.iter().enumerate() {
                let hit = match p.target {
                    Target::Material(_) => (0..element.materials.len().min(N_SLOTS))
                        .filter(|&s| element.materials[s] == *id)
                        .fold(0, |set, s| set | 1 << s),
                    Target::Property(_) => u8::MAX * u8::from(element.property == Some(*id)),
                    Target::Elements(_) => {
                        let same_kind = element.is_mass() == (p.quantity == Quantity::M);
                        u8::MAX * u8::from(element.id == *id && same_kind)
                    }
                    Target::Mass(_) => u8::MAX * u8::from(element.id == *id && element.is_mass()),
                };
                met[i] |= hit != 0;
                slots |= hit;
            }
            if slots != 0 {
                list.push(Application { parameter, quantity: p.quantity, slots });
            }
        }
        if let Some(i) = met.iter().position(|m| !m) {
            let why = format!("no element uses {noun} {}; correct the id", ids[i]);
            return Err(FemError::Parameter { name: p.name.clone(), why });
        }
    }
    Ok(applied)
}
