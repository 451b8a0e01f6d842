//! Response of one record under a hypothesis, and its changes.

use super::IdentifyError;
use super::arrays::{Pair, Split, Workspace, inverse, update, update2};
use super::attached::ClosedLoop;
use super::decaying::{closing_sigma, n_decaying};
use super::hypothesis::{Hypothesis, What};
use super::model::Modal;
use super::prepared::Prepared;
use femend_linalg::{Dense, gemm_tn};
use num_complex::Complex64;

/// Everything about one record at one point of the unknowns.
pub(crate) struct Response {
    /// Mode shapes at the sensors, then at the coordinates (r, n_out + n_w).
    pub shapes: Dense,
    pub n_out: usize,
    pub n_w: usize,
    /// Number of the last coordinates whose forces are free.
    pub n_free: usize,
    /// Modal receptances, a column each.
    pub g: Split,
    /// Modal response to the measured forces (and to the law's force in a closed loop), a column each.
    pub q: Split,
    /// Predicted accelerations without free decays, a column for each sensor; further columns have no meaning.
    pub y: Split,
    /// Accelerations per unit force at each coordinate, column i n_out + s for sensor s; further columns have no meaning.
    pub h: Split,
    /// Coordinates' displacements, a column each; those of a free force without that force.
    pub d: Split,
    pub closed: Option<ClosedLoop>,
    /// Accelerations that a closed loop answers with to an open-loop change -1 of each coordinate, and to a force of 1
    /// against each one's motion; columns as those of `h`.
    pub to_change: Split,
    pub to_force: Split,
    /// Poles of the free decays a finite record cuts off; none for an FRF (`dt` = 0).
    pub poles: Vec<Complex64>,
}

impl Response {
    pub fn new(
        at: &Prepared<'_>,
        modal: &Modal,
        hypothesis: &Hypothesis,
        x: &[f64],
        n_tuned: usize,
        ws: &mut Workspace,
    ) -> Result<Self, IdentifyError> {
        let (n_out, n_w) = (at.n_out(), hypothesis.w.nrows());
        let mut rows = at.record.out_rows.transposed();
        if n_w > 0 {
            rows.append(&hypothesis.w.transposed());
        }
        let shapes = gemm_tn(&modal.q, &rows);
        let r = modal.omega.len();
        let mut g = ws.split(at.n_lines(), r);
        receptances(at, modal, &mut g);
        let mut q = ws.split(at.n_lines(), r);
        at.u.times_into(&gemm_tn(&at.record.in_rows.transposed(), &modal.q), &mut q);
        (0..r).for_each(|m| update(q.col_mut(m), g.col(m), |q, g| q * g));
        let mut y = ws.split(at.n_lines(), n_out + n_w);
        q.times_into(&shapes, &mut y);
        let mut d = y.columns(n_out, n_w);
        for s in 0..n_out {
            update(y.col_mut(s), at.s2.col(0), |y, s2| y * s2);
        }
        for s in 0..at.cut_off.n_columns() {
            update(y.col_mut(s), at.cut_off.col(s), |y, more| y + more);
        }
        let is_law = matches!(hypothesis.what, What::Laws(_) | What::Given(..));
        let joint = joint_shapes(&shapes, n_out, is_law);
        let mut h = ws.split(at.n_lines(), joint.ncols());
        g.times_into(&joint, &mut h);
        let c = h.columns(n_w * n_out, joint.ncols() - n_w * n_out);
        for j in 0..n_w * n_out {
            update(h.col_mut(j), at.s2.col(0), |h, s2| h * s2);
        }
        let (mut to_change, mut to_force) = (Split::zeros(at.n_lines(), 0), Split::zeros(at.n_lines(), 0));
        let mut closed = None;
        if is_law {
            let law = ClosedLoop::new(at, hypothesis, x, c)?;
            d = law.closed(&d);
            let force = law.force(&d);
            push_sensors(&h, n_out, &force, &mut y);
            add_force(&shapes, n_out, &g, &force, &mut q);
            let answer = law.answer();
            to_change = mixed(&h, n_out, &answer, ws);
            to_force = mixed(&h, n_out, &law.answer_to_force(&answer), ws);
            closed = Some(law);
        }
        let poles = poles(at, modal, n_tuned);
        let n_free = hypothesis.n_free();
        Ok(Self { shapes, n_out, n_w, n_free, g, q, y, h, d, closed, to_change, to_force, poles })
    }

