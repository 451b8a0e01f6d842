//! Every law: derivatives against differences, symmetry, and what its physics says about closed loops.

use super::law::Slopes;
use super::*;
use num_complex::Complex64;

/// A law with ordinary parameters, and an amplitude (m) and rate (rad/s) at which it does something.
fn samples() -> Vec<(Law, f64, f64)> {
    let of = |kind, p: &[f64], amplitude, omega| (Law::new(kind, p).unwrap(), amplitude, omega);
    vec![
        of(Kind::Spring, &[3e4], 1e-3, 50.0),
        of(Kind::Mass, &[0.7], 1e-3, 50.0),
        of(Kind::Dashpot, &[40.0], 1e-3, 50.0),
        of(Kind::Viscoelastic, &[1e4, 3e4, 0.02], 1e-3, 50.0),
        of(Kind::Absorber, &[0.3, 900.0, 1.5], 1e-3, 50.0),
        of(Kind::Linear, &[-2e3, 4.0, 0.1], 1e-3, 50.0),
        of(Kind::Cubic, &[4e9], 1e-3, 50.0),
        of(Kind::QuadraticStiffness, &[4e6], 1e-3, 50.0),
        of(Kind::Clearance, &[5e4, 4e-4, 1.0], 1e-3, 50.0),
        of(Kind::Clearance, &[5e4, 4e-4, -1.0], 1e-3, 50.0),
        of(Kind::Clearance, &[5e4, 4e-4, 2.0], 1e-3, 50.0),
        of(Kind::Bilinear, &[5e4, 2e4], 1e-3, 50.0),
        of(Kind::Coulomb, &[8.0, 3e4], 1e-3, 50.0),
        of(Kind::BoucWen, &[3e4, 0.1, 1.4, 1.8e4, 0.7e4], 1e-3, 50.0),
        of(Kind::BoucWen, &[3e4, 0.0, 1.0, 2e3, -1e3], 1e-3, 50.0),
        of(Kind::QuadraticDamping, &[900.0], 1e-3, 50.0),
        of(Kind::Maxwell2, &[1e4, 3e4, 0.02, 2e4, 0.1], 1e-3, 50.0),
        of(Kind::Maxwell3, &[1e4, 3e4, 0.02, 2e4, 0.1, 1e4, 0.004], 1e-3, 50.0),
        of(Kind::Fractional, &[1e4, 900.0, 0.4], 1e-3, 50.0),
        of(Kind::BoxSpectrum, &[2e3, 50.0], 1e-3, 50.0),
        of(Kind::Saturating, &[3e4, 4e-4], 1e-3, 50.0),
        of(Kind::Preloaded, &[3e4, 12.0, 1.0], 1e-3, 50.0),
        of(Kind::Preloaded, &[3e4, 12.0, -1.0], 1e-3, 50.0),
        of(Kind::Hertz, &[1e6, 3e-4, 1.0], 1e-3, 50.0),
        of(Kind::Hertz, &[1e6, 0.0, 2.0], 1e-3, 50.0),
        of(Kind::PlayFriction, &[8.0, 3e4, 2e-4], 1e-3, 50.0),
        of(Kind::SlidingFriction, &[8.0, 0.02], 1e-3, 50.0),
        of(Kind::CubicDamping, &[2e4], 1e-3, 50.0),
        of(Kind::DisplacementDamping, &[20.0, 3e6], 1e-3, 50.0),
        of(Kind::Iwan, &[4e4, 2e4, 1e4, 9e3, 8e3, 7e3, 8e-4], 1e-3, 50.0),
        // a hardening curve over d, one that grows over v; both odd, as the tests below ask for
        of(
            Kind::FreeForm,
            &[-50.0, -30.0, -14.0, -5.0, 5.0, 14.0, 30.0, 50.0, -6.0, -3.0, -1.0, 1.0, 3.0, 6.0, 9e-4, 0.04],
            1e-3,
            50.0,
        ),
    ]
}

