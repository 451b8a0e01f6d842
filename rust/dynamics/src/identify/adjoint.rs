//! Half the gradient of a cost without its columns, by the adjoint: what a change of the modal response would do to the
//! squares is worked out once for every mode and line, and every unknown is a product with that.
//!
//! A change -v(s) of the modal forces moves the squares by Re Σ λ_m(s) v_m(s), where
//!
//! ```text
//! λ_m = G_m Σ_s φ_ms (-s²) ρ̄_s + G_m Σ_i φ_mi Σ_s a_is ρ̄_s
//! ```
//!
//! with the weighted residual ρ of sensor s and a closed loop's answer a to its coordinate i. Parameters come in through
//! v = (dK + s² dM) q + s dC q, so that Σ q λᵀ over all lines and records serves them all. Free decays change with their
//! modes' frequencies, damping ratios and shapes; at their best amplitudes nothing comes of a change of these (the envelope
//! theorem), nor of a free force.

use super::arrays::{Loop, Pair, Split, Workspace, update, update_real, update2, wide};
use super::attached::ClosedLoop;
use super::model::Modal;
use super::normal::{Gradient, Step};
use super::system::System;
use femend_linalg::Dense;
use num_complex::Complex64;

/// Sums over lines and records; real parts, times the records' shares.
pub(super) struct Adjoint {
    /// Σ q λᵀ (r, r).
    stiffness: Dense,
    /// Σ s² q λᵀ (r, r), where parameters move mass.
    mass: Option<Dense>,
    /// Σ s q_m λ_m of every mode.
    damping: Vec<f64>,
    /// What every unknown of the law does.
    law: Vec<f64>,
    decays: OfDecays,
    gradient: Gradient,
}

/// What the free decays' own changes do.
pub(crate) struct OfDecays {
    /// With the logarithm of every mode's frequency, and of its damping ratio (r).
    pub frequency: Vec<f64>,
    pub damping: Vec<f64>,
    /// Where mode j, column j, takes on a unit of mode i (r, r).
    pub shape: Dense,
}

/// Adds to the first columns.
fn add(to: &mut Dense, part: &Dense) {
    to.data_mut().iter_mut().zip(part.data()).for_each(|(a, b)| *a += b);
}

/// Re Σ a b̄ over the lines of one column each.
fn inner(a: Pair<'_>, b: Pair<'_>) -> f64 {
    struct Inner<'a>(Pair<'a>, Pair<'a>);
    impl Loop for Inner<'_> {
        type Output = f64;
        #[inline(always)]
        fn run(self) -> f64 {
            let sum = |a: &[f64], b: &[f64]| {
                let mut lanes = [0.0; 8];
                let (a, b) = (a.chunks_exact(8), b.chunks_exact(8));
                let rest: f64 = a.remainder().iter().zip(b.remainder()).map(|(a, b)| a * b).sum();
                for (a, b) in a.zip(b) {
                    (0..8).for_each(|i| lanes[i] += a[i] * b[i]);
                }
                lanes.iter().sum::<f64>() + rest
            };
            sum(self.0.0, self.1.0) + sum(self.0.1, self.1.1)
        }
    }
    wide(Inner(a, b))
}

impl Adjoint {
    pub fn new(system: &System, n_law: usize, gradient: Gradient) -> Self {
        let r = system.r;
        let inertial = system.terms.iter().any(|t| t.m.is_some());
        Self {
            stiffness: Dense::zeros(r, r),
            mass: inertial.then(|| Dense::zeros(r, r)),
            damping: vec![0.0; r],
            law: vec![0.0; n_law],
            decays: OfDecays { frequency: vec![0.0; r], damping: vec![0.0; r], shape: Dense::zeros(r, r) },
            gradient,
        }
    }

    /// Adds one record.
    pub fn add(&mut self, step: &Step<'_>, ws: &mut Workspace) {
        let (at, response) = (step.at, &step.response);
        let back = residual(step);
        let exact = self.gradient == Gradient::Exact;
        let size = if exact { of_size(step, ws) } else { None };
        let (mut q, mut d) =
            response.driven(&step.free_force(), ws.split(at.n_lines(), response.g.n_columns()));
        step.decays.add_answer(at, response, &step.amplitudes, (&mut q, &mut d));
        // where nothing but the recorded forces drives the modes, both are about the same motion
        let alone = response.closed.is_none() && response.n_free == 0;
        self.moved(step, (&q, &d), Some(&back), size.as_ref().filter(|_| alone), ws);
        if let Some(mut size) = size {
            if !alone {
                self.moved(step, (&response.q, &response.d), None, Some(&size), ws);
            }
            self.decays.turned(&response.q, &mut size);
            ws.give(size.into_dense());
        }
        ws.give(q.into_dense());
    }

