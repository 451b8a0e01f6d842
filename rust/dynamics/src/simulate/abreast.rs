//! Derivatives side by side in lanes, one a lane: what a substep does to each is the same arithmetic on other numbers, and
//! each waits for its own last substep alone.
//!
//! A moved model goes its own way under the inputs, beside the model as it is; a law's parameter has no inputs, and no
//! model beside which it goes. Both are the same where their numbers are zero.

use super::beside::{Frame, Model, Moved, Square};
use super::lane::{LANES, Lane, mul, mul_add, scaled_add};
use super::modal::{MODE, Stepper};
use super::newton::{Compliance, tangent_solve};
use super::{MAX_COORDINATES, Output};
use crate::laws::{Joint, MAX_STATE};
use pulp::Simd;

const NOTHING: Lane = [0.0; LANES];

/// Motion (d, v, a) of up to N coordinates; N of them but for the largest N.
type Change<const N: usize> = [[Lane; 3]; N];

/// What is differentiated in a lane.
pub(super) enum Over<'a> {
    /// A parameter of a joint's laws: the coordinate, the index there, and the derivative of the added compliance's share.
    Parameter((usize, usize), f64),
    /// A model beside the one as it is.
    Model(&'a Moved),
}

/// A mode of each lane; no lane lies across two lines of the cache.
#[repr(C, align(64))]
struct Mode {
    /// As [`Stepper::mode`] has them.
    numbers: [Lane; MODE],
    q: Lane,
    dq: Lane,
    p: Lane,
}

/// Where coordinates are pulled by forces of one: in a substep, and at the start from rest.
type Pulled = [Vec<[Lane; 3]>; 2];

/// What it is of a lane: of a substep or (1) from rest, of which coordinates, on displacement, velocity or acceleration.
type OfPair<'f> = &'f dyn Fn(&Over, usize, (usize, usize), usize) -> f64;

/// Some derivatives.
pub(super) struct Abreast {
    /// Number of lanes in use.
    pub(super) n: usize,
    modes: Vec<Mode>,
    /// Shapes of the modes (coordinates, inputs, outputs), mode after mode.
    w: Vec<Lane>,
    phi_in: Vec<Lane>,
    phi_out: Vec<Lane>,
    /// Compliance (n_w, n_w), and what the forces of the model as it is do beside it.
    compliance: Pulled,
    beside: Pulled,
    /// One where a lane is a model.
    whole: Lane,
    /// The parameter of every lane that is one: coordinate and index there.
    owner: [Option<(usize, usize)>; LANES],
    states: Vec<Vec<[Lane; MAX_STATE]>>,
    /// Forces at the coordinates.
    pub(super) f: Vec<Lane>,
    /// Outputs, once they were given out.
    pub(super) y: Vec<Lane>,
}

/// Number of coordinates: known to the compiler for the few that joints have.
#[inline(always)]
fn count<const N: usize>(model: &Model) -> usize {
    if N < MAX_COORDINATES { N } else { model.joints.len() }
}

/// Lanes of what `value` gives for each of `all`; those beyond have what the last one has.
fn lanes(all: &[Over], value: impl Fn(&Over) -> f64) -> Lane {
    std::array::from_fn(|l| value(&all[l.min(all.len() - 1)]))
}

