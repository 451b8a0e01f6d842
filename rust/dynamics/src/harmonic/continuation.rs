//! The branch over frequency, by pseudo-arclength.
//!
//! A point is (x, omega); lengths along the branch are measured with x in shares of its size at the last point and omega
//! in shares of the band, so that a step follows the flank of a resonance and its top alike.

use super::balance::{Balance, Residual};
use super::elimination::solve;
use super::{Branch, Ended, Fold, HarmonicError, Options, linear};
use crate::laws::LawError;

/// Iterations of a corrector, and those after which a step is neither shortened nor stretched.
const MAX_ITERATIONS: usize = 10;
const USUAL: f64 = 4.0;
/// A motion is known where a step of Newton changes it by less than this share.
const TOLERANCE: f64 = 1e-10;
/// Steps in shares of the largest: the first, the shortest, and the one below which a corner of the branch is real.
const FIRST: f64 = 0.2;
const SHORTEST: f64 = 1e-7;
const CORNER: f64 = 1e-3;
/// Cosine of the largest turn of the branch in a step, and how far the corrector may go, in steps.
const TURN: f64 = 0.94;
const AWAY: f64 = 0.5;
/// Share of the largest motion so far below which lengths are no longer measured by the motion's own size.
const SMALL: f64 = 1e-2;

/// A point of the branch with its unit tangent (x in shares of `scale`, omega in shares of the band).
#[derive(Clone, Debug)]
struct Point {
    x: Vec<f64>,
    omega: f64,
    scale: f64,
    tangent: Vec<f64>,
}

struct Path<'a> {
    balance: &'a Balance<'a>,
    width: f64,
    largest: f64,
    n_iterations: usize,
}

/// The branch from the lower end of the band.
pub(super) fn follow(
    balance: &Balance,
    band: (f64, f64),
    options: &Options,
) -> Result<Branch, HarmonicError> {
    let mut path = Path { balance, width: band.1 - band.0, largest: 0.0, n_iterations: 0 };
    let none = HarmonicError::NoStart { freq_hz: band.0 / std::f64::consts::TAU, level: balance.level };
    let x = path.start(band.0)?.ok_or(none.clone())?;
    let mut upwards = vec![0.0; x.len() + 1];
    upwards[x.len()] = 1.0;
    path.largest = norm(&x);
    let scale = path.scale(&x);
    let mut last = path.with_tangent(x, band.0, scale, &upwards)?.ok_or(none)?;
    let (mut points, mut folds) = (vec![last.clone()], Vec::new());
    let mut step = FIRST * options.max_step;
    let ended = loop {
        if points.len() >= options.max_points {
            break Ended::MaxPoints;
        }
        let Some((next, taken)) = path.step(&last, &mut step, options.max_step)? else { break Ended::Stuck };
        let (before, after) = (ahead(&last), ahead(&next));
        if before * after < 0.0 {
            let fold = path.fold(&last, taken, after)?;
            if (band.0..=band.1).contains(&fold.omega) {
                folds.push(Fold { point: points.len(), upper: before > 0.0 });
                points.push(fold);
                if folds.len() >= options.max_folds {
                    break Ended::MaxFolds;
                }
            }
        }
        if !(band.0..=band.1).contains(&next.omega) {
            let upper = next.omega > band.1;
            let end = if upper { band.1 } else { band.0 };
            points.extend(path.at_end(points.last().unwrap_or(&last), &next, end)?);
            break if upper { Ended::Upper } else { Ended::Lower };
        }
        path.largest = path.largest.max(norm(&next.x));
        points.push(next.clone());
        last = next;
    };
    path.told(&points, folds, ended)
}

/// How the frequency changes along the branch.
fn ahead(point: &Point) -> f64 {
    point.tangent[point.x.len()]
}

