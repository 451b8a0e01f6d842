//! Substitution with a factor for blocks of right-hand sides.

use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve as ts;
use faer::prelude::ReborrowMut;
use faer::{Accum, MatMut, MatRef, Par};
use rayon::prelude::*;

use crate::Kind;
use crate::numeric::Store;
use crate::pivot::inverse_pair;
use crate::scalar::Scalar;
use crate::symbolic::{Supernode, Symbolic};

/// Right-hand sides per pass over the factor.
const BLOCK: usize = 32;

impl<T: Scalar> Store<T> {
    /// Solves A X = B in place, B (n, k) column-major, blocks of columns in parallel.
    pub(crate) fn substitute(&self, symbolic: &Symbolic, kind: Kind, b: &mut [T]) {
        let n = symbolic.pattern().n();
        if n == 0 || b.is_empty() {
            return;
        }
        // equal shares for the threads, in blocks that keep the kernels busy
        let share = (b.len() / n).div_ceil(rayon::current_num_threads()).clamp(1, BLOCK);
        b.par_chunks_mut(share * n).for_each(|part| {
            let k = part.len() / n;
            let mut x = vec![T::ZERO; part.len()];
            let forward = &symbolic.permutation().forward;
            for (column, b) in part.chunks_exact(n).enumerate() {
                for (place, &old) in forward.iter().enumerate() {
                    x[place * k + column] = b[old as usize];
                }
            }
            Pass { symbolic, store: self, kind, k }.run(&mut x);
            for (column, b) in part.chunks_exact_mut(n).enumerate() {
                for (place, &old) in forward.iter().enumerate() {
                    b[old as usize] = x[place * k + column];
                }
            }
        });
    }
}

/// One block of k permuted right-hand sides, row after row.
struct Pass<'a, T> {
    symbolic: &'a Symbolic,
    store: &'a Store<T>,
    kind: Kind,
    k: usize,
}

impl<T: Scalar> Pass<'_, T> {
    fn run(&self, x: &mut [T]) {
        let nodes = self.symbolic.supernodes();
        let mut below = Vec::new();
        for node in nodes {
            self.forward(node, x, &mut below);
        }
        for node in nodes.iter().rev() {
            self.backward(node, x, &mut below);
        }
    }

    fn panel(&self, node: &Supernode) -> (MatRef<'_, T>, MatRef<'_, T>) {
        let panel = &self.store.values[node.panel.clone()];
        MatRef::from_column_major_slice(panel, node.height(), node.width()).split_at_row(node.width())
    }

    fn forward(&self, node: &Supernode, x: &mut [T], below: &mut Vec<T>) {
        let (k, width) = (self.k, node.width());
        let (diagonal, lower) = self.panel(node);
        let own = &mut x[node.columns.start * k..node.columns.end * k];
        self.permute(node, own, false);
        if self.kind == Kind::Indefinite {
            let own = MatMut::from_row_major_slice_mut(&mut *own, width, k);
            ts::solve_unit_lower_triangular_in_place(diagonal, own, Par::Seq);
        } else {
            let own = MatMut::from_row_major_slice_mut(&mut *own, width, k);
            ts::solve_lower_triangular_in_place(diagonal, own, Par::Seq);
        }
        let rows = self.symbolic.rows(node);
        if rows.is_empty() {
            return;
        }
        below.resize((rows.len() * k).max(below.len()), T::ZERO);
        let product = MatMut::from_row_major_slice_mut(&mut below[..rows.len() * k], rows.len(), k);
        let own = MatRef::from_row_major_slice(&*own, width, k);
        matmul(product, Accum::Replace, lower, own, T::ONE, Par::Seq);
        for (&row, product) in rows.iter().zip(below.chunks_exact(k)) {
            let target = &mut x[row as usize * k..(row as usize + 1) * k];
            target.iter_mut().zip(product).for_each(|(t, &p)| *t -= p);
        }
    }

    fn backward(&self, node: &Supernode, x: &mut [T], below: &mut Vec<T>) {
        let (k, width) = (self.k, node.width());
        let (diagonal, lower) = self.panel(node);
        let rows = self.symbolic.rows(node);
        below.resize((rows.len() * k).max(below.len()), T::ZERO);
        for (&row, copy) in rows.iter().zip(below.chunks_exact_mut(k)) {
            copy.copy_from_slice(&x[row as usize * k..(row as usize + 1) * k]);
        }
        let own = &mut x[node.columns.start * k..node.columns.end * k];
        if self.kind == Kind::Indefinite {
            self.divide(node, own);
        }
        let mut block = MatMut::from_row_major_slice_mut(&mut *own, width, k);
        if !rows.is_empty() {
            let below = MatRef::from_row_major_slice(&below[..rows.len() * k], rows.len(), k);
            matmul(block.rb_mut(), Accum::Add, lower.transpose(), below, -T::ONE, Par::Seq);
        }
        if self.kind == Kind::Indefinite {
            ts::solve_unit_upper_triangular_in_place(diagonal.transpose(), block, Par::Seq);
        } else {
            ts::solve_upper_triangular_in_place(diagonal.transpose(), block, Par::Seq);
        }
        self.permute(node, own, true);
    }

    /// Moves the rows of a supernode to the order of its pivots, or back.
    fn permute(&self, node: &Supernode, own: &mut [T], back: bool) {
        if self.kind == Kind::Cholesky {
            return;
        }
        let (k, perm) = (self.k, &self.store.perm[node.columns.clone()]);
        if perm.iter().enumerate().all(|(i, &p)| i == p as usize) {
            return;
        }
        let copy = own.to_vec();
        for (i, &p) in perm.iter().enumerate() {
            let (to, from) = if back { (p as usize, i) } else { (i, p as usize) };
            own[to * k..(to + 1) * k].copy_from_slice(&copy[from * k..(from + 1) * k]);
        }
    }

    /// Multiplies the rows of a supernode by D⁻¹.
    fn divide(&self, node: &Supernode, own: &mut [T]) {
        let (k, height) = (self.k, node.height());
        let panel = &self.store.values[node.panel.clone()];
        let subdiag = &self.store.subdiag[node.columns.clone()];
        let mut j = 0;
        while j < node.width() {
            let d = panel[j * height + j];
            if subdiag[j] == T::ZERO {
                let inverse = T::ONE / d;
                own[j * k..(j + 1) * k].iter_mut().for_each(|v| *v *= inverse);
                j += 1;
                continue;
            }
            let [p, q, r] = inverse_pair(d, subdiag[j], panel[(j + 1) * height + j + 1]);
            let (one, two) = own[j * k..(j + 2) * k].split_at_mut(k);
            for (x, y) in one.iter_mut().zip(two) {
                (*x, *y) = (*x * p + *y * q, *x * q + *y * r);
            }
            j += 2;
        }
    }
}
