//! Multifrontal factorisation: fronts are assembled from the matrix and the updates of their children, eliminated, and
//! leave an update for their parent (Duff and Reid 1983). Subtrees are tasks; fronts at the top run their products in
//! parallel. Every sum has a fixed order.

use faer::dyn_stack::MemBuffer;
use rayon::prelude::*;

use crate::front;
use crate::lanes::Lanes;
use crate::memory::{Stacks, free, lower_zeros, square, stacks, zeros};
use crate::pivot::{Pivots, ldlt};
use crate::scalar::Scalar;
use crate::symbolic::{Run, Supernode, Symbolic};
use crate::{Kind, LinalgError, Spare};

/// Numbers of a factor.
#[derive(Debug)]
pub(crate) struct Store<T: Lanes> {
    /// Panels of all supernodes.
    pub(crate) values: Vec<T>,
    /// Off-diagonal entries of 2x2 pivots, n; empty for Cholesky.
    pub(crate) subdiag: Vec<T>,
    /// Column of its supernode that stands at each place, n; empty for Cholesky.
    pub(crate) perm: Vec<u32>,
    /// Right-hand sides last solved for.
    pub(crate) rows: Spare<T::Row>,
}

/// The part of a store that belongs to a range of supernodes.
struct Part<'a, T> {
    values: &'a mut [T],
    subdiag: &'a mut [T],
    perm: &'a mut [u32],
}

impl<'a, T> Part<'a, T> {
    fn split(self, values: usize, columns: usize) -> (Self, Self) {
        let columns = columns.min(self.perm.len());
        let (a, b) = self.values.split_at_mut(values);
        let (c, d) = self.subdiag.split_at_mut(columns);
        let (e, f) = self.perm.split_at_mut(columns);
        (Self { values: a, subdiag: c, perm: e }, Self { values: b, subdiag: d, perm: f })
    }
}

/// Arithmetic that differs between the kinds of factors.
pub(crate) trait Eliminate: Lanes {
    /// Eliminates the columns of a front.
    ///
    /// # Errors
    /// The column whose pivot is not positive.
    fn eliminate(
        kind: Kind,
        panel: &mut [Self],
        width: usize,
        update: &mut [Self],
        pivots: Pivots<'_, Self>,
        room: &mut Room<Self>,
    ) -> Result<(), usize>;
}

/// Memory that a task keeps from front to front.
pub(crate) struct Room<T> {
    work: Vec<T>,
    cholesky: MemBuffer,
}

impl<T> Room<T> {
    fn new() -> Self {
        Self { work: vec![], cholesky: front::cholesky_scratch() }
    }
}

impl Eliminate for f64 {
    fn eliminate(
        kind: Kind,
        panel: &mut [f64],
        width: usize,
        update: &mut [f64],
        mut pivots: Pivots<'_, f64>,
        room: &mut Room<f64>,
    ) -> Result<(), usize> {
        let height = panel.len() / width;
        match kind {
            Kind::Cholesky => front::cholesky(panel, width, height, update, &mut room.cholesky),
            Kind::Indefinite => {
                ldlt(panel, width, height, update, &mut pivots, &mut room.work);
                Ok(())
            }
        }
    }
}

impl Eliminate for num_complex::Complex64 {
    fn eliminate(
        _: Kind,
        panel: &mut [Self],
        width: usize,
        update: &mut [Self],
        mut pivots: Pivots<'_, Self>,
        room: &mut Room<Self>,
    ) -> Result<(), usize> {
        let height = panel.len() / width;
        ldlt(panel, width, height, update, &mut pivots, &mut room.work);
        Ok(())
    }
}

impl<T: Eliminate> Store<T> {
    /// Room for a factor, after asking whether it fits.
    pub(crate) fn new(symbolic: &Symbolic, kind: Kind) -> Result<Self, LinalgError> {
        symbolic.memory().check(size_of::<T>(), free())?;
        let pivots = if kind == Kind::Indefinite { symbolic.pattern().n() } else { 0 };
        Ok(Self {
            values: zeros(T::ZERO, symbolic.nnz())?,
            subdiag: vec![T::ZERO; pivots],
            perm: vec![0; pivots],
            rows: Spare::default(),
        })
    }

    /// Factorises values in the order of the pattern.
    ///
    /// # Errors
    /// [`LinalgError::NotPositiveDefinite`], [`LinalgError::Memory`].
    pub(crate) fn factorise(
        &mut self,
        symbolic: &Symbolic,
        values: &[T],
        kind: Kind,
    ) -> Result<(), LinalgError> {
        let job = Job { symbolic, values, kind };
        let part = Part { values: &mut self.values, subdiag: &mut self.subdiag, perm: &mut self.perm };
        job.subtrees(symbolic.roots(), part).map(|_| ())
    }
}

struct Job<'a, T> {
    symbolic: &'a Symbolic,
    values: &'a [T],
    kind: Kind,
}

