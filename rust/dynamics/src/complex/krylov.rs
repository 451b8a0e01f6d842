//! The second-order Krylov space of K_σ⁻¹ B and K_σ⁻¹ M, by the two-level orthogonal Arnoldi process in blocks.
//!
//! The Arnoldi process of the linearised problem in 2 n unknowns is kept as coefficients of both halves of its vectors in
//! one space V of n unknowns (Lu, Su and Bai, SIAM J. Matrix Anal. Appl. 37 (2016) 195). All of it is real, and
//! one factor of K_σ serves; where σ = 0 and the stiffness does not change with the speed, poles nearest to 0 converge as in
//! shift-invert Arnoldi.

use femend_linalg::Dense;

use super::probe::random;
use super::space::Space;
use super::terms::{Power, add};

/// Vectors of a block: as many poles may coincide at any speed.
const BLOCK: usize = 4;
/// Part of the largest residual to which it has to fall for the process to be worth its while.
const FALL: f64 = 0.5;
/// Times it may fail to.
const PATIENCE: usize = 3;
/// Multiples of the tolerance up to which left vectors are corrected one by one.
const NEAR: f64 = 1e3;
/// Steps at a time.
const MOST_STEPS: usize = 40;
/// Part of a vector that orthogonalisation has to leave for it to be new.
const NEW: f64 = 1e-10;

/// The process for right vectors, or with transposed matrices for left ones.
pub(super) struct Krylov {
    /// Coefficients of both halves, one after the other, of orthonormal vectors; shorter ones end in zeros.
    basis: Vec<[Vec<f64>; 2]>,
    /// How many of the last belong to the block that comes next.
    block: usize,
    /// Unit of λ.
    tau: f64,
    transposed: bool,
}

impl Krylov {
    /// Starts from a real block (n, p) of displacements.
    pub fn new(space: &mut Space, start: Dense, transposed: bool) -> Self {
        let first = space.solve(start);
        let (mut energy, mut mass) = (0.0f64, 0.0f64);
        for term in space.terms.iter().filter(|t| t.power == Power::Mass) {
            mass += dot(first.data(), term.times(&first, false).data());
        }
        energy += dot(first.data(), space.metric_times(&first).data());
        let tau = if mass > 0.0 { (energy / mass).sqrt() } else { 1.0 };
        let mut process = Self { basis: Vec::new(), block: 0, tau, transposed };
        let halves = process.coordinates(space, &first);
        process.take(halves.into_iter().map(|a| [a, Vec::new()]).collect());
        process
    }

    /// Expands the last block. False when nothing new comes of it.
    pub fn step(&mut self, space: &mut Space, speed: f64) -> bool {
        if self.block == 0 {
            return false;
        }
        let last = &self.basis[self.basis.len() - self.block..];
        let halves = [0, 1].map(|half| {
            let mut y = Dense::zeros(space.len(), last.len());
            for (j, v) in last.iter().enumerate() {
                y.col_mut(j)[..v[half].len()].copy_from_slice(&v[half]);
            }
            space.expand(&y)
        });
        let mut f = Dense::zeros(space.n(), last.len());
        for term in &space.terms {
            let weight = term.weight(speed);
            let (factor, half) = match term.power {
                Power::Damping => (self.tau, 0),
                Power::Mass => (self.tau * self.tau, 1),
                _ => continue,
            };
            if weight != 0.0 {
                add(&mut f, -factor * weight, &term.times(&halves[half], self.transposed));
            }
        }
        let tops: Vec<Vec<f64>> = last.iter().map(|v| v[0].clone()).collect();
        let next = space.solve(f);
        let coordinates = self.coordinates(space, &next);
        self.take(coordinates.into_iter().zip(tops).map(|(a, b)| [a, b]).collect());
        self.block > 0
    }

    /// Coefficients of the columns in V, which takes them in.
    fn coordinates(&self, space: &mut Space, x: &Dense) -> Vec<Vec<f64>> {
        space.add_above(x, NEW);
        let inside = space.project(&space.metric_times(x));
        (0..x.ncols()).map(|j| inside.col(j).to_vec()).collect()
    }

