//! The time loop.

use super::beside::{Model, Moved};
use super::modal::{Lanes, Modes, Stepper};
use super::newton::{Forces, Motions, Solved, solve};
use super::sensitivity::Columns;
use super::stable::{Coupling, SAFE, Stabiliser};
use super::{MAX_COORDINATES, ModalModel, Response, Run, SimulationError, Status, n_parameters};
use crate::laws::{Joint, Law, Motion, State};
use pulp::Simd;

/// Response from rest of a modal model whose coordinates `w` carry the given laws (one list a coordinate).
///
/// # Errors
/// [`SimulationError`] for arrays that do not fit, values that are not finite and laws without a time-domain form.
/// A step that does not converge or a response that grows without bound is told by [`Status`].
pub fn simulate(model: &ModalModel, laws: &[Vec<Law>], run: &Run) -> Result<Response, SimulationError> {
    simulate_tangents(model, laws, run, &vec![false; n_parameters(laws)], &[])
}

/// The response with its derivatives over the law parameters that are `wanted` (in the order of coordinates and laws)
/// and, beside it, the responses of models `moved` a little, the laws linear around the motion of the first. The moved
/// models have the first one's residual compliance.
///
/// # Errors
/// As [`simulate`].
pub fn simulate_tangents(
    model: &ModalModel,
    laws: &[Vec<Law>],
    run: &Run,
    wanted: &[bool],
    moved: &[ModalModel],
) -> Result<Response, SimulationError> {
    let n_in = run.check()?;
    if laws.len() > MAX_COORDINATES {
        let (name, place) = ("number of law coordinates", String::new());
        return Err(SimulationError::Value { name, place, value: laws.len() as f64, need: "6 or less" });
    }
    for model in std::iter::once(model).chain(moved) {
        model.check(laws.len(), n_in)?;
    }
    if wanted.len() != n_parameters(laws) {
        return Err(SimulationError::Shape {
            name: "wanted",
            given: wanted.len(),
            expected: n_parameters(laws),
            why: "one for each parameter of all laws",
        });
    }
    let h = run.dt / run.substeps as f64;
    let joints: Vec<Joint> = laws.iter().map(|laws| Joint::new(laws, h)).collect::<Result<_, _>>()?;
    let stepper = Stepper::new(model, h, run.output);
    let mut stabiliser = Stabiliser::new(model, laws, &stepper);
    let simulated = |stabiliser: &Stabiliser| {
        let beside: Vec<Moved> =
            moved.iter().map(|m| stabiliser.moved(m, model, laws, h, run.output)).collect();
        dispatched(Simulation::new(model, &joints, &stepper, run, stabiliser, wanted, &beside))
    };
    let first = simulated(&stabiliser);
    if first.status.failed_at.is_some() && stabiliser.share < 1.0 {
        // a law whose stiffness grows with amplitude went beyond what the plain scheme carries
        stabiliser.share = 1.0;
        stabiliser.slopes.fill(0.0);
        return Ok(simulated(&stabiliser).decimated(run.decimate));
    }
    Ok(first.decimated(run.decimate))
}

/// Runs a simulation in the widest vector instructions the machine has.
fn dispatched(simulation: Simulation<'_>) -> Response {
    struct Whole<'a>(Simulation<'a>);
    impl pulp::WithSimd for Whole<'_> {
        type Output = Response;
        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> Response {
            self.0.run(simd)
        }
    }
    pulp::Arch::new().dispatch(Whole(simulation))
}

struct Simulation<'a> {
    joints: &'a [Joint],
    stepper: &'a Stepper,
    run: &'a Run<'a>,
    stabiliser: &'a Stabiliser,
    coupling: Coupling,
    inertial: bool,
    /// Parameters whose derivatives are wanted, and models beside this one.
    wanted: &'a [bool],
    moved: &'a [Moved],
}

/// What moves during a run.
struct Moving {
    modes: Modes,
    states: Vec<Vec<State<f64>>>,
    next: Vec<Vec<State<f64>>>,
    f: Forces,
    f_before: Forces,
    /// Motion of the coordinates without the forces at the end of the substep, and what these are found to be.
    free: Motions,
    solved: Solved,
    scale: f64,
    /// Inputs at the end of the substep.
    u: Vec<f64>,
    /// What every mode gives out.
    own: Lanes,
    columns: Option<Columns>,
}