fn motion(amplitude: f64, omega: f64, t: f64) -> Motion<f64> {
    let (sin, cos) = (omega * t).sin_cos();
    Motion { d: amplitude * sin, v: amplitude * omega * cos, a: -amplitude * omega * omega * sin }
}

/// States and forces along a sine; the force and energy at every step.
fn drive(
    law: &PreparedLaw,
    amplitude: f64,
    omega: f64,
    dt: f64,
    n: usize,
) -> Vec<(Motion<f64>, State<f64>, f64)> {
    let mut state = [0.0; MAX_STATE];
    (0..=n)
        .map(|i| {
            let x = motion(amplitude, omega, i as f64 * dt);
            let (f, new) = law.force(x, &state);
            state = new;
            (x, state, f)
        })
        .collect()
}

/// Asserts that a derivative is the central difference of a function of one number, to a share of `scale`.
macro_rules! assert_derivative {
    ($what:expr, $exact:expr, $x:expr, $h:expr, $scale:expr, $function:expr) => {{
        let (x, h): (f64, f64) = ($x, $h);
        let difference = ($function(x + h) - $function(x - h)) / (2.0 * h);
        // central differences of smooth pieces: h^2 truncation 1e-10 plus rounding 1e-16 / 1e-5
        let (exact, scale): (f64, f64) = ($exact, $scale);
        assert!(
            (exact - difference).abs() <= 2e-6 * (exact.abs() + scale),
            "{}: {exact} against {difference}",
            $what
        );
    }};
}

/// Force, its slopes, and those of every new state variable.
fn all_slopes(law: &PreparedLaw, x: Motion<f64>, state: &State<f64>) -> (f64, Slopes, Vec<Slopes>) {
    let (mut force, mut states) = ([0.0; MANY], vec![[0.0; MANY]; law.n_state()]);
    law.linearise(x, state, &mut force, &mut states);
    (law.force(x, state).0, force, states)
}

#[test]
fn every_derivative_is_its_difference() {
    let dt = 1.3e-3;
    for (law, amplitude, omega) in samples() {
        let prepared = law.prepare(dt).unwrap();
        let name = law.kind().name();
        let path = drive(&prepared, amplitude, omega, dt, 90);
        for i in [3, 17, 29, 44, 61, 83] {
            let (state, x) = (path[i].1, path[i + 1].0);
            let (f, slopes_of_f, _) = all_slopes(&prepared, x, &state);
            let mut tangent_state = [0.0; MAX_STATE];
            let (tangent_force, slopes) = prepared.tangent(x, &state, &mut tangent_state);
            let (plain, new) = prepared.force(x, &state);
            // Rust may contract products in one of the three and not in the others
            assert!((f - tangent_force).abs() <= 1e-12 * f.abs() && (f - plain).abs() <= 1e-12 * f.abs());
            for (a, b) in tangent_state.iter().zip(new) {
                assert!((a - b).abs() <= 1e-12 * b.abs());
            }
            let scale = path.iter().map(|(_, _, f)| f.abs()).fold(0.0, f64::max);
            let sizes = [amplitude, amplitude * omega, amplitude * omega * omega];
            for (axis, size) in sizes.into_iter().enumerate() {
                let shifted = |value: f64| {
                    let mut x = x;
                    *[&mut x.d, &mut x.v, &mut x.a][axis] = value;
                    prepared.force(x, &state)
                };
                let at = [x.d, x.v, x.a][axis];
                // the slope of a law as it is differs from that of its integration by the error of this
                let close = if law.kind() == Kind::BoucWen { 1e-4 } else { 1e-12 };
                assert!((slopes[axis] - slopes_of_f[axis]).abs() <= close * scale / size);
                assert_derivative!(
                    format!("{name} df/d{}", ["d", "v", "a"][axis]),
                    slopes_of_f[axis],
                    at,
                    1e-5 * size,
                    scale / size,
                    |value| shifted(value).0
                );
            }
            for k in 0..law.kind().n_state() {
                let size = path.iter().map(|(_, s, _)| s[k].abs()).fold(0.0, f64::max);
                let shifted = |value: f64| {
                    let mut state = state;
                    state[k] = value;
                    prepared.force(x, &state)
                };
                let what = format!("{name} df/ds{k}");
                assert_derivative!(what, slopes_of_f[3 + k], state[k], 1e-5 * size, scale / size, |s| {
                    shifted(s).0
                });
            }
            check_parameters(&law, dt, x, &state, scale);
        }
    }
}