    /// Orthonormalises vectors against those before and takes them in as the next block.
    fn take(&mut self, vectors: Vec<[Vec<f64>; 2]>) {
        let before = self.basis.len();
        for mut v in vectors {
            let size = norm(&v);
            for _ in 0..2 {
                for q in &self.basis {
                    for half in 0..2 {
                        let longer = q[half].len().max(v[half].len());
                        v[half].resize(longer, 0.0);
                    }
                    let c: f64 = (0..2).map(|h| dot(&q[h], &v[h])).sum();
                    for half in 0..2 {
                        v[half].iter_mut().zip(&q[half]).for_each(|(v, q)| *v -= c * q);
                    }
                }
            }
            let left = norm(&v);
            if left > NEW * size {
                v.iter_mut().flatten().for_each(|x| *x /= left);
                self.basis.push(v);
            }
        }
        self.block = self.basis.len() - before;
    }
}

/// The growth of a space by both processes, as long as it pays.
#[derive(Default)]
pub(super) struct Growth {
    processes: Option<[Krylov; 2]>,
    /// Largest residual when each was asked last.
    worst: [f64; 2],
    /// Size of the space then.
    size: [usize; 2],
    /// Times in a row that it did not fall.
    idle: [usize; 2],
}

/// Vectors to add: those that the rate between two looks, (residual, size) each, asks for, from an eighth to a half of what
/// there is.
fn due(before: (f64, usize), now: (f64, usize), tolerance: f64) -> usize {
    let least = (now.1 / 8).max(2 * BLOCK);
    let fallen = (before.0 / now.0).ln();
    if !(fallen.is_finite() && fallen > 0.0 && now.1 > before.1) {
        return (now.1 / 4).max(least);
    }
    let rate = fallen / (now.1 - before.1) as f64;
    let wanted = 1.05 * (now.0 / tolerance).ln() / rate;
    (wanted as usize).clamp(least, (now.1 / 2).max(least))
}

impl Growth {
    /// Fills the space to a few vectors for each mode that is wanted, from random ones.
    pub fn begin(&mut self, space: &mut Space, speed: f64, n_modes: Option<usize>, seed: &mut u64) {
        let block = BLOCK;
        let start = random(space.n(), block, seed);
        self.processes = Some([false, true].map(|transposed| Krylov::new(space, start.clone(), transposed)));
        self.worst = [f64::INFINITY; 2];
        let size = (7 * n_modes.unwrap_or(10) + 4 * block).min(space.n());
        let Some([process, _]) = &mut self.processes else { return };
        while space.len() < size && process.step(space, speed) {}
    }

    /// Lets the process of one side (0 right, 1 left) go on for a while. False where it cannot, or where the residual does
    /// not fall with it (what is factorised is not all of the stiffness).
    pub fn further(
        &mut self,
        space: &mut Space,
        speed: f64,
        side: usize,
        worst: f64,
        tolerance: f64,
    ) -> bool {
        let Some(processes) = &mut self.processes else { return false };
        self.idle[side] = if worst < FALL * self.worst[side] { 0 } else { self.idle[side] + 1 };
        // a few corrections cost less than a process that begins anew
        if side == 1 && worst < NEAR * tolerance {
            return false;
        }
        let due_from = (self.worst[side], self.size[side]);
        self.worst[side] = self.worst[side].min(worst);
        if self.idle[side] > PATIENCE {
            return false;
        }
        let before = space.len();
        let size = before + due(due_from, (worst, before), tolerance);
        self.size[side] = before;
        let mut steps = 0;
        while space.len() < size && steps < MOST_STEPS && processes[side].step(space, speed) {
            steps += 1;
        }
        space.len() > before
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn norm(v: &[Vec<f64>; 2]) -> f64 {
    v.iter().flatten().map(|x| x * x).sum::<f64>().sqrt()
}
