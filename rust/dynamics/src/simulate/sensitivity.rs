//! Derivatives of a simulation by differentiating each substep: over the laws' parameters, and over the model.
//!
//! Over a law's parameter everything that moves has a derivative. Over the model there are two of it, the model as it is
//! and one moved a little: the moved one goes its own way under the same inputs, with the laws taken as linear around the
//! motion of the first. Neither needs the laws' force to be found again.

use super::modal::{Lanes, Modes, Stepper};
use super::newton::{Compliance, Forces, Motions, tangent_matrix, tangent_solve};
use super::{MAX_COORDINATES, Response};
use crate::laws::{Joint, Linearised, Motion, State};
use pulp::Simd;

type Square = [[f64; MAX_COORDINATES]; MAX_COORDINATES];

/// Motion (d, v, a) of up to N coordinates; N of them but for the largest N.
type Change<const N: usize> = [[f64; 3]; N];

/// Number of coordinates: known to the compiler for the few that joints have.
#[inline(always)]
fn count<const N: usize>(step: &Substep) -> usize {
    if N < MAX_COORDINATES { N } else { step.model.joints.len() }
}

/// The derivative of everything that moves with respect to one parameter.
struct Column {
    /// Coordinate whose law owns the parameter, and the index among that joint's parameters.
    owner: (usize, usize),
    modes: Modes,
    states: Vec<Vec<State<f64>>>,
    f: Forces,
    /// Derivative of the added compliance's share.
    share: f64,
}

/// A model moved a little, with what couples its coordinates.
pub(super) struct Moved {
    pub(super) stepper: Stepper,
    pub(super) compliance: Compliance,
    /// The same at the start from rest.
    pub(super) compliance_at_rest: Compliance,
}

/// Where a moved model is; of its laws' states how far from those of the model as it is.
struct Beside {
    modes: Modes,
    load: Lanes,
    states: Vec<Vec<State<f64>>>,
    f: Forces,
}

/// Substeps that every derivative takes at once: what it needs of its own stays in the nearest cache meanwhile.
const BLOCK: usize = 32;

/// Derivatives that go through a substep one after the other: each waits for its own last substep alone, so that the
/// machine works on several at a time.
const SIDE_BY_SIDE: usize = 4;

/// What the model as it is did in a substep.
#[derive(Default)]
struct Frame {
    x: Motions,
    f: Forces,
    slopes: [[f64; 3]; MAX_COORDINATES],
    at: Vec<Linearised>,
    /// Inputs at the end of the substep.
    u: Vec<f64>,
    /// Whether this is the start from rest.
    first: bool,
    /// Kept sample at its end.
    kept: Option<usize>,
}

/// Derivatives with respect to parameters, and moved models.
pub(super) struct Columns {
    columns: Vec<Column>,
    beside: Vec<Beside>,
    frames: Vec<Frame>,
    /// Frames that no derivative has been through.
    waiting: usize,
    /// What every mode gives out.
    own: Lanes,
}

/// What belongs to all substeps.
pub(super) struct Model<'a> {
    pub(super) stepper: &'a Stepper,
    pub(super) joints: &'a [Joint],
    pub(super) compliance: &'a Compliance,
    /// The same at the start from rest.
    pub(super) compliance_at_rest: &'a Compliance,
    /// Velocity compliance that acts on the force at the start of the substep.
    pub(super) memory: &'a Square,
    /// The stabilising compliance at its full share.
    pub(super) lacking: &'a Square,
    pub(super) moved: &'a [Moved],
    /// Whether some law depends on the acceleration.
    pub(super) inertial: bool,
}

/// A substep of the model.
struct Substep<'a> {
    model: &'a Model<'a>,
    frame: &'a Frame,
    compliance: &'a Compliance,
}

impl Columns {
    /// `share[k]` is the derivative of the added compliance's share with respect to parameter k, `wanted[k]` whether that
    /// over parameter k is.
    pub(super) fn new(
        stepper: &Stepper,
        joints: &[Joint],
        share: &[f64],
        wanted: &[bool],
        moved: &[Moved],
    ) -> Self {
        let rest = || joints.iter().map(Joint::rest).collect::<Vec<_>>();
        let owners =
            joints.iter().enumerate().flat_map(|(i, joint)| (0..joint.n_parameters()).map(move |j| (i, j)));
        let columns = owners
            .zip(share)
            .zip(wanted)
            .filter(|(_, wanted)| **wanted)
            .map(|((owner, share), _)| Column {
                owner,
                modes: stepper.rest(),
                states: rest(),
                f: [0.0; MAX_COORDINATES],
                share: *share,
            })
            .collect();
        let beside = moved
            .iter()
            .map(|moved| Beside {
                modes: moved.stepper.rest(),
                load: moved.stepper.unloaded(),
                states: rest(),
                f: [0.0; MAX_COORDINATES],
            })
            .collect();
        let frame = || Frame { at: vec![Linearised::default(); joints.len()], ..Frame::default() };
        Self {
            columns,
            beside,
            frames: (0..BLOCK).map(|_| frame()).collect(),
            waiting: 0,
            own: stepper.unloaded(),
        }
    }

