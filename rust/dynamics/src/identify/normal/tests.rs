//! Columns, projection and gradient against finite differences and explicit least squares on small random systems.

mod adjoint;
mod given;
mod own_dashpots;
mod projection;
mod reference;
mod refused;
mod solving;

use super::*;
use crate::identify::{Attached, Dashpots, PickedUp, RecordLines, Settings, Term, What};
use crate::laws::Kind;
use femend_linalg::gemm;
use num_complex::Complex64;

const R: usize = 6;
const N_LINES: usize = 14;

/// Numbers in [-1, 1), the same in every run.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    fn complex(&mut self) -> Complex64 {
        Complex64::new(self.next(), self.next())
    }

    fn dense(&mut self, n: usize, m: usize) -> Dense {
        Dense::from_vec(n, m, (0..n * m).map(|_| self.next()).collect())
    }

    /// scale A A^T.
    fn semidefinite(&mut self, n: usize, scale: f64) -> Dense {
        let a = self.dense(n, n);
        let mut c = Dense::zeros(n, n);
        gemm(&mut c, 0.0, scale, &a, &a.transposed());
        c
    }
}

/// Two parameters: one enters K to the powers one and three, one moves K and M, and both move a term together.
fn system(numbers: &mut Numbers, n_tuned: usize, zeta: f64) -> System {
    let mut k = numbers.semidefinite(R, 400.0);
    let mut m = numbers.semidefinite(R, 0.02);
    for i in 0..R {
        k[(i, i)] += 2000.0 * (1.0 + i as f64).powi(2);
        m[(i, i)] += 1.0;
    }
    let part = |numbers: &mut Numbers| Some(numbers.semidefinite(R, 150.0));
    let terms = vec![
        Term { exponents: vec![(0, 1.0)], k: part(numbers), m: None },
        Term { exponents: vec![(0, 3.0)], k: part(numbers), m: None },
        Term { exponents: vec![(1, 1.0)], k: part(numbers), m: Some(numbers.semidefinite(R, 0.05)) },
        Term { exponents: vec![(0, 1.0), (1, 1.0)], k: part(numbers), m: None },
    ];
    let mut mean = vec![0.0; 2 + n_tuned];
    mean.extend(vec![zeta.ln(); n_tuned + 1]);
    let mut sd = vec![0.3; 2];
    sd.extend(vec![0.005; n_tuned]);
    sd.extend(vec![0.5; n_tuned + 1]);
    let dashpots = Dashpots::none();
    let system = System { r: R, k_fixed: k, m_fixed: m, terms, n_par: 2, n_tuned, mean, sd, dashpots };
    system.check().expect("sizes");
    system
}

fn record(numbers: &mut Numbers, n_out: usize, n_in: usize, sigma: f64) -> RecordLines {
    let s: Vec<Complex64> =
        (0..N_LINES).map(|k| Complex64::new(sigma, 35.0 + 10.0 * k as f64 + numbers.next())).collect();
    let mut draw = |n: usize| (0..n).map(|_| numbers.complex()).collect::<Vec<_>>();
    let (u, y) = (draw(N_LINES * n_in), draw(N_LINES * n_out));
    let picked_up = PickedUp { sensor: vec![n_out - 1, 0], motion: draw(N_LINES * 2), sd: 0.1 };
    RecordLines {
        cut_off: Vec::new(),
        picked_up,
        s,
        u,
        y,
        weight: (0..N_LINES * n_out).map(|_| 1.5 + numbers.next()).collect(),
        out_rows: numbers.dense(n_out, R),
        in_rows: numbers.dense(n_in, R),
        dt: 0.01,
        n_samples: 900.0,
        thinning: 2.0,
        sigma,
        driven_to: 0.0,
        share: 0.2,
    }
}

/// A record whose sensors pick up nothing but their own motion.
fn bare(record: RecordLines) -> RecordLines {
    RecordLines { picked_up: PickedUp::default(), ..record }
}

fn nothing() -> Hypothesis {
    let none = Dense::zeros(0, 0);
    Hypothesis {
        w: none,
        what: What::Nothing,
        free: 0,
        compliance: vec![],
        held: vec![],
        law_mean: vec![],
        law_sd: vec![],
    }
}

