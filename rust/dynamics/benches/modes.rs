//! Twenty modes of a net of masses, and modal FRFs of 60 modes.

use std::f64::consts::TAU;
use std::hint::black_box;
use std::sync::Arc;

use criterion::{Criterion, criterion_group, criterion_main};
use femend_dynamics::{FrfKind, ModalModel, ModeOptions, modes};
use femend_linalg::{Dense, Ordering, Pattern, Symbolic, SymmetricCsc};
use num_complex::Complex64;

/// Net of m x (m + 3) unit masses and springs, clamped at its rim.
fn net(m: usize) -> (SymmetricCsc, SymmetricCsc) {
    let w = m + 3;
    let n = m * w;
    let down = (0..n - w).map(|i| (i + w, i));
    let right = (0..n).filter(|i| i % w + 1 < w).map(|i| (i + 1, i));
    let pattern = Arc::new(Pattern::from_entries(n, down.chain(right)).expect("rows are in range"));
    let fill = |diagonal: f64, off: f64| {
        let mut values = vec![off; pattern.nnz()];
        for j in 0..n {
            values[pattern.position(j, j).expect("the diagonal is stored")] = diagonal;
        }
        SymmetricCsc::new(pattern.clone(), values, "net").expect("is symmetric")
    };
    (fill(4.0, -1.0), fill(1.0, 0.0))
}

fn eigen(c: &mut Criterion) {
    let (k, m) = net(150);
    let symbolic = Arc::new(Symbolic::new(k.pattern().clone(), Ordering::Auto).expect("orders"));
    let mut group = c.benchmark_group("modes, net of 22 950 DOFs");
    group.sample_size(10);
    let options = ModeOptions { n_modes: Some(20), ..Default::default() };
    group.bench_function("20 modes, cold", |b| {
        b.iter(|| modes(&symbolic, black_box(&k), &m, &options).expect("converges"));
    });
    let start = modes(&symbolic, &k, &m, &options).expect("converges").phi;
    let warm = ModeOptions { start: Some(start), ..options };
    // an uneven change, so that the shapes change too
    let mut values = k.values().to_vec();
    for j in 0..k.n() {
        values[k.pattern().position(j, j).expect("the diagonal is stored")] += 1e-3 * (j as f64).sin().abs();
    }
    let changed = SymmetricCsc::new(k.pattern().clone(), values, "net").expect("is symmetric");
    group.bench_function("20 modes, warm", |b| {
        b.iter(|| modes(&symbolic, black_box(&changed), &m, &warm).expect("converges"));
    });
    group.finish();
}

fn frf(c: &mut Criterion) {
    let shape =
        |rows: usize, r: usize| Dense::from_vec(rows, r, (0..rows * r).map(|i| (i as f64).sin()).collect());
    let (n_out, n_in, r) = (100, 5, 60);
    let model = ModalModel {
        omega: (1..=r).map(|j| TAU * 10.0 * j as f64).collect(),
        zeta: vec![0.01; r],
        phi_out: shape(n_out, r),
        phi_in: shape(n_in, r),
    };
    let s: Vec<Complex64> = (1..=4000).map(|l| Complex64::new(0.0, TAU * 0.2 * f64::from(l))).collect();
    let mut out = vec![Complex64::ZERO; s.len() * n_out * n_in];
    c.bench_function("modal FRF, 100 x 5 x 60 modes x 4000 lines", |b| {
        b.iter(|| model.frf(black_box(&s), FrfKind::Accelerance, None, &mut out).expect("fits"));
    });
}

criterion_group!(all, eigen, frf);
criterion_main!(all);
