//! The time loop.

use super::modal::{Lanes, Modes, Stepper, add};
use super::newton::{Compliance, Forces, Motions, solve};
use super::sensitivity::{Columns, Substep};
use super::{MAX_COORDINATES, ModalModel, Response, Run, SimulationError, Status, n_parameters};
use crate::laws::{Joint, Law, Motion, State};

/// Stiffness (in units of the critical one) up to which the plain scheme is used.
const SAFE: f64 = 0.8;
type Square = [[f64; MAX_COORDINATES]; MAX_COORDINATES];

/// Response from rest of a modal model whose coordinates `w` carry the given laws (one list a coordinate).
///
/// # Errors
/// [`SimulationError`] for arrays that do not fit, values that are not finite and laws without a time-domain form.
/// A step that does not converge or a response that grows without bound is told by [`Status`].
pub fn simulate(model: &ModalModel, laws: &[Vec<Law>], run: &Run) -> Result<Response, SimulationError> {
    let n_in = run.check()?;
    if laws.len() > MAX_COORDINATES {
        let (name, place) = ("number of law coordinates", String::new());
        return Err(SimulationError::Value { name, place, value: laws.len() as f64, need: "6 or less" });
    }
    model.check(laws.len(), n_in)?;
    let h = run.dt / run.substeps as f64;
    let joints: Vec<Joint> = laws.iter().map(|laws| Joint::new(laws, h)).collect::<Result<_, _>>()?;
    let stepper = Stepper::new(model, h, run.output);
    let plain = Stabiliser::new(model, laws, &stepper);
    let first = dispatched(Simulation::new(model, &joints, &stepper, run, &plain));
    if first.status.failed_at.is_some() && plain.share < 1.0 {
        // a law whose stiffness grows with amplitude went beyond what the plain scheme carries
        let full = Stabiliser { share: 1.0, slopes: vec![0.0; n_parameters(laws)], ..plain };
        return Ok(dispatched(Simulation::new(model, &joints, &stepper, run, &full)));
    }
    Ok(first)
}

/// Runs a simulation in the widest vector instructions the machine has.
fn dispatched(simulation: Simulation<'_>) -> Response {
    struct Whole<'a>(Simulation<'a>);
    impl pulp::WithSimd for Whole<'_> {
        type Output = Response;
        #[inline(always)]
        fn with_simd<S: pulp::Simd>(self, _: S) -> Response {
            self.0.run()
        }
    }
    pulp::Arch::new().dispatch(Whole(simulation))
}

/// Series compliance at the laws' coordinates that keeps stiff laws stable.
struct Stabiliser {
    /// Compliance for stability at any stiffness.
    lacking: Square,
    /// Share of it in use.
    share: f64,
    /// Derivatives of the share with respect to all parameters.
    slopes: Vec<f64>,
}

impl Stabiliser {
    fn new(model: &ModalModel, laws: &[Vec<Law>], stepper: &Stepper) -> Self {
        let n = laws.len();
        let mut lacking = [[0.0; MAX_COORDINATES]; MAX_COORDINATES];
        for i in 0..n {
            for j in 0..n {
                let residual = model.residual_compliance.map_or(0.0, |r| r[i * n + j]);
                lacking[i][j] = stepper.lacking(i, j) - residual;
            }
        }
        if n == 1 {
            lacking[0][0] = f64::max(lacking[0][0], 0.0);
        }
        let (mut load, mut slopes) = (0.0, Vec::new());
        for (i, laws) in laws.iter().enumerate() {
            let mut bound = 0.0;
            for law in laws {
                let (stiffness, over_p) = law.stiffness_bound();
                let known = stiffness.is_finite();
                bound += if known { stiffness } else { 0.0 };
                slopes.extend(
                    law.values()
                        .iter()
                        .zip(over_p)
                        .map(|(_, slope)| if known { slope } else { 0.0 } * lacking[i][i]),
                );
            }
            load += bound.max(0.0) * lacking[i][i].max(0.0);
        }
        let share = if load > SAFE { 1.0 - SAFE / load } else { 0.0 };
        for slope in &mut slopes {
            *slope *= if load > SAFE { SAFE / (load * load) } else { 0.0 };
        }
        Self { lacking, share, slopes }
    }
}

struct Simulation<'a> {
    joints: &'a [Joint],
    stepper: &'a Stepper,
    run: &'a Run<'a>,
    stabiliser: &'a Stabiliser,
    compliance: Compliance,
    /// Compliance at the start from rest: forces act on accelerations alone.
    compliance_at_rest: Compliance,
    memory: Square,
    inertial: bool,
}

/// What moves during a run.
struct Moving {
    modes: Modes,
    states: Vec<Vec<State<f64>>>,
    next: Vec<Vec<State<f64>>>,
    f: Forces,
    f_before: Forces,
    x: Motions,
    scale: f64,
    columns: Option<Columns>,
}

impl<'a> Simulation<'a> {
    fn new(
        model: &ModalModel,
        joints: &'a [Joint],
        stepper: &'a Stepper,
        run: &'a Run<'a>,
        stabiliser: &'a Stabiliser,
    ) -> Self {
        let (n, h) = (joints.len(), run.dt / run.substeps as f64);
        let mut compliance = Compliance::default();
        let mut compliance_at_rest = Compliance::default();
        let mut memory = Square::default();
        for i in 0..n {
            for j in 0..n {
                let residual = model.residual_compliance.map_or(0.0, |r| r[i * n + j]);
                let added = residual + stabiliser.share * stabiliser.lacking[i][j];
                memory[i][j] = residual / h;
                compliance[i][j] = stepper.compliance(i, j);
                compliance[i][j][0] += added;
                compliance[i][j][1] += memory[i][j];
                compliance_at_rest[i][j] = [added, memory[i][j], stepper.mobility_at_rest(i, j)];
            }
        }
        let inertial =
            joints.iter().any(|j| if run.sensitivities { j.is_inertial() } else { j.uses_acceleration() });
        Self { joints, stepper, run, stabiliser, compliance, compliance_at_rest, memory, inertial }
    }

