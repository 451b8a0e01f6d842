//! Response of one record under a hypothesis, and its columns: free decays, free force, sensitivities.

use super::system::{Hypothesis, Modal, What};
use super::{IdentifyError, RecordLines};
use femend_linalg::{Dense, gemm};
use num_complex::Complex64;

/// A window exp(-sigma t) has closed at the end T of a record where sigma T is more than this.
const WINDOW_CLOSED: f64 = 7.0;
/// Modes up to this multiple of the highest line's frequency have free decays that the lines can tell from noise.
const DECAYS_ABOVE: f64 = 1.5;

/// A complex array over (row, line) as two real ones, so that products with real matrices are real products.
#[derive(Debug, Clone)]
pub(crate) struct Split {
    pub re: Dense,
    pub im: Dense,
}

impl Split {
    pub fn zeros(n: usize, k: usize) -> Self {
        Self { re: Dense::zeros(n, k), im: Dense::zeros(n, k) }
    }

    pub fn get(&self, i: usize, k: usize) -> Complex64 {
        Complex64::new(self.re[(i, k)], self.im[(i, k)])
    }

    pub fn set(&mut self, i: usize, k: usize, v: Complex64) {
        self.re[(i, k)] = v.re;
        self.im[(i, k)] = v.im;
    }

    /// A x for real A.
    pub fn times(a: &Dense, x: &Self) -> Self {
        let mut y = Self::zeros(a.nrows(), x.re.ncols());
        gemm(&mut y.re, 0.0, 1.0, a, &x.re);
        gemm(&mut y.im, 0.0, 1.0, a, &x.im);
        y
    }

    /// Elementwise product.
    pub fn hadamard(&self, x: &Self) -> Self {
        let mut y = Self::zeros(self.re.nrows(), self.re.ncols());
        let (a, b) = (self.re.data(), self.im.data());
        let (c, d) = (x.re.data(), x.im.data());
        for (i, v) in y.re.data_mut().iter_mut().enumerate() {
            *v = a[i] * c[i] - b[i] * d[i];
        }
        for (i, v) in y.im.data_mut().iter_mut().enumerate() {
            *v = a[i] * d[i] + b[i] * c[i];
        }
        y
    }
}

/// The closed loop of a linear law: D = B (D_0 + T_d c), F = -kappa D.
pub(crate) struct Loop {
    /// kappa on every line.
    pub kappa: Vec<Complex64>,
    /// Parts of kappa on every line that act on velocity and on acceleration: kappa = elastic + s velocity + s^2 inertia.
    pub velocity: Vec<Complex64>,
    pub inertia: Vec<Complex64>,
    /// d kappa / d x_j on every line.
    pub slopes: Vec<Vec<Complex64>>,
    /// B = (I + kappa c)^-1, n_w x n_w a line, row-major.
    pub b: Vec<Complex64>,
    /// Joint compliance c = W G W^T, n_w x n_w a line, row-major.
    pub c: Vec<Complex64>,
}

/// Everything about one record at one point of the unknowns.
pub(crate) struct Response {
    pub out: Dense,
    pub w: Dense,
    pub g: Split,
    /// Modal response to the measured forces (and to the law's force in a closed loop).
    pub q: Split,
    /// Predicted accelerations without free decays (n_out, K).
    pub y: Split,
    /// Accelerations per unit force at each coordinate: n_w arrays (n_out, K).
    pub h: Vec<Split>,
    /// Coordinates' displacements (n_w, K); those of a free force without that force.
    pub d: Split,
    pub closed: Option<Loop>,
    /// Poles of the free decays a finite record cuts off; none for an FRF (`dt` = 0).
    pub poles: Vec<Complex64>,
}

/// How many modes decay beyond a record's end: the tuned ones, and those above the lines whose skirts reach into them.
fn decaying(record: &RecordLines, modal: &Modal, n_tuned: usize) -> usize {
    if n_tuned == 0 {
        return 0;
    }
    let reach = DECAYS_ABOVE * record.s.iter().fold(0.0_f64, |a, s| a.max(s.im));
    n_tuned.max(modal.omega.iter().take_while(|w| **w < reach).count())
}

