//! The closed loop of linear laws at the coordinates of a hypothesis.

use super::IdentifyError;
use super::arrays::{Pair, Split, inverse, update, update2};
use super::hypothesis::{Hypothesis, Stiffness};
use super::prepared::Prepared;
use num_complex::Complex64;

/// The closed loop of linear laws: D = B (D_0 + T_d c), F = -kappa D, with kappa a diagonal matrix over the coordinates.
pub(crate) struct ClosedLoop {
    /// Group of every coordinate: those with the same laws are one.
    pub group: Vec<usize>,
    /// kappa, a column for each group.
    kappa: Split,
    /// Parts of kappa that act on velocity and on acceleration: kappa = elastic + s velocity + s^2 inertia.
    velocity: Split,
    inertia: Split,
    /// d kappa / d x_j, a column each, and the coordinates where it acts.
    pub slopes: Split,
    pub reach: Vec<Vec<usize>>,
    /// Of these the parts per velocity, or per acceleration where `inertial` says so.
    moving_slopes: Split,
    inertial: Vec<bool>,
    /// B = (I + C kappa)^-1, column i n_w + j for each of its entries.
    pub b: Split,
    /// Joint compliance C = W G W^T, likewise.
    pub c: Split,
    /// Whether a part of a group's kappa acts on velocity or acceleration.
    pub moving: Vec<bool>,
    n_w: usize,
}

fn columns(values: &[Vec<Complex64>]) -> Split {
    Split::new(values.first().map_or(0, Vec::len), values.len(), |k, j| values[j][k])
}

impl ClosedLoop {
    /// Closes the loop; `c` is the compliance of the coordinates in the basis.
    pub fn new(
        at: &Prepared<'_>,
        hypothesis: &Hypothesis,
        x: &[f64],
        mut c: Split,
    ) -> Result<Self, IdentifyError> {
        let (n, n_w) = (at.n_lines(), hypothesis.w.nrows());
        let laws = hypothesis.stiffness(x, &at.record.s)?;
        for (i, own) in hypothesis.compliance.iter().enumerate() {
            c.col_mut(i * n_w + i).0.iter_mut().for_each(|v| *v += own);
        }
        let moving =
            laws.velocity.iter().zip(&laws.inertia).map(|(velocity, inertia)| {
                velocity.iter().chain(inertia).any(|v| *v != Complex64::default())
            });
        let moving = moving.collect();
        let kappa = columns(&laws.kappa);
        let mut b = Split::zeros(n, n_w * n_w);
        if n_w == 1 {
            update2(b.col_mut(0), kappa.col(0), c.col(0), |_, kappa, c| inverse(1.0 + kappa * c));
        } else {
            invert_lines(&kappa, &laws.group, &c, &mut b);
        }
        let (velocity, inertia) = (columns(&laws.velocity), columns(&laws.inertia));
        let slopes = Split::new(n, laws.slopes.len(), |k, j| laws.slopes[j][k]);
        let moving_slopes = Split::new(n, laws.slopes.len(), |k, j| laws.moving_slopes[j][k]);
        let Stiffness { group, reach, inertial, .. } = laws;
        Ok(Self {
            group,
            kappa,
            velocity,
            inertia,
            slopes,
            moving_slopes,
            inertial,
            reach,
            b,
            c,
            moving,
            n_w,
        })
    }

