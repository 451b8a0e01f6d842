//! Derivatives of a simulation by differentiating each substep: over the laws' parameters, and over the model.
//!
//! Over a law's parameter everything that moves has a derivative. Over the model there are two of it, the model as it is
//! and one moved a little: the moved one goes its own way under the same inputs, with the laws taken as linear around the
//! motion of the first. Neither needs the laws' force to be found again.

use super::abreast::{Abreast, Over};
use super::beside::{Frame, Model};
use super::lane::LANES;
use super::newton::{Forces, Motions};
use super::{MAX_COORDINATES, Response};
use crate::laws::{Linearised, State};
use pulp::Simd;

/// Substeps that every derivative takes at once: what it needs of its own stays in the nearest cache meanwhile.
const BLOCK: usize = 32;

/// Derivatives with respect to parameters, and moved models.
pub(super) struct Columns {
    /// Parameters, then moved models.
    abreast: Vec<Abreast>,
    n_parameters: usize,
    frames: Vec<Frame>,
    /// Frames that no derivative has been through.
    waiting: usize,
}

impl Columns {
    /// `share[k]` is the derivative of the added compliance's share with respect to parameter k, `wanted[k]` whether that
    /// over parameter k is.
    pub(super) fn new(model: &Model, share: &[f64], wanted: &[bool]) -> Self {
        let joints = model.joints;
        let owners =
            joints.iter().enumerate().flat_map(|(i, joint)| (0..joint.n_parameters()).map(move |j| (i, j)));
        let parameters = owners.zip(share).zip(wanted).filter(|(_, wanted)| **wanted);
        let mut all: Vec<Over> =
            parameters.map(|((owner, share), _)| Over::Parameter(owner, *share)).collect();
        let n_parameters = all.len();
        all.extend(model.moved.iter().map(Over::Model));
        let compliance = [model.compliance, model.compliance_at_rest];
        let some = |all: &[Over]| Abreast::new(model.stepper, joints, compliance, model.lacking, all);
        let frame = || Frame { at: vec![Linearised::default(); joints.len()], ..Frame::default() };
        Self {
            abreast: all.chunks(LANES).map(some).collect(),
            n_parameters,
            frames: (0..BLOCK).map(|_| frame()).collect(),
            waiting: 0,
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
        let (n, n_out, n_w) = (out.n, model.stepper.n_outputs(), model.joints.len());
        let (quantity, n_parameters) = (model.stepper.quantity(), self.n_parameters);
        for (some, abreast) in self.abreast.iter_mut().enumerate() {
            for frame in frames {
                abreast.advance::<S, N>(simd, model, frame);
                let Some(k) = frame.kept else { continue };
                abreast.give_out(simd, quantity);
                for l in 0..abreast.n {
                    let j = some * LANES + l;
                    let (j, y, f) = if j < n_parameters {
                        (j, &mut out.dy, &mut out.df)
                    } else {
                        (j - n_parameters, &mut out.moved_y, &mut out.moved_f)
                    };
                    for row in 0..n_out {
                        y[(j * n_out + row) * n + k] = abreast.y[row][l];
                    }
                    for i in 0..n_w {
                        f[(j * n_w + i) * n + k] = abreast.f[i][l];
                    }
                }
            }
        }
        self.waiting = 0;
    }
}
