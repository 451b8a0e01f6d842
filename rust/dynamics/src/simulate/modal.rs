//! Modes side by side in lanes: one substep without the laws' end force, then its correction.

use super::{ModalModel, Output};
use crate::oscillator::exact_step;

/// Modes treated together, so that the compiler keeps them in vector registers.
pub(super) const LANES: usize = 4;
/// Lanes of modes.
pub(super) type Lanes = Vec<[f64; LANES]>;

/// omega dt above which a mode follows its force statically: its pole is too near the Nyquist frequency, where any
/// stiff law would make it unstable.
const STATIC_LIMIT: f64 = 2.4;

/// Coefficients of all modes for one substep length.
#[derive(Debug)]
pub(super) struct Stepper {
    a: [[Lanes; 2]; 2],
    b0: [Lanes; 2],
    b1: [Lanes; 2],
    /// Rows of w, and b1 w.
    w: Vec<Lanes>,
    b1_w: Vec<[Lanes; 2]>,
    /// Rows of phi_in.
    phi_in: Vec<Lanes>,
    /// Acceleration of a mode = gain p - stiffness q - damping q'.
    gain: Lanes,
    stiffness: Lanes,
    damping: Lanes,
    /// Rows of phi_out, and what is given out there.
    phi_out: Vec<Lanes>,
    quantity: Output,
    /// Response of each mode to a force that alternates every substep, seen where the force is positive.
    alternating: Vec<f64>,
    pub(super) n_static: usize,
}

/// Displacements, velocities and forces of all modes.
#[derive(Clone, Debug)]
pub(super) struct Modes {
    pub(super) q: Lanes,
    pub(super) dq: Lanes,
    pub(super) p: Lanes,
}

fn lanes(values: impl Iterator<Item = f64>) -> Lanes {
    let values: Vec<f64> = values.collect();
    values.chunks(LANES).map(|chunk| std::array::from_fn(|i| chunk.get(i).copied().unwrap_or(0.0))).collect()
}

/// Sum over modes of the products of two rows.
#[inline(always)]
pub(super) fn dot(x: &Lanes, y: &Lanes) -> f64 {
    let mut sum = [0.0; LANES];
    for (x, y) in x.iter().zip(y) {
        for i in 0..LANES {
            sum[i] += x[i] * y[i];
        }
    }
    sum.iter().sum()
}

fn times(x: &Lanes, y: &Lanes) -> Lanes {
    x.iter().zip(y).map(|(x, y)| std::array::from_fn(|i| x[i] * y[i])).collect()
}

/// target += factor * row
#[inline(always)]
pub(super) fn add(target: &mut Lanes, factor: f64, row: &Lanes) {
    for (target, row) in target.iter_mut().zip(row) {
        for i in 0..LANES {
            target[i] += factor * row[i];
        }
    }
}

/// One mode's numbers: a (4), b0 (2), b1 (2), gain, stiffness, damping, alternating response.
fn mode(omega: f64, zeta: f64, h: f64) -> [f64; 12] {
    if omega * h > STATIC_LIMIT {
        let flexibility = 1.0 / (omega * omega);
        // q = p / omega^2, its velocity by the backward difference
        return [0.0, 0.0, -1.0 / h, 0.0, 0.0, 0.0, flexibility, flexibility / h, 0.0, 0.0, 0.0, flexibility];
    }
    let (stiffness, damping) = (omega * omega, 2.0 * zeta * omega);
    let s = exact_step(stiffness, damping, h);
    // x(n+1) = -x(n) under p = +1, -1, ...: (a + 1) x = b1 - b0
    let (b, c) = (s.b1[0] - s.b0[0], s.b1[1] - s.b0[1]);
    let (m00, m01, m10, m11) = (s.a[0][0] + 1.0, s.a[0][1], s.a[1][0], s.a[1][1] + 1.0);
    let alternating = (m11 * b - m01 * c) / (m00 * m11 - m01 * m10);
    [
        s.a[0][0],
        s.a[0][1],
        s.a[1][0],
        s.a[1][1],
        s.b0[0],
        s.b0[1],
        s.b1[0],
        s.b1[1],
        1.0,
        stiffness,
        damping,
        alternating,
    ]
}