impl Response {
    pub fn new(
        record: &RecordLines,
        modal: &Modal,
        hypothesis: &Hypothesis,
        x: &[f64],
        n_tuned: usize,
    ) -> Result<Self, IdentifyError> {
        let n = record.n_lines();
        let out = product(&record.out_rows, &modal.q);
        let input = product(&record.in_rows, &modal.q);
        let w = product(&hypothesis.w, &modal.q);
        let g = receptances(record, modal);
        let mut load = Split::zeros(record.n_in(), n);
        for k in 0..n {
            for i in 0..record.n_in() {
                load.set(i, k, record.u[k * record.n_in() + i]);
            }
        }
        let mut q = Split::times(&input.transposed(), &load).hadamard(&g);
        let mut d = Split::times(&w, &q);
        let gw: Vec<Split> = (0..w.nrows()).map(|i| scale_rows(&g, &row(&w, i))).collect();
        let mut h: Vec<Split> = gw.iter().map(|gw| Split::times(&out, gw)).collect();
        h.iter_mut().for_each(|h| times_line(h, |k| record.s[k] * record.s[k]));
        let closed = match hypothesis.what {
            What::Laws(_) => {
                let (kappa, slopes) = hypothesis.kappa(x, &record.s)?;
                let mut closed = close(kappa, slopes, &w, &gw, &hypothesis.compliance, n);
                (closed.velocity, closed.inertia) = hypothesis.moving_parts(x, &record.s)?;
                let force = close_loop(&closed, &mut d);
                for (i, gw) in gw.iter().enumerate() {
                    add_force(&mut q, gw, &force, i);
                }
                Some(closed)
            }
            _ => None,
        };
        let mut y = Split::times(&out, &q);
        times_line(&mut y, |k| record.s[k] * record.s[k]);
        // behind a window that has closed nothing is cut off, and all records begin at rest
        let closed_window = record.sigma * record.n_samples * record.dt > WINDOW_CLOSED;
        let n_decays = if record.dt > 0.0 && !closed_window { decaying(record, modal, n_tuned) } else { 0 };
        let poles = (0..n_decays)
            .map(|m| {
                let z = modal.zeta[m].min(0.999);
                modal.omega[m] * Complex64::new(-z, (1.0 - z * z).sqrt())
            })
            .collect();
        Ok(Self { out, w, g, q, y, h, d, closed, poles })
    }

    /// Columns of the free decays on every line: displacement, velocity and acceleration of column t at line k, all
    /// without the mode's amplitude at the sensor. Two columns a mode.
    pub fn decays(&self, record: &RecordLines) -> Vec<[[Complex64; 3]; 2]> {
        let mut all = Vec::with_capacity(self.poles.len() * record.n_lines());
        let i = Complex64::i();
        for k in 0..record.n_lines() {
            for pole in &self.poles {
                let (a, b) = (tail(record, *pole, k), tail(record, pole.conj(), k));
                let turns = [0, 1, 2].map(|n| pole.powi(n) / pole.norm_sqr());
                all.push([
                    turns.map(|turn| turn * a + turn.conj() * b),
                    turns.map(|turn| i * (turn * a - turn.conj() * b)),
                ]);
            }
        }
        all
    }

    /// Force of the law on line k beyond kappa times the displacement, where the coordinates decay with displacement,
    /// velocity and acceleration `shape` times `amplitude` each: what is cut off at a record's end makes the transforms
    /// of velocity and acceleration more than s and s^2 times that of the displacement.
    pub fn cut_off(&self, record: &RecordLines, k: usize, shape: [Complex64; 3]) -> Complex64 {
        let Some(closed) = &self.closed else { return Complex64::default() };
        let (s, [d, v, a]) = (record.s[k], shape);
        closed.velocity[k] * (v - s * d) + closed.inertia[k] * (a - s * s * d)
    }

    /// Compliance between coordinates i and j on line k; a closed loop alone has it.
    pub fn compliance(&self, k: usize, i: usize, j: usize) -> Complex64 {
        let n_w = self.w.nrows();
        self.closed.as_ref().map_or(Complex64::default(), |c| c.c[(k * n_w + i) * n_w + j])
    }

