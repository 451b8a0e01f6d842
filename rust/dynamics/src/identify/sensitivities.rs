//! Columns of the Gauss-Newton matrix of one record: what each unknown does to the weighted accelerations.

use super::arrays::{Split, Workspace, update, update_real, update2};
use super::model::{Modal, Slopes, top};
use super::normal::Step;
use super::prepared::Prepared;
use super::projector::Projector;
use super::response::Response;
use super::shapes::Shapes;
use super::system::System;
use femend_linalg::Dense;

/// What a closed loop answers at the sensors to a change -1 of each coordinate, with their weights, columns as those of
/// [`Response::h`]; none where no loop is closed.
fn weighted_answer(at: &Prepared<'_>, response: &Response, ws: &mut Workspace) -> Split {
    let n_out = at.n_out();
    let mut answer = ws.split(at.n_lines(), response.to_change.n_columns());
    for j in 0..answer.n_columns() {
        let weight = at.weight.col(j % n_out);
        update_real(answer.col_mut(j), response.to_change.col(j), weight, |_, a, w| a * w);
    }
    answer
}

/// Writes the columns of one record.
pub(super) struct Sensitivities<'a> {
    at: &'a Prepared<'a>,
    response: &'a Response,
    projector: Option<&'a Projector>,
    shapes: &'a Shapes,
    modal: &'a Modal,
    /// Modal response with the force that acts, and the same times the receptances.
    q: Split,
    gq: Split,
    /// What comes of a change of the modal response at sensors and coordinates.
    y: Split,
    /// What a closed loop answers at the sensors to a change -1 of each coordinate, with the sensors' weights.
    answer: Split,
    /// Coordinates of what is projected, of no further use.
    along: Vec<f64>,
}

impl<'a> Sensitivities<'a> {
    /// All columns, unknown after unknown, weighted and projected.
    pub fn fill(
        step: &'a Step<'a>,
        system: &System,
        modal: &'a Modal,
        slopes: &Slopes,
        ws: &mut Workspace,
    ) -> Dense {
        let (at, response) = (step.at, &step.response);
        let r = system.r;
        let (q, d) = response.driven(&step.free_force(), ws.split(at.n_lines(), r));
        let mut gq = ws.split(at.n_lines(), r);
        for m in 0..r {
            update2(gq.col_mut(m), q.col(m), response.g.col(m), |_, q, g| q * g);
        }
        let y = ws.split(at.n_lines(), response.shapes.ncols());
        let n_law = response.closed.as_ref().map_or(0, |c| c.slopes.n_columns());
        let mut columns = ws.take(at.n_rows(), system.n_unknowns() + n_law);
        let along = vec![0.0; 2 * at.n_lines() * response.n_free];
        let (projector, shapes) = (step.projector.as_ref(), &step.shapes);
        let answer = weighted_answer(at, response, ws);
        let mut this = Self { at, response, projector, shapes, modal, q, gq, y, answer, along };
        this.parameters(slopes, &mut columns, ws);
        this.tuned(system, &mut columns);
        this.damping(system, &mut columns);
        let mut y = Split::zeros(at.n_lines(), at.n_out());
        for j in 0..n_law {
            response.law_column(j, &d, &mut y);
            let to = (columns.col_mut(system.n_unknowns() + j), &mut this.along[..]);
            Projector::fill(projector, at, &y, to);
        }
        [this.q, this.gq, this.y, this.answer].into_iter().for_each(|a| ws.give(a.into_dense()));
        columns
    }

    /// Columns of the user's parameters: dY = -s² Φ G (dK + s dC + s² dM) q, closed loop included.
    fn parameters(&mut self, slopes: &Slopes, columns: &mut Dense, ws: &mut Workspace) {
        let (n, r) = (self.q.n_lines(), slopes.n_modes);
        let any_inertial = slopes.groups.iter().any(|g| g.inertial);
        let mut both = ws.split(n, if any_inertial { 2 * r } else { 0 });
        if any_inertial {
            self.with_acceleration(r, &mut both);
        }
        let q = self.q.columns(0, r);
        let shapes = top(&self.response.shapes, r);
        let mut gv = ws.split(n, r);
        for group in &slopes.groups {
            let mut v = ws.split(n, group.d.ncols());
            if group.inertial { &both } else { &q }.times_into(&group.d, &mut v);
            for (p, parameter) in group.parameters.iter().enumerate() {
                for m in 0..r {
                    let (v, g) = (v.col(p * r + m), self.response.g.col(m));
                    update2(gv.col_mut(m), v, g, |_, v, g| v * g);
                    let damping = group.damping[p][m];
                    update2(gv.col_mut(m), self.gq.col(m), self.at.s.col(0), |gv, gq, s| {
                        gv + gq * s * damping
                    });
                }
                gv.times_into(&shapes, &mut self.y);
                self.write(columns.col_mut(*parameter));
            }
            ws.give(v.into_dense());
        }
        [both, gv].into_iter().for_each(|a| ws.give(a.into_dense()));
    }

    /// The response of the lowest `r` modes, then s² times it.
    fn with_acceleration(&self, r: usize, both: &mut Split) {
        for m in 0..r {
            update(both.col_mut(m), self.q.col(m), |_, q| q);
            update2(both.col_mut(r + m), self.q.col(m), self.at.s2.col(0), |_, q, s2| q * s2);
        }
    }

    /// Writes to a column what changes -d of the modal response come to, with d at the sensors and coordinates in `y`.
    fn write(&mut self, column: &mut [f64]) {
        let (at, n_out) = (self.at, self.at.n_out());
        for (s, (part, _)) in at.sensors(column).enumerate() {
            let (re, im) = part;
            update2((&mut *re, &mut *im), self.y.col(s), at.weighted_s2.col(s), |_, y, ws2| -ws2 * y);
            for i in 0..self.answer.n_columns() / n_out {
                let (answer, d) = (self.answer.col(i * n_out + s), self.y.col(n_out + i));
                update2((&mut *re, &mut *im), answer, d, |y, answer, d| y + answer * d);
            }
        }
        if let Some(p) = self.projector {
            p.project(column, &mut self.along);
        }
    }

    /// Columns of the tuned modes' frequency factors and damping ratios; each changes one mode.
    fn tuned(&mut self, system: &System, columns: &mut Dense) {
        let mut change = Split::zeros(self.at.n_lines(), 1);
        for m in 0..system.n_tuned {
            let (w, z) = (self.modal.omega[m], self.modal.zeta[m]);
            let damping = 2.0 * z * w;
            for (stiff, at) in [(2.0 * w * w, system.n_par + m), (0.0, system.n_par + system.n_tuned + m)] {
                update2(change.col_mut(0), self.gq.col(m), self.at.s.col(0), |_, gq, s| {
                    (damping * s + stiff) * gq
                });
                let to = (columns.col_mut(at), &mut self.along[..]);
                self.shapes.one_mode(self.at, self.response, self.projector, (m, &change), to);
            }
        }
    }

    /// Column of the damping ratio that all other modes share.
    fn damping(&mut self, system: &System, columns: &mut Dense) {
        let mut shapes = self.response.shapes.clone();
        for s in 0..shapes.ncols() {
            for (m, v) in shapes.col_mut(s).iter_mut().enumerate() {
                *v *= if m < system.n_tuned { 0.0 } else { 2.0 * self.modal.zeta[m] * self.modal.omega[m] };
            }
        }
        self.gq.times_into(&shapes, &mut self.y);
        self.y.times_line(&self.at.s);
        self.write(columns.col_mut(system.n_unknowns() - 1));
    }
}