    /// Takes down a substep under inputs `u` that led to the motions `x` and forces `f` from `states`.
    #[inline(always)]
    pub(super) fn step<S: Simd>(
        &mut self,
        simd: S,
        model: &Model,
        (x, f, u): (&Motions, &Forces, &[f64]),
        states: &[Vec<State<f64>>],
        first: bool,
        out: &mut Response,
    ) {
        if self.waiting == BLOCK {
            self.follow(simd, model, out);
        }
        let frame = &mut self.frames[self.waiting];
        let n = model.joints.len();
        frame.x[..n].copy_from_slice(&x[..n]);
        frame.f[..n].copy_from_slice(&f[..n]);
        (frame.first, frame.kept) = (first, None);
        frame.u.clear();
        frame.u.extend_from_slice(u);
        for (i, joint) in model.joints.iter().enumerate() {
            joint.linearise(x[i], &states[i], &mut frame.at[i]);
            frame.slopes[i] = frame.at[i].df;
        }
        self.waiting += 1;
    }

    /// The end of the last substep is kept as sample `k`.
    #[inline(always)]
    pub(super) fn keep(&mut self, k: usize) {
        if let Some(frame) = self.waiting.checked_sub(1).and_then(|last| self.frames.get_mut(last)) {
            frame.kept = Some(k);
        }
    }

    /// Takes all derivatives through the substeps taken down, and writes those of what is kept.
    #[inline(always)]
    pub(super) fn follow<S: Simd>(&mut self, simd: S, model: &Model, out: &mut Response) {
        match model.joints.len() {
            1 => self.follow_all::<S, 1>(simd, model, out),
            2 => self.follow_all::<S, 2>(simd, model, out),
            3 => self.follow_all::<S, 3>(simd, model, out),
            _ => self.follow_all::<S, MAX_COORDINATES>(simd, model, out),
        }
    }

    #[inline(always)]
    fn follow_all<S: Simd, const N: usize>(&mut self, simd: S, model: &Model, out: &mut Response) {
        let frames = &self.frames[..self.waiting];
        let substep = |frame| Substep {
            model,
            frame,
            compliance: if frame.first { model.compliance_at_rest } else { model.compliance },
        };
        let (n, n_out, n_w) = (out.n, model.stepper.n_outputs(), model.joints.len());
        for (some, columns) in self.columns.chunks_mut(SIDE_BY_SIDE).enumerate() {
            for frame in frames {
                let step = substep(frame);
                // a closure would be compiled for the narrowest registers
                for column in columns.iter_mut() {
                    column.advance::<S, N>(simd, &step);
                }
                let Some(k) = frame.kept else { continue };
                for (i, column) in columns.iter().enumerate() {
                    let j = some * SIDE_BY_SIDE + i;
                    let keep = |row, y| out.dy[(j * n_out + row) * n + k] = y;
                    model.stepper.outputs(simd, &column.modes, &mut self.own, keep);
                    (0..n_w).for_each(|i| out.df[(j * n_w + i) * n + k] = column.f[i]);
                }
            }
        }
        let moved = model.moved.chunks(SIDE_BY_SIDE);
        for (some, (beside, moved)) in self.beside.chunks_mut(SIDE_BY_SIDE).zip(moved).enumerate() {
            for frame in frames {
                for (beside, moved) in beside.iter_mut().zip(moved) {
                    let compliance = if frame.first { &moved.compliance_at_rest } else { &moved.compliance };
                    beside.advance::<S, N>(simd, &Substep { model, frame, compliance }, &moved.stepper);
                }
                let Some(k) = frame.kept else { continue };
                for (i, (beside, moved)) in beside.iter().zip(moved).enumerate() {
                    let j = some * SIDE_BY_SIDE + i;
                    let keep = |row, y| out.moved_y[(j * n_out + row) * n + k] = y;
                    moved.stepper.outputs(simd, &beside.modes, &mut self.own, keep);
                    (0..n_w).for_each(|i| out.moved_f[(j * n_w + i) * n + k] = beside.f[i]);
                }
            }
        }
        self.waiting = 0;
    }
}

