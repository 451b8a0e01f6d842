//! Hypotheses closed around the dashpots that a model has itself.
//!
//! They are laws of it, at coordinates that come before its own. Those of a
//! parameter are laws whose one unknown is the parameter's, so that derivatives are worked out as those of any law's and
//! added to the parameter's afterwards.

use super::dashpots::Dashpots;
use super::hypothesis::{Attached, Hypothesis, What};
use super::system::System;
use crate::laws::Kind;
use femend_linalg::{Dense, gemm_tn};
use std::borrow::Cow;

impl Dashpots {
    /// Their laws at the first coordinates of a hypothesis.
    fn laws(&self) -> Vec<Attached> {
        let mut all: Vec<_> = self.moved().map(|(i, _)| Attached::unknown(Kind::Dashpot, vec![i])).collect();
        let still: Vec<_> = (0..self.len()).filter(|i| self.of[*i].is_none()).collect();
        if !still.is_empty() {
            all.push(Attached { kind: Kind::Dashpot, at: still, known: Some(vec![1.0]) });
        }
        all
    }
}

impl System {
    /// Rows (n, r) of its dashpots over the modes `q` (r, r), each of 1 N s/m at the unknowns `p`.
    #[must_use]
    pub fn modal_dashpots(&self, p: &[f64], q: &Dense) -> Dense {
        if self.dashpots.is_empty() {
            return Dense::zeros(0, q.ncols());
        }
        let mut columns = gemm_tn(q, &self.dashpots.rows.transposed());
        for (i, of) in self.dashpots.moved() {
            columns.col_mut(i).iter_mut().for_each(|v| *v *= (0.5 * p[of]).exp());
        }
        columns.transposed()
    }

    /// Number of the unknowns that stand before those of the laws of a hypothesis beside its dashpots.
    pub(crate) fn n_own(&self) -> usize {
        self.dashpots.moved().count()
    }

    /// Unknowns of the laws of a hypothesis beside its dashpots: `x` behind those at the unknowns `p`.
    pub(crate) fn beside_own(&self, p: &[f64], x: &[f64]) -> Vec<f64> {
        self.dashpots.moved().map(|(_, of)| p[of]).chain(x.iter().copied()).collect()
    }

    /// What is there for each unknown of a hypothesis beside its dashpots, as it is for each of the model and of the
    /// hypothesis alone: what is of a dashpot is its parameter's.
    pub(crate) fn folded(&self, mut of_each: Vec<f64>) -> Vec<f64> {
        let (n, n_own) = (self.n_unknowns(), self.n_own());
        for (j, (_, of)) in self.dashpots.moved().enumerate() {
            of_each[of] += of_each[n + j];
        }
        of_each.drain(n..n + n_own);
        of_each
    }

    /// Columns of each unknown, likewise.
    pub(crate) fn folded_columns(&self, columns: Dense) -> Dense {
        let (n, n_own) = (self.n_unknowns(), self.n_own());
        if n_own == 0 {
            return columns;
        }
        let mut out = Dense::zeros(columns.nrows(), columns.ncols() - n_own);
        for j in 0..columns.ncols() {
            let to = match j.checked_sub(n) {
                None => j,
                Some(own) if own < n_own => self.dashpots.moved().nth(own).map_or(j, |(_, of)| of),
                Some(_) => j - n_own,
            };
            out.col_mut(to).iter_mut().zip(columns.col(j)).for_each(|(a, b)| *a += b);
        }
        out
    }

    /// A symmetric matrix over all unknowns, likewise.
    pub(crate) fn folded_matrix(&self, matrix: Dense) -> Dense {
        if self.n_own() == 0 {
            return matrix;
        }
        self.folded_columns(self.folded_columns(matrix).transposed())
    }
}

impl Hypothesis {
    /// The hypothesis on a model that has `dashpots` of its own, whose coordinates and unknowns come first.
    pub(crate) fn beside<'h>(&'h self, dashpots: &Dashpots) -> Cow<'h, Self> {
        let n = dashpots.len();
        if n == 0 {
            return Cow::Borrowed(self);
        }
        let shifted = |a: &Attached| Attached { at: a.at.iter().map(|i| i + n).collect(), ..a.clone() };
        let with = |all: &[Attached]| dashpots.laws().into_iter().chain(all.iter().map(shifted)).collect();
        let what = match &self.what {
            What::Nothing | What::FreeForce => What::Laws(dashpots.laws()),
            What::Laws(all) => What::Laws(with(all)),
            What::Given(kappa, all) => {
                let n_lines = kappa.first().map_or(0, Vec::len);
                let nothing = std::iter::repeat_n(vec![0.0.into(); n_lines], n);
                What::Given(nothing.chain(kappa.iter().cloned()).collect(), with(all))
            }
        };
        let beside = |of_own: f64, n: usize, v: &[f64]| {
            std::iter::repeat_n(of_own, n).chain(v.iter().copied()).collect::<Vec<_>>()
        };
        let mut w = dashpots.rows.transposed();
        if self.w.nrows() > 0 {
            w.append(&self.w.transposed());
        }
        let n_own = dashpots.moved().count();
        Cow::Owned(Self {
            w: w.transposed(),
            what,
            free: self.n_free(),
            compliance: beside(0.0, n, &self.compliance),
            held: if self.held.is_empty() { Vec::new() } else { beside(0.0, n, &self.held) },
            // what is known of them is known of their parameters
            law_mean: beside(0.0, n_own, &self.law_mean),
            law_sd: beside(f64::INFINITY, n_own, &self.law_sd),
        })
    }
}
