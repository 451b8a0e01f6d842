//! Cost, gradient and Gauss-Newton matrix of one hypothesis over all records.

use super::response::{Response, Split, tail};
use super::system::{Hypothesis, Modal, System, What};
use super::{IdentifyError, RecordLines, check};
use femend_linalg::{Dense, gemm_tn};
use num_complex::Complex64;

/// Power of a mode, relative to the strongest, below which its free decay is not believed to be any smaller.
const DECAY_FLOOR: f64 = 1e-6;

/// Cost of a hypothesis at one point, with what its minimisation needs.
#[derive(Debug, Clone)]
pub struct Evaluation {
    /// Tempered sum of squares plus prior.
    pub cost: f64,
    /// Prior part of the cost.
    pub prior: f64,
    /// Mean weighted square of the residual per complex value left free, for each record.
    pub misfit: Vec<f64>,
    /// Half the gradient (n), empty where it was not asked for.
    pub gradient: Vec<f64>,
    /// Gauss-Newton matrix (n, n), empty likewise.
    pub hessian: Dense,
}

/// What is predicted and left over on the lines of one record, line after line.
#[derive(Debug, Clone)]
pub struct Fitted {
    /// Predicted accelerations, free decays included, K x n_out.
    pub y: Vec<Complex64>,
    /// Displacements of the coordinates, K x n_w.
    pub d: Vec<Complex64>,
    /// Forces on the structure at the coordinates, K x n_w.
    pub force: Vec<Complex64>,
}

/// The weighted columns of one record: 2 n_out rows a line (real and imaginary part of each sensor).
struct Columns {
    data: Dense,
    n_out: usize,
}

impl Columns {
    fn new(n_lines: usize, n_out: usize, n_cols: usize) -> Self {
        Self { data: Dense::zeros(2 * n_lines * n_out, n_cols), n_out }
    }

    fn fill(&mut self, j: usize, record: &RecordLines, value: impl Fn(usize, usize) -> Complex64) {
        let n_out = self.n_out;
        let column = self.data.col_mut(j);
        for k in 0..record.n_lines() {
            for s in 0..n_out {
                let v = value(s, k) * record.weight[k * n_out + s];
                column[2 * (k * n_out + s)] = v.re;
                column[2 * (k * n_out + s) + 1] = v.im;
            }
        }
    }

    /// Fills a column with weighted values held as real and imaginary parts.
    fn fill_split(&mut self, j: usize, record: &RecordLines, y: &Split) {
        let (re, im) = (y.re.data(), y.im.data());
        let column = self.data.col_mut(j);
        for (i, w) in record.weight.iter().enumerate() {
            column[2 * i] = re[i] * w;
            column[2 * i + 1] = im[i] * w;
        }
    }

    /// Removes from every column on every line its part in the span of `basis` (orthonormal vectors of n_out).
    fn project(&mut self, basis: &[Vec<Vec<Complex64>>]) {
        let n_out = self.n_out;
        for j in 0..self.data.ncols() {
            let column = self.data.col_mut(j);
            for (here, vectors) in column.chunks_exact_mut(2 * n_out).zip(basis) {
                for v in vectors {
                    let (mut a, mut b) = (0.0, 0.0);
                    for (v, x) in v.iter().zip(here.chunks_exact(2)) {
                        a += v.re * x[0] + v.im * x[1];
                        b += v.re * x[1] - v.im * x[0];
                    }
                    for (v, x) in v.iter().zip(here.chunks_exact_mut(2)) {
                        x[0] -= v.re * a - v.im * b;
                        x[1] -= v.re * b + v.im * a;
                    }
                }
            }
        }
    }
}

/// Orthonormal basis of the weighted force columns on every line, and their triangular factor (column-major, n_w x n_w).
struct Projector {
    basis: Vec<Vec<Vec<Complex64>>>,
    triangle: Vec<Vec<Complex64>>,
}

