//! Factors of random sparse matrices against dense algebra.

use std::sync::Arc;

use femend_linalg::{
    ComplexFactor, Dense, Factor, Kind, LinalgError, Ordering, Pattern, Symbolic, SymmetricCsc,
    solve_complex_dense,
};
use num_complex::Complex64;
use proptest::prelude::*;

/// Deterministic numbers in (-1, 1).
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

/// Pattern of `nodes` nodes with `w` DOFs each, coupled by the given pairs, and in a chain.
fn pattern(nodes: usize, w: usize, pairs: &[(usize, usize)]) -> Arc<Pattern> {
    let chain = (1..nodes).map(|i| (i - 1, i));
    let own = (0..nodes).map(|i| (i, i));
    let couples = pairs.iter().map(|&(a, b)| (a % nodes, b % nodes)).chain(chain).chain(own);
    let entries: Vec<_> =
        couples.flat_map(|(a, b)| (0..w * w).map(move |c| (a * w + c / w, b * w + c % w))).collect();
    Arc::new(Pattern::from_entries(nodes * w, entries).unwrap())
}

/// Symmetric values from a function of the place (row >= column).
fn fill<T: Copy>(p: &Pattern, zero: T, mut value: impl FnMut(usize, usize) -> T) -> Vec<T> {
    let mut values = vec![zero; p.nnz()];
    for j in 0..p.n() {
        for k in p.range(j) {
            let i = p.row_idx()[k] as usize;
            if i >= j {
                values[k] = value(i, j);
                values[p.position(j, i).unwrap()] = values[k];
            }
        }
    }
    values
}

/// Real symmetric values with a multiple of the identity added.
fn real(p: &Pattern, seed: u64, shift: f64) -> Vec<f64> {
    let mut noise = Noise(seed);
    fill(p, 0.0, |i, j| noise.next() + if i == j { shift } else { 0.0 })
}

fn dense(p: &Pattern, values: &[f64]) -> Dense {
    let mut a = Dense::zeros(p.n(), p.n());
    for j in 0..p.n() {
        for k in p.range(j) {
            a[(p.row_idx()[k] as usize, j)] = values[k];
        }
    }
    a
}

/// A block of loads.
fn loads(n: usize, k: usize) -> Dense {
    let mut noise = Noise(5);
    Dense::from_vec(n, k, (0..n * k).map(|_| noise.next()).collect())
}

fn worst(a: &Dense, b: &Dense) -> f64 {
    a.data().iter().zip(b.data()).fold(0.0, |m, (a, b)| m.max((a - b).abs()))
}

fn symbolic(p: &Arc<Pattern>, ordering: Ordering) -> Arc<Symbolic> {
    Arc::new(Symbolic::new(p.clone(), ordering).unwrap())
}

