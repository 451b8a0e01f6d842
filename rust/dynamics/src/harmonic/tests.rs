//! Against closed forms, against the time simulation, and against scaling laws.

use super::aft::Aft;
use super::{Branch, Ended, HarmonicError, Options, Steady, branch, branches};
use crate::laws::{Joint, Kind, Law, LawError};
use crate::simulate::{ModalModel, Output, Run, simulate};
use num_complex::Complex64;
use std::f64::consts::TAU;

const ONE: ModalModel<'_> = ModalModel {
    omega: &[1.0],
    zeta: &[0.01],
    phi_in: &[1.0],
    phi_out: &[1.0],
    w: &[1.0],
    residual_compliance: None,
};
/// Two modes, which the coordinate and the output see differently.
const TWO: ModalModel<'_> = ModalModel {
    omega: &[60.0, 210.0],
    zeta: &[0.03, 0.02],
    phi_in: &[0.8, 0.5],
    phi_out: &[1.0, -0.6],
    w: &[0.9, 0.7],
    residual_compliance: None,
};

fn law(kind: Kind, p: &[f64]) -> Vec<Law> {
    vec![Law::new(kind, p).unwrap()]
}

fn forced<'a>(model: ModalModel<'a>, force: &'a [Complex64], band: (f64, f64)) -> Steady<'a> {
    Steady { model, force, band }
}

const UNIT: [Complex64; 1] = [Complex64::ONE];

#[test]
fn a_linear_law_gives_the_receptance() {
    let (k, c) = (900.0, 4.0);
    let laws = vec![Law::new(Kind::Spring, &[k]).unwrap(), Law::new(Kind::Dashpot, &[c]).unwrap()];
    let found = branch(&forced(TWO, &UNIT, (20.0, 300.0)), &laws, 2.5, &Options::default()).unwrap();
    assert_eq!((found.ended, found.folds.len()), (Ended::Upper, 0));
    for (i, w) in found.omega.iter().enumerate() {
        let g = |j: usize| {
            Complex64::new(TWO.omega[j].powi(2) - w * w, 2.0 * TWO.zeta[j] * TWO.omega[j] * w).inv()
        };
        let sum = |a: &[f64], b: &[f64]| g(0) * (a[0] * b[0]) + g(1) * (a[1] * b[1]);
        let kappa = Complex64::new(k, c * w);
        let d = 2.5 * sum(TWO.w, TWO.phi_in) / (1.0 + sum(TWO.w, TWO.w) * kappa);
        let y = 2.5 * sum(TWO.phi_out, TWO.phi_in) - sum(TWO.phi_out, TWO.w) * kappa * d;
        assert!((found.d[8 * i + 1] - d).norm() < 1e-9 * d.norm());
        assert!((found.y[8 * i + 1] - y).norm() < 1e-9 * (y.norm() + d.norm()));
        assert!((found.f[8 * i + 1] - kappa * d).norm() < 1e-9 * (kappa * d).norm());
    }
}

fn duffing(harmonics: usize, level: f64, k3: f64) -> Branch {
    let options = Options { harmonics, ..Options::default() };
    branch(&forced(ONE, &UNIT, (0.6, 2.5)), &law(Kind::Cubic, &[k3]), level, &options).unwrap()
}

#[test]
fn one_harmonic_of_a_duffing_oscillator_is_the_closed_form_with_its_turning_points() {
    let (level, k3) = (0.05, 0.8);
    let found = duffing(1, level, k3);
    assert_eq!(found.ended, Ended::Upper);
    for (w, d) in found.omega.iter().zip(found.d.chunks(2)) {
        let (a, spring) = (d[1].norm(), 0.75 * k3 * d[1].norm_sqr());
        let (elastic, lost) = (1.0 - w * w + spring, 0.02 * w);
        assert!((elastic.hypot(lost) * a / level - 1.0).abs() < 1e-8);
    }
    // where the response curve has a vertical tangent: (D + s)(D + 3 s) + (2 zeta w)^2 = 0 with s = 3/4 k3 A^2
    assert_eq!(found.folds.iter().map(|fold| fold.upper).collect::<Vec<_>>(), [true, false]);
    for fold in &found.folds {
        let (w, s) = (found.omega[fold.point], 0.75 * k3 * found.d[2 * fold.point + 1].norm_sqr());
        let delta = 1.0 - w * w;
        let left = (delta + s) * (delta + 3.0 * s) + (0.02 * w).powi(2);
        assert!(left.abs() < 1e-8, "{left} at {w}");
    }
    // the upper one at the end of the backbone: 2 zeta w A = level
    let top = found.folds[0].point;
    assert!((0.02 * found.omega[top] * found.d[2 * top + 1].norm() / level - 1.0).abs() < 1e-3);
}