/// Derivatives of the force and of the new state over each continuous parameter.
fn check_parameters(law: &Law, dt: f64, x: Motion<f64>, state: &State<f64>, scale: f64) {
    let prepared = law.prepare(dt).unwrap();
    let (_, f, slopes) = all_slopes(&prepared, x, state);
    let (_, new) = prepared.force(x, state);
    for (j, parameter) in law.kind().parameters().iter().enumerate() {
        if matches!(parameter.domain, Domain::Sides | Domain::Side)
            || (parameter.domain == Domain::NonNegative && law.values()[j] == 0.0)
            || (parameter.domain == Domain::Fraction && law.values()[j] == 0.0)
            || (parameter.domain == Domain::AtLeastOne && law.values()[j] == 1.0)
        {
            continue;
        }
        let value = law.values()[j];
        let at = |value: f64| {
            let mut p = law.values().to_vec();
            p[j] = value;
            Law::new(law.kind(), &p).unwrap().prepare(dt).unwrap().force(x, state)
        };
        let what = format!("{} d/d{}", law.kind().name(), parameter.name);
        let seed = 3 + law.kind().n_state() + j;
        assert_derivative!(what, f[seed], value, 1e-5 * value.abs(), scale / value.abs(), |p| at(p).0);
        for k in 0..law.kind().n_state() {
            let size = new[k].abs().max(state[k].abs()) / value.abs();
            assert_derivative!(what, slopes[k][seed], value, 1e-5 * value.abs(), size, |p| at(p).1[k]);
        }
    }
}

#[test]
fn symmetric_laws_are_odd() {
    let dt = 1.3e-3;
    for (law, amplitude, omega) in samples() {
        let even = match law.kind() {
            Kind::QuadraticStiffness | Kind::Bilinear | Kind::Preloaded => true,
            Kind::Clearance | Kind::Hertz => law.values()[2] != 2.0,
            _ => false,
        };
        let prepared = law.prepare(dt).unwrap();
        let there = drive(&prepared, amplitude, omega, dt, 200);
        let back = drive(&prepared, -amplitude, omega, dt, 200);
        let scale = there.iter().map(|x| x.2.abs()).fold(0.0, f64::max);
        // a spline is evaluated from the left end of its interval, so the two sides round differently
        let odd = there.iter().zip(&back).all(|(x, y)| (x.2 + y.2).abs() <= 1e-12 * scale);
        assert_eq!(odd, !even, "{}", law.kind().name());
    }
}

#[test]
fn closed_loops_conserve_or_dissipate() {
    // the last of three periods, 8000 steps each: trapezoid work is good to 1e-6 of the energy that goes round
    let n = 8000;
    for (law, amplitude, omega) in samples() {
        let dt = std::f64::consts::TAU / omega / n as f64;
        let prepared = law.prepare(dt).unwrap();
        let path = drive(&prepared, amplitude, omega, dt, 40 * n);
        let last = &path[39 * n..];
        let work: f64 = last.windows(2).map(|w| 0.5 * (w[0].2 + w[1].2) * (w[1].0.d - w[0].0.d)).sum();
        let scale = path.iter().map(|(_, _, f)| f.abs()).fold(0.0, f64::max) * amplitude;
        let name = law.kind().name();
        match law.kind() {
            Kind::Spring
            | Kind::Mass
            | Kind::Cubic
            | Kind::QuadraticStiffness
            | Kind::Clearance
            | Kind::Saturating
            | Kind::Preloaded
            | Kind::Hertz
            | Kind::Bilinear => {
                assert!(work.abs() < 1e-6 * scale, "{name} conserves: {work} of {scale}");
            }
            _ => assert!(work > 1e-2 * scale, "{name} dissipates: {work} of {scale}"),
        }
    }
}

