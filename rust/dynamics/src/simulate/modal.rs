//! Modes side by side in lanes: one substep without the laws' end force, then its correction.
//!
//! What belongs to the same modes lies together: a loop over separate arrays has to make sure at every substep that none
//! of them overlap, which took twice the time of the arithmetic.

use super::lane::{LANES, Lane, mul, mul_add, scaled_add, total};
use super::{ModalModel, Output};
use crate::oscillator::exact_step;
use pulp::{Scalar, Simd};

/// Lanes of modes.
pub(super) type Lanes = Vec<Lane>;

/// omega dt above which a mode follows its force statically: its pole is too near the Nyquist frequency, where any
/// stiff law would make it unstable.
const STATIC_LIMIT: f64 = 2.4;

/// Numbers of a mode.
pub(super) const MODE: usize = 11;

/// Coefficients of some modes for one substep length. No lane of these, nor of what moves, lies across two lines of the
/// cache: what was written there could not be read again soon.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
struct Numbers {
    a: [[Lane; 2]; 2],
    b0: [Lane; 2],
    b1: [Lane; 2],
    /// Acceleration of a mode = gain p - stiffness q - damping q'.
    gain: Lane,
    stiffness: Lane,
    damping: Lane,
}

/// Some modes at a law's coordinate: w, and b1 w.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
struct Shape {
    w: Lane,
    b1_w: [Lane; 2],
}

/// Coefficients of all modes for one substep length.
#[derive(Debug)]
pub(super) struct Stepper {
    numbers: Vec<Numbers>,
    /// Shapes at every coordinate.
    shapes: Vec<Vec<Shape>>,
    /// Rows of phi_in.
    phi_in: Vec<Lanes>,
    /// Rows of phi_out, and what is given out there.
    phi_out: Vec<Lanes>,
    quantity: Output,
    /// Response of each mode to a force that alternates every substep, seen where the force is positive.
    alternating: Vec<f64>,
    pub(super) n_static: usize,
}

/// Displacements, velocities and forces of some modes.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(64))]
pub(super) struct Moving {
    q: Lane,
    dq: Lane,
    p: Lane,
}

/// Displacements, velocities and forces of all modes.
pub(super) type Modes = Vec<Moving>;

