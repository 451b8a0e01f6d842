//! Columns, projection and gradient against finite differences and explicit least squares on small random systems.

use super::*;
use crate::identify::{Settings, Term, solve};
use crate::laws::Kind;
use femend_linalg::gemm;

const R: usize = 6;
const N_LINES: usize = 14;

/// Numbers in [-1, 1), the same in every run.
pub(super) struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    fn complex(&mut self) -> Complex64 {
        Complex64::new(self.next(), self.next())
    }

    fn dense(&mut self, n: usize, m: usize) -> Dense {
        Dense::from_vec(n, m, (0..n * m).map(|_| self.next()).collect())
    }

    /// scale A A^T.
    fn semidefinite(&mut self, n: usize, scale: f64) -> Dense {
        let a = self.dense(n, n);
        let mut c = Dense::zeros(n, n);
        gemm(&mut c, 0.0, scale, &a, &a.transposed());
        c
    }
}

/// Two parameters: one enters K to the powers one and three, one moves K and M, and both move a term together.
fn system(numbers: &mut Numbers, n_tuned: usize, zeta: f64) -> System {
    let mut k = numbers.semidefinite(R, 400.0);
    let mut m = numbers.semidefinite(R, 0.02);
    for i in 0..R {
        k[(i, i)] += 2000.0 * (1.0 + i as f64).powi(2);
        m[(i, i)] += 1.0;
    }
    let part = |numbers: &mut Numbers| Some(numbers.semidefinite(R, 150.0));
    let terms = vec![
        Term { exponents: vec![(0, 1.0)], k: part(numbers), m: None },
        Term { exponents: vec![(0, 3.0)], k: part(numbers), m: None },
        Term { exponents: vec![(1, 1.0)], k: part(numbers), m: Some(numbers.semidefinite(R, 0.05)) },
        Term { exponents: vec![(0, 1.0), (1, 1.0)], k: part(numbers), m: None },
    ];
    let mut mean = vec![0.0; 2 + n_tuned];
    mean.extend(vec![zeta.ln(); n_tuned + 1]);
    let mut sd = vec![0.3; 2];
    sd.extend(vec![0.005; n_tuned]);
    sd.extend(vec![0.5; n_tuned + 1]);
    let system = System { r: R, k_fixed: k, m_fixed: m, terms, n_par: 2, n_tuned, mean, sd };
    system.check().expect("sizes");
    system
}

fn record(numbers: &mut Numbers, n_out: usize, n_in: usize, sigma: f64) -> RecordLines {
    let s: Vec<Complex64> =
        (0..N_LINES).map(|k| Complex64::new(sigma, 35.0 + 10.0 * k as f64 + numbers.next())).collect();
    let mut draw = |n: usize| (0..n).map(|_| numbers.complex()).collect::<Vec<_>>();
    let (u, y) = (draw(N_LINES * n_in), draw(N_LINES * n_out));
    RecordLines {
        s,
        u,
        y,
        weight: (0..N_LINES * n_out).map(|_| 1.5 + numbers.next()).collect(),
        out_rows: numbers.dense(n_out, R),
        in_rows: numbers.dense(n_in, R),
        dt: 0.01,
        n_samples: 900.0,
        thinning: 2.0,
        sigma,
        share: 0.2,
    }
}

fn nothing() -> Hypothesis {
    let none = Dense::zeros(0, 0);
    Hypothesis { w: none, what: What::Nothing, compliance: vec![], law_mean: vec![], law_sd: vec![] }
}

fn free(numbers: &mut Numbers, n_w: usize) -> Hypothesis {
    Hypothesis { w: numbers.dense(n_w, R), what: What::FreeForce, compliance: vec![0.0; n_w], ..nothing() }
}

fn closed(numbers: &mut Numbers, n_w: usize, kinds: &[Kind], x: &[f64]) -> Hypothesis {
    Hypothesis {
        w: numbers.dense(n_w, R),
        what: What::Laws(kinds.to_vec()),
        compliance: (0..n_w).map(|i| 2e-5 * (1 + i) as f64).collect(),
        law_mean: x.to_vec(),
        law_sd: vec![2.0; x.len()],
    }
}