#[test]
fn dissipation_never_runs_backwards() {
    // along a motion of two unrelated frequencies: work done on the law exceeds what it stores, at every step
    let dt = 2e-5;
    for (law, amplitude, omega) in samples() {
        if law.kind() == Kind::Linear {
            continue; // with any sign allowed it stands for a correction, not for a passive part
        }
        let prepared = law.prepare(dt).unwrap();
        let (mut state, mut work) = ([0.0; MAX_STATE], 0.0);
        let mut before: Option<(Motion<f64>, f64)> = None;
        let (mut floor, mut largest, mut start) = (0.0_f64, 0.0_f64, None);
        for i in 0..40_000 {
            let t = f64::from(i) * dt;
            let (one, two) = (motion(0.7 * amplitude, omega, t), motion(0.3 * amplitude, 2.7 * omega, t));
            let x = Motion { d: one.d + two.d, v: one.v + two.v, a: one.a + two.a };
            let (f, new) = prepared.force(x, &state);
            state = new;
            if let Some((last, force)) = before {
                work += 0.5 * (f + force) * (x.d - last.d);
            }
            before = Some((x, f));
            let Some(stored) = prepared.stored(x, &state) else { continue };
            let dissipated = work - (stored - *start.get_or_insert(stored));
            largest = largest.max(work.abs()).max(stored);
            floor = floor.min(dissipated);
        }
        // trapezoid error of the work, second order in omega dt = 3e-3
        assert!(floor >= -2e-4 * largest, "{}: {floor} of {largest}", law.kind().name());
    }
}

#[test]
fn dynamic_stiffness_is_the_response_to_a_growing_oscillation() {
    // d = Re exp(s t) with Re s > 0 from far back forgets its start: f -> Re kappa exp(s t)
    let s = Complex64::new(8.0, 60.0);
    let dt = 1e-5;
    for (law, _, _) in samples().into_iter().filter(|(law, _, _)| law.kind().is_linear()) {
        let (kappa, _) = law.dynamic_stiffness(s).unwrap();
        let n = 200_000;
        let times = (0..=n).map(|i| f64::from(i - n) * dt);
        let base: Vec<Complex64> = times.map(|t| (s * t).exp()).collect();
        let part = |power: i32| base.iter().map(|e| (e * s.powi(power)).re).collect::<Vec<_>>();
        let f = law.prepare(dt).unwrap().history(&part(0), &part(1), &part(2));
        let (last, exact) = (f[f.len() - 1], kappa.re);
        // the linear interpolation of the motion errs by (|s| dt)^2 / 12, sums of exponentials by 0.5 %
        let summed = matches!(law.kind(), Kind::Fractional | Kind::BoxSpectrum);
        let tolerance = if summed { 5e-3 } else { 1e-6 };
        assert!((last - exact).abs() < tolerance * kappa.norm(), "{}: {last} {exact}", law.kind().name());
    }
}

#[test]
fn dynamic_stiffness_derivatives_are_differences() {
    let structural = Law::new(Kind::Structural, &[2e4, 0.07]).unwrap();
    let linear = samples().into_iter().map(|(law, _, _)| law).filter(|law| law.kind().is_linear());
    for law in linear.chain([structural]) {
        for s in [Complex64::new(0.0, 70.0), Complex64::new(-3.0, 20.0), Complex64::new(5.0, -400.0)] {
            let (kappa, slopes) = law.dynamic_stiffness(s).unwrap();
            for (j, value) in law.values().iter().enumerate() {
                let at = |value: f64| {
                    let mut p = law.values().to_vec();
                    p[j] = value;
                    Law::new(law.kind(), &p).unwrap().dynamic_stiffness(s).unwrap().0
                };
                let what = format!("{} dkappa/dp{j}", law.kind().name());
                let (h, scale) = (1e-5 * value.abs(), kappa.norm() / value.abs());
                assert_derivative!(what, slopes[j].re, *value, h, scale, |p| at(p).re);
                assert_derivative!(what, slopes[j].im, *value, h, scale, |p| at(p).im);
            }
        }
    }
}

