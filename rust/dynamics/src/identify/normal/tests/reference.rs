//! Responses, fitted lines and batches against plain formulas, a line at a time.

use super::*;
use crate::identify::{Hypothesis, IdentifyError, Job, Race, System, fitted, solve, solve_batch};
use femend_linalg::solve_complex_dense;

/// (dynamic stiffness + what each law adds at its coordinate) q = load, one dense complex system in modal coordinates
/// with the coordinates' forces as further unknowns: D = W q - compliance F, F = kappa D.
fn plain(
    system: &System,
    record: &RecordLines,
    hypothesis: &Hypothesis,
    z: &[f64],
    k: usize,
) -> Vec<Complex64> {
    let (p, x) = z.split_at(system.n_unknowns());
    let modal = system.modal(p).expect("modes");
    let (s, n_w) = (record.s[k], hypothesis.w.nrows());
    let n = R + n_w;
    let shape =
        |rows: &Dense, i: usize, m: usize| -> f64 { (0..R).map(|j| rows[(i, j)] * modal.q[(j, m)]).sum() };
    let laws = hypothesis.stiffness(x, &[s]).expect("laws");
    let kappa = |i: usize| laws.kappa[laws.group[i]][0];
    let (mut a, mut b) = (vec![Complex64::default(); n * n], vec![Complex64::default(); n]);
    for m in 0..R {
        let (w, zeta) = (modal.omega[m], modal.zeta[m]);
        a[m * n + m] = w * w + s * s + 2.0 * zeta * w * s;
        b[m] =
            (0..record.n_in()).map(|i| record.u[k * record.n_in() + i] * shape(&record.in_rows, i, m)).sum();
        for i in 0..n_w {
            a[(R + i) * n + m] = shape(&hypothesis.w, i, m).into();
            a[m * n + R + i] = -kappa(i) * shape(&hypothesis.w, i, m);
        }
    }
    (0..n_w).for_each(|i| a[(R + i) * n + R + i] = 1.0 + kappa(i) * hypothesis.compliance[i]);
    let q = solve_complex_dense(n, &a, &b).expect("regular");
    (0..record.n_out()).map(|o| (0..R).map(|m| s * s * q[m] * shape(&record.out_rows, o, m)).sum()).collect()
}

fn all_laws() -> Vec<(Vec<Kind>, Vec<f64>)> {
    let with = |kinds: &[Kind], values: &[f64]| (kinds.to_vec(), values.iter().map(|v| v.ln()).collect());
    vec![
        laws(),
        with(&[Kind::Absorber], &[0.4, 2500.0, 7.0]),
        with(&[Kind::Mass, Kind::Structural], &[0.3, 600.0, 0.2]),
        with(&[Kind::Absorber, Kind::Viscoelastic], &[0.2, 900.0, 30.0, 300.0, 500.0, 0.012]),
    ]
}

#[test]
fn responses_equal_dense_solutions_line_by_line() {
    let numbers = &mut Numbers(17);
    let mut cases = vec![apart(numbers), (nothing(), vec![])];
    for (kinds, x) in all_laws() {
        cases.extend([1, 3].map(|n_w| (closed(numbers, n_w, &kinds, &x), x.clone())));
    }
    for (hypothesis, x) in cases {
        let system = system(numbers, 3, 0.02);
        let record = RecordLines { dt: 0.0, ..bare(record(numbers, 4, 2, 1.5)) };
        let z = start(&system, &x);
        let (p, x) = z.split_at(system.n_unknowns());
        let found = fitted(&system, std::slice::from_ref(&record), &hypothesis, p, x).expect("lines");
        for k in 0..N_LINES {
            let expected = plain(&system, &record, &hypothesis, &z, k);
            let size = expected.iter().fold(0.0_f64, |a, v| a.max(v.norm()));
            for (a, b) in found[0].y[k * 4..].iter().zip(&expected) {
                assert!((a - b).norm() < 1e-10 * size, "{:?}, line {k}: {a} and {b}", hypothesis.what);
            }
        }
    }
}