impl Projector {
    fn new(response: &Response, record: &RecordLines) -> Self {
        let (n_w, n_out) = (response.h.len(), record.n_out());
        let (mut basis, mut triangle) = (Vec::new(), Vec::new());
        for k in 0..record.n_lines() {
            let mut vectors: Vec<Vec<Complex64>> = Vec::with_capacity(n_w);
            let mut r = vec![Complex64::default(); n_w * n_w];
            for j in 0..n_w {
                let mut v: Vec<Complex64> =
                    (0..n_out).map(|s| response.h[j].get(s, k) * record.weight[k * n_out + s]).collect();
                let size = norm(&v);
                for (i, u) in vectors.iter().enumerate() {
                    let dot: Complex64 = u.iter().zip(&v).map(|(u, v)| u.conj() * v).sum();
                    r[j * n_w + i] = dot;
                    v.iter_mut().zip(u).for_each(|(v, u)| *v -= u * dot);
                }
                let left = norm(&v);
                // A column that depends on the earlier ones adds nothing to the span and carries no force of its own.
                if left > 1e-7 * size && left > 0.0 {
                    v.iter_mut().for_each(|v| *v /= left);
                    r[j * n_w + j] = left.into();
                } else {
                    v.fill(Complex64::default());
                }
                vectors.push(v);
            }
            basis.push(vectors);
            triangle.push(r);
        }
        Self { basis, triangle }
    }

    /// Least-squares forces of a weighted residual on one line.
    fn forces(&self, k: usize, residual: &[Complex64]) -> Vec<Complex64> {
        let (vectors, r) = (&self.basis[k], &self.triangle[k]);
        let n = vectors.len();
        let mut f: Vec<Complex64> =
            vectors.iter().map(|v| v.iter().zip(residual).map(|(v, r)| v.conj() * r).sum()).collect();
        for i in (0..n).rev() {
            for j in i + 1..n {
                let t = r[j * n + i] * f[j];
                f[i] -= t;
            }
            let pivot = r[i * n + i];
            f[i] = if pivot.norm() > 0.0 { f[i] / pivot } else { Complex64::default() };
        }
        f
    }
}

fn norm(v: &[Complex64]) -> f64 {
    v.iter().map(Complex64::norm_sqr).sum::<f64>().sqrt()
}

/// One record's state: response, decay columns, projector, decay amplitudes.
struct Step<'a> {
    record: &'a RecordLines,
    response: Response,
    projector: Option<Projector>,
    decays: Vec<Split>,
    /// Forces against the motion of the laws' own decays (n_w, K), after the modes' columns.
    inner: Vec<Split>,
    amplitudes: Vec<f64>,
    columns: Columns,
    gram: Dense,
    ridge: Vec<f64>,
    sum: f64,
    free: f64,
}

impl<'a> Step<'a> {
    fn new(
        record: &'a RecordLines,
        system: &System,
        modal: &Modal,
        hypothesis: &Hypothesis,
        x: &[f64],
    ) -> Result<Self, IdentifyError> {
        let response = Response::new(record, modal, hypothesis, x, system.n_tuned)?;
        let mut decays = decay_columns(record, &response);
        let mut ridge = decay_ridge(record, &response);
        let inner = inner_forces(record, &response, hypothesis, x)?;
        for (force, weight) in &inner {
            let mut y = Split::zeros(record.n_out(), record.n_lines());
            response.push(force, &mut y);
            decays.push(y);
            ridge.push(*weight);
        }
        let inner = inner.into_iter().map(|(force, _)| force).collect();
        let n_t = decays.len();
        let mut columns = Columns::new(record.n_lines(), record.n_out(), n_t + 1);
        for (t, column) in decays.iter().enumerate() {
            columns.fill_split(t, record, column);
        }
        let n_out = record.n_out();
        columns.fill(n_t, record, |s, k| record.y[k * n_out + s] - response.y.get(s, k));
        let projector = matches!(hypothesis.what, What::FreeForce).then(|| Projector::new(&response, record));
        if let Some(p) = &projector {
            columns.project(&p.basis);
        }
        let gram = gemm_tn(&columns.data, &columns.data);
        let (amplitudes, sum) = eliminate(&gram, &ridge);
        let lost = if projector.is_some() { response.h.len().min(n_out) } else { 0 };
        let free = (record.n_lines() * (n_out - lost)) as f64;
        Ok(Self { record, response, projector, decays, inner, amplitudes, columns, gram, ridge, sum, free })
    }

