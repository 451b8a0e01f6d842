//! Dashpots that the model has itself, against the same ones as a law of a hypothesis.

use super::*;
use crate::identify::{fitted, force_products, model_columns, solve};

const C: f64 = 6.0;

/// A dashpot C at the first of the coordinates of `hypothesis` that is a law, with unknowns `x` of all.
fn as_law(hypothesis: &Hypothesis, row: &Dense, x: &[f64]) -> (Hypothesis, Vec<f64>) {
    let mut all = vec![Attached::unknown(Kind::Dashpot, vec![0])];
    if let What::Laws(own) = &hypothesis.what {
        all.extend(own.iter().map(|a| Attached::unknown(a.kind, a.at.iter().map(|i| i + 1).collect())));
    }
    let mut w = row.transposed();
    if hypothesis.w.nrows() > 0 {
        w.append(&hypothesis.w.transposed());
    }
    let mut values = vec![C.ln()];
    values.extend_from_slice(x);
    let n_free = if matches!(hypothesis.what, What::FreeForce) { hypothesis.w.nrows() } else { 0 };
    let mut compliance = vec![0.0];
    compliance.extend_from_slice(&hypothesis.compliance);
    let law_sd = vec![2.0; values.len()];
    let made = Hypothesis {
        w: w.transposed(),
        what: What::Laws(all),
        free: n_free,
        compliance,
        held: vec![],
        law_mean: values.clone(),
        law_sd,
    };
    (made, values)
}

/// A dashpot C at a row of the basis, as it is drawn.
fn drawn(row: &Dense) -> Dashpots {
    Dashpots { rows: Dense::from_vec(1, R, (0..R).map(|j| C.sqrt() * row[(0, j)]).collect()), of: vec![None] }
}

#[test]
fn they_are_what_a_law_with_known_parameters_is() {
    let numbers = &mut Numbers(41);
    let plain = system(numbers, 3, 0.02);
    let row = numbers.dense(1, R);
    let damped = System { dashpots: drawn(&row), ..plain.clone() };
    let records = [record(numbers, 4, 2, 0.0), record(numbers, 4, 2, 3.0)];
    let (kinds, x) = laws();
    let settings = Settings { iterations: 0, ..Settings::default() };
    let cases = [(nothing(), vec![]), (free(numbers, 2), vec![]), (closed(numbers, 2, &kinds, &x), x)];
    for (hypothesis, x) in cases {
        let (law, values) = as_law(&hypothesis, &row, &x);
        let p = start(&plain, &[]);
        let own = solve(&damped, &records, &hypothesis, &p, &x, settings).expect("own");
        let other = solve(&plain, &records, &law, &p, &values, settings).expect("law");
        assert!((own.at.cost - other.at.cost).abs() < 1e-9 * other.at.cost);
        let without = solve(&plain, &records, &hypothesis, &p, &x, settings).expect("none");
        assert!((without.at.cost - own.at.cost).abs() > 1e-3 * own.at.cost, "the dashpot shows");
        // the matrices but for the row of the dashpot's own unknown
        let n = plain.n_unknowns();
        let skipped = |i: usize| if i < n { i } else { i + 1 };
        assert_eq!(own.at.hessian.nrows(), n + x.len());
        let size = (0..n).fold(0.0_f64, |a, i| a.max(other.at.hessian[(i, i)]));
        for (i, j) in (0..n + x.len()).flat_map(|i| (0..n + x.len()).map(move |j| (i, j))) {
            let (a, b) = (own.at.hessian[(i, j)], other.at.hessian[(skipped(i), skipped(j))]);
            assert!((a - b).abs() < 1e-8 * size, "{i} {j}: {a} {b}");
        }
        let a = fitted(&damped, &records, &hypothesis, &p, &x).expect("own");
        let b = fitted(&plain, &records, &law, &p, &values).expect("law");
        let n_w = hypothesis.w.nrows();
        for (a, b) in a.iter().zip(&b) {
            let same = |a: &[Complex64], b: &[Complex64]| {
                let size = b.iter().fold(1e-30_f64, |m, v| m.max(v.norm()));
                assert_eq!(a.len(), b.len());
                assert!(a.iter().zip(b).all(|(a, b)| (a - b).norm() < 1e-9 * size));
            };
            same(&a.y, &b.y);
            // its own coordinate is not among those asked for
            let asked =
                |v: &[Complex64]| v.chunks(n_w + 1).flat_map(|line| line[1..].to_vec()).collect::<Vec<_>>();
            same(&a.d, &asked(&b.d));
            same(&a.force, &asked(&b.force));
        }
    }
}

