//! Fits of lines made from known unknowns.

use super::*;
use crate::identify::solve;

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
    let (prepared, ws) = (Prepared::new(record), &mut Workspace::default());
    let response = Response::new(&prepared, &modal, hypothesis, x, system.n_tuned, ws).expect("response");
    let n_out = record.n_out();
    let size = (0..N_LINES * n_out).map(|i| response.y.get(i % n_out, i / n_out).norm()).fold(0.0, f64::max);
    for k in 0..N_LINES {
        for s in 0..n_out {
            let pushed: Complex64 = force.map_or_else(Complex64::default, |f| {
                (0..f.n_columns()).map(|i| response.h.get(i * n_out + s, k) * f.get(i, k)).sum()
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
        let sparing = Settings { derivatives: false, ..settings() };
        let same = solve(&system, &records, &hypothesis, &system.mean, &begin, sparing).expect("solution");
        assert_eq!((&same.p, &same.x, same.at.cost), (&found.p, &found.x, found.at.cost));
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
        let mut force = Split::zeros(N_LINES, 1);
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