    /// Weighted residual after the free decays, before any projection.
    fn residual(&self, k: usize) -> Vec<Complex64> {
        let n_out = self.record.n_out();
        (0..n_out)
            .map(|s| {
                let decay: Complex64 =
                    self.decays.iter().zip(&self.amplitudes).map(|(t, a)| t.get(s, k) * a).sum();
                (self.record.y[k * n_out + s] - self.response.y.get(s, k) - decay)
                    * self.record.weight[k * n_out + s]
            })
            .collect()
    }

    fn force(&self) -> Split {
        let n_w = self.response.h.len();
        let mut force = Split::zeros(n_w, self.record.n_lines());
        for k in 0..self.record.n_lines() {
            if let Some(p) = &self.projector {
                for (i, f) in p.forces(k, &self.residual(k)).into_iter().enumerate() {
                    force.set(i, k, f);
                }
            } else if let Some(closed) = &self.response.closed {
                (0..n_w).for_each(|i| force.set(i, k, -closed.kappa[k] * self.response.d.get(i, k)));
            }
        }
        force
    }

    /// Adds to the coordinates' displacements what the fitted free decays move them by, the law's answer included.
    fn add_decays(&self, d: &mut Split) {
        let shapes = self.response.decays(self.record);
        let (n_modes, n_w) = (self.response.poles.len(), self.response.w.nrows());
        for k in 0..self.record.n_lines() {
            let at = |i: usize, what: &dyn Fn([Complex64; 3]) -> Complex64| -> Complex64 {
                (0..2 * n_modes)
                    .map(|t| {
                        let shape = shapes[k * n_modes + t / 2][t % 2];
                        what(shape) * self.response.w[(i, t / 2)] * self.amplitudes[t]
                    })
                    .sum()
            };
            let inner = self.inner.iter().zip(&self.amplitudes[2 * n_modes..]);
            let extra: Vec<Complex64> = (0..n_w)
                .map(|i| {
                    let own: Complex64 = inner.clone().map(|(force, a)| force.get(i, k) * a).sum();
                    own + at(i, &|shape| self.response.cut_off(self.record, k, shape))
                })
                .collect();
            let open: Vec<Complex64> = (0..n_w)
                .map(|i| {
                    let pushed: Complex64 =
                        (0..n_w).map(|j| self.response.compliance(k, i, j) * extra[j]).sum();
                    at(i, &|shape| shape[0]) - pushed
                })
                .collect();
            for i in 0..n_w {
                let moved = match &self.response.closed {
                    Some(closed) => (0..n_w).map(|j| closed.b[(k * n_w + i) * n_w + j] * open[j]).sum(),
                    None => open[i],
                };
                let v = d.get(i, k) + moved;
                d.set(i, k, v);
            }
        }
    }

    /// Adds this record's part of the Gauss-Newton matrix and half gradient.
    fn accumulate(
        &self,
        system: &System,
        modal: &Modal,
        n_law: usize,
        hessian: &mut Dense,
        gradient: &mut [f64],
    ) {
        let n = system.n_unknowns() + n_law;
        let n_t = self.decays.len();
        let mut columns = Columns::new(self.record.n_lines(), self.record.n_out(), n);
        self.sensitivities(system, modal, n_law, &mut columns);
        if let Some(p) = &self.projector {
            columns.project(&p.basis);
        }
        let cross = gemm_tn(&self.columns.data, &columns.data);
        let own = gemm_tn(&columns.data, &columns.data);
        let mut reduced = Dense::zeros(n, n);
        if n_t > 0 {
            let Some(l) = decay_factor(&self.gram, &self.ridge) else { return };
            let mut tj = Dense::zeros(n_t, n);
            for j in 0..n {
                tj.col_mut(j).copy_from_slice(&cross.col(j)[..n_t]);
            }
            l.solve_lower_in_place(false, &mut tj);
            reduced = gemm_tn(&tj, &tj);
        }
        let jr: Vec<f64> = (0..n)
            .map(|j| cross[(n_t, j)] - (0..n_t).map(|t| cross[(t, j)] * self.amplitudes[t]).sum::<f64>())
            .collect();
        let share = self.record.share;
        for j in 0..n {
            gradient[j] -= share * jr[j];
            for i in 0..n {
                hessian[(i, j)] += share * (own[(i, j)] - reduced[(i, j)]);
            }
        }
    }

