//! The laws' forces at the end of a substep: f = law(free motion - compliance f).

use super::MAX_COORDINATES;
use crate::laws::{Joint, Motion, State};

/// Effect of unit forces on (-d, -v, -a), coordinates moved by coordinates loaded.
pub(super) type Compliance = [[[f64; 3]; MAX_COORDINATES]; MAX_COORDINATES];
pub(super) type Forces = [f64; MAX_COORDINATES];
pub(super) type Motions = [Motion<f64>; MAX_COORDINATES];
type Square = [[f64; MAX_COORDINATES]; MAX_COORDINATES];

const MAX_ITERATIONS: usize = 80;
/// Newton steps without a bracket before one is sought.
const PATIENCE: usize = 8;
/// Steps from which the law's own value is taken for the other end of a bracket, whatever the slope.
const RESORT: usize = 40;
/// Relative change of the force that counts as converged.
const TOLERANCE: f64 = 1e-11;

/// A solved substep; of forces, motions and slopes as many as there are coordinates.
#[derive(Default)]
pub(super) struct Solved {
    pub(super) f: Forces,
    pub(super) x: Motions,
    /// Slope of each law over its displacement.
    pub(super) stiffness: Forces,
    pub(super) n_iterations: usize,
    pub(super) converged: bool,
}

/// Motion under the forces `f`.
fn moved(free: &Motions, c: &Compliance, f: &Forces, n: usize) -> Motions {
    let mut x = *free;
    for i in 0..n {
        for j in 0..n {
            x[i].d -= c[i][j][0] * f[j];
            x[i].v -= c[i][j][1] * f[j];
            x[i].a -= c[i][j][2] * f[j];
        }
    }
    x
}

/// Rounding of a law's force through the rounding of its motion.
fn rounding(slope: &[f64; 3], free: &Motion<f64>) -> f64 {
    4.0 * f64::EPSILON * ((slope[0] * free.d).abs() + (slope[1] * free.v).abs() + (slope[2] * free.a).abs())
}

/// Solves for the forces from the guess in `out`; `scale` is the largest force so far, `new` receives the laws' states.
#[inline(always)]
pub(super) fn solve(
    joints: &[Joint],
    free: &Motions,
    c: &Compliance,
    scale: f64,
    states: &[Vec<State<f64>>],
    new: &mut [Vec<State<f64>>],
    out: &mut Solved,
) {
    if joints.len() == 1 {
        solve_one(&joints[0], &free[0], &c[0][0], scale, &states[0], &mut new[0], out);
    } else {
        *out = solve_several(joints, free, c, out.f, scale, states, new);
    }
}

/// One coordinate: Newton, held inside a bracket as soon as one is known.
#[inline(always)]
fn solve_one(
    joint: &Joint,
    free: &Motion<f64>,
    [cd, cv, ca]: &[f64; 3],
    scale: f64,
    state: &[State<f64>],
    new: &mut [State<f64>],
    out: &mut Solved,
) {
    let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
    let mut f = out.f[0];
    let linear = joint.is_linear();
    out.converged = false;
    for iteration in 1..=MAX_ITERATIONS {
        let x = Motion { d: free.d - cd * f, v: free.v - cv * f, a: free.a - ca * f };
        let (force, slope) = joint.tangent(x, state, new);
        let residual = f - force;
        let derivative = 1.0 + slope[0] * cd + slope[1] * cv + slope[2] * ca;
        (out.n_iterations, out.f[0], out.x[0], out.stiffness[0]) = (iteration, f, x, slope[0]);
        if !residual.is_finite() {
            return;
        }
        let allowed =
            TOLERANCE * (f.abs() + 1e-3 * scale) + rounding(&slope, free) / derivative.abs().max(1e-3);
        if (residual / derivative).abs() <= allowed || residual == 0.0 {
            out.converged = true;
            return;
        }
        if residual > 0.0 {
            high = high.min(f)
        } else {
            low = low.max(f)
        }
        if high - low <= allowed {
            // a jump of the force inside rounding
            out.converged = true;
            return;
        }
        f -= residual / derivative;
        if linear && iteration < 3 {
            continue;
        }
        let bracketed = low.is_finite() && high.is_finite();
        if bracketed && !(f > low && f < high) {
            f = 0.5 * (low + high);
        } else if !bracketed && (iteration >= PATIENCE || !f.is_finite()) {
            // Newton comes to the root of a convex law from one side, and from afar by half the way a step: twice the
            // step goes beyond. Where the force falls with f, the law's own value lies on the other side of the root;
            // elsewhere it may lie so far there that no bracket is closed in time.
            let beyond = f - residual / derivative;
            f = if derivative > 0.0 && iteration < RESORT && beyond.is_finite() { beyond } else { force };
        }
    }
}

