//! The gradient by the adjoint against that of the columns.

use super::*;
use femend_linalg::gemm_tn;

fn by_adjoint(
    system: &System,
    records: &[RecordLines],
    hypothesis: &Hypothesis,
    p: &[f64],
    x: &[f64],
) -> Vec<f64> {
    let prepared: Vec<Prepared<'_>> = records.iter().map(Prepared::new).collect();
    let model = Model { modal: system.modal(p).expect("modes"), slopes: None };
    let ws = &mut Workspace::default();
    let start = (model, p.to_vec(), x.to_vec());
    let mut point = Point::new(system, &prepared, hypothesis, start, ws).expect("cost");
    point.derive_once(system, hypothesis, (Gradient::Exact, Dense::zeros(0, 0)), ws);
    point.at.gradient
}

fn all_hypotheses(numbers: &mut Numbers) -> Vec<(Hypothesis, Vec<f64>)> {
    let (kinds, x) = laws();
    let (pushed, free_too) = (closed(numbers, 3, &kinds, &x), apart(numbers));
    vec![
        (nothing(), vec![]),
        (free(numbers, 1), vec![]),
        (free(numbers, 2), vec![]),
        (closed(numbers, 1, &kinds, &x), x.clone()),
        (Hypothesis { free: 1, ..pushed.clone() }, x.clone()),
        (pushed, x.clone()),
        (
            closed(numbers, 1, &[Kind::Absorber], &[0.4, 900.0, 3.0].map(f64::ln)),
            [0.4, 900.0, 3.0].map(f64::ln).to_vec(),
        ),
        free_too,
    ]
}

/// Minus half the gradient by the columns, which hold free decays still.
fn by_columns(system: &System, record: &RecordLines, hypothesis: &Hypothesis, z: &[f64]) -> Vec<f64> {
    let (columns, left) = columns_and_residual(system, record, hypothesis, z);
    let down = gemm_tn(&columns, &Dense::from_vec(left.len(), 1, left));
    down.data().iter().map(|v| v * record.share).collect()
}

/// The same sums in another order: all but the last digits. Where no mode is tuned there are no decays.
#[test]
fn the_adjoint_gives_the_gradient_of_the_columns() {
    let numbers = &mut Numbers(23);
    for (n_in, sigma) in [(1, 0.0), (2, 6.0), (0, 0.0)] {
        for (which, (hypothesis, x)) in all_hypotheses(numbers).into_iter().enumerate() {
            if n_in == 0 && hypothesis.n_free() == 0 {
                continue;
            }
            let system = system(numbers, 0, 0.02);
            let record = bare(record(numbers, 4, n_in, sigma));
            let z = start(&system, &[]);
            let all: Vec<f64> = z.iter().chain(&x).copied().collect();
            let columns = by_columns(&system, &record, &hypothesis, &all);
            let adjoint = by_adjoint(&system, std::slice::from_ref(&record), &hypothesis, &z, &x);
            let prior: Vec<f64> =
                deviations(&system, &hypothesis, &z, &x).iter().map(|(v, sd)| v / sd).collect();
            let size = columns.iter().fold(0.0_f64, |a, v| a.max(v.abs()));
            for (j, (a, (prior, b))) in adjoint.iter().zip(prior.iter().zip(&columns)).enumerate() {
                let b = prior - b;
                assert!((a - b).abs() < 1e-9 * size, "hypothesis {which}, unknown {j}: {a} and {b}");
            }
        }
    }
}

/// Distances of the gradient from central differences of the cost, relative to these but at least to the cost itself's
/// thousandth.
fn off(system: &System, record: &RecordLines, hypothesis: &Hypothesis, z: &[f64], x: &[f64]) -> Vec<f64> {
    let records = std::slice::from_ref(record);
    let gradient = by_adjoint(system, records, hypothesis, z, x);
    let all: Vec<f64> = z.iter().chain(x).copied().collect();
    let cost = |at: &[f64]| evaluate(system, records, hypothesis, &at[..z.len()], &at[z.len()..]).cost;
    let least = 1e-3 * cost(&all);
    (0..all.len())
        .map(|j| {
            let h = 1e-5;
            let (mut up, mut down) = (all.clone(), all.clone());
            (up[j], down[j]) = (up[j] + h, down[j] - h);
            let expected = (cost(&up) - cost(&down)) / (4.0 * h);
            (gradient[j] - expected).abs() / expected.abs().max(least)
        })
        .collect()
}

/// Free decays move with the modes, a free force moves with all. With next to no damping all is exact; with some, the
/// damping between modes is left out of what parameters do.
#[test]
fn the_gradient_is_that_of_the_cost_with_free_decays() {
    let numbers = &mut Numbers(31);
    for (zeta, allowed) in [(1e-6, 1e-4), (0.01, 1e-2)] {
        let system = system(numbers, 3, zeta);
        for hypothesis in [nothing(), free(numbers, 1), free(numbers, 2)] {
            let record = record(numbers, 5, 1, 0.3);
            let mut z = start(&system, &[]);
            z[2..5].copy_from_slice(&[0.004, -0.003, 0.002]);
            let off = off(&system, &record, &hypothesis, &z, &[]);
            assert!(off.iter().all(|v| *v < allowed), "damping {zeta}: {off:?}");
            assert!(off[2..].iter().all(|v| *v < 1e-4), "damping {zeta}: {off:?}");
        }
    }
}

/// The decays of laws' inner states are of a size that the laws' parameters move, which is left out.
#[test]
fn the_gradient_is_that_of_the_cost_with_laws_and_free_decays() {
    let numbers = &mut Numbers(37);
    let all = [
        (vec![Kind::Spring], vec![900.0], 1e-4),
        (vec![Kind::Spring, Kind::Dashpot], vec![900.0, 6.0], 1e-4),
        (vec![Kind::Mass], vec![0.3], 1e-4),
        (vec![Kind::Spring, Kind::Viscoelastic], vec![900.0, 300.0, 500.0, 0.012], 1e-1),
    ];
    for (kinds, values, allowed) in all {
        let x: Vec<f64> = values.into_iter().map(f64::ln).collect();
        for (n_w, free) in [(1, 0), (2, 0), (2, 1)] {
            let system = system(numbers, 3, 1e-4);
            let record = record(numbers, 5, 1, 0.3);
            let hypothesis = Hypothesis { free, ..closed(numbers, n_w, &kinds, &x) };
            let off = off(&system, &record, &hypothesis, &start(&system, &[]), &x);
            let (parameters, others) = off.split_at(2);
            assert!(parameters.iter().all(|v| *v < 1e-2), "{kinds:?} at {n_w}: {off:?}");
            assert!(others.iter().all(|v| *v < allowed), "{kinds:?} at {n_w}: {off:?}");
        }
    }
}