    fn sensitivities(&self, system: &System, modal: &Modal, n_law: usize, columns: &mut Columns) {
        let (record, response) = (self.record, &self.response);
        let q =
            if self.projector.is_some() { response.with_force(&self.force()) } else { response.q.clone() };
        for i in 0..system.n_par {
            let mut v = Split::times(&modal.dk[i], &q);
            if let Some(dm) = &modal.dm[i] {
                let inertia = Split::times(dm, &q);
                for k in 0..record.n_lines() {
                    let s2 = record.s[k] * record.s[k];
                    for m in 0..system.r {
                        let value = v.get(m, k) + s2 * inertia.get(m, k);
                        v.set(m, k, value);
                    }
                }
            }
            let y = response.change(record, &v);
            columns.fill_split(i, record, &y);
        }
        let slope = |m: usize, k: usize, jitter: bool| {
            let (w, z) = (modal.omega[m], modal.zeta[m]);
            let damping = 2.0 * z * w * record.s[k];
            if jitter { damping + 2.0 * w * w } else { damping }
        };
        for m in 0..system.n_tuned {
            for (jitter, at) in [(true, system.n_par + m), (false, system.n_par + system.n_tuned + m)] {
                let y = self.one_mode(m, |k| slope(m, k, jitter) * q.get(m, k) * response.g.get(m, k));
                columns.fill_split(at, record, &y);
            }
        }
        let mut v = Split::zeros(system.r, record.n_lines());
        for k in 0..record.n_lines() {
            for m in system.n_tuned..system.r {
                v.set(m, k, slope(m, k, false) * q.get(m, k));
            }
        }
        let y = response.change(record, &v);
        columns.fill_split(system.n_unknowns() - 1, record, &y);
        for j in 0..n_law {
            let y = response.law_column(j);
            columns.fill_split(system.n_unknowns() + j, record, &y);
        }
    }

    /// [`Response::change`] where one mode alone changes; `gv` is its G v on every line.
    fn one_mode(&self, m: usize, gv: impl Fn(usize) -> Complex64) -> Split {
        let (record, response) = (self.record, &self.response);
        let (n_out, n_w) = (record.n_out(), response.w.nrows());
        let mut y = Split::zeros(n_out, record.n_lines());
        let mut d = Split::zeros(n_w, record.n_lines());
        for k in 0..record.n_lines() {
            let change = gv(k);
            let a = -record.s[k] * record.s[k] * change;
            let shape = response.out.col(m);
            y.re.col_mut(k).iter_mut().zip(shape).for_each(|(y, o)| *y = a.re * o);
            y.im.col_mut(k).iter_mut().zip(shape).for_each(|(y, o)| *y = a.im * o);
            (0..n_w).for_each(|i| d.set(i, k, change * response.w[(i, m)]));
        }
        if let Some(closed) = &response.closed {
            response.feed_back(closed, &d, &mut y);
        }
        y
    }
}

/// Unweighted columns of the free decays, the answer of a closed loop included.
fn decay_columns(record: &RecordLines, response: &Response) -> Vec<Split> {
    let shapes = response.decays(record);
    let n_modes = response.poles.len();
    let (n_out, n_w) = (record.n_out(), response.w.nrows());
    let mut all = Vec::with_capacity(2 * n_modes);
    for m in 0..n_modes {
        for part in 0..2 {
            let mut y = Split::zeros(n_out, record.n_lines());
            let mut d = Split::zeros(n_w, record.n_lines());
            let mut extra = Split::zeros(n_w, record.n_lines());
            let shape = response.out.col(m);
            for k in 0..record.n_lines() {
                let moved = shapes[k * n_modes + m][part];
                y.re.col_mut(k).iter_mut().zip(shape).for_each(|(y, o)| *y = moved[2].re * o);
                y.im.col_mut(k).iter_mut().zip(shape).for_each(|(y, o)| *y = moved[2].im * o);
                let force = response.cut_off(record, k, moved);
                for i in 0..n_w {
                    d.set(i, k, -moved[0] * response.w[(i, m)]);
                    extra.set(i, k, force * response.w[(i, m)]);
                }
            }
            if let Some(closed) = &response.closed {
                response.feed_back(closed, &d, &mut y);
                response.push(&extra, &mut y);
            }
            all.push(y);
        }
    }
    all
}

