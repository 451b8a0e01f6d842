//! Ordering, factorisation and block solve on a cube of nodes with three DOFs each, coupled as by 8-node solids.

use std::hint::black_box;
use std::sync::Arc;

use criterion::{Criterion, criterion_group, criterion_main};
use femend_linalg::{Dense, Factor, Kind, Ordering, Pattern, Symbolic};

/// 27-point stencil with 3 x 3 blocks, diagonally dominant.
fn cube(m: usize) -> (Arc<Pattern>, Vec<f64>) {
    let at = |x: usize, y: usize, z: usize| (x * m + y) * m + z;
    let mut entries = Vec::new();
    for x in 0..m {
        for y in 0..m {
            for z in 0..m {
                for step in 0..27 {
                    let (u, v, w) = (x + step / 9, y + step / 3 % 3, z + step % 3);
                    if u > 0 && v > 0 && w > 0 && u <= m && v <= m && w <= m {
                        let (i, j) = (at(x, y, z), at(u - 1, v - 1, w - 1));
                        entries.extend((0..9).map(|c| (3 * i + c / 3, 3 * j + c % 3)));
                    }
                }
            }
        }
    }
    let pattern = Arc::new(Pattern::from_entries(3 * m * m * m, entries).expect("rows are in range"));
    let mut values = vec![-1.0; pattern.nnz()];
    for j in 0..pattern.n() {
        let degree = pattern.column(j).len() as f64;
        values[pattern.position(j, j).expect("the diagonal is stored")] = degree;
    }
    (pattern, values)
}

fn benches(c: &mut Criterion) {
    let (pattern, values) = cube(18);
    let mut group = c.benchmark_group("factor, cube of 17 496 DOFs");
    group.sample_size(10);
    group.bench_function("order and analyse", |b| {
        b.iter(|| Symbolic::new(black_box(pattern.clone()), Ordering::Auto).expect("orders"));
    });
    let symbolic = Arc::new(Symbolic::new(pattern.clone(), Ordering::Auto).expect("orders"));
    for (name, kind) in [("Cholesky, refresh", Kind::Cholesky), ("pivoted, refresh", Kind::Indefinite)] {
        let mut factor = Factor::new(symbolic.clone(), &values, kind, None).expect("is positive definite");
        group.bench_function(name, |b| {
            b.iter(|| factor.refresh(black_box(&values), None).expect("factorises"))
        });
    }
    let factor = Factor::new(symbolic, &values, Kind::Cholesky, None).expect("is positive definite");
    let rhs = Dense::from_vec(pattern.n(), 16, (0..16 * pattern.n()).map(|i| (i % 13) as f64).collect());
    group.bench_function("solve 16 right-hand sides", |b| b.iter(|| factor.solve(black_box(&rhs))));
    group.finish();
}

criterion_group!(all, benches);
criterion_main!(all);
