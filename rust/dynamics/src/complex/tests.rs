//! Chains of masses with known complex modes.

use std::f64::consts::PI;
use std::sync::Arc;

use femend_linalg::{Dense, Ordering, Pattern, Symbolic, SymmetricCsc};
use num_complex::Complex64;

use super::*;
use crate::DynamicsError;

const K: f64 = 1e4;

/// Pattern, K and M of n unit masses in a row, clamped at both ends or free.
fn chain(n: usize, free: bool) -> (Arc<Symbolic>, SymmetricCsc, SymmetricCsc) {
    let p = Arc::new(Pattern::from_entries(n, (1..n).map(|i| (i, i - 1))).unwrap());
    let end = |i: usize| if free && (i == 0 || i == n - 1) { 1.0 } else { 2.0 };
    let k = values(&p, |i, j| if i == j { K * end(i) } else { -K });
    let m = values(&p, |i, j| f64::from(u8::from(i == j)));
    let symbolic = Arc::new(Symbolic::new(p.clone(), Ordering::Auto).unwrap());
    (symbolic, SymmetricCsc::new(p.clone(), k, "K").unwrap(), SymmetricCsc::new(p, m, "M").unwrap())
}

/// Values by row and column.
fn values(p: &Pattern, at: impl Fn(usize, usize) -> f64) -> Vec<f64> {
    (0..p.n()).flat_map(|j| p.column(j).iter().map(|&i| at(i as usize, j)).collect::<Vec<_>>()).collect()
}

fn options(n_modes: usize) -> ComplexOptions {
    ComplexOptions { n_modes: Some(n_modes), f_max: None, tolerance: 1e-9, left_tolerance: 1e-9 }
}

fn term(power: Power, speed_power: i32, values: Vec<f64>) -> Term {
    Term { power, speed_power, values }
}

/// ω of the clamped chain.
fn omega(n: usize, r: usize) -> f64 {
    2.0 * K.sqrt() * ((r + 1) as f64 * PI / (2.0 * (n + 1) as f64)).sin()
}

#[test]
fn proportional_and_structural_damping_have_their_closed_form() {
    let n = 400;
    let (symbolic, k, m) = chain(n, false);
    let (c, eta) = (1.5, 0.03);
    let damping = m.values().iter().map(|v| c * v).collect();
    let structural = k.values().iter().map(|v| eta * v).collect();
    let terms = [term(Power::Damping, 0, damping), term(Power::Structural, 0, structural)];
    let mut problem = ComplexProblem::new(&symbolic, &k, &m, &terms, 0.0, &options(8)).unwrap();
    let found = problem.modes(0.0).unwrap();
    for r in 0..8 {
        let stiffness = omega(n, r).powi(2) * Complex64::new(1.0, eta);
        let exact = -0.5 * c + Complex64::I * (stiffness - 0.25 * c * c).sqrt();
        assert!((found.lambda[r] - exact).norm() < 1e-9 * exact.norm(), "{r}: {}", found.lambda[r]);
        assert_eq!(found.kind[r], PoleKind::Oscillatory);
    }
    assert_eq!(found.kind.iter().filter(|k| **k == PoleKind::Mirrored).count(), 8);
    assert!(found.residual.iter().flatten().all(|r| *r < 1e-9));
}

/// Two chains side by side that G couples with the mass matrix: λ² + ω² ± iWgλ = 0.
#[test]
fn gyroscopic_coupling_splits_pairs_into_two_senses() {
    let (half, g) = (150, 2.0);
    let n = 2 * half;
    let p = Arc::new(
        Pattern::from_entries(
            n,
            (1..half)
                .flat_map(|i| [(i, i - 1), (half + i, half + i - 1)])
                .chain((0..half).map(|i| (half + i, i))),
        )
        .unwrap(),
    );
    let side = |i: usize| i / half;
    let stiffness = values(&p, |i, j| match (i == j, side(i) == side(j)) {
        (true, _) => 2.0 * K,
        (false, true) => -K,
        _ => 0.0,
    });
    let mass = values(&p, |i, j| f64::from(u8::from(i == j)));
    let gyro = values(&p, |i, j| match (side(i), side(j)) {
        (0, 1) => g,
        (1, 0) => -g,
        _ => 0.0,
    });
    let symbolic = Arc::new(Symbolic::new(p.clone(), Ordering::Auto).unwrap());
    let k = SymmetricCsc::new(p.clone(), stiffness, "K").unwrap();
    let m = SymmetricCsc::new(p, mass, "M").unwrap();
    let terms = [term(Power::Damping, 1, gyro)];
    let mut problem = ComplexProblem::new(&symbolic, &k, &m, &terms, 0.0, &options(6)).unwrap();
    for speed in [0.0, 3.0] {
        let found = problem.modes(speed).unwrap();
        let shift = 0.5 * g * speed;
        let mut exact: Vec<f64> = (0..20)
            .flat_map(|r| [-1.0, 1.0].map(|sign| omega(half, r).hypot(shift) + sign * shift))
            .collect();
        exact.sort_by(f64::total_cmp);
        for (lambda, exact) in found.lambda.iter().zip(&exact) {
            assert!((lambda - Complex64::new(0.0, *exact)).norm() < 1e-9 * exact, "{lambda} {exact}");
        }
        // left vectors of an undamped gyroscopic system are the conjugate right ones
        let psi = &found.right[..n];
        let y = &found.left[..n];
        let (num, den) =
            psi.iter().zip(y).fold((Complex64::ZERO, 0.0), |(s, d), (p, y)| (s + p * y, d + p.norm_sqr()));
        assert!(speed == 0.0 || (num.norm() / den - 1.0).abs() < 1e-6);
    }
}