/// Nodes, DOFs per node, couples, seed.
fn cases() -> impl Strategy<Value = (usize, usize, Vec<(usize, usize)>, u64)> {
    (2usize..60, 1usize..5).prop_flat_map(|(nodes, w)| {
        (Just(nodes), Just(w), prop::collection::vec((0..nodes, 0..nodes), 0..2 * nodes), any::<u64>())
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn positive_definite_solutions_equal_dense_ones_under_every_order((nodes, w, pairs, seed) in cases()) {
        let p = pattern(nodes, w, &pairs);
        let rows = (0..p.n()).map(|j| p.column(j).len()).max().unwrap();
        let values = real(&p, seed, rows as f64 + 1.0);
        let (a, b) = (SymmetricCsc::new(p.clone(), values.clone(), "A").unwrap(), loads(p.n(), 3));
        let l = dense(&p, &values).cholesky().unwrap();
        let mut exact = b.clone();
        l.solve_lower_in_place(false, &mut exact);
        l.solve_lower_in_place(true, &mut exact);
        for ordering in [Ordering::Natural, Ordering::Amd, Ordering::NestedDissection] {
            for kind in [Kind::Cholesky, Kind::Indefinite] {
                let f = Factor::new(symbolic(&p, ordering), a.values(), kind, None).unwrap();
                prop_assert!(worst(&f.solve(&b), &exact) < 1e-13, "{:?} {:?}", ordering, kind);
                prop_assert_eq!(f.inertia().negative, 0);
                prop_assert_eq!(f.inertia().positive, p.n());
            }
        }
    }

    #[test]
    fn inertia_is_that_of_the_dense_matrix((nodes, w, pairs, seed) in cases()) {
        let p = pattern(nodes, w, &pairs);
        let values = real(&p, seed, 0.3);
        let eigen = dense(&p, &values).symmetric_eigen().unwrap().values;
        let size = eigen.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        prop_assume!(eigen.iter().all(|v| v.abs() > 1e-6 * size));
        let negative = eigen.iter().filter(|v| **v < 0.0).count();
        for ordering in [Ordering::Amd, Ordering::NestedDissection] {
            let f = Factor::new(symbolic(&p, ordering), &values, Kind::Indefinite, None).unwrap();
            prop_assert_eq!(f.inertia().negative, negative);
            let a = SymmetricCsc::new(p.clone(), values.clone(), "A").unwrap();
            let b = loads(p.n(), 2);
            // condition up to 1e6 and growth over supernode borders: the residual, not the error, is what is bounded
            let x = f.solve(&b);
            let scale = x.data().iter().fold(1.0f64, |m, v| m.max(v.abs()));
            prop_assert!(worst(&a.times(&x), &b) < 1e-8 * scale);
        }
    }

    #[test]
    fn complex_symmetric_solutions_equal_dense_ones((nodes, w, pairs, seed) in cases()) {
        let p = pattern(nodes, w, &pairs);
        let n = p.n();
        let mut noise = Noise(seed);
        let values = fill(&p, Complex64::ZERO, |i, j| {
            let shift = if i == j { Complex64::new(0.2, 0.7) } else { Complex64::ZERO };
            Complex64::new(noise.next(), noise.next()) + shift
        });
        let mut full = vec![Complex64::ZERO; n * n];
        for j in 0..n {
            p.range(j).for_each(|k| full[j * n + p.row_idx()[k] as usize] = values[k]);
        }
        let b: Vec<Complex64> = (0..2 * n).map(|_| Complex64::new(noise.next(), noise.next())).collect();
        let exact = solve_complex_dense(n, &full, &b).unwrap();
        let size = exact.iter().fold(0.0f64, |m, v| m.max(v.norm()));
        let f = ComplexFactor::new(symbolic(&p, Ordering::Auto), &values).unwrap();
        let mut x = b.clone();
        f.solve_in_place(&mut x);
        let worst = x.iter().zip(&exact).fold(0.0f64, |m, (a, b)| m.max((a - b).norm()));
        prop_assert!(worst < 1e-8 * size, "{:e} of {:e}", worst, size);
    }

    #[test]
    fn free_structures_are_singular((nodes, w, pairs, _) in cases()) {
        // the graph Laplacian of each DOF: constant vectors are in its null space
        let p = pattern(nodes, w, &pairs);
        let mut values = fill(&p, 0.0, |i, j| if i % w == j % w && i != j { -1.0 } else { 0.0 });
        for j in 0..p.n() {
            let sum: f64 = p.range(j).map(|k| values[k]).sum();
            values[p.position(j, j).unwrap()] = -sum;
        }
        let s = symbolic(&p, Ordering::Auto);
        let found = Factor::new(s.clone(), &values, Kind::Indefinite, None);
        let singular = matches!(found, Err(LinalgError::Singular { .. }));
        prop_assert!(singular, "{:?}", found.map(|f| f.inertia()));
        let complex: Vec<Complex64> = values.iter().map(|&v| Complex64::new(v, 0.02 * v)).collect();
        let found = ComplexFactor::new(s, &complex);
        let singular = matches!(found, Err(LinalgError::Singular { .. }));
        prop_assert!(singular, "{:?}", found.map(|f| f.probe()));
    }
}

#[test]
fn renumbered_dofs_give_the_same_solution() {
    let nodes = 90;
    let pairs: Vec<_> = (0..nodes).map(|i| (i, (i * 7 + 3) % nodes)).collect();
    let p = pattern(nodes, 3, &pairs);
    let n = p.n();
    let values = real(&p, 3, 30.0);
    let to = |i: usize| (i * 7 + 5) % n; // 7 does not divide 270
    let moved = (0..n).flat_map(|j| p.column(j).iter().map(move |&i| (to(i as usize), to(j))));
    let q = Arc::new(Pattern::from_entries(n, moved).unwrap());
    let mut renumbered = vec![0.0; q.nnz()];
    for j in 0..n {
        for k in p.range(j) {
            renumbered[q.position(to(p.row_idx()[k] as usize), to(j)).unwrap()] = values[k];
        }
    }
    let b = loads(n, 5);
    let mut c = Dense::zeros(n, 5);
    for column in 0..5 {
        (0..n).for_each(|i| c[(to(i), column)] = b[(i, column)]);
    }
    let x = Factor::new(symbolic(&p, Ordering::Auto), &values, Kind::Cholesky, None).unwrap().solve(&b);
    let y = Factor::new(symbolic(&q, Ordering::Auto), &renumbered, Kind::Cholesky, None).unwrap().solve(&c);
    for column in 0..5 {
        (0..n).for_each(|i| assert!((x[(i, column)] - y[(to(i), column)]).abs() < 1e-14));
    }
}

#[test]
fn any_number_of_threads_gives_the_same_factor() {
    // wide enough for divided subtrees and parallel products
    let m = 16;
    let at = |x: usize, y: usize, z: usize| (x * m + y) * m + z;
    let mut pairs = vec![];
    for (x, y, z) in (0..m * m * m).map(|i| (i / m / m, i / m % m, i % m)) {
        if x + 1 < m {
            pairs.push((at(x, y, z), at(x + 1, y, z)));
        }
        if y + 1 < m {
            pairs.push((at(x, y, z), at(x, y + 1, z)));
        }
    }
    let p = pattern(m * m * m, 3, &pairs);
    let values = real(&p, 9, 40.0);
    let b = loads(p.n(), 1);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            Factor::new(symbolic(&p, Ordering::NestedDissection), &values, Kind::Cholesky, None)
                .unwrap()
                .solve(&b)
        })
    };
    let (one, three) = (run(1), run(3));
    assert_eq!(one, three);
    let a = SymmetricCsc::new(p.clone(), values.clone(), "A").unwrap();
    assert!(worst(&a.times(&one), &b) < 1e-13);
}

#[test]
fn memory_is_known_before_the_factorisation() {
    let p = pattern(2000, 2, &(0..2000).map(|i| (i, (i + 45) % 2000)).collect::<Vec<_>>());
    let s = symbolic(&p, Ordering::Auto);
    let memory = s.memory();
    assert_eq!(memory.factor, 8 * s.nnz());
    assert_eq!(memory.numeric(16), 2 * memory.numeric(8));
    // the factor cannot hold less than its entries, nor merging waste more than it saves
    assert!(s.nnz() as f64 >= s.permutation().nnz && (s.nnz() as f64) < 2.0 * s.permutation().nnz);
    assert!(memory.work > 0 && memory.work < 4 * memory.factor);
}