/// Forces (n_w, K) of the laws' inner states as they decay beyond a record's end, with their inverse prior variances:
/// a state is about as strong as the force of the law that moves.
fn inner_forces(
    record: &RecordLines,
    response: &Response,
    hypothesis: &Hypothesis,
    x: &[f64],
) -> Result<Vec<(Split, f64)>, IdentifyError> {
    let mut all = Vec::new();
    let Some(closed) = response.closed.as_ref().filter(|_| !response.poles.is_empty()) else {
        return Ok(all);
    };
    let n_w = response.w.nrows();
    for (pole, pair) in hypothesis.inner_poles(x)? {
        for i in 0..n_w {
            let power: f64 = (0..record.n_lines())
                .map(|k| {
                    let s = record.s[k];
                    let moving = s * closed.velocity[k] + s * s * closed.inertia[k];
                    (moving * response.d.get(i, k)).norm_sqr()
                })
                .sum();
            let variance = 2.0 * power * record.thinning / (record.n_samples * record.n_samples);
            for part in 0..if pair { 2 } else { 1 } {
                let mut force = Split::zeros(n_w, record.n_lines());
                for k in 0..record.n_lines() {
                    let own = tail(record, pole, k);
                    let value = match (pair, part) {
                        (false, _) => own,
                        (true, 0) => own + tail(record, pole.conj(), k),
                        (true, _) => Complex64::i() * (own - tail(record, pole.conj(), k)),
                    };
                    force.set(i, k, value);
                }
                all.push((force, 1.0 / variance.max(f64::MIN_POSITIVE)));
            }
        }
    }
    Ok(all)
}

/// Inverse prior variances of the decay amplitudes: a decay is about as strong as the mode's own answer to the measured
/// force. Without that, a free force and a decay of the mode it drives could grow against each other without limit.
fn decay_ridge(record: &RecordLines, response: &Response) -> Vec<f64> {
    let power: Vec<f64> = (0..response.poles.len())
        .map(|m| {
            let sum: f64 = record
                .s
                .iter()
                .enumerate()
                .map(|(k, s)| s.norm_sqr().powi(2) * response.q.get(m, k).norm_sqr())
                .sum();
            2.0 * sum * record.thinning / (record.n_samples * record.n_samples)
        })
        .collect();
    let floor = DECAY_FLOOR * power.iter().fold(f64::MIN_POSITIVE, |a, b| a.max(*b));
    power.iter().flat_map(|p| [1.0 / p.max(floor), 1.0 / p.max(floor)]).collect()
}

fn decay_factor(gram: &Dense, ridge: &[f64]) -> Option<Dense> {
    let n_t = ridge.len();
    let mut a = Dense::zeros(n_t, n_t);
    for j in 0..n_t {
        for i in 0..n_t {
            a[(i, j)] = gram[(i, j)];
        }
        a[(j, j)] += ridge[j] + f64::MIN_POSITIVE;
    }
    a.cholesky().ok()
}

/// Best decay amplitudes and the sum of squares they leave, their prior included; `gram` is over [decays, residual].
fn eliminate(gram: &Dense, ridge: &[f64]) -> (Vec<f64>, f64) {
    let n_t = ridge.len();
    let total = gram[(n_t, n_t)];
    if n_t == 0 {
        return (Vec::new(), total);
    }
    let Some(l) = decay_factor(gram, ridge) else { return (vec![0.0; n_t], f64::NAN) };
    let right: Vec<f64> = (0..n_t).map(|t| gram[(t, n_t)]).collect();
    let mut c = Dense::from_vec(n_t, 1, right.clone());
    l.solve_lower_in_place(false, &mut c);
    l.solve_lower_in_place(true, &mut c);
    let c = c.into_vec();
    let explained: f64 = c.iter().zip(&right).map(|(c, g)| c * g).sum();
    (c, (total - explained).max(0.0))
}

