//! A free force projected out against explicit least squares, alone and beside laws.

use super::*;

/// Laws at a coordinate of their own beside `n_free` free forces.
fn beside_laws(numbers: &mut Numbers, n_free: usize) -> Hypothesis {
    let (kinds, x) = laws();
    let all = kinds.iter().map(|&kind| Attached::unknown(kind, vec![0])).collect();
    let compliance = (0..=n_free).map(|i| if i == 0 { 2e-5 } else { 0.0 }).collect();
    Hypothesis { what: What::Laws(all), free: n_free, compliance, ..closed(numbers, 1 + n_free, &kinds, &x) }
}

/// Least squares over forces on every line and decay amplitudes at once, by one dense normal equation.
fn explicit(step: &Step<'_>, record: &RecordLines) -> (f64, Vec<f64>, Vec<Complex64>) {
    let (n_out, n_w, n_t) = (record.n_out(), step.response.n_free, step.decays.len());
    let mut decay = vec![Split::zeros(N_LINES, n_out); n_t];
    decay.iter_mut().enumerate().for_each(|(t, y)| step.decays.column(step.at, &step.response, t, y));
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
                let v = decay[t].get(s, k) * w;
                (a[(i, t)], a[(i + 1, t)]) = (v.re, v.im);
            }
            for f in 0..n_w {
                let (h, sign) = step.response.per_free_force(f, s);
                let (v, at) = (Complex64::new(h.0[k], h.1[k]) * sign * w, n_t + 2 * (k * n_w + f));
                (a[(i, at)], a[(i + 1, at)]) = (v.re, v.im);
                (a[(i, at + 1)], a[(i + 1, at + 1)]) = (-v.im, v.re);
            }
        }
    }
    (0..n_t).for_each(|t| a[(rows + t, t)] = step.decays.ridge[t].sqrt());
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
    let mut cases = vec![(free(numbers, 1), 1, vec![], 1), (free(numbers, 2), 2, vec![], 1)];
    for n_in in [0, 1] {
        cases.push((beside_laws(numbers, 1), 1, laws().1, n_in));
        cases.push((beside_laws(numbers, 2), 2, laws().1, n_in));
    }
    for (hypothesis, n_w, x, n_in) in cases {
        let system = system(numbers, 2, 0.02);
        let record = record(numbers, 5, n_in, 1.0);
        let modal = system.modal(&system.mean).expect("modes");
        let prepared = Prepared::new(&record);
        let step = Step::new(&prepared, &system, &modal, &hypothesis, &x, &mut Workspace::default())
            .expect("response");
        let (sum, amplitudes, forces) = explicit(&step, &record);
        assert!((step.sum - sum).abs() < 1e-8 * sum, "{} and {sum}", step.sum);
        let size = amplitudes.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
        for (a, b) in step.amplitudes.iter().zip(&amplitudes) {
            assert!((a - b).abs() < 1e-6 * size, "decays {a} and {b}");
        }
        let found = step.free_force();
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
    let mut cases = vec![(free(numbers, 1), vec![]), (free(numbers, 2), vec![])];
    cases.push((beside_laws(numbers, 1), laws().1));
    cases.push((beside_laws(numbers, 2), laws().1));
    for (hypothesis, x) in cases {
        let system = system(numbers, 0, 1e-7);
        let records = [record(numbers, 5, 1, 5.0), record(numbers, 5, 0, 5.0)];
        let start = start(&system, &x);
        let (n_w, n_p) = (hypothesis.n_free(), system.n_unknowns());
        let at = |z: &[f64]| evaluate(&system, &records, &hypothesis, &z[..n_p], &z[n_p..]);
        let cost = |z: &[f64]| at(z).cost;
        let gradient = at(&start).gradient;
        for j in (0..2).chain(n_p..start.len()) {
            let h = 1e-5;
            let (mut up, mut down) = (start.clone(), start.clone());
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

/// What a free force does beside laws is what the same force does as a measured one.
#[test]
fn a_free_force_moves_the_closed_loop_as_a_measured_one() {
    let numbers = &mut Numbers(47);
    let (system, hypothesis, x) = (system(numbers, 2, 0.02), beside_laws(numbers, 1), laws().1);
    let mut record = record(numbers, 4, 1, 1.0);
    record.in_rows = Dense::from_vec(1, R, (0..R).map(|m| hypothesis.w[(1, m)]).collect());
    record.u.iter_mut().for_each(|u| *u = Complex64::ONE);
    let modal = system.modal(&system.mean).expect("modes");
    let prepared = Prepared::new(&record);
    let ws = &mut Workspace::default();
    let step = Step::new(&prepared, &system, &modal, &hypothesis, &x, ws).expect("response");
    for (s, k) in (0..4).flat_map(|s| (0..N_LINES).map(move |k| (s, k))) {
        let (h, sign) = step.response.per_free_force(0, s);
        let (found, measured) = (Complex64::new(h.0[k], h.1[k]) * sign, step.response.y.get(s, k));
        assert!((found - measured).norm() < 1e-10 * measured.norm(), "{found} and {measured}");
    }
}