impl Stepper {
    pub(super) fn new(model: &ModalModel, h: f64, output: Output) -> Self {
        let r = model.omega.len();
        let numbers: Vec<[f64; 12]> =
            model.omega.iter().zip(model.zeta).map(|(o, z)| mode(*o, *z, h)).collect();
        let column = |i: usize| lanes(numbers.iter().map(|n| n[i]));
        let rows =
            |values: &[f64]| values.chunks(r).map(|row| lanes(row.iter().copied())).collect::<Vec<_>>();
        let (b1, w) = ([column(6), column(7)], rows(model.w));
        let (gain, stiffness, damping) = (column(8), column(9), column(10));
        Self {
            a: [[column(0), column(1)], [column(2), column(3)]],
            b0: [column(4), column(5)],
            b1_w: w.iter().map(|row| [times(&b1[0], row), times(&b1[1], row)]).collect(),
            b1,
            w,
            phi_in: rows(model.phi_in),
            gain,
            stiffness,
            damping,
            phi_out: rows(model.phi_out),
            quantity: output,
            alternating: numbers.iter().map(|n| n[11]).collect(),
            n_static: model.omega.iter().filter(|omega| **omega * h > STATIC_LIMIT).count(),
        }
    }

    pub(super) fn rest(&self) -> Modes {
        let zero = vec![[0.0; LANES]; self.gain.len()];
        Modes { q: zero.clone(), dq: zero.clone(), p: zero }
    }

    /// Modal force of the inputs `u` (one value an input), written to `p`.
    #[inline(always)]
    pub(super) fn load(&self, u: impl Iterator<Item = f64>, p: &mut Lanes) {
        p.fill([0.0; LANES]);
        for (row, u) in self.phi_in.iter().zip(u) {
            add(p, u, row);
        }
    }

    /// One substep under the force `x.p` at its start and, for now, only the inputs' force `load` at its end.
    #[inline(always)]
    pub(super) fn free(&self, x: &mut Modes, load: &Lanes) {
        let [[a00, a01], [a10, a11]] = &self.a;
        let ([b0q, b0v], [b1q, b1v]) = (&self.b0, &self.b1);
        let n = x.q.len();
        let (q, dq, p) = (&mut x.q[..n], &mut x.dq[..n], &mut x.p[..n]);
        let (a00, a01, a10, a11) = (&a00[..n], &a01[..n], &a10[..n], &a11[..n]);
        let (b0q, b0v, b1q, b1v, load) = (&b0q[..n], &b0v[..n], &b1q[..n], &b1v[..n], &load[..n]);
        for k in 0..n {
            for i in 0..LANES {
                let (q0, v0, p0, p1) = (q[k][i], dq[k][i], p[k][i], load[k][i]);
                q[k][i] = a00[k][i] * q0 + a01[k][i] * v0 + b0q[k][i] * p0 + b1q[k][i] * p1;
                dq[k][i] = a10[k][i] * q0 + a11[k][i] * v0 + b0v[k][i] * p0 + b1v[k][i] * p1;
                p[k][i] = p1;
            }
        }
    }

    /// A free substep of a sensitivity: no input force at its end.
    pub(super) fn free_unloaded(&self, x: &mut Modes) {
        let n = x.q.len();
        for k in 0..n {
            for i in 0..LANES {
                let (q0, v0, p0) = (x.q[k][i], x.dq[k][i], x.p[k][i]);
                x.q[k][i] = self.a[0][0][k][i] * q0 + self.a[0][1][k][i] * v0 + self.b0[0][k][i] * p0;
                x.dq[k][i] = self.a[1][0][k][i] * q0 + self.a[1][1][k][i] * v0 + self.b0[1][k][i] * p0;
                x.p[k][i] = 0.0;
            }
        }
    }