impl<'a> Simulation<'a> {
    fn new(
        model: &ModalModel,
        joints: &'a [Joint],
        stepper: &'a Stepper,
        run: &'a Run<'a>,
        stabiliser: &'a Stabiliser,
        wanted: &'a [bool],
        moved: &'a [Moved],
    ) -> Self {
        let (residual, Stabiliser { share, lacking, .. }) = (model.residual_compliance, stabiliser);
        let h = run.dt / run.substeps as f64;
        let coupling = Coupling::new(stepper, residual, *share, lacking, joints.len(), h);
        let inertial = joints.iter().any(Joint::uses_acceleration) || inertia_wanted(joints, wanted);
        Self { joints, stepper, run, stabiliser, coupling, inertial, wanted, moved }
    }

    /// Writes the inputs a `share` of the step after a sample to `u`.
    #[inline(always)]
    fn inputs(&self, sample: usize, share: f64, u: &mut [f64]) {
        let Run { u: all, n, .. } = *self.run;
        for (value, row) in u.iter_mut().zip(all.chunks_exact(n)) {
            *value = row[sample];
            if share > 0.0 {
                *value += share * (row[sample + 1] - row[sample]);
            }
        }
    }

    #[inline(always)]
    fn run<S: Simd>(&self, simd: S) -> Response {
        let mut out = self.empty();
        let mut now = self.start();
        let Run { n, substeps, stride, .. } = *self.run;
        let mut load = self.stepper.unloaded();
        self.inputs(0, 0.0, &mut now.u);
        self.stepper.load(simd, &now.u, &mut load);
        self.stepper.start(&mut now.modes, &load);
        let mut good = self.solve_step(simd, &mut now, true, &mut out);
        for sample in 0..n {
            if let Err(advice) = good {
                self.fail(sample.div_ceil(stride), advice, &mut out);
                return out;
            }
            if sample % stride == 0 {
                self.record(simd, &mut now, sample / stride, &mut out);
            }
            if sample + 1 == n {
                break;
            }
            for part in 1..=substeps {
                let (at, share) =
                    if part < substeps { (sample, part as f64 / substeps as f64) } else { (sample + 1, 0.0) };
                self.inputs(at, share, &mut now.u);
                self.stepper.load(simd, &now.u, &mut load);
                self.stepper.free(simd, &mut now.modes, &load);
                good = self.solve_step(simd, &mut now, false, &mut out);
                if good.is_err() {
                    break;
                }
            }
        }
        if let Some(columns) = &mut now.columns {
            columns.follow(simd, &self.differentiated(), &mut out);
        }
        out
    }