/// Forces tried at several coordinates: the motions under them and `f - law(motion)`.
struct Trial {
    f: Forces,
    x: Motions,
    residual: Forces,
}

impl Trial {
    /// Sum of the squares of the residual.
    fn size(&self, n: usize) -> f64 {
        self.residual[..n].iter().map(|x| x * x).sum()
    }
}

/// Several coordinates: Newton with a step that is halved until the residual falls.
fn solve_several(
    joints: &[Joint],
    free: &Motions,
    c: &Compliance,
    guess: Forces,
    scale: f64,
    states: &[Vec<State<f64>>],
    new: &mut [Vec<State<f64>>],
) -> Solved {
    let n = joints.len();
    let mut slopes = [[0.0; 3]; MAX_COORDINATES];
    let mut evaluate = |f: Forces, slopes: &mut [[f64; 3]; MAX_COORDINATES]| -> Trial {
        let x = moved(free, c, &f, n);
        let mut residual = [0.0; MAX_COORDINATES];
        for i in 0..n {
            let (force, slope) = joints[i].tangent(x[i], &states[i], &mut new[i]);
            residual[i] = f[i] - force;
            slopes[i] = slope;
        }
        Trial { f, x, residual }
    };
    let mut now = evaluate(guess, &mut slopes);
    let mut out =
        Solved { f: guess, x: now.x, stiffness: [0.0; MAX_COORDINATES], n_iterations: 0, converged: false };
    for iteration in 1..=MAX_ITERATIONS {
        (out.f, out.x, out.n_iterations) = (now.f, now.x, iteration);
        for i in 0..n {
            out.stiffness[i] = slopes[i][0];
        }
        let Some(step) = tangent_solve(&tangent_matrix(c, &slopes, n), &now.residual, n) else { return out };
        let largest = (0..n).map(|i| now.f[i].abs()).fold(0.0, f64::max);
        let allowed = |i: usize| TOLERANCE * (largest + 1e-3 * scale) + rounding(&slopes[i], &free[i]);
        if (0..n).all(|i| step[i].abs() <= allowed(i)) {
            out.converged = true;
            return out;
        }
        let before = now.size(n);
        if !before.is_finite() {
            return out;
        }
        let mut share = 1.0;
        now = loop {
            let shortened = std::array::from_fn(|i| now.f[i] - share * step[i]);
            let trial = evaluate(shortened, &mut slopes);
            // a kink may need a rising step: after eight halvings the smallest one is taken
            if trial.size(n) < before || share < 5e-3 {
                break trial;
            }
            share *= 0.5;
        };
    }
    out
}

/// Derivative of f - law(free - C f) with respect to f.
#[inline(always)]
pub(super) fn tangent_matrix(c: &Compliance, slopes: &[[f64; 3]; MAX_COORDINATES], n: usize) -> Square {
    let mut m = [[0.0; MAX_COORDINATES]; MAX_COORDINATES];
    for i in 0..n {
        for j in 0..n {
            let slope: f64 = (0..3).map(|q| slopes[i][q] * c[i][j][q]).sum();
            m[i][j] = slope + f64::from(u8::from(i == j));
        }
    }
    m
}

/// Gauss elimination with row pivoting; `None` where the matrix is singular or not finite.
pub(super) fn tangent_solve(m: &Square, rhs: &Forces, n: usize) -> Option<Forces> {
    let (mut m, mut x) = (*m, *rhs);
    for k in 0..n {
        let pivot = (k..n).max_by(|a, b| m[*a][k].abs().total_cmp(&m[*b][k].abs()))?;
        if m[pivot][k] == 0.0 || !m[pivot][k].is_finite() {
            return None;
        }
        m.swap(k, pivot);
        x.swap(k, pivot);
        for i in k + 1..n {
            let factor = m[i][k] / m[k][k];
            for j in k..n {
                m[i][j] -= factor * m[k][j];
            }
            x[i] -= factor * x[k];
        }
    }
    for k in (0..n).rev() {
        for j in k + 1..n {
            x[k] -= m[k][j] * x[j];
        }
        x[k] /= m[k][k];
    }
    Some(x)
}