    /// Takes forces against the motion (n_w, K) off the accelerations, with what the closed loop makes of them.
    pub fn push(&self, force: &Split, y: &mut Split) {
        let Some(closed) = &self.closed else { return };
        let n_w = self.w.nrows();
        let mut d = Split::zeros(n_w, y.re.ncols());
        for k in 0..y.re.ncols() {
            for i in 0..n_w {
                d.set(i, k, (0..n_w).map(|j| self.compliance(k, i, j) * force.get(j, k)).sum());
            }
            for s in 0..y.re.nrows() {
                let pushed: Complex64 = (0..n_w).map(|i| self.h[i].get(s, k) * force.get(i, k)).sum();
                let v = y.get(s, k) - pushed;
                y.set(s, k, v);
            }
        }
        self.feed_back(closed, &d, y);
    }

    /// Adds a force at coordinate rows to the modal response, for the sensitivities of a free force.
    pub fn with_force(&self, force: &Split) -> Split {
        let mut q = self.q.clone();
        for i in 0..self.w.nrows() {
            let gw = scale_rows(&self.g, &row(&self.w, i));
            add_force(&mut q, &gw, force, i);
        }
        q
    }

    /// dY for a change of the dynamic stiffness whose product with the modal response is `v`: -s² Φ G v, closed loop
    /// included.
    pub fn change(&self, record: &RecordLines, v: &Split) -> Split {
        let gv = self.g.hadamard(v);
        let mut y = Split::times(&self.out, &gv);
        times_line(&mut y, |k| -record.s[k] * record.s[k]);
        if let Some(closed) = &self.closed {
            let d = Split::times(&self.w, &gv);
            self.feed_back(closed, &d, &mut y);
        }
        y
    }

    /// Adds the answer of the law to open-loop changes -d of its coordinates: y += h kappa B d.
    pub fn feed_back(&self, closed: &Loop, d: &Split, y: &mut Split) {
        let n_w = self.w.nrows();
        for k in 0..y.re.ncols() {
            for i in 0..n_w {
                let mut bd = Complex64::default();
                for j in 0..n_w {
                    bd += closed.b[(k * n_w + i) * n_w + j] * d.get(j, k);
                }
                let f = closed.kappa[k] * bd;
                for s in 0..y.re.nrows() {
                    let v = y.get(s, k) + self.h[i].get(s, k) * f;
                    y.set(s, k, v);
                }
            }
        }
    }

    /// dY/dx_j of the law's parameters.
    pub fn law_column(&self, j: usize) -> Split {
        let n_w = self.w.nrows();
        let mut y = Split::zeros(self.out.nrows(), self.y.re.ncols());
        let Some(closed) = &self.closed else { return y };
        for k in 0..y.re.ncols() {
            let e: Vec<Complex64> = (0..n_w).map(|i| closed.slopes[j][k] * self.d.get(i, k)).collect();
            let at = |a: &[Complex64], i: usize, l: usize| a[(k * n_w + i) * n_w + l];
            let ce: Vec<Complex64> =
                (0..n_w).map(|i| (0..n_w).map(|l| at(&closed.c, i, l) * e[l]).sum()).collect();
            for i in 0..n_w {
                let bce: Complex64 = (0..n_w).map(|l| at(&closed.b, i, l) * ce[l]).sum();
                let df = closed.kappa[k] * bce - e[i];
                for s in 0..y.re.nrows() {
                    let v = y.get(s, k) + self.h[i].get(s, k) * df;
                    y.set(s, k, v);
                }
            }
        }
        y
    }
}

/// Transform of a decay exp(pole t) that begins where the record ends, on line k.
pub(crate) fn tail(record: &RecordLines, pole: Complex64, k: usize) -> Complex64 {
    let lambda = ((pole - record.sigma) * record.dt).exp();
    let z = Complex64::new(0.0, -record.s[k].im * record.dt).exp();
    (1.0 - lambda * z).inv()
}

fn product(a: &Dense, b: &Dense) -> Dense {
    if a.nrows() == 0 {
        return Dense::zeros(0, b.ncols());
    }
    let mut c = Dense::zeros(a.nrows(), b.ncols());
    gemm(&mut c, 0.0, 1.0, a, b);
    c
}

fn row(a: &Dense, i: usize) -> Vec<f64> {
    (0..a.ncols()).map(|j| a[(i, j)]).collect()
}

fn scale_rows(g: &Split, w: &[f64]) -> Split {
    let mut out = g.clone();
    for part in [&mut out.re, &mut out.im] {
        for k in 0..part.ncols() {
            part.col_mut(k).iter_mut().zip(w).for_each(|(v, w)| *v *= w);
        }
    }
    out
}

