//! Cost, gradient and Gauss-Newton matrix of one hypothesis over all records.

use super::adjoint::Adjoint;
use super::arrays::{Split, Workspace, update, update2};
use super::decays::{Decays, decay_factor, eliminate};
use super::hypothesis::Hypothesis;
use super::model::{Modal, Model, Slopes};
use super::prepared::Prepared;
use super::projector::Projector;
use super::response::Response;
use super::sensitivities::Sensitivities;
use super::shapes::Shapes;
use super::system::System;
use super::{IdentifyError, RecordLines};
use femend_linalg::{Dense, LinalgError, gemm_tn, gram};

/// Modes up to this multiple of the highest line, and so many more, count in the matrix of a search.
const COUNT_BELOW: f64 = 1.5;
const FURTHER: usize = 3;

/// Cost of a hypothesis at one point, with what its minimisation needs.
#[derive(Debug, Clone)]
pub struct Evaluation {
    /// Tempered sum of squares plus prior.
    pub cost: f64,
    /// Prior part of the cost.
    pub prior: f64,
    /// Mean weighted square of the residual per complex value left free, for each record.
    pub misfit: Vec<f64>,
    /// Half the gradient (n).
    pub gradient: Vec<f64>,
    /// Gauss-Newton matrix (n, n).
    pub hessian: Dense,
}

/// Mean square of the residual per value, in multiples of the noise's, below which a fit is near it.
const NEAR: f64 = 4.0;

impl Evaluation {
    /// Nothing evaluated.
    pub(crate) fn nothing() -> Self {
        let (misfit, gradient) = (Vec::new(), Vec::new());
        Self { cost: f64::NAN, prior: f64::NAN, misfit, gradient, hessian: Dense::zeros(0, 0) }
    }

    /// Whether every record is left with little more than its noise, so that its free decays are what they seem.
    pub(crate) fn near(&self) -> bool {
        self.misfit.iter().all(|v| *v < NEAR)
    }
}

/// One record's state: response, free decays and their best amplitudes, projector of a free force.
pub(crate) struct Step<'a> {
    pub at: &'a Prepared<'a>,
    pub response: Response,
    pub projector: Option<Projector>,
    pub shapes: Shapes,
    pub decays: Decays,
    pub amplitudes: Vec<f64>,
    /// Weighted columns of the decays, then the residual without them, projected.
    pub base: Dense,
    /// Coordinates of these columns in the projector's basis, a column of n_w blocks of lines each.
    along: Dense,
    /// Cholesky factor of the decays' normal equations.
    factor: Option<Dense>,
    /// Weighted sum of squares, and the number of complex values it is of.
    pub sum: f64,
    pub free: f64,
}

impl<'a> Step<'a> {
    pub fn new(
        at: &'a Prepared<'a>,
        system: &System,
        modal: &Modal,
        hypothesis: &Hypothesis,
        x: &[f64],
        ws: &mut Workspace,
    ) -> Result<Self, IdentifyError> {
        let response = Response::new(at, modal, hypothesis, x, system.n_tuned, ws)?;
        let projector = (response.n_free > 0).then(|| Projector::new(at, &response));
        let driven = projector.as_ref().filter(|_| at.u.n_columns() == 0).map(|p| {
            // no force was recorded: what moves modes and coordinates is the free one
            let mut column = vec![0.0; at.n_rows()];
            at.fill(&mut column, &at.y);
            response.driven(&p.taken_out(&mut column), ws.split(at.n_lines(), response.q.n_columns()))
        });
        let (q, d) = driven.as_ref().map_or((&response.q, &response.d), |(q, d)| (q, d));
        let decays = Decays::new(at, &response, (hypothesis, x), (q, d))?;
        driven.into_iter().for_each(|(q, _)| ws.give(q.into_dense()));
        let n_t = decays.len();
        let n_modes = system.n_tuned.max(response.poles.len());
        let shapes = Shapes::new(at, &response, projector.as_ref(), n_modes, ws);
        let mut base = ws.take(at.n_rows(), n_t + 1);
        let mut along = ws.take(2 * at.n_lines() * response.n_free, n_t + 1);
        for t in 0..decays.n_modal() {
            let motion = decays.needed_motion(&response, t);
            let to = (base.col_mut(t), along.col_mut(t));
            shapes.decay(at, &response, projector.as_ref(), (t / 2, &motion), to);
        }
        let mut y = Split::zeros(at.n_lines(), at.n_out());
        for t in decays.n_modal()..n_t {
            decays.column(at, &response, t, &mut y);
            Projector::fill(projector.as_ref(), at, &y, (base.col_mut(t), along.col_mut(t)));
        }
        for s in 0..at.n_out() {
            update2(y.col_mut(s), at.y.col(s), response.y.col(s), |_, recorded, y| recorded - y);
        }
        Projector::fill(projector.as_ref(), at, &y, (base.col_mut(n_t), along.col_mut(n_t)));
        let products = gram(&base);
        let factor = if n_t > 0 { decay_factor(&products, &decays.ridge) } else { None };
        let (amplitudes, sum) = eliminate(&products, factor.as_ref(), n_t);
        let lost = response.n_free.min(at.n_out());
        let free = (at.n_lines() * (at.n_out() - lost)) as f64;
        Ok(Self { at, response, projector, shapes, decays, amplitudes, base, along, factor, sum, free })
    }