    /// Adds a law force `f` on coordinate `j` to the end of the substep.
    #[inline(always)]
    pub(super) fn correct(&self, x: &mut Modes, j: usize, f: f64) {
        let n = x.q.len();
        let (q, dq, p) = (&mut x.q[..n], &mut x.dq[..n], &mut x.p[..n]);
        let (bq, bv, w) = (&self.b1_w[j][0][..n], &self.b1_w[j][1][..n], &self.w[j][..n]);
        for k in 0..n {
            for i in 0..LANES {
                q[k][i] -= f * bq[k][i];
                dq[k][i] -= f * bv[k][i];
                p[k][i] -= f * w[k][i];
            }
        }
    }

    /// Adds a law force `f` on coordinate `j` at the start from rest, where nothing has moved yet.
    #[inline(always)]
    pub(super) fn load_only(&self, x: &mut Modes, j: usize, f: f64) {
        add(&mut x.p, -f, &self.w[j]);
    }

    /// Acceleration of coordinate i by a unit force on coordinate j on the structure at rest, 1/kg.
    pub(super) fn mobility_at_rest(&self, i: usize, j: usize) -> f64 {
        dot(&self.w[i], &times(&self.gain, &self.w[j]))
    }

    /// Displacement and velocity of coordinate `j`.
    #[inline(always)]
    pub(super) fn motion(&self, x: &Modes, j: usize) -> (f64, f64) {
        let n = x.q.len();
        let (w, q, dq) = (&self.w[j][..n], &x.q[..n], &x.dq[..n]);
        let (mut d, mut v) = ([0.0; LANES], [0.0; LANES]);
        for k in 0..n {
            for i in 0..LANES {
                d[i] += w[k][i] * q[k][i];
                v[i] += w[k][i] * dq[k][i];
            }
        }
        (d.iter().sum(), v.iter().sum())
    }

    /// Acceleration of coordinate `j`.
    #[inline(always)]
    pub(super) fn acceleration(&self, x: &Modes, j: usize) -> f64 {
        let mut sum = [0.0; LANES];
        for (k, w) in self.w[j].iter().enumerate() {
            for i in 0..LANES {
                let inner = self.gain[k][i] * x.p[k][i] - self.stiffness[k][i] * x.q[k][i];
                sum[i] += w[i] * (inner - self.damping[k][i] * x.dq[k][i]);
            }
        }
        sum.iter().sum()
    }

    /// Effect of a unit law force at the end of the substep on (-d, -v, -a): coordinates i (moved) and j (force).
    pub(super) fn compliance(&self, i: usize, j: usize) -> [f64; 3] {
        let mut unit = self.rest();
        self.correct(&mut unit, j, -1.0);
        let (d, v) = self.motion(&unit, i);
        [d, v, self.acceleration(&unit, i)]
    }

    /// What the modes lack in compliance at the Nyquist frequency of the substep between coordinates i and j, m/N.
    pub(super) fn lacking(&self, i: usize, j: usize) -> f64 {
        let flat = |row: &Lanes| row.iter().flatten().copied().collect::<Vec<_>>();
        let (wi, wj) = (flat(&self.w[i]), flat(&self.w[j]));
        self.alternating.iter().zip(wi.iter().zip(&wj)).map(|(g, (x, y))| -g * x * y).sum()
    }

    /// Number of outputs.
    pub(super) fn n_outputs(&self) -> usize {
        self.phi_out.len()
    }

    /// Gives the output of every row to `keep`.
    #[inline(always)]
    pub(super) fn outputs(&self, x: &Modes, mut keep: impl FnMut(usize, f64)) {
        let acceleration: Lanes;
        let values = match self.quantity {
            Output::Displacement => &x.q,
            Output::Velocity => &x.dq,
            Output::Acceleration => {
                acceleration = self.accelerations(x);
                &acceleration
            }
        };
        for (row, phi) in self.phi_out.iter().enumerate() {
            keep(row, dot(phi, values));
        }
    }

    #[inline(always)]
    fn accelerations(&self, x: &Modes) -> Lanes {
        let one = |k: usize| -> [f64; LANES] {
            std::array::from_fn(|i| {
                let inner = self.gain[k][i] * x.p[k][i] - self.stiffness[k][i] * x.q[k][i];
                inner - self.damping[k][i] * x.dq[k][i]
            })
        };
        (0..x.q.len()).map(one).collect()
    }
}
