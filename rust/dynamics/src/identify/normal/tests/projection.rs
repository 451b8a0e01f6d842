//! A free force projected out against explicit least squares.

use super::*;

/// Least squares over forces on every line and decay amplitudes at once, by one dense normal equation.
fn explicit(step: &Step<'_>, record: &RecordLines) -> (f64, Vec<f64>, Vec<Complex64>) {
    let (n_out, n_w, n_t) = (record.n_out(), step.response.n_w, step.decays.len());
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
                let (v, at) = (step.response.h.get(f * n_out + s, k) * w, n_t + 2 * (k * n_w + f));
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
    for n_w in [1, 2] {
        let system = system(numbers, 2, 0.02);
        let record = record(numbers, 5, 1, 1.0);
        let hypothesis = free(numbers, n_w);
        let modal = system.modal(&system.mean).expect("modes");
        let prepared = Prepared::new(&record);
        let step = Step::new(&prepared, &system, &modal, &hypothesis, &[], &mut Workspace::default())
            .expect("response");
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
        let cost = |p: &[f64]| evaluate(&system, &records, &hypothesis, p, &[]).cost;
        let gradient = evaluate(&system, &records, &hypothesis, &p, &[]).gradient;
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