#[test]
fn more_harmonics_change_the_turning_point_by_what_the_third_one_is() {
    let [one, many] = [1, 7].map(|h| duffing(h, 0.05, 0.8));
    let at = |b: &Branch| b.omega[b.folds[0].point];
    let (third, first) =
        (many.d[8 * many.folds[0].point + 3].norm(), many.d[8 * many.folds[0].point + 1].norm());
    let change = (at(&many) / at(&one) - 1.0).abs();
    assert!(change > 1e-5 && change < third / first, "{change} {}", third / first);
    let even = many.d[8 * many.folds[0].point + 2].norm() + many.d[8 * many.folds[0].point].norm();
    assert!(even < 1e-9 * first);
}

#[test]
fn motion_grows_with_level_where_the_cubic_falls_with_its_square() {
    let sets = [law(Kind::Cubic, &[0.8]), law(Kind::Cubic, &[0.8 / 9.0])];
    let found = branches(&forced(ONE, &UNIT, (0.6, 2.5)), &sets, &[0.02, 0.06], &Options::default()).unwrap();
    let (small, large) = (&found[0], &found[3]);
    assert_eq!(small.omega.len(), large.omega.len());
    for (a, b) in small.folds.iter().zip(&large.folds) {
        assert!((small.omega[a.point] / large.omega[b.point] - 1.0).abs() < 1e-9);
        let ratio = large.d[8 * b.point + 1].norm() / small.d[8 * a.point + 1].norm();
        assert!((ratio - 3.0).abs() < 1e-6, "{ratio}");
    }
    // and not where it does not
    assert!((found[1].omega[found[1].folds[0].point] / small.omega[small.folds[0].point] - 1.0).abs() > 0.1);
}

/// Harmonics of the coordinate in the last of `periods` periods of a simulation from rest.
fn simulated(laws: &[Law], w: f64, level: f64, periods: usize) -> Vec<Complex64> {
    let (n, substeps) = (256, 8);
    let dt = TAU / w / n as f64;
    // what is interpolated linearly between samples has lost (w dt)^2 / 12 of its amplitude
    let raised = level / (0.5 * w * dt).sin().powi(2) * (0.5 * w * dt).powi(2);
    let u: Vec<f64> = (0..n * periods).map(|i| raised * (TAU * i as f64 / n as f64).cos()).collect();
    let run = Run { u: &u, n: u.len(), dt, substeps, stride: 1, decimate: 1, output: Output::Displacement };
    let done = simulate(&TWO, &[laws.to_vec()], &run).unwrap();
    let last = &done.d[n * (periods - 1)..];
    (0..4)
        .map(|h| {
            let turn = |k: usize| Complex64::from_polar(1.0, -TAU * (h * k) as f64 / n as f64);
            let sum: Complex64 = last.iter().enumerate().map(|(k, d)| turn(k) * d).sum();
            sum * (if h == 0 { 1.0 } else { 2.0 } / n as f64)
        })
        .collect()
}

/// The balance at the ends of bands equals the simulated steady state to a thousandth of the motion.
fn compare(laws: &[Law], level: f64, ends: &[f64]) {
    let options = Options { harmonics: 15, samples: 512, ..Options::default() };
    let found = branch(&forced(TWO, &UNIT, (ends[0], ends[1])), laws, level, &options).unwrap();
    assert_eq!(found.ended, Ended::Upper);
    for (i, w) in [(0, ends[0]), (found.omega.len() - 1, ends[1])] {
        assert_eq!(found.omega[i], w);
        let time = simulated(laws, w, level, 120);
        for (h, time) in time.iter().enumerate() {
            let error = (found.d[16 * i + h] - time).norm() / time_size(&found, i);
            assert!(error < 1e-3, "{:?} at {w}, harmonic {h}: {error}", laws[0].kind());
        }
    }
}

fn time_size(found: &Branch, i: usize) -> f64 {
    found.d[16 * i..16 * (i + 1)].iter().map(|d| d.norm_sqr()).sum::<f64>().sqrt()
}

#[test]
fn smooth_laws_follow_the_simulation() {
    compare(&law(Kind::Cubic, &[4e5]), 60.0, &[35.0, 62.0]);
    compare(&law(Kind::QuadraticDamping, &[30.0]), 60.0, &[45.0, 62.0]);
    // an even force shifts the mean
    compare(&law(Kind::QuadraticStiffness, &[3e4]), 20.0, &[30.0, 50.0]);
}

#[test]
fn laws_with_corners_follow_the_simulation() {
    compare(&law(Kind::Clearance, &[2e3, 5e-3, 2.0]), 30.0, &[40.0, 62.0]);
    compare(&law(Kind::Clearance, &[800.0, 5e-3, 1.0]), 30.0, &[40.0, 80.0]);
    compare(&law(Kind::Coulomb, &[8.0, 3e3]), 30.0, &[45.0, 62.0]);
}