/// Evaluates a hypothesis at unknowns `p` and law unknowns `x`.
///
/// # Errors
/// [`IdentifyError`] when the reduced model cannot be solved or a law refuses its parameters.
pub(crate) fn evaluate(
    system: &System,
    records: &[RecordLines],
    hypothesis: &Hypothesis,
    p: &[f64],
    x: &[f64],
    derivatives: bool,
) -> Result<Evaluation, IdentifyError> {
    let modal = system.modal(p)?;
    let n = p.len() + x.len();
    let deviations = |i: usize| {
        if i < p.len() {
            ((p[i] - system.mean[i]) / system.sd[i], system.sd[i])
        } else {
            let j = i - p.len();
            ((x[j] - hypothesis.law_mean[j]) / hypothesis.law_sd[j], hypothesis.law_sd[j])
        }
    };
    let prior: f64 = (0..n).map(|i| deviations(i).0.powi(2)).sum();
    let (mut gradient, mut hessian) = (Vec::new(), Dense::zeros(0, 0));
    if derivatives {
        gradient = (0..n).map(|i| deviations(i).0 / deviations(i).1).collect();
        hessian = Dense::zeros(n, n);
        (0..n).for_each(|i| hessian[(i, i)] = deviations(i).1.powi(-2));
    }
    let (mut cost, mut misfit) = (prior, Vec::new());
    for record in records {
        let step = Step::new(record, system, &modal, hypothesis, x)?;
        cost += record.share * step.sum;
        misfit.push(step.sum / step.free.max(1.0));
        if derivatives {
            step.accumulate(system, &modal, x.len(), &mut hessian, &mut gradient);
        }
    }
    Ok(Evaluation { cost, prior, misfit, gradient, hessian })
}

/// Predictions, coordinates and forces of a hypothesis on the lines of every record.
///
/// # Errors
/// As [`evaluate`], and for arrays that do not fit.
pub fn fitted(
    system: &System,
    records: &[RecordLines],
    hypothesis: &Hypothesis,
    p: &[f64],
    x: &[f64],
) -> Result<Vec<Fitted>, IdentifyError> {
    check(system, records, hypothesis, p, x)?;
    let modal = system.modal(p)?;
    records
        .iter()
        .map(|record| {
            let step = Step::new(record, system, &modal, hypothesis, x)?;
            let mut force = step.force();
            let (n_out, n_w) = (record.n_out(), step.response.h.len());
            let mut out = Fitted { y: Vec::new(), d: Vec::new(), force: Vec::new() };
            let free = step.projector.is_some();
            // Displacements of the coordinates answer to a free force through the whole model; free decays move them too.
            let mut d = if free {
                Split::times(&step.response.w, &step.response.with_force(&force))
            } else {
                step.response.d.clone()
            };
            step.add_decays(&mut d);
            if let Some(closed) = &step.response.closed {
                for k in 0..record.n_lines() {
                    (0..n_w).for_each(|i| force.set(i, k, -closed.kappa[k] * d.get(i, k)));
                }
            }
            let seen = step.force();
            for k in 0..record.n_lines() {
                for s in 0..n_out {
                    let decay: Complex64 =
                        step.decays.iter().zip(&step.amplitudes).map(|(t, a)| t.get(s, k) * a).sum();
                    let pushed: Complex64 = if free {
                        (0..n_w).map(|i| step.response.h[i].get(s, k) * seen.get(i, k)).sum()
                    } else {
                        Complex64::default()
                    };
                    out.y.push(step.response.y.get(s, k) + decay + pushed);
                }
                (0..n_w).for_each(|i| out.d.push(d.get(i, k)));
                (0..n_w).for_each(|i| out.force.push(force.get(i, k)));
            }
            Ok(out)
        })
        .collect()
}

#[cfg(test)]
mod tests;