impl Abreast {
    /// Up to `LANES` derivatives of the model `stepper`, whose coordinates are coupled by `compliance` (in a substep, and
    /// from rest) and lack the compliance `lacking`.
    pub(super) fn new(
        stepper: &Stepper,
        joints: &[Joint],
        compliance: [&Compliance; 2],
        lacking: &Square,
        all: &[Over],
    ) -> Self {
        let n_w = joints.len();
        let own = |over: &Over, value: &dyn Fn(&Stepper) -> f64| match over {
            Over::Parameter(..) => value(stepper),
            Over::Model(moved) => value(&moved.stepper),
        };
        let of_modes = |n: usize, value: &dyn Fn(&Over, usize, usize) -> f64| {
            let each = (0..stepper.n_modes()).flat_map(|m| (0..n).map(move |row| (row, m)));
            each.map(|(row, m)| lanes(all, |over| value(over, row, m))).collect::<Vec<_>>()
        };
        let mode = |m: usize| Mode {
            numbers: std::array::from_fn(|i| lanes(all, |over| own(over, &|s| s.mode(m)[i]))),
            q: NOTHING,
            dq: NOTHING,
            p: NOTHING,
        };
        let pairs = || (0..n_w * n_w).map(|e| (e / n_w, e % n_w));
        let at = |moved: &Moved, rest: usize, (i, j): (usize, usize), q: usize| {
            [&moved.compliance, &moved.compliance_at_rest][rest][i][j][q]
        };
        let pulled = |value: OfPair| {
            [0, 1].map(|rest| {
                let three = |ij| std::array::from_fn(|q| lanes(all, |over| value(over, rest, ij, q)));
                pairs().map(three).collect::<Vec<[Lane; 3]>>()
            })
        };
        let owner = |over: &Over| if let Over::Parameter(owner, _) = over { Some(*owner) } else { None };
        let rest = |joint: &Joint| vec![[NOTHING; MAX_STATE]; joint.laws().len()];
        Self {
            n: all.len(),
            modes: (0..stepper.n_modes()).map(mode).collect(),
            w: of_modes(n_w, &|over, row, m| own(over, &|s| s.shape(row, m))),
            phi_in: of_modes(stepper.n_inputs(), &|over, row, m| match over {
                Over::Parameter(..) => 0.0,
                Over::Model(moved) => moved.stepper.input(row, m),
            }),
            phi_out: of_modes(stepper.n_outputs(), &|over, row, m| own(over, &|s| s.output(row, m))),
            compliance: pulled(&|over, rest, ij, q| match over {
                Over::Parameter(..) => compliance[rest][ij.0][ij.1][q],
                Over::Model(moved) => at(moved, rest, ij, q),
            }),
            beside: pulled(&|over, rest, ij, q| match over {
                Over::Parameter(_, share) if q == 0 => share * lacking[ij.0][ij.1],
                Over::Parameter(..) => 0.0,
                Over::Model(moved) => at(moved, rest, ij, q),
            }),
            whole: lanes(all, |over| f64::from(u8::from(matches!(over, Over::Model(_))))),
            owner: std::array::from_fn(|l| all.get(l).and_then(owner)),
            states: joints.iter().map(rest).collect(),
            f: vec![NOTHING; n_w],
            y: vec![NOTHING; stepper.n_outputs()],
        }
    }

    /// Takes the derivatives through a substep.
    #[inline(always)]
    pub(super) fn advance<S: Simd, const N: usize>(&mut self, simd: S, model: &Model, frame: &Frame) {
        let free = self.free::<S, N>(simd, model, frame);
        let df = self.closed::<S, N>(simd, model, frame, &free);
        let n = count::<N>(model);
        for i in 0..n {
            self.f[i] = scaled_add(simd, frame.f[i], &self.whole, &df[i]);
        }
        for (mode, w) in self.modes.iter_mut().zip(self.w.chunks_exact(n)) {
            let mut p = NOTHING;
            for i in 0..n {
                p = mul_add(simd, &w[i], &self.f[i], &p);
            }
            mode.p = scaled_add(simd, -1.0, &p, &mode.p);
            if !frame.first {
                let minus = scaled_add(simd, -1.0, &p, &NOTHING);
                mode.q = mul_add(simd, &mode.numbers[6], &minus, &mode.q);
                mode.dq = mul_add(simd, &mode.numbers[7], &minus, &mode.dq);
            }
        }
    }

    /// How far the motion (d, v, a) under the laws' forces is from that of the model as it is, of a parameter its derivative
    /// before that of the end force is known; moves the modes there.
    #[inline(always)]
    fn free<S: Simd, const N: usize>(&mut self, simd: S, model: &Model, frame: &Frame) -> Change<N> {
        let (n, n_in) = (count::<N>(model), frame.u.len());
        let mut free = [[NOTHING; 3]; N];
        for m in 0..self.modes.len() {
            let mode = &mut self.modes[m];
            let [a00, a01, a10, a11, b0q, b0v, b1q, b1v, ..] = &mode.numbers;
            let mut load = NOTHING;
            for (u, phi) in frame.u.iter().zip(&self.phi_in[m * n_in..]) {
                load = scaled_add(simd, *u, phi, &load);
            }
            let (mut q, mut dq) = (mode.q, mode.dq);
            if !frame.first {
                let from = mul_add(simd, a01, &mode.dq, &mul(simd, b0q, &mode.p));
                q = mul_add(simd, b1q, &load, &mul_add(simd, a00, &mode.q, &from));
                let from = mul_add(simd, a11, &mode.dq, &mul(simd, b0v, &mode.p));
                dq = mul_add(simd, b1v, &load, &mul_add(simd, a10, &mode.q, &from));
            }
            (mode.q, mode.dq, mode.p) = (q, dq, load);
            let w = &self.w[m * n..];
            for i in 0..n {
                free[i][0] = mul_add(simd, &w[i], &q, &free[i][0]);
                free[i][1] = mul_add(simd, &w[i], &dq, &free[i][1]);
                if model.inertial {
                    free[i][2] = mul_add(simd, &w[i], &mode.acceleration(simd), &free[i][2]);
                }
            }
        }
        let beside = &self.beside[usize::from(frame.first)];
        for i in 0..n {
            let x = &frame.x[i];
            // where no law depends on the acceleration, it makes no difference
            let there = [x.d, x.v, if model.inertial { x.a } else { 0.0 }];
            for q in 0..3 {
                free[i][q] = scaled_add(simd, -there[q], &self.whole, &free[i][q]);
            }
            for j in 0..n {
                free[i][1] = scaled_add(simd, model.memory[i][j], &self.f[j], &free[i][1]);
                for q in 0..3 {
                    free[i][q] = scaled_add(simd, -frame.f[j], &beside[i * n + j][q], &free[i][q]);
                }
            }
        }
        free
    }