/// Two kinds of linear laws that together use a complex and line-dependent dynamic stiffness.
fn laws() -> (Vec<Kind>, Vec<f64>) {
    (
        vec![Kind::Spring, Kind::Dashpot, Kind::Viscoelastic],
        [900.0, 6.0, 300.0, 500.0, 0.012].map(f64::ln).to_vec(),
    )
}

/// The weighted columns and the weighted residual before free decays, both as they stand without a projector.
fn columns_and_residual(
    system: &System,
    record: &RecordLines,
    hypothesis: &Hypothesis,
    z: &[f64],
) -> (Dense, Vec<f64>) {
    let (p, x) = z.split_at(system.n_unknowns());
    let modal = system.modal(p).expect("modes");
    let step = Step::new(record, system, &modal, hypothesis, x).expect("response");
    let mut columns = Columns::new(record.n_lines(), record.n_out(), z.len());
    step.sensitivities(system, &modal, x.len(), &mut columns);
    (columns.data, step.columns.data.col(step.decays.len()).to_vec())
}

/// Largest distance of a column from minus the central difference of the residual, relative to that column's size.
fn worst_columns(system: &System, record: &RecordLines, hypothesis: &Hypothesis, z: &[f64]) -> Vec<f64> {
    let (columns, _) = columns_and_residual(system, record, hypothesis, z);
    (0..z.len())
        .map(|j| {
            let h = 1e-5;
            let at = |sign: f64| {
                let mut moved = z.to_vec();
                moved[j] += sign * h;
                columns_and_residual(system, record, hypothesis, &moved).1
            };
            let (up, down) = (at(1.0), at(-1.0));
            let expected: Vec<f64> = up.iter().zip(&down).map(|(a, b)| -(a - b) / (2.0 * h)).collect();
            let size = expected.iter().map(|v| v * v).sum::<f64>().sqrt();
            let off = expected.iter().zip(columns.col(j)).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
            assert!(size > 1e-9, "unknown {j} changes nothing: the comparison says nothing");
            off / size
        })
        .collect()
}

fn start(system: &System, x: &[f64]) -> Vec<f64> {
    let mut z = system.mean.clone();
    z[0] = 0.13;
    z[1] = -0.21;
    z.extend_from_slice(x);
    z
}

/// Next to no damping, so that the parameters' columns, which hold the damping matrix still, are exact too; the windowed
/// lines keep the response smooth. Truncation and round-off of the differences stay below 1e-5.
#[test]
fn columns_are_derivatives_of_the_residual() {
    let numbers = &mut Numbers(11);
    let (kinds, x) = laws();
    for n_w in [0, 1, 3] {
        let system = system(numbers, 3, 1e-7);
        let record = record(numbers, 4, 2, 6.0);
        let (hypothesis, x) =
            if n_w == 0 { (nothing(), vec![]) } else { (closed(numbers, n_w, &kinds, &x), x.clone()) };
        let z = start(&system, &x);
        let damping = system.n_par + system.n_tuned..system.n_unknowns();
        for (j, off) in worst_columns(&system, &record, &hypothesis, &z).into_iter().enumerate() {
            // at this damping its own columns are ten million times smaller than the residual: fewer digits
            let allowed = if damping.contains(&j) { 1e-2 } else { 1e-5 };
            assert!(off < allowed, "{n_w} coordinates, unknown {j}: off by {off:e}");
        }
    }
}

#[test]
fn columns_of_frequency_factors_damping_and_laws_are_exact_at_real_damping() {
    let numbers = &mut Numbers(5);
    let (kinds, x) = laws();
    for n_w in [0, 1, 3] {
        let system = system(numbers, 3, 0.015);
        let record = record(numbers, 4, 1, 0.0);
        let (hypothesis, x) =
            if n_w == 0 { (nothing(), vec![]) } else { (closed(numbers, n_w, &kinds, &x), x.clone()) };
        let mut z = start(&system, &x);
        z[2..5].copy_from_slice(&[0.004, -0.003, 0.002]);
        let off = worst_columns(&system, &record, &hypothesis, &z);
        assert!(off[2..].iter().all(|v| *v < 1e-5), "{n_w} coordinates: {off:?}");
        // a parameter moves the damping matrix too, which its column leaves out: some times the damping ratio
        assert!(off[..2].iter().all(|v| *v < 0.15), "{n_w} coordinates: {off:?}");
    }
}