    fn differentiated(&self) -> Model<'_> {
        let Coupling { compliance, at_rest: compliance_at_rest, memory } = &self.coupling;
        let Stabiliser { lacking, .. } = self.stabiliser;
        let Self { stepper, joints, moved, inertial, .. } = *self;
        Model { stepper, joints, compliance, compliance_at_rest, memory, lacking, moved, inertial }
    }

    fn start(&self) -> Moving {
        let rest: Vec<_> = self.joints.iter().map(Joint::rest).collect();
        let columns = !self.moved.is_empty() || self.wanted.contains(&true);
        let Stabiliser { slopes, .. } = self.stabiliser;
        let made = || Columns::new(&self.differentiated(), slopes, self.wanted);
        Moving {
            modes: self.stepper.rest(),
            next: rest.clone(),
            states: rest,
            f: [0.0; MAX_COORDINATES],
            f_before: [0.0; MAX_COORDINATES],
            free: Motions::default(),
            solved: Solved::default(),
            scale: 0.0,
            u: vec![0.0; self.run.u.len() / self.run.n],
            own: self.stepper.unloaded(),
            columns: columns.then(made),
        }
    }

    /// Finds the law forces at the end of a substep whose free motion the modes hold, and completes the motion.
    #[inline(always)]
    fn solve_step<S: Simd>(
        &self,
        simd: S,
        now: &mut Moving,
        first: bool,
        out: &mut Response,
    ) -> Result<(), &'static str> {
        let n = self.joints.len();
        if n == 0 {
            return Ok(());
        }
        for i in 0..n {
            let (d, mut v) = self.stepper.motion(simd, &now.modes, i);
            let a = if self.inertial { self.stepper.acceleration(simd, &now.modes, i) } else { 0.0 };
            for j in 0..n {
                v += self.coupling.memory[i][j] * now.f[j];
            }
            now.free[i] = Motion { d, v, a };
            now.solved.f[i] = 2.0 * now.f[i] - now.f_before[i];
        }
        let Coupling { compliance, at_rest, .. } = &self.coupling;
        let compliance = if first { at_rest } else { compliance };
        let Moving { modes, states, next, f, f_before, free, solved, scale, u, columns, .. } = now;
        solve(self.joints, free, compliance, *scale, states, next, solved);
        out.status.n_iterations += solved.n_iterations;
        let sum: f64 = solved.f[..n].iter().chain(solved.x[..n].iter().map(|x| &x.d)).map(|x| x.abs()).sum();
        if sum.is_nan() || sum > 1e150 {
            return Err("the response grows without bound: the law destabilises the model at this level; \
                        check the law's sign and parameters");
        }
        if !solved.converged {
            return Err("the law's force did not converge; use more substeps");
        }
        if self.stabiliser.share < 1.0 && self.too_stiff(&solved.stiffness) {
            return Err("the law became stiffer than the step carries; use more substeps");
        }
        for i in 0..n {
            if first {
                self.stepper.load_only(simd, modes, i, solved.f[i]);
            } else {
                self.stepper.correct(simd, modes, i, solved.f[i]);
            }
            *scale = scale.max(solved.f[i].abs());
        }
        if let Some(columns) = columns {
            let motion = (&solved.x, &solved.f, u.as_slice());
            columns.step(simd, &self.differentiated(), motion, states, first, out);
        }
        for i in 0..n {
            f_before[i] = if first { solved.f[i] } else { f[i] };
            f[i] = solved.f[i];
        }
        std::mem::swap(states, next);
        Ok(())
    }

    /// Whether the laws' slopes exceed what the scheme keeps stable with the compliance in use.
    #[inline(always)]
    fn too_stiff(&self, stiffness: &Forces) -> bool {
        let Stabiliser { lacking, share, .. } = self.stabiliser;
        let load: f64 = (0..self.joints.len()).map(|i| stiffness[i].max(0.0) * lacking[i][i].max(0.0)).sum();
        (1.0 - share) * load > 0.5 * (1.0 + SAFE)
    }

    fn empty(&self) -> Response {
        let n = self.run.n.div_ceil(self.run.stride);
        let (n_out, n_w) = (self.stepper.n_outputs(), self.joints.len());
        let n_p = self.wanted.iter().filter(|w| **w).count();
        let n_moved = self.moved.len();
        let zeros = |rows: usize| vec![0.0; rows * n];
        let status = Status {
            n_static_modes: self.stepper.n_static,
            added_compliance: self.stabiliser.share,
            ..Status::default()
        };
        Response {
            n,
            y: zeros(n_out),
            d: zeros(n_w),
            v: zeros(n_w),
            f: zeros(n_w),
            dy: zeros(n_p * n_out),
            df: zeros(n_p * n_w),
            moved_y: zeros(n_moved * n_out),
            moved_f: zeros(n_moved * n_w),
            status,
        }
    }

    #[inline(always)]
    fn record<S: Simd>(&self, simd: S, now: &mut Moving, k: usize, out: &mut Response) {
        let n = out.n;
        self.stepper.outputs(simd, &now.modes, &mut now.own, |row, y| out.y[row * n + k] = y);
        for i in 0..self.joints.len() {
            out.d[i * n + k] = now.solved.x[i].d;
            out.v[i * n + k] = now.solved.x[i].v;
            out.f[i * n + k] = now.f[i];
        }
        if let Some(columns) = &mut now.columns {
            columns.keep(k);
        }
    }

    fn fail(&self, k: usize, advice: &str, out: &mut Response) {
        let n = out.n;
        let moved = [&mut out.moved_y, &mut out.moved_f];
        for history in [&mut out.y, &mut out.d, &mut out.v, &mut out.f, &mut out.dy, &mut out.df]
            .into_iter()
            .chain(moved)
        {
            for row in history.chunks_mut(n) {
                row[k.min(n)..].fill(f64::NAN);
            }
        }
        out.status.failed_at = Some(k);
        out.status.advice = format!("from sample {k} of {n} on nothing was computed: {advice}");
    }
}

/// Whether a derivative is wanted over a parameter of a law that may depend on the acceleration.
fn inertia_wanted(joints: &[Joint], wanted: &[bool]) -> bool {
    let laws = joints.iter().flat_map(|joint| joint.laws());
    let mut first = 0;
    for law in laws {
        let own = first..first + law.n_parameters();
        first = own.end;
        if law.kind().is_inertial() && wanted[own].last() == Some(&true) {
            return true;
        }
    }
    false
}