    /// Changes of the forces that belong to changes `free` of the motion without them, with the states taken along.
    #[inline(always)]
    fn closed<S: Simd, const N: usize>(
        &mut self,
        simd: S,
        model: &Model,
        frame: &Frame,
        free: &Change<N>,
    ) -> [Lane; N] {
        let (n, joints, at) = (count::<N>(model), model.joints, &frame.at);
        let compliance = &self.compliance[usize::from(frame.first)];
        let mut df = [NOTHING; N];
        for i in 0..n {
            df[i] = joints[i].from_states(&at[i], &self.states[i]);
            for q in 0..3 {
                df[i] = scaled_add(simd, frame.slopes[i][q], &free[i][q], &df[i]);
            }
        }
        for (l, owner) in self.owner.iter().enumerate() {
            if let Some((i, parameter)) = owner {
                df[*i][l] += at[*i].df_dp[*parameter];
            }
        }
        if N == 1 {
            let mut slope = [1.0; LANES];
            for q in 0..3 {
                slope = scaled_add(simd, frame.slopes[0][q], &compliance[0][q], &slope);
            }
            for l in 0..LANES {
                df[0][l] /= slope[l];
            }
        } else {
            solve_lanes(&mut df[..n], compliance, &frame.slopes, self.n);
        }
        for i in 0..n {
            let mut dx = free[i];
            for j in 0..n {
                for q in 0..3 {
                    let minus = scaled_add(simd, -1.0, &df[j], &NOTHING);
                    dx[q] = mul_add(simd, &compliance[i * n + j][q], &minus, &dx[q]);
                }
            }
            joints[i].advance_states(&at[i], &dx, (i, &self.owner), &mut self.states[i]);
        }
        df
    }

    /// Works out all outputs.
    #[inline(always)]
    pub(super) fn give_out<S: Simd>(&mut self, simd: S, quantity: Output) {
        let n = self.y.len();
        self.y.fill(NOTHING);
        for (mode, phi) in self.modes.iter().zip(self.phi_out.chunks_exact(n.max(1))) {
            let own = match quantity {
                Output::Displacement => mode.q,
                Output::Velocity => mode.dq,
                Output::Acceleration => mode.acceleration(simd),
            };
            for row in 0..n {
                self.y[row] = mul_add(simd, &phi[row], &own, &self.y[row]);
            }
        }
    }
}

impl Mode {
    #[inline(always)]
    fn acceleration<S: Simd>(&self, simd: S) -> Lane {
        let [.., gain, stiffness, damping] = &self.numbers;
        let held = mul_add(simd, stiffness, &self.q, &mul(simd, damping, &self.dq));
        scaled_add(simd, -1.0, &held, &mul(simd, gain, &self.p))
    }
}

/// Solves (I + slopes C) df = rhs for the first `lanes` of the right-hand sides `df`.
fn solve_lanes(
    df: &mut [Lane],
    compliance: &[[Lane; 3]],
    slopes: &[[f64; 3]; MAX_COORDINATES],
    lanes: usize,
) {
    let n = df.len();
    for l in 0..lanes {
        let (mut matrix, mut rhs) = (Square::default(), [0.0; MAX_COORDINATES]);
        for i in 0..n {
            for j in 0..n {
                let slope: f64 = (0..3).map(|q| slopes[i][q] * compliance[i * n + j][q][l]).sum();
                matrix[i][j] = slope + f64::from(u8::from(i == j));
            }
            rhs[i] = df[i][l];
        }
        // the same matrix let the step itself converge; a kink exactly here leaves the derivative undefined
        let solved = tangent_solve(&matrix, &rhs, n).unwrap_or([f64::NAN; MAX_COORDINATES]);
        (0..n).for_each(|i| df[i][l] = solved[i]);
    }
}