#[test]
fn a_dashpot_shifts_poles_as_the_static_answer_to_it_needs() {
    let n = 500;
    let (symbolic, k, m) = chain(n, true);
    for c in [1.0, 100.0, 1e4] {
        let local = values(k.pattern(), |i, j| if i == j && i == 70 { c } else { 0.0 });
        let terms = [term(Power::Damping, 0, local)];
        let mut problem = ComplexProblem::new(&symbolic, &k, &m, &terms, 0.0, &options(6)).unwrap();
        let found = problem.modes(0.0).unwrap();
        // no rigid-body motion is free of the damper: it moves on at a real pole near -c / n where c is small
        assert_eq!(found.kind[0], PoleKind::Rigid);
        assert!(found.residual.iter().flatten().all(|r| *r < 1e-8), "{:?}", found.residual);
        assert!(found.lambda.iter().all(|l| l.re < 1e-9));
        let drift = found.lambda.iter().zip(&found.kind).find(|(_, k)| **k == PoleKind::Overdamped);
        assert!(c > 1.0 || drift.is_some_and(|(l, _)| (l.re * n as f64 / c + 1.0).abs() < 0.05));
    }
}

#[test]
fn receptance_in_the_space_is_that_of_the_chain() {
    let n = 300;
    let (symbolic, k, m) = chain(n, false);
    let terms = [term(Power::Damping, 0, m.values().iter().map(|v| 2.0 * v).collect())];
    let mut problem = ComplexProblem::new(&symbolic, &k, &m, &terms, 0.0, &options(4)).unwrap();
    problem.modes(0.0).unwrap();
    let (mut b_out, mut b_in) = (Dense::zeros(n, 2), Dense::zeros(n, 1));
    (b_out[(10, 0)], b_out[(200, 1)], b_in[(10, 0)]) = (1.0, 1.0, 1.0);
    let s = [Complex64::new(0.0, 1.3), Complex64::new(0.0, 3.0)];
    let found = problem.receptance(0.0, &b_out, &b_in, &s, 1e-10).unwrap();
    for (line, s) in s.iter().enumerate() {
        for (o, row) in [10usize, 200].into_iter().enumerate() {
            let exact: Complex64 = (0..n)
                .map(|r| {
                    let shape = |i: usize| ((i + 1) as f64 * (r + 1) as f64 * PI / (n + 1) as f64).sin();
                    2.0 / (n + 1) as f64 * shape(row) * shape(10) / (s * s + 2.0 * s + omega(n, r).powi(2))
                })
                .sum();
            assert!((found[2 * line + o] - exact).norm() < 1e-9 * exact.norm());
        }
    }
}

#[test]
fn bad_arguments_are_told() {
    let (symbolic, k, m) = chain(80, false);
    let refused = |terms: &[Term], options: ComplexOptions| {
        matches!(
            ComplexProblem::new(&symbolic, &k, &m, terms, 0.0, &options),
            Err(DynamicsError::Argument(_))
        )
    };
    assert!(refused(&[], options(0)));
    assert!(refused(
        &[],
        ComplexOptions { n_modes: None, f_max: None, tolerance: 1e-8, left_tolerance: 1e-8 }
    ));
    assert!(refused(
        &[],
        ComplexOptions { n_modes: None, f_max: Some(-1.0), tolerance: 1e-8, left_tolerance: 1e-8 }
    ));
    assert!(refused(&[], ComplexOptions { tolerance: 0.0, ..options(2) }));
    assert!(refused(&[term(Power::Damping, 0, vec![1.0])], options(2)));
    assert!(refused(&[term(Power::Damping, 0, vec![f64::NAN; k.values().len()])], options(2)));
    let mut problem = ComplexProblem::new(&symbolic, &k, &m, &[], 0.0, &options(2)).unwrap();
    assert!(problem.modes(f64::NAN).is_err());
}