#[test]
fn hysteresis_does_not_depend_on_rate() {
    let path: Vec<f64> = (0..4000).map(|i| 1e-3 * (f64::from(i) * 0.011).sin()).collect();
    let still = vec![0.0; path.len()];
    for (law, _, _) in samples() {
        if matches!(law.kind(), Kind::Coulomb | Kind::BoucWen | Kind::PlayFriction | Kind::Iwan) {
            let slow = law.prepare(1.0).unwrap().history(&path, &still, &still);
            let fast = law.prepare(1e-4).unwrap().history(&path, &still, &still);
            assert_eq!(slow, fast);
        }
    }
}

#[test]
fn bouc_wen_with_n_one_is_its_exponential() {
    // loading from rest with n = 1: z = (1 - exp(-(beta + gamma) d)) / (beta + gamma)
    let (k, beta, gamma) = (2e4, 3e3, 1e3);
    let law = Law::new(Kind::BoucWen, &[k, 0.0, 1.0, beta, gamma]).unwrap().prepare(1e-3).unwrap();
    for d in [1e-5, 1e-4, 1e-3, 1e-2, 1.0] {
        let f = law.history(&[d], &[0.0], &[0.0])[0];
        let exact = k * (1.0 - (-(beta + gamma) * d).exp()) / (beta + gamma);
        assert!((f - exact).abs() < 1e-3 * exact, "{d}: {f} {exact}");
    }
}

/// Relative error of a law's stiffness in time at s = i omega, `share` of pi/dt, beside its own as a function of s.
fn error_in_time(law: &Law, dt: f64, share: f64) -> f64 {
    let s = Complex64::new(0.0, share * std::f64::consts::PI / dt);
    // a growing oscillation as above, so that the history before the start does not matter
    let growing = s + 0.05 * s.norm();
    let n = (200.0 / (growing.re * dt)).min(4e5) as i32;
    let times = (0..=n).map(|i| f64::from(i - n) * dt);
    let base: Vec<Complex64> = times.map(|t| (growing * t).exp()).collect();
    let part = |power: i32, turn: Complex64| {
        base.iter().map(|e| (turn * e * growing.powi(power)).re).collect::<Vec<_>>()
    };
    let prepared = law.prepare(dt).unwrap();
    let mut found = [0.0; 2];
    for (turn, out) in [Complex64::new(1.0, 0.0), Complex64::new(0.0, -1.0)].iter().zip(&mut found) {
        let f = prepared.history(&part(0, *turn), &part(1, *turn), &part(2, *turn));
        *out = f[f.len() - 1];
    }
    let exact = law.dynamic_stiffness(growing).unwrap().0;
    (Complex64::new(found[0], found[1]) - exact).norm() / exact.norm()
}

#[test]
fn sums_of_exponentials_follow_their_laws_in_the_band() {
    let dt = 1e-4;
    let powers = [0.1, 0.3, 0.5, 0.7, 0.9].map(|alpha| Law::new(Kind::Fractional, &[0.0, 1.0, alpha]));
    // loss factors of 0.1, 0.4 and 1 at a hundredth of the Nyquist frequency, and a box that begins there
    let boxes = [2e4, 0.16, 1.5e-2, 3e-3].map(|tau| Law::new(Kind::BoxSpectrum, &[1.0, tau]));
    for law in powers.into_iter().chain(boxes).map(Result::unwrap) {
        for share in [2e-4, 1e-3, 1e-2, 5e-2, 0.1] {
            let error = error_in_time(&law, dt, share);
            // linear interpolation of the motion errs by (omega dt)^2 / 12 of the fast branches
            let interpolation = (share * std::f64::consts::PI).powi(2) / 12.0;
            assert!(error < 5e-3 + interpolation, "{law:?}, omega {share} of Nyquist: {error}");
        }
    }
}

