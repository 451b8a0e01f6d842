//! Free decays that a record's end cuts off: two columns a mode, and those of the laws' inner states. What sensors may
//! pick up of other motion has columns beside them, whose shares are eliminated in the same way.

use super::IdentifyError;
use super::arrays::{PairMut, Split, update, update2};
use super::hypothesis::{Hypothesis, InnerPole};
use super::prepared::Prepared;
use super::response::Response;
use femend_linalg::Dense;
use num_complex::Complex64;
use std::f64::consts::PI;

/// Power of a mode, relative to the strongest, below which its free decay is not believed to be any smaller.
const DECAY_FLOOR: f64 = 1e-6;

/// Largest inverse variance of an amplitude, where nothing moves a mode.
const MOST_HELD: f64 = 1e150;

/// The free decays of one record at one point of the unknowns.
pub(crate) struct Decays {
    /// Transforms of exp(pole t) beyond the record's end, a column for each pole and one for its conjugate.
    tails: Split,
    /// Forces against the motion of the laws' own decays (n_w columns), whose columns come after the modes'.
    pub inner: Vec<Split>,
    /// Inverse prior variances of the amplitudes.
    pub ridge: Vec<f64>,
    /// How many times as strongly each mode rings as its answer on the lines shows (`ringing`).
    ringing: Vec<f64>,
}

impl Decays {
    /// `q` and `d` are the modes' and the coordinates' answers by which the size of decays is judged.
    pub fn new(
        at: &Prepared<'_>,
        response: &Response,
        (hypothesis, x): (&Hypothesis, &[f64]),
        (q, d): (&Split, &Split),
    ) -> Result<Self, IdentifyError> {
        let mut tails = Split::zeros(at.n_lines(), 2 * response.poles.len());
        for (m, pole) in response.poles.iter().enumerate() {
            at.tail(*pole, tails.col_mut(2 * m));
            at.tail(pole.conj(), tails.col_mut(2 * m + 1));
        }
        let ringing = ringing(at, response);
        let mut ridge = decay_ridge(at, &ringing, q);
        let mut inner = Vec::new();
        for (force, weight) in inner_forces(at, response, hypothesis, x, d)? {
            inner.push(force);
            ridge.push(weight);
        }
        let held = 1.0 / (at.record.share * at.record.picked_up.sd.powi(2)).max(1.0 / MOST_HELD);
        ridge.extend(at.record.picked_up.sensor.iter().map(|_| held));
        Ok(Self { tails, inner, ridge, ringing })
    }

    /// Number of columns.
    pub fn len(&self) -> usize {
        self.ridge.len()
    }

    /// Number of columns of modes.
    pub fn n_modal(&self) -> usize {
        self.tails.n_columns()
    }

    /// Displacement, velocity or acceleration (`order` 0, 1, 2) of modal column `t` without the mode's shape.
    fn moved(&self, response: &Response, t: usize, order: i32, out: PairMut<'_>) {
        let pole = response.poles[t / 2];
        let i = if t.is_multiple_of(2) { Complex64::ONE } else { Complex64::I };
        let turn = i * pole.powi(order) / pole.norm_sqr();
        let (own, mirrored) = (self.tails.col(t - t % 2), self.tails.col(t - t % 2 + 1));
        let back = turn.conj();
        update2(out, own, mirrored, |_, a, b| turn * a + back * b);
    }

    /// Displacement, velocity and acceleration of modal column `t`, a column each.
    pub fn motion(&self, response: &Response, t: usize) -> Split {
        let mut all = Split::zeros(self.tails.n_lines(), 3);
        (0..3).for_each(|order| self.moved(response, t, order as i32, all.col_mut(order)));
        all
    }

