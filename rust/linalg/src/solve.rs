//! Substitution with a factor for blocks of right-hand sides.

use pulp::{Simd, WithSimd};
use rayon::prelude::*;

use crate::Kind;
use crate::lanes::{Columns, LANES, Lanes};
use crate::numeric::Store;
use crate::pivot::inverse_pair;
use crate::symbolic::{Supernode, Symbolic};

/// Right-hand sides per pass over the factor.
const BLOCK: usize = 32;

impl<T: Lanes> Store<T> {
    /// Solves A X = B in place, B (n, k) column-major, blocks of columns in parallel.
    pub(crate) fn substitute(&self, symbolic: &Symbolic, kind: Kind, b: &mut [T]) {
        let n = symbolic.pattern().n();
        if n == 0 || b.is_empty() {
            return;
        }
        // equal shares for the threads, in whole rows of lanes
        let share = (b.len() / n).div_ceil(rayon::current_num_threads()).next_multiple_of(LANES).min(BLOCK);
        b.par_chunks_mut(share * n).for_each(|part| {
            let (columns, groups) = (part.len() / n, part.len().div_ceil(n * LANES));
            let mut x = self.rows.take(groups * n, T::EMPTY);
            let forward = &symbolic.permutation().forward;
            for (group, x) in x.chunks_exact_mut(n).take(groups).enumerate() {
                let lanes = LANES.min(columns - group * LANES);
                let part = &part[group * LANES * n..];
                for (row, &old) in x.iter_mut().zip(forward) {
                    (0..lanes).for_each(|lane| T::set(row, lane, part[lane * n + old as usize]));
                }
            }
            pulp::Arch::new().dispatch(Pass { symbolic, store: self, kind, x: &mut x[..groups * n] });
            for (group, x) in x.chunks_exact(n).take(groups).enumerate() {
                let lanes = LANES.min(columns - group * LANES);
                let part = &mut part[group * LANES * n..];
                for (row, &old) in x.iter().zip(forward) {
                    (0..lanes).for_each(|lane| part[lane * n + old as usize] = T::get(row, lane));
                }
            }
            self.rows.give(x);
        });
    }
}

/// Permuted right-hand sides, groups of eight one after the other.
struct Pass<'a, T: Lanes> {
    symbolic: &'a Symbolic,
    store: &'a Store<T>,
    kind: Kind,
    x: &'a mut [T::Row],
}

impl<T: Lanes> WithSimd for Pass<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { symbolic, store, kind, x } = self;
        let (n, nodes) = (symbolic.pattern().n(), symbolic.supernodes());
        let supernode = |node| Front { node, symbolic, store, kind };
        // the rows of a supernode side by side
        let mut rows = vec![T::EMPTY; nodes.iter().map(Supernode::height).max().unwrap_or(0)];
        for node in nodes {
            x.chunks_exact_mut(n).for_each(|x| supernode(node).forward(simd, x, &mut rows));
        }
        for node in nodes.iter().rev() {
            x.chunks_exact_mut(n).for_each(|x| supernode(node).backward(simd, x, &mut rows));
        }
    }
}

/// One supernode's part in a pass.
struct Front<'a, T: Lanes> {
    node: &'a Supernode,
    symbolic: &'a Symbolic,
    store: &'a Store<T>,
    kind: Kind,
}

impl<T: Lanes> Front<'_, T> {
    fn columns(&self) -> Columns<'_, T> {
        let values = &self.store.values[self.node.panel.clone()];
        Columns { values, height: self.node.height(), unit: self.kind == Kind::Indefinite }
    }

    #[inline(always)]
    fn forward<S: Simd>(&self, simd: S, x: &mut [T::Row], rows: &mut [T::Row]) {
        let (node, below) = (self.node, self.symbolic.rows(self.node));
        self.permute(&mut x[node.columns.clone()], false);
        self.gather(x, rows);
        self.columns().forward(simd, rows);
        x[node.columns.clone()].copy_from_slice(&rows[..node.width()]);
        for (&row, from) in below.iter().zip(&rows[node.width()..]) {
            x[row as usize] = *from;
        }
    }

    #[inline(always)]
    fn backward<S: Simd>(&self, simd: S, x: &mut [T::Row], rows: &mut [T::Row]) {
        let node = self.node;
        if self.kind == Kind::Indefinite {
            self.divide(&mut x[node.columns.clone()]);
        }
        self.gather(x, rows);
        self.columns().backward(simd, rows);
        x[node.columns.clone()].copy_from_slice(&rows[..node.width()]);
        self.permute(&mut x[node.columns.clone()], true);
    }

    #[inline(always)]
    fn gather(&self, x: &[T::Row], rows: &mut [T::Row]) {
        let (own, below) = rows.split_at_mut(self.node.width());
        own.copy_from_slice(&x[self.node.columns.clone()]);
        for (&row, to) in self.symbolic.rows(self.node).iter().zip(below) {
            *to = x[row as usize];
        }
    }

    /// Moves the rows of a supernode to the order of its pivots, or back.
    fn permute(&self, own: &mut [T::Row], back: bool) {
        if self.kind == Kind::Cholesky {
            return;
        }
        let perm = &self.store.perm[self.node.columns.clone()];
        if perm.iter().enumerate().all(|(i, &p)| i == p as usize) {
            return;
        }
        let copy = own.to_vec();
        for (i, &p) in perm.iter().enumerate() {
            let (to, from) = if back { (p as usize, i) } else { (i, p as usize) };
            own[to] = copy[from];
        }
    }

    /// Multiplies the rows of a supernode by D⁻¹.
    fn divide(&self, own: &mut [T::Row]) {
        let height = self.node.height();
        let panel = &self.store.values[self.node.panel.clone()];
        let subdiag = &self.store.subdiag[self.node.columns.clone()];
        let mut j = 0;
        while j < own.len() {
            let d = panel[j * height + j];
            if subdiag[j] == T::ZERO {
                let inverse = T::ONE / d;
                for lane in 0..LANES {
                    let value = T::get(&own[j], lane) * inverse;
                    T::set(&mut own[j], lane, value);
                }
                j += 1;
                continue;
            }
            let [p, q, r] = inverse_pair(d, subdiag[j], panel[(j + 1) * height + j + 1]);
            for lane in 0..LANES {
                let (x, y) = (T::get(&own[j], lane), T::get(&own[j + 1], lane));
                T::set(&mut own[j], lane, x * p + y * q);
                T::set(&mut own[j + 1], lane, x * q + y * r);
            }
            j += 2;
        }
    }
}