impl<T: Eliminate> Job<'_, T> {
    /// Sibling subtrees in parallel; their updates in order. `part` begins with them.
    fn subtrees(&self, roots: &[u32], mut part: Part<'_, T>) -> Result<Vec<Vec<T>>, LinalgError> {
        let nodes = self.symbolic.supernodes();
        let mut tasks = Vec::with_capacity(roots.len());
        for &r in roots {
            let (root, first) = (&nodes[r as usize], &nodes[nodes[r as usize].start as usize]);
            let columns = root.columns.end - first.columns.start;
            let (own, rest) = part.split(root.panel.end - first.panel.start, columns);
            tasks.push((r as usize, own));
            part = rest;
        }
        tasks.into_par_iter().map(|(r, part)| self.subtree(r, part)).collect()
    }

    fn subtree(&self, root: usize, part: Part<'_, T>) -> Result<Vec<T>, LinalgError> {
        let nodes = self.symbolic.supernodes();
        let node = &nodes[root];
        let first = &nodes[node.start as usize];
        let (below, own) =
            part.split(node.panel.start - first.panel.start, node.columns.start - first.columns.start);
        let mut update = lower_zeros(T::ZERO, node.below())?;
        let mut room = Room::new();
        if node.divided {
            let updates = self.subtrees(&node.children, below)?;
            self.assemble(node, own.values);
            for (&c, child) in node.children.iter().zip(&updates) {
                self.extend_add(&nodes[c as usize], child, node, own.values, &mut update);
            }
            drop(updates);
        } else {
            let sizes = stacks(self.symbolic, root).peak;
            let mut sides = [zeros(T::ZERO, sizes[0])?, zeros(T::ZERO, sizes[1])?];
            let places = self.descend(root, below, &mut sides, &mut room)?;
            self.assemble(node, own.values);
            let side = &sides[usize::from(!node.odd)];
            for (&c, place) in node.children.iter().zip(places) {
                let child = &nodes[c as usize];
                self.extend_add(child, &side[place..place + square(child)], node, own.values, &mut update);
            }
        }
        self.eliminate(node, own, &mut update, &mut room)?;
        Ok(update)
    }

    /// Works through a subtree without its root on two stacks; returns where the updates of the root's children stand.
    fn descend(
        &self,
        root: usize,
        mut part: Part<'_, T>,
        sides: &mut [Vec<T>; 2],
        room: &mut Room<T>,
    ) -> Result<Vec<usize>, LinalgError> {
        let nodes = self.symbolic.supernodes();
        let start = nodes[root].start as usize;
        let mut stacks = Stacks::default();
        let mut places = vec![0usize; root - start];
        for s in start..root {
            let node = &nodes[s];
            let (own, rest) = part.split(node.panel.len(), node.width());
            part = rest;
            let place = stacks.step(self.symbolic, node);
            places[s - start] = place;
            let (even, odd) = sides.split_at_mut(1);
            let (mine, other) = if node.odd { (&mut odd[0], &even[0]) } else { (&mut even[0], &odd[0]) };
            let update = &mut mine[place..place + square(node)];
            update.fill(T::ZERO);
            self.assemble(node, own.values);
            for &c in &node.children {
                let (child, at) = (&nodes[c as usize], places[c as usize - start]);
                self.extend_add(child, &other[at..at + square(child)], node, own.values, update);
            }
            self.eliminate(node, own, update, room)?;
        }
        Ok(nodes[root].children.iter().map(|&c| places[c as usize - start]).collect())
    }

    fn assemble(&self, node: &Supernode, panel: &mut [T]) {
        panel.fill(T::ZERO);
        for entry in self.symbolic.entries(node) {
            panel[entry.place as usize] = self.values[entry.source as usize];
        }
    }

    fn extend_add(&self, child: &Supernode, from: &[T], node: &Supernode, panel: &mut [T], update: &mut [T]) {
        let runs = self.symbolic.runs(child);
        let (size, width, height, below) = (child.below(), node.width(), node.height(), node.below());
        for (r, run) in runs.iter().enumerate() {
            for k in 0..run.len {
                let (column, to) = ((run.from + k) as usize, (run.to + k) as usize);
                let source = &from[column * size..(column + 1) * size];
                let (target, skip) = if to < width {
                    (&mut panel[to * height..(to + 1) * height], 0)
                } else {
                    (&mut update[(to - width) * below..(to - width + 1) * below], width)
                };
                let rest = Run { from: run.from + k, to: run.to + k, len: run.len - k };
                add(source, target, rest, skip);
                runs[r + 1..].iter().for_each(|&next| add(source, target, next, skip));
            }
        }
    }

    fn eliminate(
        &self,
        node: &Supernode,
        own: Part<'_, T>,
        update: &mut [T],
        room: &mut Room<T>,
    ) -> Result<(), LinalgError> {
        let width = node.width();
        let pivots = width.min(own.perm.len());
        let pivots = Pivots { subdiag: &mut own.subdiag[..pivots], perm: &mut own.perm[..pivots] };
        T::eliminate(self.kind, own.values, width, update, pivots, room)
            .map_err(|_| LinalgError::NotPositiveDefinite)
    }
}

fn add<T: Scalar>(source: &[T], target: &mut [T], run: Run, skip: usize) {
    let (from, to, len) = (run.from as usize, run.to as usize - skip, run.len as usize);
    let target = &mut target[to..to + len];
    target.iter_mut().zip(&source[from..from + len]).for_each(|(t, &s)| *t += s);
}
