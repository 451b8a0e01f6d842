//! What one mode alone does to the weighted accelerations: each has two free decays, a frequency factor and a damping
//! ratio, whose columns differ by a factor on every line.

use super::arrays::{Loop, Pair, PairMut, Split, Workspace, update, update_real, update2, wide};
use super::prepared::Prepared;
use super::projector::Projector;
use super::response::Response;
use femend_linalg::Dense;

/// Weighted columns of modes.
pub(crate) struct Shapes {
    /// The mode's shape at the sensors, projected; of a closed loop the law's answer h kappa B w to the mode, which is
    /// not: there every column is projected for itself.
    first: Dense,
    /// The projected part's coordinates in the projector's basis.
    along: Dense,
    /// In a closed loop, for every group of coordinates whose laws move, h (kappa B C w - w) with w of that group: what
    /// forces on the mode beyond the laws' come to.
    second: Vec<(usize, Dense)>,
}

/// column = factor times `shape` on every line, sensor after sensor (or coordinate after coordinate).
fn times(column: &mut [f64], shape: &[f64], factor: Pair<'_>) {
    let n = factor.0.len();
    for (to, shape) in column.chunks_exact_mut((2 * n).max(1)).zip(shape.chunks_exact((2 * n).max(1))) {
        update2(to.split_at_mut(n), shape.split_at(n), factor, |_, e, a| e * a);
    }
}

/// The same, added.
fn add_times(column: &mut [f64], shape: &[f64], factor: Pair<'_>) {
    let n = factor.0.len();
    for (to, shape) in column.chunks_exact_mut((2 * n).max(1)).zip(shape.chunks_exact((2 * n).max(1))) {
        update2(to.split_at_mut(n), shape.split_at(n), factor, |y, e, a| y + e * a);
    }
}

/// y = scale w a + e b on every line.
struct Both<'a> {
    y: PairMut<'a>,
    scale: f64,
    w: &'a [f64],
    a: Pair<'a>,
    e: Pair<'a>,
    b: Pair<'a>,
}

impl Loop for Both<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let n = self.y.0.len();
        let (yr, yi, w) = (&mut self.y.0[..n], &mut self.y.1[..n], &self.w[..n]);
        let (ar, ai, er, ei) = (&self.a.0[..n], &self.a.1[..n], &self.e.0[..n], &self.e.1[..n]);
        let (br, bi) = (&self.b.0[..n], &self.b.1[..n]);
        for k in 0..n {
            let own = self.scale * w[k];
            yr[k] = own * ar[k] + er[k] * br[k] - ei[k] * bi[k];
            yi[k] = own * ai[k] + er[k] * bi[k] + ei[k] * br[k];
        }
    }
}

/// The column of a mode in a closed loop: its shape at the sensors times `a`, and the law's answer `e` times `b`.
fn answered(
    at: &Prepared<'_>,
    response: &Response,
    m: usize,
    (column, a): (&mut [f64], Pair<'_>),
    (e, b): (&[f64], Pair<'_>),
) {
    let n = at.n_lines();
    let parts = at.sensors(column).zip(e.chunks_exact((2 * n).max(1)));
    for (s, ((y, w), e)) in parts.enumerate() {
        wide(Both { y, scale: response.shapes[(m, s)], w, a, e: e.split_at(n), b });
    }
}

/// Weighted columns of `responses` (as those of [`Response::h`]) to mode `m` at the given coordinates.
fn close(
    at: &Prepared<'_>,
    response: &Response,
    responses: &Split,
    coordinates: &[usize],
    m: usize,
    column: &mut [f64],
) {
    for (s, ((re, im), w)) in at.sensors(column).enumerate() {
        re.fill(0.0);
        im.fill(0.0);
        for &i in coordinates {
            let shape = response.w(i, m);
            let h = responses.col(i * response.n_out + s);
            update_real((&mut *re, &mut *im), h, w, |y, h, w| y + h * (w * shape));
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
        let n_along = if projector.is_some() && response.closed.is_none() {
            2 * at.n_lines() * response.n_free
        } else {
            0
        };
        let mut along = ws.take(n_along, n);
        if let Some(closed) = &response.closed {
            let all: Vec<usize> = (0..response.n_w).collect();
            (0..n).for_each(|m| close(at, response, &response.to_change, &all, m, first.col_mut(m)));
            let mut second = Vec::new();
            for g in (0..closed.moving.len()).filter(|g| closed.moving[*g]) {
                let own: Vec<usize> = all.iter().copied().filter(|i| closed.group[*i] == g).collect();
                let mut shapes = ws.take(at.n_rows(), n);
                (0..n).for_each(|m| close(at, response, &response.to_force, &own, m, shapes.col_mut(m)));
                second.push((g, shapes));
            }
            return Self { first, along, second };
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
        Self { first, along, second: Vec::new() }
    }

    /// Column of the free decay of mode `m` with the given motion; `along` becomes the coordinates of what was
    /// projected.
    pub fn decay(
        &self,
        at: &Prepared<'_>,
        response: &Response,
        projector: Option<&Projector>,
        (m, motion): (usize, &Split),
        (column, along): (&mut [f64], &mut [f64]),
    ) {
        let acceleration = motion.col(motion.n_columns() - 1);
        let Some(closed) = &response.closed else {
            times(column, self.first.col(m), acceleration);
            return times(along, self.along.col(m), acceleration);
        };
        let mut back = Split::zeros(at.n_lines(), 1);
        update(back.col_mut(0), motion.col(0), |_, d| -d);
        answered(at, response, m, (&mut *column, acceleration), (self.first.col(m), back.col(0)));
        for (g, second) in &self.second {
            add_times(column, second.col(m), closed.cut_off(at, *g, motion).col(0));
        }
        if let Some(p) = projector {
            p.project(column, along);
        }
    }

    /// Column of what changes mode `m` alone by -`change` (one column).
    pub fn one_mode(
        &self,
        at: &Prepared<'_>,
        response: &Response,
        projector: Option<&Projector>,
        (m, change): (usize, &Split),
        (column, along): (&mut [f64], &mut [f64]),
    ) {
        let mut acceleration = Split::zeros(at.n_lines(), 1);
        update2(acceleration.col_mut(0), at.s2.col(0), change.col(0), |_, s2, v| -s2 * v);
        if response.closed.is_none() {
            return times(column, self.first.col(m), acceleration.col(0));
        }
        answered(at, response, m, (&mut *column, acceleration.col(0)), (self.first.col(m), change.col(0)));
        if let Some(p) = projector {
            p.project(column, along);
        }
    }

    pub fn give_back(self, ws: &mut Workspace) {
        ws.give(self.first);
        ws.give(self.along);
        self.second.into_iter().for_each(|(_, a)| ws.give(a));
    }
}