/// Least squares over forces on every line and decay amplitudes at once, by one dense normal equation.
fn explicit(step: &Step<'_>, record: &RecordLines) -> (f64, Vec<f64>, Vec<Complex64>) {
    let (n_out, n_w, n_t) = (record.n_out(), step.response.h.len(), step.decays.len());
    let n = n_t + 2 * n_w * N_LINES;
    let rows = 2 * n_out * N_LINES;
    let mut a = Dense::zeros(rows + n_t, n);
    let mut b = Dense::zeros(rows + n_t, 1);
    for k in 0..N_LINES {
        for s in 0..n_out {
            let (i, w) = (2 * (k * n_out + s), record.weight[k * n_out + s]);
            let left = (record.y[k * n_out + s] - step.response.y.get(s, k)) * w;
            (b[(i, 0)], b[(i + 1, 0)]) = (left.re, left.im);
            for t in 0..n_t {
                let v = step.decays[t].get(s, k) * w;
                (a[(i, t)], a[(i + 1, t)]) = (v.re, v.im);
            }
            for f in 0..n_w {
                let (v, at) = (step.response.h[f].get(s, k) * w, n_t + 2 * (k * n_w + f));
                (a[(i, at)], a[(i + 1, at)]) = (v.re, v.im);
                (a[(i, at + 1)], a[(i + 1, at + 1)]) = (-v.im, v.re);
            }
        }
    }
    (0..n_t).for_each(|t| a[(rows + t, t)] = step.ridge[t].sqrt());
    let l = gemm_tn(&a, &a).cholesky().expect("regular");
    let mut c = gemm_tn(&a, &b);
    l.solve_lower_in_place(false, &mut c);
    l.solve_lower_in_place(true, &mut c);
    let mut left = b;
    gemm(&mut left, 1.0, -1.0, &a, &c);
    let sum = left.data().iter().map(|v| v * v).sum();
    let (amplitudes, forces) = c.data().split_at(n_t);
    (sum, amplitudes.to_vec(), forces.chunks_exact(2).map(|f| Complex64::new(f[0], f[1])).collect())
}

#[test]
fn projecting_a_free_force_out_is_least_squares_over_it() {
    let numbers = &mut Numbers(23);
    for n_w in [1, 2] {
        let system = system(numbers, 2, 0.02);
        let record = record(numbers, 5, 1, 1.0);
        let hypothesis = free(numbers, n_w);
        let modal = system.modal(&system.mean).expect("modes");
        let step = Step::new(&record, &system, &modal, &hypothesis, &[]).expect("response");
        let (sum, amplitudes, forces) = explicit(&step, &record);
        assert!((step.sum - sum).abs() < 1e-8 * sum, "{} and {sum}", step.sum);
        let size = amplitudes.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
        for (a, b) in step.amplitudes.iter().zip(&amplitudes) {
            assert!((a - b).abs() < 1e-6 * size, "decays {a} and {b}");
        }
        let found = step.force();
        let largest = forces.iter().fold(0.0_f64, |a, b| a.max(b.norm()));
        for k in 0..N_LINES {
            for i in 0..n_w {
                let off = (found.get(i, k) - forces[k * n_w + i]).norm();
                assert!(off < 1e-6 * largest, "line {k}, force {i}: off by {off:e}");
            }
        }
        assert_eq!(step.free, (N_LINES * (5 - n_w)) as f64);
    }
}

