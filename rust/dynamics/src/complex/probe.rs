//! Directions that no residual asks for: random ones, and what the terms make of them.

use femend_linalg::Dense;

use super::space::Space;

/// Columns of a probe.
const COLUMNS: usize = 4;

/// Adds random displacements and `steps` blocks of the second-order Krylov space from them: K_σ⁻¹ M w and K_σ⁻¹ A w with
/// every other term. Poles near s₀ that the space is blind to grow in it as in Arnoldi's method; terms of a rank up to the
/// number of columns (local dashpots, bearings, discs) are in it exactly after one step.
pub(super) fn probe(space: &mut Space, speed: f64, steps: usize, seed: &mut u64) {
    let mut block = random(space.n(), COLUMNS, seed);
    block = space.solve(block);
    space.add(&block);
    for _ in 0..steps {
        let mut next = Dense::zeros(space.n(), 0);
        for (t, term) in space.terms.iter().enumerate() {
            // K itself gives back what was there; terms that the speed switches off do nothing
            if t > 0 && term.weight(speed) != 0.0 {
                next.append(&term.times(&block, false));
            }
        }
        block = space.solve(next);
        space.add(&block);
        let keep: Vec<usize> = (0..COLUMNS.min(block.ncols())).collect();
        block = block.select(&keep);
    }
}

/// A block (n, k) of a fixed sequence.
pub(super) fn random(n: usize, columns: usize, seed: &mut u64) -> Dense {
    let mut block = Dense::zeros(n, columns);
    block.data_mut().iter_mut().for_each(|v| *v = draw(seed));
    block
}

/// A fixed sequence between -0.5 and 0.5, so that two runs give the same digits.
fn draw(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
}