/// Changes of the forces that belong to changes `free` of the motion without them, with the states taken along; `own` is
/// the parameter that changes by one: its coordinate and its index there.
#[inline(always)]
fn closed<const N: usize>(
    step: &Substep,
    free: &Change<N>,
    states: &mut [Vec<State<f64>>],
    own: Option<(usize, usize)>,
) -> [f64; N] {
    let (n, joints, at) = (count::<N>(step), step.model.joints, &step.frame.at);
    let mut rhs = [0.0; N];
    for i in 0..n {
        let df = &at[i].df;
        let moved = df[0] * free[i][0] + df[1] * free[i][1] + df[2] * free[i][2];
        rhs[i] = moved + joints[i].from_states(&at[i], &states[i]);
    }
    if let Some((i, parameter)) = own {
        rhs[i] += at[i].df_dp[parameter];
    }
    let matrix = tangent_matrix(step.compliance, &step.frame.slopes, n);
    let mut df = rhs;
    if N == 1 {
        df[0] /= matrix[0][0];
    } else {
        let mut all = [0.0; MAX_COORDINATES];
        all[..n].copy_from_slice(&rhs[..n]);
        // the same matrix let the step itself converge; a kink exactly here leaves the derivative undefined
        let solved = tangent_solve(&matrix, &all, n).unwrap_or([f64::NAN; MAX_COORDINATES]);
        df[..n].copy_from_slice(&solved[..n]);
    }
    for i in 0..n {
        let mut dx = free[i];
        for j in 0..n {
            for q in 0..3 {
                dx[q] -= step.compliance[i][j][q] * df[j];
            }
        }
        let parameter = own.filter(|(owner, _)| *owner == i).map(|(_, parameter)| parameter);
        joints[i].advance_state(&at[i], dx, parameter, &mut states[i]);
    }
    df
}

impl Column {
    /// Takes the derivative through a substep.
    #[inline(always)]
    fn advance<S: Simd, const N: usize>(&mut self, simd: S, step: &Substep) {
        let (free, stepper) = (self.free::<S, N>(simd, step), step.model.stepper);
        let df = closed(step, &free, &mut self.states, Some(self.owner));
        for i in 0..count::<N>(step) {
            if step.frame.first {
                stepper.load_only(simd, &mut self.modes, i, df[i]);
            } else {
                stepper.correct(simd, &mut self.modes, i, df[i]);
            }
            self.f[i] = df[i];
        }
    }

    /// Derivative of the motion (d, v, a) before the end force's own derivative is known; moves the modes there.
    #[inline(always)]
    fn free<S: Simd, const N: usize>(&mut self, simd: S, step: &Substep) -> Change<N> {
        let (n, model, stepper) = (count::<N>(step), step.model, step.model.stepper);
        if !step.frame.first {
            stepper.free_unloaded(simd, &mut self.modes);
        }
        let mut free = [[0.0; 3]; N];
        for i in 0..n {
            let (d, v) = stepper.motion(simd, &self.modes, i);
            let a = if model.inertial { stepper.acceleration(simd, &self.modes, i) } else { 0.0 };
            free[i] = [d, v, a];
            for j in 0..n {
                free[i][0] -= self.share * model.lacking[i][j] * step.frame.f[j];
                free[i][1] += model.memory[i][j] * self.f[j];
            }
        }
        free
    }
}

impl Beside {
    /// Takes the model of `stepper` through a substep.
    #[inline(always)]
    fn advance<S: Simd, const N: usize>(&mut self, simd: S, step: &Substep, stepper: &Stepper) {
        let free = self.free::<S, N>(simd, step, stepper);
        let df = closed(step, &free, &mut self.states, None);
        for i in 0..count::<N>(step) {
            self.f[i] = step.frame.f[i] + df[i];
            if step.frame.first {
                stepper.load_only(simd, &mut self.modes, i, self.f[i]);
            } else {
                stepper.correct(simd, &mut self.modes, i, self.f[i]);
            }
        }
    }

    /// How far the motion (d, v, a) under the laws' forces is from that of the model as it is; moves the modes there.
    #[inline(always)]
    fn free<S: Simd, const N: usize>(&mut self, simd: S, step: &Substep, stepper: &Stepper) -> Change<N> {
        let (n, model, frame) = (count::<N>(step), step.model, step.frame);
        stepper.load(simd, &frame.u, &mut self.load);
        if frame.first {
            stepper.start(&mut self.modes, &self.load);
        } else {
            stepper.free(simd, &mut self.modes, &self.load);
        }
        let mut free = [[0.0; 3]; N];
        for i in 0..n {
            let (d, v) = stepper.motion(simd, &self.modes, i);
            let Motion { d: d0, v: v0, a: a0 } = frame.x[i];
            // where no law depends on the acceleration, it makes no difference
            let a = if model.inertial { stepper.acceleration(simd, &self.modes, i) } else { a0 };
            free[i] = [d - d0, v - v0, a - a0];
            for j in 0..n {
                free[i][1] += model.memory[i][j] * self.f[j];
                for q in 0..3 {
                    free[i][q] -= step.compliance[i][j][q] * frame.f[j];
                }
            }
        }
        free
    }
}