/// Without tuned modes there are no free decays, and the projected cost has the gradient that holds the force still.
#[test]
fn the_gradient_of_the_projected_cost_is_its_derivative() {
    let numbers = &mut Numbers(41);
    for n_w in [1, 2] {
        let system = system(numbers, 0, 1e-7);
        let records = [record(numbers, 5, 1, 5.0), record(numbers, 4, 2, 5.0)];
        let hypothesis = free(numbers, n_w);
        let p = start(&system, &[]);
        let cost = |p: &[f64]| evaluate(&system, &records, &hypothesis, p, &[], false).expect("cost").cost;
        let gradient = evaluate(&system, &records, &hypothesis, &p, &[], true).expect("cost").gradient;
        for j in 0..2 {
            let h = 1e-5;
            let (mut up, mut down) = (p.clone(), p.clone());
            up[j] += h;
            down[j] -= h;
            let expected = (cost(&up) - cost(&down)) / (4.0 * h);
            assert!(
                (gradient[j] - expected).abs() < 1e-5 * expected.abs(),
                "{n_w} forces, unknown {j}: {} instead of {expected}",
                gradient[j]
            );
        }
    }
}

/// Responses of the model (with laws, or with forces at `w`) in the place of the recorded ones.
fn answer(
    system: &System,
    record: &mut RecordLines,
    hypothesis: &Hypothesis,
    z: &[f64],
    force: Option<&Split>,
) {
    let (p, x) = z.split_at(system.n_unknowns());
    let modal = system.modal(p).expect("modes");
    let response = Response::new(record, &modal, hypothesis, x, system.n_tuned).expect("response");
    let n_out = record.n_out();
    let size = (0..N_LINES * n_out).map(|i| response.y.get(i % n_out, i / n_out).norm()).fold(0.0, f64::max);
    for k in 0..N_LINES {
        for s in 0..n_out {
            let pushed: Complex64 = force.map_or_else(Complex64::default, |f| {
                (0..f.re.nrows()).map(|i| response.h[i].get(s, k) * f.get(i, k)).sum()
            });
            record.y[k * n_out + s] = response.y.get(s, k) + pushed;
        }
    }
    record.weight.iter_mut().for_each(|w| *w = 1e4 / size);
}

fn settings() -> Settings {
    Settings { iterations: 60, tolerance: 1e-9, ..Settings::default() }
}

fn truth(system: &System, x: &[f64]) -> Vec<f64> {
    let mut z = system.mean.clone();
    (z[0], z[1]) = (0.08, -0.05);
    z.extend_from_slice(x);
    z
}

#[test]
fn solving_recovers_what_made_the_lines() {
    let numbers = &mut Numbers(3);
    let (kinds, x) = (vec![Kind::Spring, Kind::Dashpot], [700.0, 5.0].map(f64::ln).to_vec());
    for hypothesis in [nothing(), closed(numbers, 1, &kinds, &x), closed(numbers, 3, &kinds, &x)] {
        let system = system(numbers, 3, 0.01);
        let x = if hypothesis.n_law() == 0 { vec![] } else { x.clone() };
        let z = truth(&system, &x);
        let mut records = [record(numbers, 4, 1, 0.5), record(numbers, 4, 1, 0.5)];
        records.iter_mut().for_each(|r| answer(&system, r, &hypothesis, &z, None));
        let begin: Vec<f64> = x.iter().map(|v| v + 0.4).collect();
        let found =
            solve(&system, &records, &hypothesis, &system.mean, &begin, settings()).expect("solution");
        assert!(found.converged);
        for (a, b) in found.p[..2].iter().zip(&z).chain(found.x.iter().zip(&x)) {
            assert!((a - b).abs() < 1e-3, "{:?} {:?} instead of {z:?}", found.p, found.x);
        }
    }
}

#[test]
fn solving_with_a_free_force_recovers_the_parameters() {
    let numbers = &mut Numbers(8);
    let system = system(numbers, 3, 0.01);
    let hypothesis = free(numbers, 1);
    let z = truth(&system, &[]);
    let mut records = [record(numbers, 4, 1, 0.5), record(numbers, 4, 1, 0.5)];
    for record in &mut records {
        let mut force = Split::zeros(1, N_LINES);
        (0..N_LINES).for_each(|k| force.set(0, k, 2.0 * numbers.complex()));
        answer(&system, record, &hypothesis, &z, Some(&force));
    }
    let with = solve(&system, &records, &hypothesis, &system.mean, &[], settings()).expect("solution");
    let without = solve(&system, &records, &nothing(), &system.mean, &[], settings()).expect("solution");
    for (a, b) in with.p[..2].iter().zip(&z) {
        assert!((a - b).abs() < 2e-3, "{:?} instead of {z:?}", with.p);
    }
    assert!(without.at.cost > 1e3 * with.at.cost, "{} and {}", without.at.cost, with.at.cost);
}