    /// Accelerations of sensor `s` per unit of free force `j`, a closed loop's answer included, up to the sign that is
    /// given beside.
    pub fn per_free_force(&self, j: usize, s: usize) -> (Pair<'_>, f64) {
        let column = (self.n_w - self.n_free + j) * self.n_out + s;
        if self.closed.is_some() { (self.to_force.col(column), -1.0) } else { (self.h.col(column), 1.0) }
    }

    /// Adds free forces (`n_free` columns) to the accelerations of the sensors.
    pub fn push_free(&self, free: &Split, y: &mut Split) {
        for (j, s) in (0..self.n_free).flat_map(|j| (0..self.n_out).map(move |s| (j, s))) {
            let (h, sign) = self.per_free_force(j, s);
            update2(y.col_mut(s), h, free.col(j), |y, h, f| y + sign * (h * f));
        }
    }

    /// Adds free forces to those of all coordinates.
    pub fn add_free(&self, free: &Split, force: &mut Split) {
        let first = self.n_w - self.n_free;
        (0..self.n_free).for_each(|j| update(force.col_mut(first + j), free.col(j), |f, own| f + own));
    }

    /// Adds the law's answer to open-loop changes -d of its coordinates.
    pub fn feed_back(&self, d: &Split, y: &mut Split) {
        push_sensors(&self.to_change, self.n_out, d, y);
    }

    /// Adds what forces against the motion come to in a closed loop.
    pub fn push_back(&self, force: &Split, y: &mut Split) {
        push_sensors(&self.to_force, self.n_out, force, y);
    }

    /// Modal response with free forces (`n_free` columns) added, and of a closed loop the displacements of the
    /// coordinates with them; `q` is overwritten.
    pub fn driven(&self, free: &Split, mut q: Split) -> (Split, Split) {
        (0..q.n_columns()).for_each(|m| update(q.col_mut(m), self.q.col(m), |_, q| q));
        if self.n_free == 0 {
            return (q, self.d.clone());
        }
        let mut force = Split::zeros(self.g.n_lines(), self.n_w);
        self.add_free(free, &mut force);
        if let Some(closed) = &self.closed {
            let mut moved = Split::zeros(self.g.n_lines(), self.n_w);
            closed.add_compliance(1.0, &force, &mut moved);
            let mut d = closed.closed(&moved);
            let answer = closed.force(&d);
            (0..self.n_w).for_each(|i| update(force.col_mut(i), answer.col(i), |f, a| f + a));
            add_force(&self.shapes, self.n_out, &self.g, &force, &mut q);
            (0..self.n_w).for_each(|i| update(d.col_mut(i), self.d.col(i), |d, own| d + own));
            return (q, d);
        }
        add_force(&self.shapes, self.n_out, &self.g, &force, &mut q);
        (q, self.d.clone())
    }

    /// Adds the modal response to forces at the coordinates.
    pub fn answer(&self, force: &Split, q: &mut Split) {
        add_force(&self.shapes, self.n_out, &self.g, force, q);
    }

    /// Displacements of the coordinates under a modal response, where no loop is closed.
    pub fn open_motion(&self, q: &Split) -> Split {
        let mut all = Split::zeros(self.g.n_lines(), self.shapes.ncols());
        q.times_into(&self.shapes, &mut all);
        all.columns(self.n_out, self.n_w)
    }

    /// dY/dx_j of the law's parameters where its coordinates move by `d`.
    pub fn law_column(&self, j: usize, d: &Split, y: &mut Split) {
        (0..self.n_out).for_each(|s| y.col_mut(s).0.fill(0.0));
        (0..self.n_out).for_each(|s| y.col_mut(s).1.fill(0.0));
        let Some(closed) = &self.closed else { return };
        let mut extra = Split::zeros(self.d.n_lines(), self.n_w);
        for &i in &closed.reach[j] {
            update2(extra.col_mut(i), d.col(i), closed.slopes.col(j), |_, d, slope| d * slope);
        }
        self.push_back(&extra, y);
    }

    pub fn give_back(self, ws: &mut Workspace) {
        [self.g, self.q, self.y, self.h, self.to_change, self.to_force]
            .into_iter()
            .for_each(|a| ws.give(a.into_dense()));
    }

    /// Mode `m` at coordinate `i`.
    pub fn w(&self, i: usize, m: usize) -> f64 {
        self.shapes[(m, self.n_out + i)]
    }

    /// What the laws' forces beyond kappa times the displacement are where mode `m` decays with a motion.
    pub fn cut_off(
        &self,
        at: &Prepared<'_>,
        closed: &ClosedLoop,
        m: usize,
        factor: f64,
        motion: &Split,
    ) -> Split {
        let forces: Vec<Split> = (0..closed.moving.len()).map(|g| closed.cut_off(at, g, motion)).collect();
        let mut force = Split::zeros(motion.n_lines(), self.n_w);
        for i in 0..self.n_w {
            let w = factor * self.w(i, m);
            update(force.col_mut(i), forces[closed.group[i]].col(0), |_, v| v * w);
        }
        force
    }

