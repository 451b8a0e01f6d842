//! One hypothesis after another on the spectral lines of one record: the model alone, a free force, a spring and dashpot.

use std::f64::consts::TAU;
use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use femend_dynamics::identify::{
    Dashpots, Hypothesis, PickedUp, RecordLines, Settings, System, Term, What, solve,
};
use femend_dynamics::laws::Kind;
use femend_linalg::Dense;
use num_complex::Complex64;

const R: usize = 30;
const N_TUNED: usize = 12;
const LINES: usize = 500;
const N_OUT: usize = 12;

fn wave(rows: usize, scale: f64) -> Dense {
    let values = (0..rows * R).map(|i| scale * (1.0 + 0.7 * i as f64).sin()).collect();
    Dense::from_vec(rows, R, values)
}

fn diagonal(value: impl Fn(usize) -> f64) -> Dense {
    let mut a = Dense::zeros(R, R);
    (0..R).for_each(|i| a[(i, i)] = value(i));
    a
}

/// Modes every 20 Hz; one parameter scales the whole stiffness, another a tenth of the mass.
fn system() -> System {
    let n = 2 + 2 * N_TUNED + 1;
    let mut mean = vec![0.0; n];
    mean[2 + N_TUNED..].fill(0.01_f64.ln());
    let mut sd = vec![0.005; n];
    sd[..2].fill(0.1);
    sd[2 + N_TUNED..].fill(0.5);
    let stiff = |i: usize| (TAU * 20.0 * (i + 1) as f64).powi(2);
    System {
        r: R,
        k_fixed: Dense::zeros(R, R),
        m_fixed: diagonal(|_| 0.9),
        terms: vec![
            Term { exponents: vec![(0, 1.0)], k: Some(diagonal(stiff)), m: None },
            Term { exponents: vec![(1, 1.0)], k: None, m: Some(diagonal(|i| 0.2 * (i % 2) as f64)) },
        ],
        n_par: 2,
        n_tuned: N_TUNED,
        mean,
        sd,
        dashpots: Dashpots::none(),
    }
}

/// Responses to a unit force of the system at the given unknowns, with a weight as of 1 % noise.
fn record(system: &System, p: &[f64]) -> RecordLines {
    let (out_rows, in_rows) = (wave(N_OUT, 1.0), wave(1, 0.8));
    let modal = system.modal(p).expect("is positive definite");
    let rows = |a: &Dense, i: usize, r: usize| (0..R).map(|j| a[(i, j)] * modal.q[(j, r)]).sum::<f64>();
    let s: Vec<Complex64> = (0..LINES).map(|l| Complex64::new(0.0, TAU * (8.0 + 0.5 * l as f64))).collect();
    let mut y = Vec::with_capacity(LINES * N_OUT);
    for s in &s {
        for o in 0..N_OUT {
            y.push(
                (0..R)
                    .map(|r| {
                        let (w, z) = (modal.omega[r], modal.zeta[r]);
                        s * s * (rows(&out_rows, o, r) * rows(&in_rows, 0, r))
                            / (w * w + s * s + 2.0 * z * w * s)
                    })
                    .sum::<Complex64>(),
            );
        }
    }
    let rms = (y.iter().map(|v| v.norm_sqr()).sum::<f64>() / y.len() as f64).sqrt();
    RecordLines {
        cut_off: Vec::new(),
        picked_up: PickedUp::default(),
        u: vec![Complex64::ONE; LINES],
        weight: vec![100.0 / rms; LINES * N_OUT],
        s,
        y,
        out_rows,
        in_rows,
        dt: 1e-3,
        n_samples: 2000.0,
        thinning: 1.0,
        sigma: 0.0,
        driven_to: 0.0,
        share: 0.1,
    }
}

fn hypothesis(what: What, law_mean: Vec<f64>) -> Hypothesis {
    let n_w = usize::from(!matches!(what, What::Nothing));
    Hypothesis {
        w: wave(n_w, 0.5),
        what,
        free: 0,
        compliance: vec![0.0; n_w],
        held: Vec::new(),
        law_sd: vec![3.0; law_mean.len()],
        law_mean,
    }
}

fn benches(c: &mut Criterion) {
    let system = system();
    let mut truth = system.mean.clone();
    (truth[0], truth[1]) = (0.05, -0.04);
    let records = [record(&system, &truth)];
    let start = system.mean.clone();
    let spring = vec![(1e4_f64).ln(), (1e1_f64).ln()];
    let mut group = c.benchmark_group(format!("identify, {R} modes, {LINES} lines x {N_OUT} sensors"));
    group.sample_size(10);
    for (name, hypothesis) in [
        ("model alone", hypothesis(What::Nothing, Vec::new())),
        ("free force at one place", hypothesis(What::FreeForce, Vec::new())),
        (
            "spring and dashpot at one place",
            hypothesis(What::everywhere(&[Kind::Spring, Kind::Dashpot], 1), spring),
        ),
    ] {
        group.bench_function(name, |b| {
            b.iter(|| {
                let x = &hypothesis.law_mean;
                solve(&system, black_box(&records), &hypothesis, &start, x, Settings::default())
                    .expect("solves")
            });
        });
    }
    group.finish();
}

criterion_group!(all, benches);
criterion_main!(all);