/// A change that breaks the sizes of a system, a record or a hypothesis.
type Break = fn(&mut System, &mut RecordLines, &mut Hypothesis, &mut Vec<f64>, &mut Vec<f64>);

#[test]
fn arrays_that_do_not_fit_are_refused() {
    let breaks: [(&str, Break); 16] = [
        ("fixed stiffness", |s, _, _, _, _| s.k_fixed = Dense::zeros(R - 1, R)),
        ("fixed mass", |s, _, _, _, _| s.m_fixed = Dense::zeros(R * R, 1)),
        ("a parameter's part of K or M", |s, _, _, _, _| s.terms[0].k = Some(Dense::zeros(1, R * R))),
        ("parameters", |s, _, _, _, _| s.terms[0].exponents[0].0 = 9),
        ("prior means", |s, _, _, _, _| s.mean.truncate(3)),
        ("prior standard deviations", |s, _, _, _, _| s.sd.push(1.0)),
        ("prior means", |s, _, _, _, _| s.n_tuned = R + 1),
        ("basis rows of the sensors", |_, r, _, _, _| r.out_rows = Dense::zeros(4, R + 1)),
        ("basis rows of the forces", |_, r, _, _, _| r.in_rows = Dense::zeros(1, 0)),
        ("spectra of the forces", |_, r, _, _, _| r.u.truncate(5)),
        ("spectra of the responses", |_, r, _, _, _| r.y.truncate(5)),
        ("weights", |_, r, _, _, _| r.weight.clear()),
        ("direction vectors", |_, _, h, _, _| h.w = Dense::zeros(1, R - 2)),
        ("residual compliances", |_, _, h, _, _| h.compliance.clear()),
        ("start values", |_, _, _, p, _| p.truncate(2)),
        ("start values of the law", |_, _, _, _, x| x.push(0.0)),
    ];
    let (kinds, law) = laws();
    for (wanted, change) in breaks {
        let numbers = &mut Numbers(2);
        let mut system = system(numbers, 3, 0.01);
        let mut record = record(numbers, 4, 1, 0.5);
        let mut hypothesis = closed(numbers, 1, &kinds, &law);
        let (mut p, mut x) = (system.mean.clone(), law.clone());
        change(&mut system, &mut record, &mut hypothesis, &mut p, &mut x);
        let records = [record];
        let solved = solve(&system, &records, &hypothesis, &p, &x, settings()).map(|_| ());
        let told = fitted(&system, &records, &hypothesis, &p, &x).map(|_| ());
        for outcome in [solved, told] {
            match outcome {
                Err(IdentifyError::Shape { what, .. }) => assert_eq!(what, wanted),
                other => panic!("{wanted}: {other:?}"),
            }
        }
    }
}

#[test]
fn unknowns_without_a_model_are_an_error_and_no_panic() {
    let numbers = &mut Numbers(2);
    let system = system(numbers, 3, 0.01);
    let records = [record(numbers, 4, 1, 0.5)];
    let (kinds, law) = laws();
    let hypothesis = closed(numbers, 1, &kinds, &law);
    for (i, value) in [(0, f64::NAN), (1, 1e4), (0, f64::INFINITY)] {
        let mut p = system.mean.clone();
        p[i] = value;
        assert!(
            solve(&system, &records, &hypothesis, &p, &law, settings()).is_err(),
            "unknown {i} = {value}"
        );
    }
    let mut x = law.clone();
    x[0] = f64::NAN;
    assert!(matches!(
        solve(&system, &records, &hypothesis, &system.mean, &x, settings()),
        Err(IdentifyError::Law(_))
    ));
}