fn lanes(values: impl Iterator<Item = f64>) -> Lanes {
    let values: Vec<f64> = values.collect();
    values.chunks(LANES).map(|chunk| std::array::from_fn(|i| chunk.get(i).copied().unwrap_or(0.0))).collect()
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
        let modes: Vec<[f64; 12]> =
            model.omega.iter().zip(model.zeta).map(|(o, z)| mode(*o, *z, h)).collect();
        let columns: [Lanes; 11] = std::array::from_fn(|i| lanes(modes.iter().map(|n| n[i])));
        let numbers: Vec<Numbers> = (0..r.div_ceil(LANES))
            .map(|k| {
                let [a00, a01, a10, a11, b0q, b0v, b1q, b1v, gain, stiffness, damping] =
                    std::array::from_fn(|i| columns[i][k]);
                let a = [[a00, a01], [a10, a11]];
                Numbers { a, b0: [b0q, b0v], b1: [b1q, b1v], gain, stiffness, damping }
            })
            .collect();
        let rows =
            |values: &[f64]| values.chunks(r).map(|row| lanes(row.iter().copied())).collect::<Vec<_>>();
        let shape =
            |(w, n): (Lane, &Numbers)| Shape { w, b1_w: n.b1.map(|b| std::array::from_fn(|i| b[i] * w[i])) };
        let shapes = rows(model.w).into_iter().map(|w| w.into_iter().zip(&numbers).map(shape).collect());
        Self {
            shapes: shapes.collect(),
            numbers,
            phi_in: rows(model.phi_in),
            phi_out: rows(model.phi_out),
            quantity: output,
            alternating: modes.iter().map(|n| n[11]).collect(),
            n_static: model.omega.iter().filter(|omega| **omega * h > STATIC_LIMIT).count(),
        }
    }

    /// Number of modes.
    pub(super) fn n_modes(&self) -> usize {
        self.alternating.len()
    }

    /// Numbers of mode `m`: those of its displacement and velocity before (4), of its force before (2) and at the end (2),
    /// then those of its acceleration: gain, stiffness, damping.
    pub(super) fn mode(&self, m: usize) -> [f64; MODE] {
        let (n, i) = (&self.numbers[m / LANES], m % LANES);
        let [[a00, a01], [a10, a11]] = n.a;
        [a00, a01, a10, a11, n.b0[0], n.b0[1], n.b1[0], n.b1[1], n.gain, n.stiffness, n.damping].map(|v| v[i])
    }

    /// Mode `m` at coordinate `j`.
    pub(super) fn shape(&self, j: usize, m: usize) -> f64 {
        self.shapes[j][m / LANES].w[m % LANES]
    }

    /// Mode `m` at an input.
    pub(super) fn input(&self, row: usize, m: usize) -> f64 {
        self.phi_in[row][m / LANES][m % LANES]
    }

    /// Mode `m` at an output.
    pub(super) fn output(&self, row: usize, m: usize) -> f64 {
        self.phi_out[row][m / LANES][m % LANES]
    }

    /// Number of inputs.
    pub(super) fn n_inputs(&self) -> usize {
        self.phi_in.len()
    }

    /// What is given out.
    pub(super) fn quantity(&self) -> Output {
        self.quantity
    }

    pub(super) fn rest(&self) -> Modes {
        vec![Moving::default(); self.numbers.len()]
    }

    /// No force on any mode.
    pub(super) fn unloaded(&self) -> Lanes {
        vec![[0.0; LANES]; self.numbers.len()]
    }

    /// Modal force of the inputs `u` (one value an input), written to `p`.
    #[inline(always)]
    pub(super) fn load<S: Simd>(&self, simd: S, u: &[f64], p: &mut Lanes) {
        p.fill([0.0; LANES]);
        for (row, u) in self.phi_in.iter().zip(u) {
            for (p, row) in p.iter_mut().zip(row) {
                *p = scaled_add(simd, *u, row, p);
            }
        }
    }

    /// Forces `load` on the modes at the start from rest.
    pub(super) fn start(&self, x: &mut Modes, load: &Lanes) {
        x.iter_mut().zip(load).for_each(|(x, load)| x.p = *load);
    }

    /// One substep under the force of `x` at its start and, for now, only the inputs' force `load` at its end.
    #[inline(always)]
    pub(super) fn free<S: Simd>(&self, simd: S, x: &mut Modes, load: &Lanes) {
        for ((x, n), load) in x.iter_mut().zip(&self.numbers).zip(load) {
            let [q, dq] = n.unloaded(simd, x);
            let (q, dq) = (mul_add(simd, &n.b1[0], load, &q), mul_add(simd, &n.b1[1], load, &dq));
            *x = Moving { q, dq, p: *load };
        }
    }

    /// Adds a law force `f` on coordinate `j` to the end of the substep.
    #[inline(always)]
    pub(super) fn correct<S: Simd>(&self, simd: S, x: &mut Modes, j: usize, f: f64) {
        for (x, n) in x.iter_mut().zip(&self.shapes[j]) {
            let q = scaled_add(simd, -f, &n.b1_w[0], &x.q);
            let dq = scaled_add(simd, -f, &n.b1_w[1], &x.dq);
            *x = Moving { q, dq, p: scaled_add(simd, -f, &n.w, &x.p) };
        }
    }

    /// Adds a law force `f` on coordinate `j` at the start from rest, where nothing has moved yet.
    #[inline(always)]
    pub(super) fn load_only<S: Simd>(&self, simd: S, x: &mut Modes, j: usize, f: f64) {
        for (x, n) in x.iter_mut().zip(&self.shapes[j]) {
            x.p = scaled_add(simd, -f, &n.w, &x.p);
        }
    }

    /// Acceleration of coordinate i by a unit force on coordinate j on the structure at rest, 1/kg.
    pub(super) fn mobility_at_rest(&self, i: usize, j: usize) -> f64 {
        let (wi, wj) = (self.shapes[i].iter(), self.shapes[j].iter());
        let one = |((x, y), n): ((&Shape, &Shape), &Numbers)| {
            (0..LANES).map(|i| x.w[i] * n.gain[i] * y.w[i]).sum::<f64>()
        };
        wi.zip(wj).zip(&self.numbers).map(one).sum()
    }

    /// Displacement and velocity of coordinate `j`.
    #[inline(always)]
    pub(super) fn motion<S: Simd>(&self, simd: S, x: &Modes, j: usize) -> (f64, f64) {
        let (mut d, mut v) = ([0.0; LANES], [0.0; LANES]);
        for (x, n) in x.iter().zip(&self.shapes[j]) {
            d = mul_add(simd, &n.w, &x.q, &d);
            v = mul_add(simd, &n.w, &x.dq, &v);
        }
        (total(simd, &d), total(simd, &v))
    }

    /// Acceleration of coordinate `j`.
    #[inline(always)]
    pub(super) fn acceleration<S: Simd>(&self, simd: S, x: &Modes, j: usize) -> f64 {
        let mut sum = [0.0; LANES];
        for ((x, n), shape) in x.iter().zip(&self.numbers).zip(&self.shapes[j]) {
            sum = mul_add(simd, &shape.w, &n.acceleration(simd, x), &sum);
        }
        total(simd, &sum)
    }

    /// Effect of a unit law force at the end of the substep on (-d, -v, -a): coordinates i (moved) and j (force).
    pub(super) fn compliance(&self, i: usize, j: usize) -> [f64; 3] {
        let (mut unit, simd) = (self.rest(), Scalar::new());
        self.correct(simd, &mut unit, j, -1.0);
        let (d, v) = self.motion(simd, &unit, i);
        [d, v, self.acceleration(simd, &unit, i)]
    }

    /// What the modes lack in compliance at the Nyquist frequency of the substep between coordinates i and j, m/N.
    pub(super) fn lacking(&self, i: usize, j: usize) -> f64 {
        let flat = |j: usize| self.shapes[j].iter().flat_map(|s| s.w);
        self.alternating.iter().zip(flat(i).zip(flat(j))).map(|(g, (x, y))| -g * x * y).sum()
    }

    /// Number of outputs.
    pub(super) fn n_outputs(&self) -> usize {
        self.phi_out.len()
    }

    /// Gives the output of every row to `keep`; `own` is taken for what every mode gives out.
    #[inline(always)]
    pub(super) fn outputs<S: Simd>(
        &self,
        simd: S,
        x: &Modes,
        own: &mut Lanes,
        mut keep: impl FnMut(usize, f64),
    ) {
        for ((own, x), n) in own.iter_mut().zip(x).zip(&self.numbers) {
            *own = match self.quantity {
                Output::Displacement => x.q,
                Output::Velocity => x.dq,
                Output::Acceleration => n.acceleration(simd, x),
            };
        }
        for (row, phi) in self.phi_out.iter().enumerate() {
            let mut sum = [0.0; LANES];
            for (own, phi) in own.iter().zip(phi) {
                sum = mul_add(simd, phi, own, &sum);
            }
            keep(row, total(simd, &sum));
        }
    }
}

impl Numbers {
    /// Displacement and velocity after a substep with no force at its end.
    #[inline(always)]
    fn unloaded<S: Simd>(&self, simd: S, x: &Moving) -> [Lane; 2] {
        std::array::from_fn(|i| {
            let moved = mul_add(simd, &self.a[i][1], &x.dq, &mul(simd, &self.b0[i], &x.p));
            mul_add(simd, &self.a[i][0], &x.q, &moved)
        })
    }

    #[inline(always)]
    fn acceleration<S: Simd>(&self, simd: S, x: &Moving) -> Lane {
        let held = mul_add(simd, &self.stiffness, &x.q, &mul(simd, &self.damping, &x.dq));
        let driven = mul(simd, &self.gain, &x.p);
        scaled_add(simd, -1.0, &held, &driven)
    }
}