    /// Free forces on the structure, a column each, that fit the residual.
    pub fn free_force(&self) -> Split {
        let (n, n_t) = (self.at.n_lines(), self.decays.len());
        let mut force = Split::zeros(n, self.response.n_free);
        let Some(p) = &self.projector else { return force };
        for i in 0..self.response.n_free {
            let block = |t: usize| self.along.col(t)[2 * n * i..2 * n * (i + 1)].split_at(n);
            update(force.col_mut(i), block(n_t), |_, v| v);
            for (t, a) in self.amplitudes.iter().enumerate() {
                update(force.col_mut(i), block(t), |f, v| f - v * *a);
            }
        }
        p.forces(force)
    }

    /// Cholesky factor of the decays' normal equations.
    ///
    /// # Errors
    /// [`LinalgError::NotPositiveDefinite`] where there are decays and they have none.
    pub fn factored(&self) -> Result<&Dense, LinalgError> {
        self.factor.as_ref().ok_or(LinalgError::NotPositiveDefinite)
    }

    /// Adds this record's part of the Gauss-Newton matrix.
    fn accumulate(
        &self,
        system: &System,
        modal: &Modal,
        slopes: &Slopes,
        ws: &mut Workspace,
        hessian: &mut Dense,
    ) {
        let n_t = self.decays.len();
        let columns = Sensitivities::fill(self, system, modal, slopes, ws);
        let n = columns.ncols();
        let own = gram(&columns);
        let mut reduced = Dense::zeros(n, n);
        if n_t > 0 {
            let cross = gemm_tn(&self.base, &columns);
            ws.give(columns);
            let Some(l) = &self.factor else { return };
            let mut tj = Dense::zeros(n_t, n);
            for j in 0..n {
                tj.col_mut(j).copy_from_slice(&cross.col(j)[..n_t]);
            }
            l.solve_lower_in_place(false, &mut tj);
            reduced = gram(&tj);
        } else {
            ws.give(columns);
        }
        let share = self.at.record.share;
        let parts = own.data().iter().zip(reduced.data());
        hessian
            .data_mut()
            .iter_mut()
            .zip(parts)
            .for_each(|(h, (own, reduced))| *h += share * (own - reduced));
    }

    fn give_back(self, ws: &mut Workspace) {
        self.response.give_back(ws);
        self.shapes.give_back(ws);
        ws.give(self.base);
        ws.give(self.along);
    }
}

/// What a Gauss-Newton matrix is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Matrix {
    /// To stand for the cost's curvature.
    Whole,
    /// To find the next step.
    Search,
}

/// What a gradient holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Gradient {
    /// All of it.
    Exact,
    /// The free decays change in size alone, not with the poles and shapes of the model.
    DecaysHeld,
}

/// Number of modes whose part in the parameters' columns shows on the lines of a search.
pub(crate) fn modes_that_count<'a>(
    system: &System,
    modal: &Modal,
    records: impl Iterator<Item = &'a RecordLines>,
) -> usize {
    let highest = COUNT_BELOW * records.flat_map(|r| &r.s).fold(0.0_f64, |a, s| a.max(s.norm()));
    let below = modal.omega.iter().filter(|w| **w < highest).count();
    (below.max(system.n_tuned) + FURTHER).min(system.r)
}

/// A hypothesis at unknowns `p` and law unknowns `x`, with those of the model's own dashpots first: its cost, and all that its derivatives need beside.
pub(crate) struct Point<'a> {
    pub p: Vec<f64>,
    pub x: Vec<f64>,
    model: Model,
    steps: Vec<Step<'a>>,
    /// Gradient and Gauss-Newton matrix are empty before [`Point::derive`].
    pub at: Evaluation,
}