#[test]
fn smooth_hysteresis_follows_the_simulation() {
    compare(&law(Kind::BoucWen, &[2e3, 0.3, 1.5, 2e3, 5e2]), 40.0, &[45.0, 65.0]);
}

#[test]
fn derivatives_of_a_hysteretic_force_are_its_differences() {
    let (aft, omega) = (Aft::new(3, 64, 2), 50.0);
    let laws = law(Kind::BoucWen, &[2e3, 0.3, 1.5, 2e3, 5e2]);
    let joint = Joint::new(&laws, aft.step(omega)).unwrap();
    let x = [1e-3, 0.02, 0.004, -3e-3, 1e-3, 2e-3, -1e-3];
    let at = aft.forces(&joint, omega, &x, true);
    for m in 0..7 {
        let moved = |by: f64| {
            let mut x = x;
            x[m] += by;
            aft.forces(&joint, omega, &x, false).f
        };
        let (up, down) = (moved(1e-7), moved(-1e-7));
        for i in 0..7 {
            let expected = (up[i] - down[i]) / 2e-7;
            assert!(
                (at.df[7 * i + m] - expected).abs() < 2e-3 * 2e3,
                "{i} {m} {} {expected}",
                at.df[7 * i + m]
            );
        }
    }
}

#[test]
fn a_free_body_held_by_the_law_alone_has_its_mean() {
    // m x'' + k3 (x)^3 = u cos: without a spring of its own; and a body that a spring holds from the frequency side
    let free = ModalModel { omega: &[0.0], zeta: &[0.0], ..ONE };
    let laws = vec![Law::new(Kind::Spring, &[1.0]).unwrap(), Law::new(Kind::Dashpot, &[0.02]).unwrap()];
    let both: Vec<Law> = laws.into_iter().chain(law(Kind::Cubic, &[0.8])).collect();
    let options = Options { harmonics: 1, ..Options::default() };
    let found = branch(&forced(free, &UNIT, (0.6, 2.5)), &both, 0.05, &options).unwrap();
    let fixed = duffing(1, 0.05, 0.8);
    for (a, b) in found.folds.iter().zip(&fixed.folds) {
        assert!((found.omega[a.point] / fixed.omega[b.point] - 1.0).abs() < 1e-7);
    }
    assert_eq!(found.folds.len(), 2);
    assert!((found.y[1] - found.d[1]).norm() < 1e-9 * found.d[1].norm());
}

#[test]
fn what_makes_no_sense_is_refused() {
    let cubic = law(Kind::Cubic, &[1.0]);
    let run = |band, level, options: &Options| branch(&forced(ONE, &UNIT, band), &cubic, level, options);
    let plain = Options::default();
    for found in [
        run((0.0, 1.0), 1.0, &plain),
        run((2.0, 1.0), 1.0, &plain),
        run((0.5, 1.0), 0.0, &plain),
        run((0.5, 1.0), 1.0, &Options { samples: 14, ..plain }),
        run((0.5, 1.0), 1.0, &Options { harmonics: 0, ..plain }),
        run((0.5, 1.0), 1.0, &Options { max_step: f64::NAN, ..plain }),
    ] {
        assert!(matches!(found, Err(HarmonicError::Value { .. })), "{found:?}");
    }
    let two = [Complex64::ONE; 2];
    assert!(matches!(
        branch(&forced(ONE, &two, (0.5, 1.0)), &cubic, 1.0, &plain),
        Err(HarmonicError::Model(_))
    ));
    // what has no force history still has a dynamic stiffness
    let structural = law(Kind::Structural, &[1.0, 0.1]);
    assert!(branch(&forced(ONE, &UNIT, (0.5, 1.0)), &structural, 1.0, &plain).is_ok());
    assert!(!matches!(Law::new(Kind::Cubic, &[]), Err(LawError::NotLinear { .. })));
}

#[test]
fn a_branch_that_is_cut_short_says_so() {
    let options = Options { max_points: 10, ..Options::default() };
    let found = branch(&forced(ONE, &UNIT, (0.6, 2.5)), &law(Kind::Cubic, &[0.8]), 0.05, &options).unwrap();
    assert_eq!((found.ended, found.omega.len()), (Ended::MaxPoints, 10));
    let options = Options { max_folds: 1, ..Options::default() };
    let found = branch(&forced(ONE, &UNIT, (0.6, 2.5)), &law(Kind::Cubic, &[0.8]), 0.05, &options).unwrap();
    assert_eq!((found.ended, found.folds.len()), (Ended::MaxFolds, 1));
    assert_eq!(found.folds[0].point + 1, found.omega.len());
    assert_eq!(found.omega[found.folds[0].point], duffing(7, 0.05, 0.8).omega[found.folds[0].point]);
}
