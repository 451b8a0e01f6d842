//! What one mode alone does to the weighted accelerations: each has two free decays, a frequency factor and a damping
//! ratio, whose columns differ by a factor on every line.

use super::arrays::{Pair, Split, Workspace, update, update_real, update2};
use super::prepared::Prepared;
use super::projector::Projector;
use super::response::Response;
use femend_linalg::Dense;

/// Weighted columns of modes.
pub(crate) struct Shapes {
    /// The mode's shape at the sensors, projected; of a closed loop the law's answer h kappa B w to the mode.
    first: Dense,
    /// The projected part's coordinates in the projector's basis.
    along: Dense,
    /// In a closed loop h (kappa B C w - w), what forces on the mode beyond the law's come to.
    second: Option<Dense>,
}

/// column = factor times `shape` on every line, sensor after sensor (or coordinate after coordinate).
fn times(column: &mut [f64], shape: &[f64], factor: Pair<'_>, add: bool) {
    let n = factor.0.len();
    for (to, shape) in column.chunks_exact_mut((2 * n).max(1)).zip(shape.chunks_exact((2 * n).max(1))) {
        let (to, shape) = (to.split_at_mut(n), shape.split_at(n));
        if add {
            update2(to, shape, factor, |y, e, a| y + e * a);
        } else {
            update2(to, shape, factor, |_, e, a| e * a);
        }
    }
}

impl Shapes {
    /// Shapes of the first `n` modes.
    pub fn new(
        at: &Prepared<'_>,
        response: &Response,
        projector: Option<&Projector>,
        n: usize,
        ws: &mut Workspace,
    ) -> Self {
        let mut first = ws.take(at.n_rows(), n);
        let n_along = if projector.is_some() { 2 * at.n_lines() * response.n_w } else { 0 };
        let mut along = ws.take(n_along, n);
        if response.closed.is_some() {
            let mut second = ws.take(at.n_rows(), n);
            for m in 0..n {
                Self::close(at, response, m, first.col_mut(m), second.col_mut(m));
            }
            return Self { first, along, second: Some(second) };
        }
        for m in 0..n {
            for (s, ((re, im), w)) in at.sensors(first.col_mut(m)).enumerate() {
                let o = response.shapes[(m, s)];
                re.iter_mut().zip(w).for_each(|(v, w)| *v = o * w);
                im.fill(0.0);
            }
            if let Some(p) = projector {
                p.project(first.col_mut(m), along.col_mut(m));
            }
        }
        Self { first, along, second: None }
    }

    fn close(at: &Prepared<'_>, response: &Response, m: usize, first: &mut [f64], second: &mut [f64]) {
        let Some(closed) = &response.closed else { return };
        let (n, n_w) = (at.n_lines(), response.n_w);
        let mut w = Split::zeros(n, n_w);
        (0..n_w).for_each(|i| w.col_mut(i).0.fill(response.w(i, m)));
        let mut y = Split::zeros(n, response.n_out);
        response.push(&closed.answer(&w), &mut y);
        at.fill(first, &y);
        let mut y = Split::zeros(n, response.n_out);
        response.push(&closed.answer_to_both(Split::zeros(n, n_w), &w), &mut y);
        at.fill(second, &y);
    }

    /// Column of the free decay of mode `m` with the given motion; `along` becomes the coordinates of what was
    /// projected.
    pub fn decay(
        &self,
        at: &Prepared<'_>,
        response: &Response,
        m: usize,
        motion: &Split,
        (column, along): (&mut [f64], &mut [f64]),
    ) {
        let acceleration = motion.col(motion.n_columns() - 1);
        let (Some(closed), Some(second)) = (&response.closed, &self.second) else {
            times(column, self.first.col(m), acceleration, false);
            return times(along, self.along.col(m), acceleration, false);
        };
        for (s, (part, w)) in at.sensors(column).enumerate() {
            let o = response.shapes[(m, s)];
            update_real(part, acceleration, w, |_, a, w| a * (o * w));
        }
        let mut back = Split::zeros(at.n_lines(), 1);
        update(back.col_mut(0), motion.col(0), |_, d| -d);
        times(column, self.first.col(m), back.col(0), true);
        times(column, second.col(m), closed.cut_off(at, motion).col(0), true);
    }

    /// Column of what changes mode `m` alone by -`change` (one column).
    pub fn one_mode(
        &self,
        at: &Prepared<'_>,
        response: &Response,
        m: usize,
        change: &Split,
        column: &mut [f64],
    ) {
        let mut acceleration = Split::zeros(at.n_lines(), 1);
        update2(acceleration.col_mut(0), at.s2.col(0), change.col(0), |_, s2, v| -s2 * v);
        if response.closed.is_none() {
            return times(column, self.first.col(m), acceleration.col(0), false);
        }
        for (s, (part, w)) in at.sensors(column).enumerate() {
            let o = response.shapes[(m, s)];
            update_real(part, acceleration.col(0), w, |_, a, w| a * (o * w));
        }
        times(column, self.first.col(m), change.col(0), true);
    }

    pub fn give_back(self, ws: &mut Workspace) {
        ws.give(self.first);
        ws.give(self.along);
        self.second.into_iter().for_each(|a| ws.give(a));
    }
}