/// What the cost says is left over is what the fitted lines leave, with the prior of the decays.
#[test]
fn fitted_lines_leave_the_cost() {
    let numbers = &mut Numbers(29);
    let mut hypotheses = vec![(nothing(), vec![]), (free(numbers, 1), vec![]), (free(numbers, 3), vec![])];
    hypotheses.push(apart(numbers));
    for (kinds, x) in all_laws() {
        hypotheses.extend([1, 3].map(|n_w| (closed(numbers, n_w, &kinds, &x), x.clone())));
    }
    for (hypothesis, x) in hypotheses {
        let system = system(numbers, 3, 0.02);
        let record = record(numbers, 5, 2, 0.3);
        let z = start(&system, &x);
        let p = &z[..system.n_unknowns()];
        let (modal, prepared) = (system.modal(p).expect("modes"), Prepared::new(&record));
        let step = Step::new(&prepared, &system, &modal, &hypothesis, &x, &mut Workspace::default());
        let step = step.expect("response");
        let lines = fitted(&system, std::slice::from_ref(&record), &hypothesis, p, &x).expect("lines");
        let left: f64 = (lines[0].y.iter().zip(&record.y).zip(&record.weight))
            .map(|((a, b), w)| ((a - b) * w).norm_sqr())
            .sum();
        let prior: f64 = step.amplitudes.iter().zip(&step.decays.ridge).map(|(a, r)| a * a * r).sum();
        assert!(step.decays.len() >= 6, "{} decays", step.decays.len());
        assert!(prior > 0.0);
        // the sum of squares explained is close to the whole one where there are nearly as many decays as lines
        assert!((left + prior - step.sum).abs() < 1e-7 * step.sum, "{} + {prior}, not {}", left, step.sum);
    }
}

/// Models, records and hypotheses of a batch, and the law's unknowns.
fn parts() -> ([System; 2], [RecordLines; 2], [Hypothesis; 4], Vec<f64>) {
    let numbers = &mut Numbers(37);
    let systems = [system(numbers, 3, 0.02), system(numbers, 2, 0.01)];
    let records = [record(numbers, 4, 1, 0.3), record(numbers, 5, 2, 0.3)];
    let (kinds, x) = laws();
    let hypotheses = [nothing(), free(numbers, 1), free(numbers, 2), closed(numbers, 1, &kinds, &x)];
    (systems, records, hypotheses, x)
}

/// Jobs that share a model and its start, jobs that do not, and one whose start has no model.
fn jobs<'a>(systems: &'a [System], hypotheses: &'a [Hypothesis], x: &[f64]) -> Vec<Job<'a>> {
    let mut jobs = Vec::new();
    for system in systems {
        for hypothesis in hypotheses {
            let x = if hypothesis.n_law() > 0 { x.to_vec() } else { vec![] };
            jobs.push(Job { system, hypothesis, p: system.mean.clone(), x });
        }
    }
    jobs.push(Job { p: vec![f64::INFINITY; jobs[0].p.len()], ..jobs[0].clone() });
    jobs.push(Job { p: jobs[1].p.iter().map(|v| v + 0.01).collect(), ..jobs[1].clone() });
    jobs
}

#[test]
fn a_batch_gives_what_its_jobs_give_alone() {
    let (systems, records, hypotheses, x) = parts();
    let jobs = jobs(&systems, &hypotheses, &x);
    let settings = Settings { iterations: 3, ..Settings::default() };
    // a race in which all stay together changes nothing
    for heats in [vec![], vec![(1, f64::MAX), (2, f64::MAX)]] {
        let race = Race { heats, groups: Vec::new() };
        for (i, (job, found)) in jobs.iter().zip(solve_batch(&jobs, &records, settings, &race)).enumerate() {
            match (found, solve(job.system, &records, job.hypothesis, &job.p, &job.x, settings)) {
                (Ok(a), Ok(b)) => {
                    assert_eq!((&a.p, &a.x, a.at.cost), (&b.p, &b.x, b.at.cost), "job {i}");
                    assert_eq!(a.at.hessian, b.at.hessian, "job {i}");
                    assert!(a.iterations > 0);
                }
                (Err(a), Err(b)) => assert!(a == b && i == 8, "job {i}: {a:?} and {b:?}"),
                (a, b) => panic!("job {i}: {} in a batch, {} alone", a.is_ok(), b.is_ok()),
            }
        }
    }
}