    /// Adds what comes of changes where modes answer `q` and coordinates move by `d`: to the residual `back`, and to the
    /// `size` of decays.
    fn moved(
        &mut self,
        step: &Step<'_>,
        (q, d): (&Split, &Split),
        back: Option<&Split>,
        size: Option<&Split>,
        ws: &mut Workspace,
    ) {
        let response = &step.response;
        let through = size.filter(|_| response.closed.is_some()).map(|size| at_forces(step, size));
        self.laws(step, d, back, through.as_ref());
        // the size of decays alone is about their modes alone, but for what a closed loop answers
        let mut lambda = match size {
            Some(size) if back.is_none() && response.closed.is_none() => {
                let mut own = ws.split(size.n_lines(), size.n_columns());
                (0..size.n_columns()).for_each(|m| update(own.col_mut(m), size.col(m), |_, v| v));
                own
            }
            _ => {
                let answers = answers(step, back, through.as_ref());
                if let Some(back) = back.filter(|_| self.gradient == Gradient::Exact) {
                    self.decays.add(step, back, &answers, ws);
                    self.beyond(step, back);
                }
                let mut lambda = everywhere(step, back, &answers, ws);
                for m in 0..size.map_or(0, Split::n_columns) {
                    size.iter().for_each(|s| update(lambda.col_mut(m), s.col(m), |v, size| v + size));
                }
                lambda
            }
        };
        self.sum(step, q, &mut lambda);
        ws.give(lambda.into_dense());
    }

    /// Adds what comes of changes of the first modes' answers, which `lambda` has for each -1 of them.
    fn sum(&mut self, step: &Step<'_>, q: &Split, lambda: &mut Split) {
        let (at, g) = (step.at, &step.response.g);
        // kept as its conjugate: products of real and of imaginary parts then add up to Re q λ
        let n_modes = lambda.n_columns();
        (0..n_modes).for_each(|m| update(lambda.col_mut(m), g.col(m), |v, g| (v * g).conj()));
        add(&mut self.stiffness, &q.inner(lambda));
        let mut speed = Split::zeros(at.n_lines(), 1);
        for m in 0..n_modes {
            update2(speed.col_mut(0), q.col(m), at.s.col(0), |_, q, s| q * s);
            self.damping[m] += inner(speed.col(0), lambda.col(m));
        }
        if let Some(mass) = &mut self.mass {
            (0..n_modes).for_each(|m| update(lambda.col_mut(m), at.s2.col(0), |v, s2| v * s2.conj()));
            add(mass, &q.inner(lambda));
        }
    }

    /// Adds what the unknowns of a closed loop's laws do where its coordinates move by `d`.
    fn laws(&mut self, step: &Step<'_>, d: &Split, back: Option<&Split>, through: Option<&Split>) {
        let response = &step.response;
        let Some(closed) = response.closed.as_ref().filter(|_| !self.law.is_empty()) else { return };
        let mut to_force = Split::zeros(step.at.n_lines(), response.n_w);
        if let Some(back) = back {
            gather(&response.to_force, response.n_out, back, &mut to_force);
        }
        if let Some(through) = through {
            gather(&closed.answer_to_force(&closed.answer()), response.n_w, through, &mut to_force);
        }
        (0..response.n_w).for_each(|i| update(to_force.col_mut(i), d.col(i), |f, d| (f * d).conj()));
        for (j, law) in self.law.iter_mut().enumerate() {
            *law +=
                closed.reach[j].iter().map(|&i| inner(closed.slopes.col(j), to_force.col(i))).sum::<f64>();
        }
    }

