//! One closed-loop record of 6144 samples in two substeps each: 30 modes, five outputs, one law; alone, with its
//! derivatives, and with twenty models moved a little beside it.

use criterion::{Criterion, criterion_group, criterion_main};
use femend_dynamics::laws::{Kind, Law};
use femend_dynamics::simulate::{ModalModel, Output, Run, simulate_tangents};
use std::hint::black_box;
use std::time::Duration;

/// Numbers in (-1, 1) that look random and are the same every time.
fn spread(n: usize, seed: f64) -> Vec<f64> {
    (0..n).map(|i| ((i as f64 + seed) * 12.9898).sin() * 43758.5453 % 1.0).collect()
}

fn records(criterion: &mut Criterion) {
    let (r, n, n_out) = (30, 6144, 5);
    let omega: Vec<f64> = (0..r).map(|i| std::f64::consts::TAU * (12.0 + 48.0 * i as f64)).collect();
    let zeta = vec![0.01; r];
    let (phi_in, phi_out, w) = (spread(r, 1.0), spread(r * n_out, 2.0), spread(r, 3.0));
    let model = ModalModel {
        omega: &omega,
        zeta: &zeta,
        phi_in: &phi_in,
        phi_out: &phi_out,
        w: &w,
        residual_compliance: None,
    };
    let u: Vec<f64> = spread(n, 4.0).iter().map(|x| 170.0 * x).collect();
    let laws = [
        (Kind::Spring, vec![2e4]),
        (Kind::Viscoelastic, vec![1e4, 2e4, 3e-3]),
        (Kind::Absorber, vec![0.1, 1e4, 1.0]),
        (Kind::Cubic, vec![1e11]),
        (Kind::Clearance, vec![5e4, 1e-4, 1.0]),
        (Kind::Coulomb, vec![5.0, 1e5]),
        (Kind::BoucWen, vec![3e4, 0.1, 1.5, 3e4, 1.5e4]),
    ];
    let mut group = criterion.benchmark_group("record 6144 x 2, 30 modes");
    group.sample_size(20).measurement_time(Duration::from_secs(2)).warm_up_time(Duration::from_millis(300));
    for (kind, p) in laws {
        let laws = [vec![Law::new(kind, &p).expect("bench laws are valid")]];
        let run = Run {
            u: &u,
            n,
            dt: 1.0 / 4096.0,
            substeps: 2,
            stride: 1,
            decimate: 1,
            output: Output::Acceleration,
        };
        for (beside, slopes, n_moved) in
            [("", false, 0), (", all slopes", true, 0), (", twenty models beside", false, 20)]
        {
            let (wanted, moved) = (vec![slopes; p.len()], vec![model; n_moved]);
            group.bench_function(format!("{}{beside}", kind.name()), |b| {
                b.iter(|| simulate_tangents(black_box(&model), &laws, &run, &wanted, &moved));
            });
        }
    }
    group.finish();
}

criterion_group!(benches, records);
criterion_main!(benches);