    /// kappa of coordinate `i`.
    fn kappa(&self, i: usize) -> Pair<'_> {
        self.kappa.col(self.group[i])
    }

    /// The part s velocity + s^2 inertia of kappa of coordinate `i` on line `k`.
    pub fn moving_part(&self, i: usize, k: usize, s: Complex64) -> Complex64 {
        let g = self.group[i];
        s * self.velocity.get(g, k) + s * s * self.inertia.get(g, k)
    }

    /// Forces -kappa d of the laws.
    pub fn force(&self, d: &Split) -> Split {
        let mut force = d.clone();
        (0..self.n_w).for_each(|i| update(force.col_mut(i), self.kappa(i), |d, kappa| -kappa * d));
        force
    }

    /// y += A x on every line for `a` of n_w x n_w entries.
    fn add_product(&self, a: &Split, x: &Split, y: &mut Split) {
        for i in 0..self.n_w {
            for j in 0..self.n_w {
                update2(y.col_mut(i), a.col(i * self.n_w + j), x.col(j), |y, a, x| y + a * x);
            }
        }
    }

    /// B x.
    pub fn closed(&self, x: &Split) -> Split {
        let mut y = Split::zeros(x.n_lines(), self.n_w);
        self.add_product(&self.b, x, &mut y);
        y
    }

    /// d += sign C f.
    pub fn add_compliance(&self, sign: f64, f: &Split, d: &mut Split) {
        let mut cf = Split::zeros(f.n_lines(), self.n_w);
        self.add_product(&self.c, f, &mut cf);
        (0..self.n_w).for_each(|i| update(d.col_mut(i), cf.col(i), |d, v| d + sign * v));
    }

    /// What multiplies open-loop changes -d of the coordinates to give the law's answer: kappa B.
    pub fn answer(&self) -> Split {
        let mut a = self.b.clone();
        for (i, j) in (0..self.n_w).flat_map(|i| (0..self.n_w).map(move |j| (i, j))) {
            update(a.col_mut(i * self.n_w + j), self.kappa(i), |b, kappa| kappa * b);
        }
        a
    }

    /// What multiplies forces against the motion to give all that acts in their wake: kappa B C - I.
    pub fn answer_to_force(&self, answer: &Split) -> Split {
        let n_w = self.n_w;
        let mut a = Split::zeros(answer.n_lines(), n_w * n_w);
        for (i, j) in (0..n_w).flat_map(|i| (0..n_w).map(move |j| (i, j))) {
            let entry = i * n_w + j;
            for l in 0..n_w {
                let (left, right) = (answer.col(i * n_w + l), self.c.col(l * n_w + j));
                update2(a.col_mut(entry), left, right, |a, b, c| a + b * c);
            }
            if i == j {
                a.col_mut(entry).0.iter_mut().for_each(|v| *v -= 1.0);
            }
        }
        a
    }

    /// Force of the laws of group `g` beyond kappa times the displacement where its coordinates decay with displacement,
    /// velocity and acceleration `moved` (three columns): what is cut off at a record's end makes the transforms of
    /// velocity and acceleration more than s and s^2 times that of the displacement.
    pub fn cut_off(&self, at: &Prepared<'_>, g: usize, moved: &Split) -> Split {
        let mut force = Split::zeros(at.n_lines(), 1);
        for (part, factor, order) in [(&self.velocity, &at.s, 1), (&self.inertia, &at.s2, 2)] {
            let mut beyond = Split::zeros(at.n_lines(), 1);
            update2(beyond.col_mut(0), factor.col(0), moved.col(0), |_, s, d| s * d);
            update2(beyond.col_mut(0), part.col(g), moved.col(order), |sd, part, v| part * (v - sd));
            update(force.col_mut(0), beyond.col(0), |f, v| f + v);
        }
        force
    }
}

impl ClosedLoop {
    /// How the force of [`ClosedLoop::cut_off`] at a coordinate changes with law unknown `j`.
    pub fn cut_off_slope(&self, at: &Prepared<'_>, j: usize, moved: &Split) -> Split {
        let (factor, order) = if self.inertial[j] { (&at.s2, 2) } else { (&at.s, 1) };
        let mut force = Split::zeros(at.n_lines(), 1);
        update2(force.col_mut(0), factor.col(0), moved.col(0), |_, s, d| s * d);
        update2(force.col_mut(0), self.moving_slopes.col(j), moved.col(order), |sd, part, v| part * (v - sd));
        force
    }
}

/// (I + C kappa)^-1 line by line.
fn invert_lines(kappa: &Split, group: &[usize], c: &Split, b: &mut Split) {
    let n_w = group.len();
    let mut a = vec![Complex64::default(); n_w * n_w];
    let mut out = a.clone();
    for k in 0..c.n_lines() {
        a.iter_mut().enumerate().for_each(|(e, a)| *a = c.get(e, k) * kappa.get(group[e % n_w], k));
        (0..n_w).for_each(|i| a[i * n_w + i] += 1.0);
        invert(&mut a, n_w, &mut out);
        out.iter().enumerate().for_each(|(e, v)| b.set(e, k, *v));
    }
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