    /// Adds what comes of a closed loop's forces beyond its stiffness times the displacement, which act as decays begin.
    fn beyond(&mut self, step: &Step<'_>, back: &Split) {
        let (at, response) = (step.at, &step.response);
        let moving = |c: &&ClosedLoop| c.moving.contains(&true);
        let Some(closed) = response.closed.as_ref().filter(moving) else { return };
        let mut to = Split::zeros(at.n_lines(), response.n_w);
        gather(&response.to_force, response.n_out, back, &mut to);
        (0..response.n_w).for_each(|i| to.col_mut(i).1.iter_mut().for_each(|v| *v = -*v));
        for m in 0..response.poles.len() {
            let orders = [0, 1, 2].map(|o| step.decays.changes((at, response), m, &step.amplitudes, o));
            let OfDecays { frequency, damping, shape } = &mut self.decays;
            for (kind, sum) in [(1, &mut frequency[m]), (2, &mut damping[m])] {
                let force = response.cut_off(at, closed, m, 1.0, &side_by_side(&orders, kind));
                *sum += (0..response.n_w).map(|i| inner(force.col(i), to.col(i))).sum::<f64>();
            }
            let motion = side_by_side(&orders, 0);
            for i in 0..response.n_w {
                let force = inner(closed.cut_off(at, closed.group[i], &motion).col(0), to.col(i));
                shape.col_mut(m).iter_mut().enumerate().for_each(|(j, v)| *v += response.w(i, j) * force);
            }
            for (j, law) in self.law.iter_mut().enumerate() {
                let force = closed.cut_off_slope(at, j, &motion);
                let at_reach =
                    closed.reach[j].iter().map(|&i| response.w(i, m) * inner(force.col(0), to.col(i)));
                *law += at_reach.sum::<f64>();
            }
        }
    }

    /// What all records add to minus half the gradient, in the order of the unknowns.
    pub fn descent(self, system: &System, p: &[f64], modal: &Modal) -> Vec<f64> {
        let Self { stiffness, mass, damping, law, decays, .. } = self;
        let nt = system.n_tuned;
        let held = |m: usize| 2.0 * modal.zeta[m] * modal.omega[m] * damping[m];
        let damped = |m: usize| held(m) + decays.damping[m];
        let stiff =
            |m: usize| 2.0 * modal.omega[m].powi(2) * stiffness[(m, m)] + held(m) + decays.frequency[m];
        let mut all = vec![0.0; system.n_par];
        all.extend((0..nt).map(stiff));
        all.extend((0..nt).map(damped));
        all.push((nt..system.r).map(damped).sum());
        all.extend(law);
        all[..system.n_par].copy_from_slice(&system.gathered(p, modal, (stiffness, mass), &damping, &decays));
        all
    }
}

/// Conjugate of the residual without its decays, with its weights and the record's share, a column for each sensor.
fn residual(step: &Step<'_>) -> Split {
    let (at, n_t) = (step.at, step.decays.len());
    let mut left = step.base.col(n_t).to_vec();
    for (t, a) in step.amplitudes.iter().enumerate() {
        left.iter_mut().zip(step.base.col(t)).for_each(|(v, b)| *v -= a * b);
    }
    let (n, share) = (at.n_lines(), at.record.share);
    let mut back = Split::zeros(n, at.n_out());
    for (s, part) in left.chunks_exact((2 * n).max(1)).enumerate() {
        update_real(back.col_mut(s), part.split_at(n), at.weight.col(s), |_, v, w| v.conj() * (w * share));
    }
    back
}

/// What a closed loop's answer to a change -1 of each coordinate's displacement does to the squares; `through` is what
/// forces at the coordinates do through the decays' size.
fn answers(step: &Step<'_>, back: Option<&Split>, through: Option<&Split>) -> Split {
    let response = &step.response;
    let mut answers = Split::zeros(step.at.n_lines(), response.n_w);
    if let Some(closed) = &response.closed {
        if let Some(back) = back {
            gather(&response.to_change, response.n_out, back, &mut answers);
        }
        if let Some(through) = through {
            gather(&closed.answer(), response.n_w, through, &mut answers);
        }
    }
    answers
}

/// What a change -1 of each sensor's, then each coordinate's displacement does to the squares.
fn at_coordinates(step: &Step<'_>, back: Option<&Split>, answers: &Split, to: &mut Split) {
    let n_out = step.response.n_out;
    for s in 0..n_out {
        match back {
            Some(back) => update2(to.col_mut(s), back.col(s), step.at.s2.col(0), |_, v, s2| -s2 * v),
            None => update(to.col_mut(s), step.at.s2.col(0), |_, _| Complex64::ZERO),
        }
    }
    (0..answers.n_columns()).for_each(|i| update(to.col_mut(n_out + i), answers.col(i), |_, v| v));
}