#[test]
fn those_far_behind_the_best_of_their_group_stop_where_they_are() {
    let (systems, records, hypotheses, x) = parts();
    let jobs = jobs(&systems, &hypotheses, &x);
    let settings = Settings { iterations: 5, tolerance: 0.0, ..Settings::default() };
    let alone = |job: &Job<'_>, iterations| {
        let settings = Settings { iterations, ..settings };
        solve(job.system, &records, job.hypothesis, &job.p, &job.x, settings)
    };
    let costs: Vec<_> = jobs.iter().map(|j| alone(j, 1).map_or(f64::INFINITY, |s| s.at.cost)).collect();
    let groups: Vec<usize> = (0..jobs.len()).map(|i| i % 2).collect();
    let least = |group: usize| costs.iter().skip(group).step_by(2).fold(f64::INFINITY, |a, b| a.min(*b));
    let race = Race { heats: vec![(1, 1.0)], groups: groups.clone() };
    let found = solve_batch(&jobs, &records, settings, &race);
    for (i, (job, found)) in jobs.iter().zip(found).enumerate().filter(|(i, _)| *i != 8) {
        let found = found.expect("a minimum");
        let goes_on = costs[i] <= least(groups[i]);
        let expected = alone(job, if goes_on { 5 } else { 1 }).expect("a minimum");
        assert_eq!((&found.p, found.at.cost), (&expected.p, expected.at.cost), "job {i}");
        assert!(goes_on || (!found.converged && found.iterations == 1), "job {i}");
    }
    let short = Race { heats: vec![(1, 1.0)], groups: vec![0] };
    let refused = solve_batch(&jobs, &records, settings, &short);
    assert!(
        refused.iter().all(|r| matches!(r, Err(IdentifyError::Shape { what: "groups of the race", .. })))
    );
}

/// Laws at no coordinate at all leave the model alone.
#[test]
fn laws_without_coordinates_change_nothing() {
    let numbers = &mut Numbers(37);
    let (system, record) = (system(numbers, 3, 0.02), record(numbers, 4, 1, 0.3));
    let (kinds, x) = laws();
    let (w, what) = (Dense::zeros(0, R), What::everywhere(&kinds, 0));
    let nowhere = Hypothesis { w, what, compliance: vec![], ..closed(numbers, 1, &kinds, &x) };
    let p = system.mean.clone();
    let with = evaluate(&system, std::slice::from_ref(&record), &nowhere, &p, &x);
    let without = evaluate(&system, std::slice::from_ref(&record), &nothing(), &p, &[]);
    assert!((with.cost - without.cost).abs() < 1e-10 * without.cost);
    for (a, b) in with.gradient.iter().zip(&without.gradient) {
        assert!((a - b).abs() < 1e-10 * (1.0 + b.abs()), "{a} and {b}");
    }
}

/// What an evaluation takes it gives back: a minimisation of any length keeps the same arrays.
#[test]
fn evaluations_do_not_gather_arrays() {
    let numbers = &mut Numbers(43);
    let system = system(numbers, 3, 0.02);
    let records = [record(numbers, 4, 1, 0.3), record(numbers, 5, 2, 0.3)];
    let prepared: Vec<Prepared<'_>> = records.iter().map(Prepared::new).collect();
    for (kinds, x) in all_laws() {
        for hypothesis in [nothing(), free(numbers, 2), closed(numbers, 2, &kinds, &x)] {
            let x = if hypothesis.n_law() > 0 { x.clone() } else { vec![] };
            let ws = &mut Workspace::default();
            let mut held = Vec::new();
            for _ in 0..4 {
                let model = Model { modal: system.modal(&system.mean).expect("modes"), slopes: None };
                let start = (model, system.mean.clone(), x.clone());
                let mut point = Point::new(&system, &prepared, &hypothesis, start, ws).expect("cost");
                point.derive(&system, &hypothesis, Matrix::Whole, ws);
                held.push(ws.n_free());
            }
            assert!(held[0] > 0 && held[1] == held[3], "{held:?} arrays");
        }
    }
}