fn free(numbers: &mut Numbers, n_w: usize) -> Hypothesis {
    Hypothesis { w: numbers.dense(n_w, R), what: What::FreeForce, compliance: vec![0.0; n_w], ..nothing() }
}

fn closed(numbers: &mut Numbers, n_w: usize, kinds: &[Kind], x: &[f64]) -> Hypothesis {
    Hypothesis {
        w: numbers.dense(n_w, R),
        what: What::everywhere(kinds, n_w),
        free: 0,
        compliance: (0..n_w).map(|i| 2e-5 * (1 + i) as f64).collect(),
        held: vec![],
        law_mean: x.to_vec(),
        law_sd: vec![2.0; x.len()],
    }
}

/// Two kinds of linear laws that together use a complex and line-dependent dynamic stiffness.
fn laws() -> (Vec<Kind>, Vec<f64>) {
    (
        vec![Kind::Spring, Kind::Dashpot, Kind::Viscoelastic],
        [900.0, 6.0, 300.0, 500.0, 0.012].map(f64::ln).to_vec(),
    )
}

/// The same two laws, one of them at the first of two coordinates, the other at the second, and a third law at both.
fn apart(numbers: &mut Numbers) -> (Hypothesis, Vec<f64>) {
    let (_, x) = laws();
    let all = [(Kind::Spring, vec![0]), (Kind::Dashpot, vec![1]), (Kind::Viscoelastic, vec![0, 1])];
    let all = all.into_iter().map(|(kind, at)| Attached::unknown(kind, at)).collect();
    (Hypothesis { what: What::Laws(all), ..closed(numbers, 2, &laws().0, &x) }, x)
}

/// The weighted columns and the weighted residual before free decays, both as they stand without a projector.
fn columns_and_residual(
    system: &System,
    record: &RecordLines,
    hypothesis: &Hypothesis,
    z: &[f64],
) -> (Dense, Vec<f64>) {
    let (p, x) = z.split_at(system.n_unknowns());
    let modal = system.modal(p).expect("modes");
    let (prepared, ws) = (Prepared::new(record), &mut Workspace::default());
    let step = Step::new(&prepared, system, &modal, hypothesis, x, ws).expect("response");
    let slopes = system.slopes(p, &modal, system.r);
    let columns = Sensitivities::fill(&step, system, &modal, &slopes, ws);
    assert_eq!(columns.ncols(), z.len());
    (columns, step.base.col(step.decays.len()).to_vec())
}

/// Cost with its derivatives.
fn evaluate(
    system: &System,
    records: &[RecordLines],
    hypothesis: &Hypothesis,
    p: &[f64],
    x: &[f64],
) -> Evaluation {
    let prepared: Vec<Prepared<'_>> = records.iter().map(Prepared::new).collect();
    let model = Model { modal: system.modal(p).expect("modes"), slopes: None };
    let ws = &mut Workspace::default();
    let start = (model, p.to_vec(), x.to_vec());
    let mut point = Point::new(system, &prepared, hypothesis, start, ws).expect("cost");
    point.derive(system, hypothesis, Matrix::Whole, ws);
    point.at
}

/// Largest distance of a column from minus the central difference of the residual, relative to that column's size.
fn worst_columns(system: &System, record: &RecordLines, hypothesis: &Hypothesis, z: &[f64]) -> Vec<f64> {
    let (columns, _) = columns_and_residual(system, record, hypothesis, z);
    (0..z.len())
        .map(|j| {
            let h = 1e-5;
            let at = |sign: f64| {
                let mut moved = z.to_vec();
                moved[j] += sign * h;
                columns_and_residual(system, record, hypothesis, &moved).1
            };
            let (up, down) = (at(1.0), at(-1.0));
            let expected: Vec<f64> = up.iter().zip(&down).map(|(a, b)| -(a - b) / (2.0 * h)).collect();
            let size = expected.iter().map(|v| v * v).sum::<f64>().sqrt();
            let off = expected.iter().zip(columns.col(j)).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
            assert!(size > 1e-9, "unknown {j} changes nothing: the comparison says nothing");
            off / size
        })
        .collect()
}

fn start(system: &System, x: &[f64]) -> Vec<f64> {
    let mut z = system.mean.clone();
    z[0] = 0.13;
    z[1] = -0.21;
    z.extend_from_slice(x);
    z
}