fn times_line(y: &mut Split, factor: impl Fn(usize) -> Complex64) {
    for k in 0..y.re.ncols() {
        let f = factor(k);
        for i in 0..y.re.nrows() {
            let v = y.get(i, k) * f;
            y.set(i, k, v);
        }
    }
}

fn receptances(record: &RecordLines, modal: &Modal) -> Split {
    let mut g = Split::zeros(modal.omega.len(), record.n_lines());
    for (k, s) in record.s.iter().enumerate() {
        let s2 = s * s;
        for (m, (w, z)) in modal.omega.iter().zip(&modal.zeta).enumerate() {
            g.set(m, k, (s2 + w * w + 2.0 * z * w * s).inv());
        }
    }
    g
}

fn add_force(q: &mut Split, gw: &Split, force: &Split, i: usize) {
    for k in 0..q.re.ncols() {
        let f = force.get(i, k);
        let (a, b) = (gw.re.col(k), gw.im.col(k));
        q.re.col_mut(k).iter_mut().enumerate().for_each(|(m, v)| *v += a[m] * f.re - b[m] * f.im);
        q.im.col_mut(k).iter_mut().enumerate().for_each(|(m, v)| *v += a[m] * f.im + b[m] * f.re);
    }
}

fn close(
    kappa: Vec<Complex64>,
    slopes: Vec<Vec<Complex64>>,
    w: &Dense,
    gw: &[Split],
    compliance: &[f64],
    n: usize,
) -> Loop {
    let n_w = w.nrows();
    let parts: Vec<Split> = gw.iter().map(|gw| Split::times(w, gw)).collect();
    let mut c = vec![Complex64::default(); n * n_w * n_w];
    let mut b = c.clone();
    for k in 0..n {
        let block = k * n_w * n_w..(k + 1) * n_w * n_w;
        let here = &mut c[block.clone()];
        for i in 0..n_w {
            for j in 0..n_w {
                here[i * n_w + j] = parts[j].get(i, k) + if i == j { compliance[i] } else { 0.0 };
            }
        }
        let mut a: Vec<Complex64> = here.iter().map(|v| v * kappa[k]).collect();
        (0..n_w).for_each(|i| a[i * n_w + i] += 1.0);
        invert(&mut a, n_w, &mut b[block]);
    }
    Loop { kappa, velocity: Vec::new(), inertia: Vec::new(), slopes, b, c }
}

/// Inverse of a small complex matrix by elimination with row pivoting; a zero pivot gives non-finite entries, which the
/// caller's cost turns down.
fn invert(a: &mut [Complex64], n: usize, out: &mut [Complex64]) {
    out.fill(Complex64::default());
    (0..n).for_each(|i| out[i * n + i] = Complex64::new(1.0, 0.0));
    for c in 0..n {
        let pivot = (c..n).max_by(|&i, &j| a[i * n + c].norm().total_cmp(&a[j * n + c].norm())).unwrap_or(c);
        for j in 0..n {
            a.swap(c * n + j, pivot * n + j);
            out.swap(c * n + j, pivot * n + j);
        }
        let inv = a[c * n + c].inv();
        for j in 0..n {
            a[c * n + j] *= inv;
            out[c * n + j] *= inv;
        }
        for i in (0..n).filter(|&i| i != c) {
            let f = a[i * n + c];
            for j in 0..n {
                let (x, y) = (a[c * n + j], out[c * n + j]);
                a[i * n + j] -= f * x;
                out[i * n + j] -= f * y;
            }
        }
    }
}

/// Turns open-loop displacements into closed-loop ones and gives the law's force on the structure.
fn close_loop(closed: &Loop, d: &mut Split) -> Split {
    let n_w = d.re.nrows();
    let mut force = Split::zeros(n_w, d.re.ncols());
    for k in 0..d.re.ncols() {
        let open: Vec<Complex64> = (0..n_w).map(|i| d.get(i, k)).collect();
        for i in 0..n_w {
            let v: Complex64 = (0..n_w).map(|j| closed.b[(k * n_w + i) * n_w + j] * open[j]).sum();
            d.set(i, k, v);
            force.set(i, k, -closed.kappa[k] * v);
        }
    }
    force
}
