//! What couples the laws' coordinates at the end of a substep, and what keeps stiff laws stable there.

use super::beside::Moved;
use super::modal::Stepper;
use super::newton::Compliance;
use super::{MAX_COORDINATES, ModalModel, Output};
use crate::laws::Law;

/// Stiffness (in units of the critical one) up to which the plain scheme is used.
pub(super) const SAFE: f64 = 0.8;
type Square = [[f64; MAX_COORDINATES]; MAX_COORDINATES];

/// Series compliance at the laws' coordinates that keeps stiff laws stable.
pub(super) struct Stabiliser {
    /// Compliance for stability at any stiffness.
    pub(super) lacking: Square,
    /// Share of it in use.
    pub(super) share: f64,
    /// Derivatives of the share with respect to all parameters.
    pub(super) slopes: Vec<f64>,
}

impl Stabiliser {
    pub(super) fn new(model: &ModalModel, laws: &[Vec<Law>], stepper: &Stepper) -> Self {
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

/// Compliance of the coordinates at the end of a substep.
pub(super) struct Coupling {
    pub(super) compliance: Compliance,
    /// Compliance at the start from rest: forces act on accelerations alone.
    pub(super) at_rest: Compliance,
    /// Velocity compliance that acts on the force at the start of the substep.
    pub(super) memory: Square,
}

impl Coupling {
    /// Of the modes of `stepper` with `residual` (n, n) and the `share` of what is `lacking` for stability.
    pub(super) fn new(
        stepper: &Stepper,
        residual: Option<&[f64]>,
        share: f64,
        lacking: &Square,
        n: usize,
        h: f64,
    ) -> Self {
        let mut out = Self {
            compliance: Compliance::default(),
            at_rest: Compliance::default(),
            memory: Square::default(),
        };
        for i in 0..n {
            for j in 0..n {
                let residual = residual.map_or(0.0, |r| r[i * n + j]);
                let added = residual + share * lacking[i][j];
                out.memory[i][j] = residual / h;
                out.compliance[i][j] = stepper.compliance(i, j);
                out.compliance[i][j][0] += added;
                out.compliance[i][j][1] += out.memory[i][j];
                out.at_rest[i][j] = [added, out.memory[i][j], stepper.mobility_at_rest(i, j)];
            }
        }
        out
    }
}

impl Stabiliser {
    /// A model moved from `model`, stabilised as far as this.
    pub(super) fn moved(
        &self,
        moved: &ModalModel,
        model: &ModalModel,
        laws: &[Vec<Law>],
        h: f64,
        output: Output,
    ) -> Moved {
        let stepper = Stepper::new(moved, h, output);
        let residual = model.residual_compliance;
        let own = Self::new(&ModalModel { residual_compliance: residual, ..*moved }, laws, &stepper);
        // one that has the whole of it keeps it
        let share = if self.share < 1.0 { own.share } else { 1.0 };
        let Coupling { compliance, at_rest, .. } =
            Coupling::new(&stepper, residual, share, &own.lacking, laws.len(), h);
        Moved { stepper, compliance, compliance_at_rest: at_rest }
    }
}