/// Deviations of the unknowns from their prior means in standard deviations, with these.
fn deviations(system: &System, hypothesis: &Hypothesis, p: &[f64], x: &[f64]) -> Vec<(f64, f64)> {
    let model = p.iter().zip(&system.mean).zip(&system.sd);
    let law = x.iter().zip(&hypothesis.law_mean).zip(&hypothesis.law_sd);
    model.chain(law).map(|((v, mean), sd)| ((v - mean) / sd, *sd)).collect()
}

impl<'a> Point<'a> {
    /// Evaluates the cost.
    ///
    /// # Errors
    /// [`IdentifyError`] when a law refuses its parameters.
    pub fn new(
        system: &System,
        records: &'a [Prepared<'a>],
        hypothesis: &Hypothesis,
        (model, p, x): (Model, Vec<f64>, Vec<f64>),
        ws: &mut Workspace,
    ) -> Result<Self, IdentifyError> {
        let prior = deviations(system, hypothesis, &p, &x).iter().map(|(v, _)| v * v).sum();
        let (mut cost, mut misfit, mut steps) = (prior, Vec::new(), Vec::new());
        for record in records {
            let step = Step::new(record, system, &model.modal, hypothesis, &x, ws)?;
            cost += record.record.share * step.sum;
            misfit.push(step.sum / step.free.max(1.0));
            steps.push(step);
        }
        let at = Evaluation { cost, prior, misfit, gradient: Vec::new(), hessian: Dense::zeros(0, 0) };
        Ok(Self { p, x, model, steps, at })
    }

    /// Adds gradient and Gauss-Newton matrix and gives back what they alone needed; a matrix for the `Search` leaves out what
    /// modes far above the lines do, the gradient is exact near the noise and holds the decays elsewhere.
    pub fn derive(&mut self, system: &System, hypothesis: &Hypothesis, matrix: Matrix, ws: &mut Workspace) {
        let prior = deviations(system, hypothesis, &self.p, &self.x);
        let n = prior.len();
        let mut hessian = Dense::zeros(n, n);
        prior.iter().enumerate().for_each(|(i, (_, sd))| hessian[(i, i)] = sd.powi(-2));
        let Model { modal, slopes } = &mut self.model;
        let n_modes = match matrix {
            Matrix::Whole => system.r,
            Matrix::Search => modes_that_count(system, modal, self.steps.iter().map(|s| s.at.record)),
        };
        if slopes.as_ref().is_none_or(|s| s.n_modes != n_modes) {
            *slopes = Some(system.slopes(&self.p, modal, n_modes));
        }
        if let Some(slopes) = slopes {
            self.steps.iter().for_each(|s| s.accumulate(system, modal, slopes, ws, &mut hessian));
        }
        let hessian = system.folded_matrix(hessian);
        let gradient = if self.at.near() { Gradient::Exact } else { Gradient::DecaysHeld };
        self.derive_once(system, hypothesis, (gradient, hessian), ws);
    }

    /// Adds half the gradient alone, at a small part of what [`Point::derive`] costs, with a matrix from elsewhere, and
    /// gives back what it needed.
    pub fn derive_once(
        &mut self,
        system: &System,
        hypothesis: &Hypothesis,
        (gradient, hessian): (Gradient, Dense),
        ws: &mut Workspace,
    ) {
        let prior = deviations(system, hypothesis, &self.p, &self.x);
        let mut adjoint = Adjoint::new(system, self.x.len(), gradient);
        for step in self.steps.drain(..) {
            adjoint.add(&step, ws);
            step.give_back(ws);
        }
        let descent = adjoint.descent(system, &self.p, &self.model.modal);
        self.at.gradient =
            system.folded(prior.iter().zip(&descent).map(|((v, sd), down)| v / sd - down).collect());
        self.at.hessian = hessian;
    }

    /// The same point evaluated anew.
    ///
    /// # Errors
    /// As [`Point::new`].
    pub fn again(
        self,
        system: &System,
        records: &'a [Prepared<'a>],
        hypothesis: &Hypothesis,
        ws: &mut Workspace,
    ) -> Result<Self, IdentifyError> {
        let Self { p, x, model, steps, .. } = self;
        steps.into_iter().for_each(|step| step.give_back(ws));
        Self::new(system, records, hypothesis, (model, p, x), ws)
    }

    /// Gives up what only further derivatives at this point need, which is much where many points wait.
    pub fn forget_slopes(&mut self) {
        self.model.slopes = None;
    }

    /// The same without what only derivatives need.
    pub fn finished(mut self, ws: &mut Workspace) -> Self {
        self.steps.drain(..).for_each(|step| step.give_back(ws));
        self
    }

    /// Gives all arrays back.
    pub fn give_back(self, ws: &mut Workspace) {
        self.steps.into_iter().for_each(|step| step.give_back(ws));
    }
}

#[cfg(test)]
mod tests;
