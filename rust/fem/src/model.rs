//! The model: elements, constraints and parameters on one fixed pattern.

use crate::assembly::{Placement, Scatter, unresisted};
use crate::constraint::{Elimination, eliminate};
use crate::dof::NodeTable;
use crate::element::{Element, Matrices};
use crate::error::FemError;
use crate::mesh::{Id, Mesh, NodeComponent, Options};
use crate::parameter::{Factors, N_SLOTS, Parameter, Quantity, Target};
use crate::resolve::resolve;
use crate::scalar::{Dual, Scalar};
use crate::small::Mat;
use femend_linalg::Pattern;
use rayon::prelude::*;

/// Elements evaluated at once before they are scattered; bounds the memory of element matrices.
pub(crate) const BATCH: usize = 4096;

/// Values of K, M, C and of the structural damping matrix (imaginary part of K) on [`Pattern`].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct System {
    /// Stiffness.
    pub k: Vec<f64>,
    /// Mass.
    pub m: Vec<f64>,
    /// Viscous damping.
    pub c: Vec<f64>,
    /// Structural damping: `K (1 + i eta)` has this imaginary part.
    pub h: Vec<f64>,
}

impl System {
    fn zeros(nnz: usize) -> Self {
        Self { k: vec![0.0; nnz], m: vec![0.0; nnz], c: vec![0.0; nnz], h: vec![0.0; nnz] }
    }

    fn arrays(&mut self) -> [&mut Vec<f64>; 4] {
        [&mut self.k, &mut self.m, &mut self.c, &mut self.h]
    }

    fn axpy(&mut self, w: f64, other: &Self) {
        let o = [&other.k, &other.m, &other.c, &other.h];
        for (a, b) in self.arrays().into_iter().zip(o) {
            for (x, y) in a.iter_mut().zip(b) {
                *x += w * y;
            }
        }
    }
}

/// One factor acting on one element.
#[derive(Debug, Clone, Copy)]
struct Application {
    parameter: usize,
    quantity: Quantity,
    slots: u8,
}

/// A finite-element model with constraints eliminated.
#[derive(Debug)]
pub struct Model {
    /// Nodes.
    pub nodes: NodeTable,
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
    applied: Vec<Vec<Application>>,
    pub(crate) scatter: Scatter,
    /// Elements each parameter acts on.
    touched: Vec<Vec<usize>>,
    /// Sum of the elements no parameter acts on.
    fixed: System,
    /// Values at factors one and derivatives, when both are all there is to know.
    affine: Option<(System, Vec<System>)>,
}