fn norm(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

impl Path<'_> {
    fn scale(&self, x: &[f64]) -> f64 {
        let size = norm(x).max(SMALL * self.largest);
        if size > 0.0 { size } else { 1.0 }
    }

    /// A periodic motion at `omega`: from the linear one, or along a force that grows to its level in ever more steps.
    fn start(&mut self, omega: f64) -> Result<Option<Vec<f64>>, LawError> {
        let linear = self.balance.linear_motion(omega)?;
        for steps in [1, 4, 16, 64] {
            let mut x: Vec<f64> = linear.iter().map(|x| x / f64::from(steps)).collect();
            let mut good = true;
            for i in 1..=steps {
                good = self.at(&mut x, omega, f64::from(i) / f64::from(steps))?;
                if !good {
                    break;
                }
            }
            if good {
                return Ok(Some(x));
            }
        }
        Ok(None)
    }

    /// Newton at a fixed frequency; whether it converged.
    fn at(&mut self, x: &mut [f64], omega: f64, share: f64) -> Result<bool, LawError> {
        for _ in 0..3 * MAX_ITERATIONS {
            self.n_iterations += 1;
            let Residual { mut r, mut jacobian } = self.balance.residual(x, omega, share, true)?;
            if solve(&mut jacobian, &mut r).is_none() {
                return Ok(false);
            }
            x.iter_mut().zip(&r).for_each(|(x, r)| *x -= r);
            if norm(&r) <= TOLERANCE * norm(x) || norm(x) == 0.0 {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Newton on the plane normal to the tangent of `from`, starting `step` ahead of it; the point and how many
    /// iterations it took, `None` where it does not converge near there.
    fn correct(&mut self, from: &Point, step: f64) -> Result<Option<(Point, usize)>, LawError> {
        let (n, scale) = (from.x.len(), from.scale);
        let mut x: Vec<f64> = from.x.iter().zip(&from.tangent).map(|(x, t)| x + step * scale * t).collect();
        let mut omega = from.omega + step * self.width * from.tangent[n];
        let mut gone = vec![0.0; n + 1];
        for iteration in 1..=MAX_ITERATIONS {
            if !(omega > 0.0 && omega.is_finite()) {
                return Ok(None);
            }
            self.n_iterations += 1;
            let at = self.balance.residual(&x, omega, 1.0, true)?;
            let mut a = self.bordered(&x, omega, scale, &at, &from.tangent)?;
            let mut b: Vec<f64> = at.r.iter().map(|r| -r).collect();
            b.push(0.0);
            if solve(&mut a, &mut b).is_none() {
                return Ok(None);
            }
            for i in 0..n {
                x[i] += scale * b[i];
            }
            omega += self.width * b[n];
            gone.iter_mut().zip(&b).for_each(|(gone, b)| *gone += b);
            if norm(&gone) > AWAY * step.abs() + TOLERANCE {
                return Ok(None);
            }
            if norm(&b) <= TOLERANCE * (1.0 + norm(&x) / scale) {
                let scale = self.scale(&x);
                let done =
                    self.with_tangent(x, omega, scale, &rescaled(&from.tangent, from.scale / scale))?;
                return Ok(done.map(|point| (point, iteration)));
            }
        }
        Ok(None)
    }

    /// Jacobian over (x in `scale`, omega in the band's width), with `along` as its last row.
    fn bordered(
        &self,
        x: &[f64],
        omega: f64,
        scale: f64,
        at: &Residual,
        along: &[f64],
    ) -> Result<Vec<f64>, LawError> {
        let n = x.len();
        let over = self.balance.over_omega(x, omega, at)?;
        let mut a = Vec::with_capacity((n + 1) * (n + 1));
        for (row, over) in at.jacobian.chunks_exact(n).zip(&over) {
            a.extend(row.iter().map(|j| scale * j));
            a.push(self.width * over);
        }
        a.extend_from_slice(along);
        Ok(a)
    }

    /// A point with its tangent, turned the way of `along`.
    fn with_tangent(
        &self,
        x: Vec<f64>,
        omega: f64,
        scale: f64,
        along: &[f64],
    ) -> Result<Option<Point>, LawError> {
        let at = self.balance.residual(&x, omega, 1.0, true)?;
        let mut a = self.bordered(&x, omega, scale, &at, along)?;
        let mut tangent = vec![0.0; x.len() + 1];
        tangent[x.len()] = 1.0;
        if solve(&mut a, &mut tangent).is_none() {
            return Ok(None);
        }
        let length = norm(&tangent);
        tangent.iter_mut().for_each(|t| *t /= length);
        Ok(Some(Point { x, omega, scale, tangent }))
    }

    /// The next point and the step that led to it; `step` is set for the one after it.
    fn step(&mut self, from: &Point, step: &mut f64, longest: f64) -> Result<Option<(Point, f64)>, LawError> {
        while *step > SHORTEST * longest {
            if let Some((next, iterations)) = self.correct(from, *step)? {
                let before = rescaled(&from.tangent, from.scale / next.scale);
                let turn = dot(&before, &next.tangent) / norm(&before);
                if turn > TURN || *step <= CORNER * longest {
                    let taken = *step;
                    let factor = 2f64.powf((USUAL - iterations as f64) / 2.0).clamp(0.5, 2.0);
                    *step = (taken * factor).min(longest);
                    return Ok(Some((next, taken)));
                }
            }
            *step *= 0.5;
        }
        Ok(None)
    }

    /// The turning point within `step` of `from`, where frequency changes the other way (by `after`) at its end: the
    /// root of the tangent's frequency by the rule of false position (Illinois).
    fn fold(&mut self, from: &Point, step: f64, after: f64) -> Result<Point, LawError> {
        let (mut low, mut high) = ((0.0, ahead(from)), (step, after));
        let (mut best, mut kept_low) = (from.clone(), None);
        for _ in 0..30 {
            let s = low.0 - low.1 * (high.0 - low.0) / (high.1 - low.1);
            let Some((point, _)) = self.correct(from, s)? else { return Ok(best) };
            let value = ahead(&point);
            let below = value * low.1 > 0.0;
            best = point;
            if value.abs() < 1e-9 || high.0 - low.0 < 1e-9 * step {
                break;
            }
            if below {
                low = (s, value);
                if kept_low == Some(false) {
                    high.1 *= 0.5;
                }
            } else {
                high = (s, value);
                if kept_low == Some(true) {
                    low.1 *= 0.5;
                }
            }
            kept_low = Some(!below);
        }
        Ok(best)
    }

    /// The point of the branch at the end of the band between two points, one on each side; none where Newton fails.
    fn at_end(&mut self, from: &Point, to: &Point, omega: f64) -> Result<Option<Point>, LawError> {
        let share = if to.omega == from.omega { 1.0 } else { (omega - from.omega) / (to.omega - from.omega) };
        let mut x: Vec<f64> = from.x.iter().zip(&to.x).map(|(a, b)| a + share * (b - a)).collect();
        let good = self.at(&mut x, omega, 1.0)?;
        Ok(good.then(|| Point { x, omega, scale: to.scale, tangent: to.tangent.clone() }))
    }

    /// The branch as it is given out.
    fn told(&self, points: &[Point], folds: Vec<Fold>, ended: Ended) -> Result<Branch, HarmonicError> {
        let (mut d, mut f, mut y) = (Vec::new(), Vec::new(), Vec::new());
        let (model, p) = (&self.balance.model, &self.balance.p);
        for point in points {
            let (motion, force) = self.balance.harmonics(&point.x, point.omega)?;
            y.extend(linear::outputs(model, p, point.omega, &motion, &force));
            d.extend(motion);
            f.extend(force);
        }
        let omega = points.iter().map(|point| point.omega).collect();
        Ok(Branch { omega, d, f, y, folds, ended, n_iterations: self.n_iterations })
    }
}

/// A tangent whose x is measured in another scale, `factor` times as short.
fn rescaled(tangent: &[f64], factor: f64) -> Vec<f64> {
    let (last, x) = tangent.split_last().unwrap_or((&0.0, &[]));
    x.iter().map(|t| t * factor).chain([*last]).collect()
}