/// What changes -1 of the answers of the modes that decay do to the squares, since decays are held the looser the stronger
/// their modes answer to what was recorded; none where no decay is held so.
fn of_size(step: &Step<'_>, ws: &mut Workspace) -> Option<Split> {
    let (at, response) = (step.at, &step.response);
    let n_poles = response.poles.len();
    if n_poles == 0 || at.u.n_columns() == 0 {
        return None;
    }
    let mut size = ws.split(at.n_lines(), n_poles);
    for m in 0..n_poles {
        let factor = at.record.share * step.decays.loosened(at, m, &step.amplitudes);
        update2(size.col_mut(m), response.q.col(m), at.s2.col(0), |_, q, s2| {
            q.conj() * (s2.norm_sqr() * factor)
        });
    }
    Some(size)
}

/// What forces -1 at the coordinates do through the answers of the modes that decay.
fn at_forces(step: &Step<'_>, size: &Split) -> Split {
    let response = &step.response;
    let mut through = Split::zeros(size.n_lines(), response.n_w);
    for i in 0..response.n_w {
        for m in 0..size.n_columns() {
            let w = response.w(i, m);
            update2(through.col_mut(i), size.col(m), response.g.col(m), |v, size, g| v - size * g * w);
        }
    }
    through
}

/// Column `kind` of each.
fn side_by_side(orders: &[Split; 3], kind: usize) -> Split {
    let mut all = orders[0].columns(kind, 1);
    orders[1..].iter().for_each(|o| all.append(&o.columns(kind, 1)));
    all
}

impl OfDecays {
    /// Adds what comes of the answers of the modes that decay as the modes take on each other.
    fn turned(&mut self, q: &Split, size: &mut Split) {
        (0..size.n_columns()).for_each(|m| size.col_mut(m).1.iter_mut().for_each(|v| *v = -*v));
        let products = size.inner(q);
        for i in 0..q.n_columns() {
            self.shape.col_mut(i).iter_mut().zip(products.col(i)).for_each(|(a, b)| *a += b);
        }
    }

    /// Adds one record's; `answers` of its coordinates.
    fn add(&mut self, step: &Step<'_>, back: &Split, answers: &Split, ws: &mut Workspace) {
        let (at, response) = (step.at, &step.response);
        let (n, r, n_poles) = (at.n_lines(), response.g.n_columns(), response.poles.len());
        if n_poles == 0 {
            return;
        }
        // what accelerations of modes at the sensors, then what displacements at the coordinates do, conjugate
        let mut all = back.clone();
        all.append(answers);
        let (sensors, coordinates) = (0..response.n_out, response.n_out..response.shapes.ncols());
        for (range, order) in [(sensors, 2), (coordinates, 0)] {
            if range.is_empty() || (order == 0 && response.closed.is_none()) {
                continue;
            }
            let sign = if order == 0 { -1.0 } else { 1.0 };
            let columns: Vec<usize> = range.clone().collect();
            let mut shapes = response.shapes.select(&columns).transposed();
            shapes.data_mut().iter_mut().for_each(|v| *v *= sign);
            let mut to = ws.split(n, r);
            all.columns(range.start, range.len()).times_into(&shapes, &mut to);
            (0..r).for_each(|m| to.col_mut(m).1.iter_mut().for_each(|v| *v = -*v));
            let mut motion = ws.split(n, n_poles);
            for m in 0..n_poles {
                let changes = step.decays.changes((at, response), m, &step.amplitudes, order);
                self.frequency[m] += inner(changes.col(1), to.col(m));
                self.damping[m] += inner(changes.col(2), to.col(m));
                update(motion.col_mut(m), changes.col(0), |_, v| v);
            }
            let shape = to.inner(&motion);
            for m in 0..n_poles {
                self.shape.col_mut(m).iter_mut().zip(shape.col(m)).for_each(|(a, b)| *a += b);
            }
            ws.give(to.into_dense());
            ws.give(motion.into_dense());
        }
    }
}

/// What changes -1 of every mode's answer do to the squares at sensors and coordinates.
fn everywhere(step: &Step<'_>, back: Option<&Split>, answers: &Split, ws: &mut Workspace) -> Split {
    let (n, response) = (step.at.n_lines(), &step.response);
    let mut to = ws.split(n, response.shapes.ncols());
    at_coordinates(step, back, answers, &mut to);
    let mut lambda = ws.split(n, response.g.n_columns());
    to.times_into(&response.shapes.transposed(), &mut lambda);
    ws.give(to.into_dense());
    lambda
}

/// to_i = Σ_s a_is back_s for the columns i n_out + s of `a`.
fn gather(a: &Split, n_out: usize, back: &Split, to: &mut Split) {
    for i in 0..to.n_columns() {
        for s in 0..n_out {
            update2(to.col_mut(i), a.col(i * n_out + s), back.col(s), |y, a, v| y + a * v);
        }
    }
}