#[test]
fn columns_with_a_given_stiffness_hold_them() {
    let numbers = &mut Numbers(43);
    let plain = system(numbers, 3, 0.02);
    let (row, w) = (numbers.dense(1, R), numbers.dense(1, R));
    let damped = System { dashpots: drawn(&row), ..plain.clone() };
    let record = RecordLines { dt: 0.0, ..record(numbers, 4, 2, 0.0) };
    let kappa: Vec<Complex64> = (0..N_LINES).map(|_| 400.0 * numbers.complex()).collect();
    let p = start(&plain, &[]);
    let own = model_columns(&damped, &record, w.clone(), vec![kappa.clone()], &p).expect("own");
    let mut both = row.transposed();
    both.append(&w.transposed());
    let of_dashpot = record.s.iter().map(|s| C * s).collect();
    let other =
        model_columns(&plain, &record, both.transposed(), vec![of_dashpot, kappa], &p).expect("given");
    let size = other.data().iter().fold(0.0_f64, |a, v| a.max(v.abs()));
    assert!(own.data().iter().zip(other.data()).all(|(a, b)| (a - b).abs() < 1e-10 * size));
}

#[test]
fn forces_at_a_place_move_the_damped_model() {
    let numbers = &mut Numbers(47);
    let plain = system(numbers, 3, 0.02);
    let row = numbers.dense(1, R);
    let damped = System { dashpots: drawn(&row), ..plain.clone() };
    let record = bare(record(numbers, 4, 2, 1.0));
    let place: Vec<f64> = (0..R).map(|_| numbers.next()).collect();
    let spectra: Vec<Complex64> = (0..N_LINES).map(|_| numbers.complex()).collect();
    let p = start(&plain, &[]);
    let products = force_products(&damped, &record, &place, &spectra, &p).expect("products");
    // the same force of one amplitude among the recorded ones: what it leaves is the cost
    let cost = |amplitude: f64| {
        let mut both = record.in_rows.transposed();
        both.append(&Dense::from_vec(R, 1, place.clone()));
        let u = record.u.chunks(2).zip(&spectra).flat_map(|(u, f)| [u[0], u[1], amplitude * f]).collect();
        let more = RecordLines { in_rows: both.transposed(), u, ..record.clone() };
        let settings = Settings { iterations: 0, ..Settings::default() };
        solve(&damped, &[more], &nothing(), &p, &[], settings).expect("cost").at.cost
    };
    // without decays' priors, which follow the recorded forces, second differences are the products
    let h = 1e-3;
    let (up, here, down) = (cost(h), cost(0.0), cost(-h));
    let (slope, curve) = ((up - down) / (2.0 * h), (up - 2.0 * here + down) / (h * h));
    assert!((slope + 2.0 * products[(0, 1)]).abs() < 2e-2 * slope.abs(), "{slope} {}", products[(0, 1)]);
    assert!((curve - 2.0 * products[(1, 1)]).abs() < 2e-2 * curve.abs(), "{curve} {}", products[(1, 1)]);
}