#[test]
fn a_springpot_at_its_ends_is_a_spring_and_a_dashpot() {
    let x = Motion { d: 2e-3, v: -0.3, a: 7.0 };
    for (alpha, expected) in [(0.0, 50.0 * 2e-3), (1.0, 50.0 * -0.3)] {
        let law = Law::new(Kind::Fractional, &[0.0, 50.0, alpha]).unwrap().prepare(1e-4).unwrap();
        let (f, _) = law.force(x, &[0.0; MAX_STATE]);
        assert!((f - expected).abs() < 1e-12 * f.abs(), "{alpha}: {f}");
    }
}

#[test]
fn play_without_gap_and_iwan_of_one_element_are_jenkins_elements() {
    let path: Vec<f64> =
        (0..3000).map(|i| 1e-3 * (f64::from(i) * 0.013).sin() * f64::from(i) / 3e3).collect();
    let still = vec![0.0; path.len()];
    let history =
        |kind, p: &[f64]| Law::new(kind, p).unwrap().prepare(1e-3).unwrap().history(&path, &still, &still);
    let jenkins = history(Kind::Coulomb, &[6.0, 3e4]);
    let iwan = history(Kind::Iwan, &[0.0, 0.0, 0.0, 0.0, 0.0, 3e4, 2e-4]);
    for other in [history(Kind::PlayFriction, &[6.0, 3e4, 0.0]), iwan] {
        for (x, y) in jenkins.iter().zip(&other) {
            assert!((x - y).abs() < 1e-9 * 6.0, "{x} {y}");
        }
    }
}

#[test]
fn play_is_free_over_twice_its_gap_after_a_reversal() {
    let law = Law::new(Kind::PlayFriction, &[6.0, 3e4, 2e-4]).unwrap().prepare(1.0).unwrap();
    // slips to 1 mm, turns: 0.2 mm unload the spring, 0.4 mm of nothing, 0.2 mm load it again
    let path: Vec<f64> = [0.0, 1.0, 0.9, 0.8, 0.6, 0.4, 0.3, 0.2, 0.0].iter().map(|d| d * 1e-3).collect();
    let still = vec![0.0; path.len()];
    let f = law.history(&path, &still, &still);
    let expected = [0.0, 6.0, 3.0, 0.0, 0.0, 0.0, -3.0, -6.0, -6.0];
    for (x, y) in f.iter().zip(expected) {
        assert!((x - y).abs() < 1e-9, "{f:?}");
    }
}

#[test]
fn a_natural_spline_through_a_line_is_the_line_and_straight_beyond_its_ends() {
    let line = [-3.0, -2.1, -1.2, -0.45, 0.45, 1.2, 2.1, 3.0];
    let mut p = line.to_vec();
    p.extend([0.0, 4.0, -1.0, 2.0, 1.0, 5.0, 3e-3, 0.3]);
    let law = Law::new(Kind::FreeForm, &p).unwrap().prepare(1.0).unwrap();
    let at = |d: f64, v: f64| law.force(Motion { d, v, a: 0.0 }, &[0.0; MAX_STATE]).0;
    for d in [-5e-3, -2.2e-3, 0.0, 0.4e-3, 3e-3, 9e-3] {
        assert!((at(d, 0.0) - 1e3 * d).abs() < 1e-12, "{d}");
    }
    for (v, f) in [(-0.3, 0.0), (-0.15, 4.0), (-0.06, -1.0), (0.06, 2.0), (0.15, 1.0), (0.3, 5.0)] {
        assert!((at(0.0, v) - f).abs() < 1e-12, "{v}");
    }
    let (a, b, c) = (at(0.0, 0.31), at(0.0, 0.4), at(0.0, 0.49));
    assert!((a + c - 2.0 * b).abs() < 1e-12);
}
