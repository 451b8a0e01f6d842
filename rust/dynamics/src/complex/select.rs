//! Which eigenvalues of the projected problem are wanted.

use std::f64::consts::TAU;

use super::options::ComplexOptions;
use super::projected::{Pair, Projected};
use crate::DynamicsError;

/// |λ| below this beside s₀ is a rigid-body motion: twice 0, which rounding splits by the root of its size.
const RIGID: f64 = 1e-5;
/// |Im λ| below this beside |λ| is an overdamped pole.
const REAL: f64 = 1e-7;

/// What a pole is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PoleKind {
    /// λ = 0.
    Rigid,
    /// Im λ > 0; with its conjugate.
    Oscillatory,
    /// Real.
    Overdamped,
    /// Im λ < 0 with structural damping: not physical there, but a pole of the same rational function.
    Mirrored,
}

/// A wanted pole.
#[derive(Debug, Clone)]
pub(super) struct Wanted {
    pub kind: PoleKind,
    pub pair: Pair,
}

/// The poles asked for: rigid-body modes, oscillatory ones by |λ|, overdamped ones up to the last of them, and with
/// structural damping as many of the other half-plane, where K + iD is not physical but part of the rational function.
pub(super) fn select(
    all: &[Pair],
    projected: &Projected,
    s0: f64,
    options: &ComplexOptions,
) -> Result<Vec<Wanted>, DynamicsError> {
    let structural = projected.structural.is_some();
    let is_rigid = |p: &Pair| s0 > 0.0 && p.lambda.norm() <= RIGID * s0;
    let mut out = Vec::new();
    if all.iter().any(is_rigid) {
        for x in projected.still()? {
            out.push(Wanted { kind: PoleKind::Rigid, pair: Pair::rigid(x) });
        }
    }
    let is_real = |p: &Pair| p.lambda.im.abs() <= REAL * p.lambda.norm();
    let sorted = |keep: &dyn Fn(&Pair) -> bool| {
        let mut some: Vec<Pair> = all.iter().filter(|p| !is_rigid(p) && keep(p)).cloned().collect();
        some.sort_by(|a, b| a.lambda.norm().total_cmp(&b.lambda.norm()));
        some
    };
    let limit = options.f_max.map_or(f64::INFINITY, |f| TAU * f);
    let room = options.n_modes.map_or(usize::MAX, |n| n.saturating_sub(out.len()));
    let above = sorted(&|p| p.lambda.im > 0.0 && !is_real(p));
    if options.f_max.is_none() && above.len() < room {
        let found = above.len() + out.len();
        let real = sorted(&|p| is_real(p)).len();
        return Err(DynamicsError::TooFewModes { wanted: found + room - above.len(), found, real });
    }
    out.truncate(options.n_modes.unwrap_or(usize::MAX));
    let chosen: Vec<Pair> = above.into_iter().take(room).take_while(|p| p.lambda.norm() <= limit).collect();
    let reach = match options.f_max {
        Some(_) if chosen.len() < room => limit,
        _ => chosen.last().map_or(limit, |p| p.lambda.norm()),
    };
    let mirrored = if structural { chosen.len() } else { 0 };
    let add = |out: &mut Vec<Wanted>, kind, pairs: Vec<Pair>| {
        out.extend(pairs.into_iter().map(|pair| Wanted { kind, pair }));
    };
    add(&mut out, PoleKind::Oscillatory, chosen);
    if structural {
        let below = sorted(&|p| p.lambda.im < 0.0 && !is_real(p)).into_iter().take(mirrored).collect();
        add(&mut out, PoleKind::Mirrored, below);
    } else {
        let real = sorted(&is_real).into_iter().take_while(|p| p.lambda.norm() <= reach).collect();
        add(&mut out, PoleKind::Overdamped, real);
    }
    Ok(out)
}