impl Model {
    /// Builds the model: elements resolved, constraints eliminated, DOFs without K, M and C held, pattern made.
    ///
    /// `added_mass` puts masses (mass units of the deck, before WTMASS) on nodes.
    ///
    /// # Errors
    /// A [`FemError`] naming element, constraint, DOF or parameter.
    pub fn new(mesh: &Mesh, parameters: &[Parameter], added_mass: &[(Id, f64)]) -> Result<Self, FemError> {
        let nodes = NodeTable::new(&mesh.nodes)?;
        let elements = resolve(mesh, &nodes, added_mass)?;
        let elimination = eliminate(mesh, &nodes)?;
        let free: Vec<Placement> =
            elements.par_iter().map(|e| Placement::new(e, &nodes, &elimination.rows)).collect();
        let ones = Factors::<f64>::ones();
        let nominal = |e: usize| {
            let Matrices { k, m, c, .. } = elements[e].matrices(&ones);
            [k, m, c]
                .into_iter()
                .map(|a| a.unwrap_or_else(|| Mat::zeros(elements[e].rows.len(), elements[e].rows.len())))
                .collect()
        };
        let held = unresisted(&elimination, &free, nominal);
        let (a_rows, t_rows) = drop_free(&elimination, &held);
        if a_rows.is_empty() {
            let why = format!("{} nodes, all held or without elements", nodes.len());
            return Err(FemError::Empty { why });
        }
        let placements = elements.par_iter().map(|e| Placement::new(e, &nodes, &t_rows)).collect();
        let applied = apply(parameters, &elements)?;
        let touched = (0..parameters.len())
            .map(|i| (0..elements.len()).filter(|&e| applied[e].iter().any(|a| a.parameter == i)).collect())
            .collect();
        let mut model = Self {
            auto_constrained: held.iter().map(|&i| nodes.component(elimination.free[i])).collect(),
            scatter: Scatter::new(a_rows.len(), placements)?,
            options: mesh.options.clone(),
            parameters: parameters.to_vec(),
            fixed: System::default(),
            affine: None,
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
        if let Some((nominal, derivatives)) = &self.affine {
            let mut out = nominal.clone();
            for (f, d) in factors.iter().zip(derivatives) {
                if *f != 1.0 {
                    out.axpy(f - 1.0, d);
                }
            }
            return Ok(out);
        }
        let mut out = self.fixed.clone();
        let changing: Vec<usize> =
            (0..self.elements.len()).filter(|&e| !self.applied[e].is_empty()).collect();
        let mut part = System::zeros(self.pattern().nnz());
        self.add_elements(&changing, factors, &mut part)?;
        out.axpy(1.0, &part);
        Ok(out)
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
            Some((_, derivatives)) => Ok(derivatives[i].clone()),
            None => self.evaluate_derivative(i, factors),
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
        let find =
            |mass: bool| self.elements.iter().position(|e| e.id == id && id != 0 && e.is_mass() == mass);
        find(false).or_else(|| find(true)).ok_or(FemError::UnknownElement { id })
    }

    /// Mass of the whole structure, held nodes included, from its motion along X.
    #[must_use]
    pub fn total_mass(&self) -> f64 {
        let along_x = |e: usize| {
            let element = &self.elements[e];
            let Some(m) = self.evaluate(e, |_| 1.0).m else { return 0.0 };
            let moves: Vec<usize> =
                (0..element.rows.len()).filter(|&i| element.rows[i].is_multiple_of(6)).collect();
            moves.iter().flat_map(|&i| moves.iter().map(move |&j| (i, j))).map(|p| m[p]).sum()
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
    fn evaluate<S: Scalar>(&self, e: usize, factor: impl Fn(usize) -> S) -> Matrices<S> {
        let mut out = self.elements[e].matrices(&self.element_factors(e, factor));
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

    /// Adds elements with factors into both triangles of `out`.
    fn add_elements(&self, list: &[usize], factors: &[f64], out: &mut System) -> Result<(), FemError> {
        self.scatter_all(list, |e| self.evaluate(e, |i| factors[i]), out)
    }

    fn scatter_all(
        &self,
        list: &[usize],
        matrices: impl Fn(usize) -> Matrices<f64> + Sync,
        out: &mut System,
    ) -> Result<(), FemError> {
        for batch in list.chunks(BATCH) {
            let evaluated: Vec<Matrices<f64>> =
                batch.par_iter().with_min_len(64).map(|&e| matrices(e)).collect();
            for (&e, Matrices { k, m, c, h }) in batch.iter().zip(&evaluated) {
                for (a, values) in [k, m, c, h].into_iter().zip(out.arrays()) {
                    let Some(a) = a else { continue };
                    if a.data.iter().any(|v| !v.is_finite()) {
                        let element = &self.elements[e];
                        let why = "has no finite stiffness or mass with these values".to_owned();
                        return Err(FemError::Element { what: element.card.to_owned(), id: element.id, why });
                    }
                    self.scatter.add(e, a, values);
                }
            }
        }
        for values in out.arrays() {
            self.scatter.symmetrise(values);
        }
        Ok(())
    }

    fn evaluate_derivative(&self, i: usize, factors: &[f64]) -> Result<System, FemError> {
        let part =
            |a: Mat<Dual>| Mat { rows: a.rows, cols: a.cols, data: a.data.iter().map(|x| x.d).collect() };
        let matrices = |e: usize| {
            let at = |j: usize| Dual { v: factors[j], d: f64::from(u8::from(j == i)) };
            let Matrices { k, m, c, h } = self.evaluate(e, at);
            Matrices { k: k.map(part), m: m.map(part), c: c.map(part), h: h.map(part) }
        };
        let mut out = System::zeros(self.pattern().nnz());
        self.scatter_all(&self.touched[i], matrices, &mut out)?;
        Ok(out)
    }

    /// Sums the elements no parameter acts on, refuses parameters without effect, and finds out whether the model is
    /// affine: then the derivatives at two different points agree.
    fn prepare(&mut self) -> Result<(), FemError> {
        let nnz = self.pattern().nnz();
        let constant: Vec<usize> = (0..self.elements.len()).filter(|&e| self.applied[e].is_empty()).collect();
        let ones = vec![1.0; self.parameters.len()];
        let mut fixed = System::zeros(nnz);
        self.add_elements(&constant, &ones, &mut fixed)?;
        self.fixed = fixed;
        // an irregular second point, so that no product of factors is constant along the way
        let other: Vec<f64> =
            (0..ones.len()).map(|i| 1.0 + 0.37 * ((i as f64 * 0.618_034 + 0.3) % 1.0) + 0.11).collect();
        let mut derivatives = Vec::with_capacity(ones.len());
        let mut affine = true;
        for i in 0..ones.len() {
            let here = self.evaluate_derivative(i, &ones)?;
            let there = self.evaluate_derivative(i, &other)?;
            if !changes(&here) && !changes(&there) {
                let p = &self.parameters[i];
                let (noun, ids) = p.target.ids();
                let why = format!(
                    "its factor changes nothing: {:?} of {noun} {ids:?} has no part in K, M or C; correct property or target",
                    p.quantity
                );
                return Err(FemError::Parameter { name: p.name.clone(), why });
            }
            affine = affine && agree(&here, &there);
            derivatives.push(here);
        }
        if affine {
            let nominal = self.assemble(&ones)?;
            self.affine = Some((nominal, derivatives));
        }
        Ok(())
    }
}

fn changes(d: &System) -> bool {
    [&d.k, &d.m, &d.c, &d.h].into_iter().any(|a| a.iter().any(|v| *v != 0.0))
}

fn agree(a: &System, b: &System) -> bool {
    [(&a.k, &b.k), (&a.m, &b.m), (&a.c, &b.c), (&a.h, &b.h)].into_iter().all(|(x, y)| {
        let largest = x.iter().fold(0.0_f64, |s, v| s.max(v.abs()));
        x.iter().zip(y).all(|(p, q)| (p - q).abs() <= 1e-10 * largest)
    })
}

/// a-set rows and rows of T after holding some of the free DOFs.
fn drop_free(elimination: &Elimination, held: &[usize]) -> (Vec<usize>, Vec<Vec<(u32, f64)>>) {
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