    /// Motion (`order` 0 displacement, 2 acceleration) of mode `m` as it decays with its amplitudes, and how that changes with
    /// the logarithms of the mode's frequency and damping ratio, a column each.
    ///
    /// With amplitudes c the motion is c p^order / |p|² times the tail of the pole p, and the same of the conjugates; a tail t
    /// changes by p dt (t² - t) for a relative change of its pole, which damping turns by ζ / √(1 - ζ²).
    pub fn changes(
        &self,
        (at, response): (&Prepared<'_>, &Response),
        m: usize,
        amplitudes: &[f64],
        order: i32,
    ) -> Split {
        let pole = response.poles[m];
        let c = Complex64::new(amplitudes[2 * m], amplitudes[2 * m + 1]) * pole.powi(order) / pole.norm_sqr();
        let turn = Complex64::new(0.0, -pole.re / pole.im);
        let (step, order) = (pole * at.record.dt, f64::from(order));
        let mut all = Split::zeros(self.tails.n_lines(), 3);
        let (own, mirrored) = (self.tails.col(2 * m), self.tails.col(2 * m + 1));
        let back = (c.conj(), step.conj(), turn.conj());
        update2(all.col_mut(0), own, mirrored, |_, t, u| c * t + back.0 * u);
        update2(all.col_mut(1), own, mirrored, |_, t, u| {
            let grown = |t: Complex64, step: Complex64| t * (order - 2.0) + step * (t * t - t);
            c * grown(t, step) + back.0 * grown(u, back.1)
        });
        update2(all.col_mut(2), own, mirrored, |_, t, u| {
            let turned = |t: Complex64, step: Complex64| t * order + step * (t * t - t);
            c * turn * turned(t, step) + back.0 * back.2 * turned(u, back.1)
        });
        all
    }

    /// How half the squares grow with a mode's own answer on a line for its size there, since a decay is held the looser the
    /// stronger its mode answers; nothing where the bound of what is believed holds it.
    pub fn loosened(&self, at: &Prepared<'_>, m: usize, amplitudes: &[f64]) -> f64 {
        let ridge = self.ridge[2 * m];
        let modal = self.ridge[..self.n_modal()].iter();
        let least = modal.fold(f64::INFINITY, |a, b| a.min(*b));
        if ridge * DECAY_FLOOR >= least * (1.0 - 1e-9) || ridge >= MOST_HELD {
            return 0.0;
        }
        let size = amplitudes[2 * m].powi(2) + amplitudes[2 * m + 1].powi(2);
        -size * ridge * ridge * variance(at, self.ringing[m])
    }

    /// The same, or where no loop is closed, and they are not needed, without displacement and velocity.
    pub fn needed_motion(&self, response: &Response, t: usize) -> Split {
        if response.closed.is_some() {
            return self.motion(response, t);
        }
        let mut acceleration = Split::zeros(self.tails.n_lines(), 1);
        self.moved(response, t, 2, acceleration.col_mut(0));
        acceleration
    }

    /// Accelerations of column `t` at the sensors, without weights, the answer of a closed loop included.
    pub fn column(&self, at: &Prepared<'_>, response: &Response, t: usize, y: &mut Split) {
        if t >= self.n_modal() {
            let n_own = self.n_modal() + self.inner.len();
            (0..y.n_columns()).for_each(|s| y.col_mut(s).0.fill(0.0));
            (0..y.n_columns()).for_each(|s| y.col_mut(s).1.fill(0.0));
            if t < n_own {
                return response.push_back(&self.inner[t - self.n_modal()], y);
            }
            let sensor = at.record.picked_up.sensor[t - n_own];
            return update(y.col_mut(sensor), at.picked_up.col(t - n_own), |_, v| v);
        }
        let (m, motion) = (t / 2, self.motion(response, t));
        let Some(closed) = &response.closed else {
            return response.at_sensors(m, &motion.columns(2, 1), y);
        };
        let open = response.at_coordinates(m, -1.0, &motion);
        let extra = response.cut_off(at, closed, m, 1.0, &motion);
        response.at_sensors(m, &motion.columns(2, 1), y);
        response.feed_back(&open, y);
        response.push_back(&extra, y);
    }

    /// Adds to modal response and displacements of the coordinates what a closed loop answers to decays of these amplitudes.
    pub fn add_answer(
        &self,
        at: &Prepared<'_>,
        response: &Response,
        amplitudes: &[f64],
        (q, d): (&mut Split, &mut Split),
    ) {
        let Some(closed) = response.closed.as_ref().filter(|_| self.len() > 0) else { return };
        let mut moved = Split::zeros(at.n_lines(), response.n_w);
        let beyond = self.add_motion(at, response, amplitudes, &mut moved);
        let mut force = closed.force(&moved);
        (0..response.n_w).for_each(|i| update(force.col_mut(i), beyond.col(i), |f, b| f - b));
        response.answer(&force, q);
        (0..response.n_w).for_each(|i| update(d.col_mut(i), moved.col(i), |d, v| d + v));
    }

    /// Adds to the coordinates' displacements what decays of these amplitudes move them by, the law's answer included; gives
    /// the forces against the motion beyond the law's stiffness times these.
    pub fn add_motion(
        &self,
        at: &Prepared<'_>,
        response: &Response,
        amplitudes: &[f64],
        d: &mut Split,
    ) -> Split {
        let mut open = Split::zeros(at.n_lines(), response.n_w);
        let mut extra = open.clone();
        let add = |to: &mut Split, part: &Split| {
            (0..part.n_columns()).for_each(|i| update(to.col_mut(i), part.col(i), |a, b| a + b));
        };
        for (t, a) in amplitudes.iter().enumerate().take(self.n_modal()) {
            let motion = self.motion(response, t);
            add(&mut open, &response.at_coordinates(t / 2, *a, &motion));
            if let Some(closed) = &response.closed {
                add(&mut extra, &response.cut_off(at, closed, t / 2, *a, &motion));
            }
        }
        for (force, a) in self.inner.iter().zip(&amplitudes[self.n_modal()..]) {
            (0..response.n_w).for_each(|i| update(extra.col_mut(i), force.col(i), |e, f| e + f * *a));
        }
        match &response.closed {
            Some(closed) => {
                closed.add_compliance(-1.0, &extra, &mut open);
                add(d, &closed.closed(&open));
            }
            None => add(d, &open),
        }
        extra
    }
}

/// Forces (n_w columns) of the laws' inner states as they decay beyond a record's end, with their inverse prior
/// variances: a state is about as strong as the force of the law that moves.
fn inner_forces(
    at: &Prepared<'_>,
    response: &Response,
    hypothesis: &Hypothesis,
    x: &[f64],
    d: &Split,
) -> Result<Vec<(Split, f64)>, IdentifyError> {
    let mut all = Vec::new();
    let Some(closed) = response.closed.as_ref().filter(|_| !response.poles.is_empty()) else {
        return Ok(all);
    };
    let (n, n_w) = (at.n_lines(), response.n_w);
    for InnerPole { pole, pair, at: coordinates } in hypothesis.inner_poles(x)? {
        let mut tails = Split::zeros(n, 2);
        at.tail(pole, tails.col_mut(0));
        at.tail(pole.conj(), tails.col_mut(1));
        for &i in coordinates {
            let power = (0..n).map(|k| (closed.moving_part(i, k, at.record.s[k]) * d.get(i, k)).norm_sqr());
            let weight = MOST_HELD.min(1.0 / variance(at, power.sum()).max(f64::MIN_POSITIVE));
            for part in 0..if pair { 2 } else { 1 } {
                let mut force = Split::zeros(n, n_w);
                update2(force.col_mut(i), tails.col(0), tails.col(1), |_, own, mirrored| {
                    match (pair, part) {
                        (false, _) => own,
                        (true, 0) => own + mirrored,
                        (true, _) => Complex64::I * (own - mirrored),
                    }
                });
                all.push((force, weight));
            }
        }
    }
    Ok(all)
}

fn variance(at: &Prepared<'_>, power: f64) -> f64 {
    2.0 * power * at.record.thinning / (at.record.n_samples * at.record.n_samples)
}

/// How many times the power that each mode shows on the lines it has in all: one of those of the band, and above it, where
/// the forces reach it, as much more as a resonance has than its skirt under a force of even spectrum, π ω/(4 ζ) over the
/// integral of |ω² g|² (white noise through a mode).
fn ringing(at: &Prepared<'_>, response: &Response) -> Vec<f64> {
    let s = &at.record.s;
    let (lowest, highest) = s.iter().fold((f64::INFINITY, 0.0_f64), |(a, b), s| (a.min(s.im), b.max(s.im)));
    let apart = (highest - lowest) / (s.len().max(2) - 1) as f64;
    let of_mode = |pole: &Complex64| {
        let (omega, decay) = (pole.norm(), -pole.re);
        if omega <= highest || omega > at.record.driven_to || apart <= 0.0 || decay <= 0.0 {
            return 1.0;
        }
        let skirt: f64 =
            s.iter().map(|s| (s * s / (s * s + 2.0 * decay * s + omega * omega)).norm_sqr()).sum();
        (0.25 * PI * omega * omega / decay / (apart * skirt).max(f64::MIN_POSITIVE)).max(1.0)
    };
    response.poles.iter().map(of_mode).collect()
}

/// Inverse prior variances of the decay amplitudes: a decay is about as strong as the mode's own answer `q` to the force.
/// Without that, a free force and a decay of the mode it drives could grow against each other without limit.
fn decay_ridge(at: &Prepared<'_>, ringing: &[f64], q: &Split) -> Vec<f64> {
    let (re, im) = at.s2.col(0);
    let factor: Vec<f64> = re.iter().zip(im).map(|(a, b)| a * a + b * b).collect();
    let power: Vec<f64> = (ringing.iter().enumerate())
        .map(|(m, times)| {
            let (re, im) = q.col(m);
            let sum: f64 = factor.iter().zip(re.iter().zip(im)).map(|(f, (a, b))| f * (a * a + b * b)).sum();
            variance(at, sum * times)
        })
        .collect();
    let floor = DECAY_FLOOR * power.iter().fold(f64::MIN_POSITIVE, |a, b| a.max(*b));
    power.iter().flat_map(|p| [MOST_HELD.min(1.0 / p.max(floor)); 2]).collect()
}

/// Cholesky factor of the decays' normal equations.
pub(crate) fn decay_factor(gram: &Dense, ridge: &[f64]) -> Option<Dense> {
    let n_t = ridge.len();
    let mut a = Dense::zeros(n_t, n_t);
    for j in 0..n_t {
        a.col_mut(j).copy_from_slice(&gram.col(j)[..n_t]);
        a[(j, j)] += ridge[j] + f64::MIN_POSITIVE;
    }
    a.cholesky().ok()
}

/// Best decay amplitudes and the sum of squares they leave, their prior included; `gram` is over [decays, residual] and
/// `factor` that of its decays.
pub(crate) fn eliminate(gram: &Dense, factor: Option<&Dense>, n_t: usize) -> (Vec<f64>, f64) {
    let total = gram[(n_t, n_t)];
    if n_t == 0 {
        return (Vec::new(), total);
    }
    let Some(l) = factor else { return (vec![0.0; n_t], f64::NAN) };
    let right: Vec<f64> = (0..n_t).map(|t| gram[(t, n_t)]).collect();
    let mut c = Dense::from_vec(n_t, 1, right.clone());
    l.solve_lower_in_place(false, &mut c);
    l.solve_lower_in_place(true, &mut c);
    let c = c.into_vec();
    let explained: f64 = c.iter().zip(&right).map(|(c, g)| c * g).sum();
    (c, (total - explained).max(0.0))
}
