//! Derivatives of a simulation with respect to every law parameter, by differentiating each substep.

use super::modal::{Modes, Stepper};
use super::newton::{Compliance, Forces, Motions, tangent_matrix, tangent_solve};
use super::{MAX_COORDINATES, Response};
use crate::laws::{Joint, Linearised, State};

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

/// Derivatives with respect to all parameters.
pub(super) struct Columns {
    columns: Vec<Column>,
    at: Vec<Linearised>,
}

/// What the derivative of a substep needs to know of it.
pub(super) struct Substep<'a> {
    pub(super) stepper: &'a Stepper,
    pub(super) joints: &'a [Joint],
    pub(super) compliance: &'a Compliance,
    /// Velocity compliance that acts on the force at the start of the substep.
    pub(super) memory: &'a [[f64; MAX_COORDINATES]; MAX_COORDINATES],
    /// The stabilising compliance at its full share.
    pub(super) lacking: &'a [[f64; MAX_COORDINATES]; MAX_COORDINATES],
    /// Whether this is the start from rest.
    pub(super) first: bool,
}

impl Columns {
    /// `share[k]` is the derivative of the added compliance's share with respect to parameter k.
    pub(super) fn new(stepper: &Stepper, joints: &[Joint], share: &[f64]) -> Self {
        let owners =
            joints.iter().enumerate().flat_map(|(i, joint)| (0..joint.n_parameters()).map(move |j| (i, j)));
        let columns = owners
            .zip(share)
            .map(|(owner, share)| Column {
                owner,
                modes: stepper.rest(),
                states: joints.iter().map(Joint::rest).collect(),
                f: [0.0; MAX_COORDINATES],
                share: *share,
            })
            .collect();
        Self { columns, at: vec![Linearised::default(); joints.len()] }
    }

    /// Takes all derivatives through one substep that led to the motions `x` and forces `f` from `states`.
    pub(super) fn advance(&mut self, step: &Substep, x: &Motions, f: &Forces, states: &[Vec<State<f64>>]) {
        let n = step.joints.len();
        let mut slopes = [[0.0; 3]; MAX_COORDINATES];
        for i in 0..n {
            step.joints[i].linearise(x[i], &states[i], &mut self.at[i]);
            slopes[i] = self.at[i].df;
        }
        let matrix = tangent_matrix(step.compliance, &slopes, n);
        for column in &mut self.columns {
            let free = column.free(step, f);
            let mut rhs = [0.0; MAX_COORDINATES];
            for i in 0..n {
                let at = &self.at[i];
                rhs[i] = (0..3).map(|q| at.df[q] * free[i][q]).sum();
                for (slope, ds) in at.df_ds.iter().zip(&column.states[i]) {
                    rhs[i] += slope.iter().zip(ds).map(|(x, y)| x * y).sum::<f64>();
                }
                if column.owner.0 == i {
                    rhs[i] += at.df_dp[column.owner.1];
                }
            }
            // the same matrix let the step itself converge; a kink exactly here leaves the derivative undefined
            let df = tangent_solve(&matrix, &rhs, n).unwrap_or([f64::NAN; MAX_COORDINATES]);
            for i in 0..n {
                let mut dx = free[i];
                for j in 0..n {
                    for q in 0..3 {
                        dx[q] -= step.compliance[i][j][q] * df[j];
                    }
                }
                let own = (column.owner.0 == i).then_some(column.owner.1);
                step.joints[i].advance_state(&self.at[i], dx, own, &mut column.states[i]);
                if step.first {
                    step.stepper.load_only(&mut column.modes, i, df[i]);
                } else {
                    step.stepper.correct(&mut column.modes, i, df[i]);
                }
            }
            column.f = df;
        }
    }

    /// Writes the derivatives of the outputs and forces at kept sample `k`.
    pub(super) fn record(&self, stepper: &Stepper, k: usize, out: &mut Response) {
        let (n, n_out, n_w) = (out.n, stepper.n_outputs(), self.at.len());
        for (j, column) in self.columns.iter().enumerate() {
            stepper.outputs(&column.modes, |row, y| out.dy[(j * n_out + row) * n + k] = y);
            for i in 0..n_w {
                out.df[(j * n_w + i) * n + k] = column.f[i];
            }
        }
    }
}

impl Column {
    /// Derivative of the motion (d, v, a) before the end force's own derivative is known; moves the modes there.
    fn free(&mut self, step: &Substep, f: &Forces) -> [[f64; 3]; MAX_COORDINATES] {
        let n = step.joints.len();
        if !step.first {
            step.stepper.free_unloaded(&mut self.modes);
        }
        let mut free = [[0.0; 3]; MAX_COORDINATES];
        for i in 0..n {
            let (d, v) = step.stepper.motion(&self.modes, i);
            let a =
                if step.joints[i].is_inertial() { step.stepper.acceleration(&self.modes, i) } else { 0.0 };
            free[i] = [d, v, a];
            for j in 0..n {
                free[i][0] -= self.share * step.lacking[i][j] * f[j];
                free[i][1] += step.memory[i][j] * self.f[j];
            }
        }
        free
    }
}