#[test]
fn a_parameter_that_is_a_factor_on_them_is_the_unknown_of_the_law() {
    let numbers = &mut Numbers(53);
    let plain = system(numbers, 3, 0.02);
    let row = numbers.dense(1, R);
    // the second parameter moves the dashpot beside its part of K and M
    let damped = System { dashpots: Dashpots { of: vec![Some(1)], ..drawn(&row) }, ..plain.clone() };
    let records = [record(numbers, 4, 2, 0.0), record(numbers, 4, 2, 3.0)];
    let (kinds, x) = laws();
    let settings = Settings { iterations: 0, ..Settings::default() };
    let cases = [(nothing(), vec![]), (free(numbers, 1), vec![]), (closed(numbers, 2, &kinds, &x), x)];
    for (hypothesis, x) in cases {
        let (mut law, mut values) = as_law(&hypothesis, &drawn(&row).rows, &x);
        let mut p = start(&plain, &[]);
        p[1] = 0.4;
        (law.law_mean[0], values[0]) = (0.0, p[1]);
        let own = solve(&damped, &records, &hypothesis, &p, &x, settings).expect("own");
        let other = solve(&plain, &records, &law, &p, &values, settings).expect("law");
        assert_eq!(own.x, x);
        let prior = 0.25 * values[0].powi(2);
        assert!((own.at.cost - other.at.cost + prior).abs() < 1e-9 * other.at.cost);
        // what the law's unknown has is added to the parameter's, but for the law's prior
        let n = plain.n_unknowns();
        let to = |i: usize| {
            if i < n {
                i
            } else if i == n {
                1
            } else {
                i - 1
            }
        };
        let size = (0..n).fold(0.0_f64, |a, i| a.max(other.at.hessian[(i, i)]));
        let mut folded = Dense::zeros(n + x.len(), n + x.len());
        for (i, j) in (0..=n + x.len()).flat_map(|i| (0..=n + x.len()).map(move |j| (i, j))) {
            let of_prior = if i == n && j == n { 0.25 } else { 0.0 };
            folded[(to(i), to(j))] += other.at.hessian[(i, j)] - of_prior;
        }
        let off = own.at.hessian.data().iter().zip(folded.data()).map(|(a, b)| (a - b).abs());
        assert!(off.fold(0.0, f64::max) < 1e-8 * size);
        let slope = other.at.gradient[1] + other.at.gradient[n] - 0.25 * values[0];
        assert!(
            (own.at.gradient[1] - slope).abs() < 1e-8 * (1.0 + slope.abs()),
            "{slope} {}",
            own.at.gradient[1]
        );
        for (a, b) in fitted(&damped, &records, &hypothesis, &p, &x)
            .expect("own")
            .iter()
            .zip(&fitted(&plain, &records, &law, &p, &values).expect("law"))
        {
            assert!(a.y.iter().zip(&b.y).all(|(a, b)| (a - b).norm() < 1e-9 * (1.0 + b.norm())));
        }
    }
}

#[test]
fn columns_of_the_model_hold_what_a_parameter_does_to_them() {
    let numbers = &mut Numbers(59);
    let plain = system(numbers, 3, 0.02);
    let (row, w) = (numbers.dense(1, R), numbers.dense(1, R));
    let damped = System { dashpots: Dashpots { of: vec![Some(0)], ..drawn(&row) }, ..plain.clone() };
    let still = System { dashpots: drawn(&row), ..plain.clone() };
    let record = RecordLines { dt: 0.0, ..bare(record(numbers, 4, 2, 0.0)) };
    let kappa: Vec<Complex64> = (0..N_LINES).map(|_| 400.0 * numbers.complex()).collect();
    let mut p = start(&plain, &[]);
    p[0] = 0.0;
    let columns =
        |of: &System| model_columns(of, &record, w.clone(), vec![kappa.clone()], &p).expect("columns");
    let (with, without) = (columns(&damped), columns(&still));
    assert_eq!(with.ncols(), plain.n_unknowns());
    // the derivative of accelerations that a dashpot law has, closed at the same coordinates
    let response = |c: f64| {
        let rows = Dense::from_vec(1, R, (0..R).map(|j| c.sqrt() * row[(0, j)]).collect());
        let system = System { dashpots: Dashpots { rows, of: vec![None] }, ..plain.clone() };
        let what = What::Given(vec![kappa.clone()], Vec::new());
        let given = Hypothesis { w: w.clone(), what, compliance: vec![0.0], ..nothing() };
        fitted(&system, std::slice::from_ref(&record), &given, &p, &[]).expect("fitted").remove(0).y
    };
    let h = 1e-5;
    let (up, down) = (response(C * (1.0 + h)), response(C * (1.0 - h)));
    let n_out = up.len() / N_LINES;
    let size = with.col(0).iter().fold(0.0_f64, |a, v| a.max(v.abs()));
    let mut largest = 0.0_f64;
    for (s, k) in (0..n_out).flat_map(|s| (0..N_LINES).map(move |k| (s, k))) {
        let i = k * n_out + s;
        let slope = (up[i] - down[i]) / (2.0 * h) * record.weight[i];
        let at = s * 2 * N_LINES + k;
        let own = |j: usize| with.col(0)[j] - without.col(0)[j];
        largest = largest.max(slope.norm());
        assert!((own(at) - slope.re).abs() + (own(at + N_LINES) - slope.im).abs() < 1e-5 * size);
    }
    assert!(largest > 1e-3 * size, "the dashpot shows");
}