/// Next to no damping, so that the parameters' columns, which hold the damping between modes still, are exact too; the
/// windowed lines keep the response smooth. Truncation and round-off of the differences stay below 1e-5.
#[test]
fn columns_are_derivatives_of_the_residual() {
    let numbers = &mut Numbers(11);
    let (kinds, x) = laws();
    for n_w in [0, 1, 3] {
        let system = system(numbers, 3, 1e-7);
        let record = record(numbers, 4, 2, 6.0);
        let (hypothesis, x) =
            if n_w == 0 { (nothing(), vec![]) } else { (closed(numbers, n_w, &kinds, &x), x.clone()) };
        let z = start(&system, &x);
        let damping = system.n_par + system.n_tuned..system.n_unknowns();
        for (j, off) in worst_columns(&system, &record, &hypothesis, &z).into_iter().enumerate() {
            // at this damping its own columns are ten million times smaller than the residual: fewer digits
            let allowed = if damping.contains(&j) { 1e-2 } else { 1e-5 };
            assert!(off < allowed, "{n_w} coordinates, unknown {j}: off by {off:e}");
        }
    }
}

#[test]
fn columns_of_frequency_factors_damping_and_laws_are_exact_at_real_damping() {
    let numbers = &mut Numbers(5);
    let (kinds, x) = laws();
    for n_w in [0, 1, 3] {
        let system = system(numbers, 3, 0.015);
        let record = record(numbers, 4, 1, 0.0);
        let (hypothesis, x) =
            if n_w == 0 { (nothing(), vec![]) } else { (closed(numbers, n_w, &kinds, &x), x.clone()) };
        let mut z = start(&system, &x);
        z[2..5].copy_from_slice(&[0.004, -0.003, 0.002]);
        let off = worst_columns(&system, &record, &hypothesis, &z);
        assert!(off[2..].iter().all(|v| *v < 1e-5), "{n_w} coordinates: {off:?}");
        // a parameter moves the damping between modes too, which its column leaves out
        assert!(off[..2].iter().all(|v| *v < 0.01), "{n_w} coordinates: {off:?}");
    }
}

#[test]
fn laws_at_coordinates_of_their_own_have_exact_columns_too() {
    let numbers = &mut Numbers(7);
    let system = system(numbers, 3, 1e-7);
    let record = record(numbers, 4, 2, 6.0);
    let (hypothesis, x) = apart(numbers);
    let off = worst_columns(&system, &record, &hypothesis, &start(&system, &x));
    let damping = system.n_par + system.n_tuned..system.n_unknowns();
    let exact = off.iter().enumerate().filter(|(j, _)| !damping.contains(j));
    assert!(exact.clone().all(|(_, v)| *v < 1e-5), "{off:?}");
    assert_eq!(exact.count(), off.len() - damping.len());
}

#[test]
fn a_law_at_every_coordinate_by_itself_is_that_law_everywhere() {
    let numbers = &mut Numbers(19);
    let (kinds, x) = laws();
    let (system, record) = (system(numbers, 3, 0.02), record(numbers, 4, 2, 0.0));
    let everywhere = closed(numbers, 2, &kinds, &x);
    let once: Vec<Attached> =
        (0..2).flat_map(|i| kinds.iter().map(move |&kind| Attached::unknown(kind, vec![i]))).collect();
    let twice = [x.clone(), x.clone()].concat();
    let (law_mean, law_sd) = (twice.clone(), vec![2.0; twice.len()]);
    let apart = Hypothesis { what: What::Laws(once), law_mean, law_sd, ..everywhere.clone() };
    let p = start(&system, &[]);
    let records = std::slice::from_ref(&record);
    let (one, two) =
        (evaluate(&system, records, &everywhere, &p, &x), evaluate(&system, records, &apart, &p, &twice));
    assert!((one.cost - two.cost).abs() < 1e-9 * one.cost, "{} and {}", one.cost, two.cost);
    let (n, m) = (p.len(), x.len());
    for j in 0..m {
        let both = two.gradient[n + j] + two.gradient[n + m + j];
        assert!(
            (one.gradient[n + j] - both).abs() < 1e-8 * (1.0 + one.gradient[n + j].abs()),
            "law unknown {j}"
        );
    }
}