    #[inline(always)]
    fn load(&self, sample: usize, p: &mut Lanes) {
        let Run { u, n, .. } = *self.run;
        self.stepper.load((0..u.len() / n).map(|row| u[row * n + sample]), p);
    }

    #[inline(always)]
    fn run(&self) -> Response {
        let mut out = self.empty();
        let mut now = self.start();
        let Run { n, substeps, stride, .. } = *self.run;
        let mut load = now.modes.p.clone();
        self.load(0, &mut load);
        now.modes.p.clone_from(&load);
        let (mut end, mut inside) = (load.clone(), load.clone());
        let mut good = self.solve_step(&mut now, true, &mut out.status);
        for sample in 0..n {
            if let Err(advice) = good {
                self.fail(sample.div_ceil(stride), advice, &mut out);
                return out;
            }
            if sample % stride == 0 {
                self.record(&now, sample / stride, &mut out);
            }
            if sample + 1 == n {
                break;
            }
            self.load(sample + 1, &mut end);
            for part in 1..=substeps {
                let share = part as f64 / substeps as f64;
                if part < substeps {
                    inside.fill_with(Default::default);
                    add(&mut inside, share, &end);
                    add(&mut inside, 1.0 - share, &load);
                }
                self.stepper.free(&mut now.modes, if part < substeps { &inside } else { &end });
                good = self.solve_step(&mut now, false, &mut out.status);
                if good.is_err() {
                    break;
                }
            }
            std::mem::swap(&mut load, &mut end);
        }
        out
    }

    fn start(&self) -> Moving {
        let rest: Vec<_> = self.joints.iter().map(Joint::rest).collect();
        let columns = self.run.sensitivities;
        Moving {
            modes: self.stepper.rest(),
            next: rest.clone(),
            states: rest,
            f: [0.0; MAX_COORDINATES],
            f_before: [0.0; MAX_COORDINATES],
            x: Motions::default(),
            scale: 0.0,
            columns: columns.then(|| Columns::new(self.stepper, self.joints, &self.stabiliser.slopes)),
        }
    }

    /// Finds the law forces at the end of a substep whose free motion the modes hold, and completes the motion.
    #[inline(always)]
    fn solve_step(&self, now: &mut Moving, first: bool, status: &mut Status) -> Result<(), &'static str> {
        let n = self.joints.len();
        if n == 0 {
            return Ok(());
        }
        let mut free = Motions::default();
        let mut guess = now.f;
        for i in 0..n {
            let (d, mut v) = self.stepper.motion(&now.modes, i);
            let a = if self.inertial { self.stepper.acceleration(&now.modes, i) } else { 0.0 };
            for j in 0..n {
                v += self.memory[i][j] * now.f[j];
            }
            free[i] = Motion { d, v, a };
            guess[i] = 2.0 * now.f[i] - now.f_before[i];
        }
        let compliance = if first { &self.compliance_at_rest } else { &self.compliance };
        let solved = solve(self.joints, &free, compliance, guess, now.scale, &now.states, &mut now.next);
        status.n_iterations += solved.n_iterations;
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
                self.stepper.load_only(&mut now.modes, i, solved.f[i]);
            } else {
                self.stepper.correct(&mut now.modes, i, solved.f[i]);
            }
            now.scale = now.scale.max(solved.f[i].abs());
        }
        if let Some(columns) = &mut now.columns {
            let lacking = &self.stabiliser.lacking;
            let (stepper, joints, memory) = (self.stepper, self.joints, &self.memory);
            let step = Substep { stepper, joints, compliance, memory, lacking, first };
            columns.advance(&step, &solved.x, &solved.f, &now.states);
        }
        (now.f_before, now.f, now.x) = (now.f, solved.f, solved.x);
        if first {
            now.f_before = now.f;
        }
        std::mem::swap(&mut now.states, &mut now.next);
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
        let n_p = if self.run.sensitivities { self.stabiliser.slopes.len() } else { 0 };
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
            status,
        }
    }

    #[inline(always)]
    fn record(&self, now: &Moving, k: usize, out: &mut Response) {
        let n = out.n;
        self.stepper.outputs(&now.modes, |row, y| out.y[row * n + k] = y);
        for i in 0..self.joints.len() {
            out.d[i * n + k] = now.x[i].d;
            out.v[i * n + k] = now.x[i].v;
            out.f[i * n + k] = now.f[i];
        }
        if let Some(columns) = &now.columns {
            columns.record(self.stepper, k, out);
        }
    }

    fn fail(&self, k: usize, advice: &str, out: &mut Response) {
        let n = out.n;
        for history in [&mut out.y, &mut out.d, &mut out.v, &mut out.f, &mut out.dy, &mut out.df] {
            for row in history.chunks_mut(n) {
                row[k.min(n)..].fill(f64::NAN);
            }
        }
        out.status.failed_at = Some(k);
        out.status.advice = format!("from sample {k} of {n} on nothing was computed: {advice}");
    }
}