    /// The shape of mode `m` at the coordinates times one column of lines.
    pub fn at_coordinates(&self, m: usize, factor: f64, column: &Split) -> Split {
        let mut d = Split::zeros(column.n_lines(), self.n_w);
        for i in 0..self.n_w {
            let w = factor * self.w(i, m);
            update(d.col_mut(i), column.col(0), |_, v| v * w);
        }
        d
    }

    /// The shape of mode `m` at the sensors times one column of lines.
    pub fn at_sensors(&self, m: usize, column: &Split, y: &mut Split) {
        for s in 0..self.n_out {
            let o = self.shapes[(m, s)];
            update(y.col_mut(s), column.col(0), |_, v| v * o);
        }
    }
}

/// For each coordinate the products of its modes with those at the sensors and, for a law, at all coordinates after them.
fn joint_shapes(shapes: &Dense, n_out: usize, is_law: bool) -> Dense {
    let (r, n) = (shapes.nrows(), shapes.ncols());
    let pairs = |range: std::ops::Range<usize>| {
        (n_out..n).flat_map(move |i| range.clone().map(move |s| (i, s))).collect::<Vec<_>>()
    };
    let mut all = pairs(0..n_out);
    if is_law {
        all.extend(pairs(n_out..n));
    }
    let mut joint = Dense::zeros(r, all.len());
    for (j, (i, s)) in all.into_iter().enumerate() {
        let (a, b) = (shapes.col(i), shapes.col(s));
        joint.col_mut(j).iter_mut().zip(a.iter().zip(b)).for_each(|(v, (a, b))| *v = a * b);
    }
    joint
}

fn push_sensors(h: &Split, n_out: usize, force: &Split, y: &mut Split) {
    for i in 0..force.n_columns() {
        for s in 0..n_out {
            update2(y.col_mut(s), h.col(i * n_out + s), force.col(i), |y, h, f| y + h * f);
        }
    }
}

/// h A for `a` of n_w x n_w entries: columns of the sensors' accelerations for each coordinate.
fn mixed(h: &Split, n_out: usize, a: &Split, ws: &mut Workspace) -> Split {
    let n_w = a.n_columns().isqrt();
    let mut y = ws.split(h.n_lines(), n_w * n_out);
    for (j, s) in (0..n_w).flat_map(|j| (0..n_out).map(move |s| (j, s))) {
        let to = j * n_out + s;
        update2(y.col_mut(to), h.col(s), a.col(j), |_, h, a| h * a);
        for i in 1..n_w {
            update2(y.col_mut(to), h.col(i * n_out + s), a.col(i * n_w + j), |y, h, a| y + h * a);
        }
    }
    y
}

fn add_force(shapes: &Dense, n_out: usize, g: &Split, force: &Split, q: &mut Split) {
    for i in 0..force.n_columns() {
        for m in 0..q.n_columns() {
            let w = shapes[(m, n_out + i)];
            update2(q.col_mut(m), g.col(m), force.col(i), |q, g, f| q + g * f * w);
        }
    }
}

fn receptances(at: &Prepared<'_>, modal: &Modal, g: &mut Split) {
    for (m, (w, z)) in modal.omega.iter().zip(&modal.zeta).enumerate() {
        let (square, damping) = (w * w, 2.0 * z * w);
        update2(g.col_mut(m), at.s.col(0), at.s2.col(0), |_, s, s2| inverse(s2 + square + damping * s));
    }
}

/// Poles of the modes that decay beyond a record's end (`n_decaying`). Behind a window that has closed nothing is cut off,
/// and all records begin at rest.
fn poles(at: &Prepared<'_>, modal: &Modal, n_tuned: usize) -> Vec<Complex64> {
    let record = at.record;
    let closed_window = record.sigma > closing_sigma(record.n_samples * record.dt);
    if record.dt <= 0.0 || closed_window || n_tuned == 0 {
        return Vec::new();
    }
    let highest = record.s.iter().fold(0.0_f64, |a, s| a.max(s.im));
    let n = n_decaying(&modal.omega, highest, n_tuned, record.driven_to);
    (0..n)
        .map(|m| {
            let z = modal.zeta[m].min(0.999);
            modal.omega[m] * Complex64::new(-z, (1.0 - z * z).sqrt())
        })
        .collect()
}
