//! What free forces along every two of many directions would leave, after one linear step of a model's unknowns.
//!
//! With e the weighted residual of a line, J its derivatives by the unknowns and h what a force along a direction does to
//! the sensors, two forces that are free on every line leave P = I - B Bᴴ of both, B an orthonormal basis of their two
//! answers, and the least squares of what is left, with the prior of the unknowns, are
//!
//! ```text
//! A = Re Σ Jᴴ P J + S⁻²,   g = Re Σ Jᴴ P e - S⁻² (p - mean),   cost = Σ eᴴ P e + |(p - mean)/S|² - gᵀ A⁻¹ g
//! ```
//!
//! (Golub and Pereyra, SIAM J. Numer. Anal. 10 (1973) 413-432; one Gauss-Newton step.) All that a pair needs of a line
//! are its directions' products with J, e and each other.

use femend_linalg::{Dense, gram};
use num_complex::Complex64;
use rayon::prelude::*;

/// One line: the answers `h` of n directions, the residual and its derivatives, all weighted.
#[derive(Clone, Debug)]
pub struct StepLine {
    /// How many sensors.
    pub n_out: usize,
    /// Answers to forces of one, direction by direction (n, n_out).
    pub h: Vec<Complex64>,
    /// Residual (n_out).
    pub e: Vec<Complex64>,
    /// Derivatives of the answers, sensor by sensor (n_out, n_p).
    pub j: Vec<Complex64>,
}

/// What the prior of the unknowns says around where they are.
#[derive(Clone, Debug)]
pub struct StepPrior {
    /// 1/sd² of each unknown (n_p).
    pub curvature: Vec<f64>,
    /// (p - mean)/sd² (n_p).
    pub pull: Vec<f64>,
    /// Sum of squared deviations.
    pub cost: f64,
}

/// Share of an answer that has to lie across the other one for the two to count as different.
const ACROSS: f64 = 1e-12;

/// A line as pairs need it: products of the directions with J (n, n_p), e (n) and each other (n, n).
struct Products {
    factor: f64,
    squares: f64,
    jacobian: Vec<Complex64>,
    residual: Vec<Complex64>,
    gram: Vec<Complex64>,
}

/// Costs (n, n) by rows, infinite on the diagonal and where one direction answers as the other does or not at all.
/// None for sizes that do not fit together.
#[must_use]
pub fn pair_costs(lines: &[StepLine], prior: &StepPrior) -> Option<Vec<f64>> {
    let n_p = prior.curvature.len();
    let n = lines.first().map_or(Some(0), |line| line.h.len().checked_div(line.n_out))?;
    let fit = prior.pull.len() == n_p
        && lines.iter().all(|line| {
            line.h.len() == n * line.n_out && line.e.len() == line.n_out && line.j.len() == n_p * line.n_out
        });
    if !fit {
        return None;
    }
    let (mut shared, mut pulled) =
        (Dense::zeros(n_p, n_p), prior.pull.iter().map(|p| -p).collect::<Vec<_>>());
    for (i, curvature) in prior.curvature.iter().enumerate() {
        shared.col_mut(i)[i] = *curvature;
    }
    for line in lines {
        for (row, e) in line.j.chunks_exact(n_p.max(1)).zip(&line.e) {
            for b in 0..n_p {
                pulled[b] += (row[b].conj() * e).re;
                let column = shared.col_mut(b);
                column.iter_mut().zip(row).for_each(|(s, a)| *s += (a.conj() * row[b]).re);
            }
        }
    }
    let products: Vec<Products> = lines.par_iter().map(|line| of_line(line, n, n_p)).collect();
    let rows: Vec<Vec<f64>> =
        (0..n).into_par_iter().map(|i| row_of(i, n, &products, &shared, &pulled, prior.cost)).collect();
    let mut costs = rows.concat();
    for i in 0..n {
        for j in 0..i {
            costs[i * n + j] = costs[j * n + i];
        }
    }
    Some(costs)
}

fn of_line(line: &StepLine, n: usize, n_p: usize) -> Products {
    let h = |i: usize| &line.h[i * line.n_out..(i + 1) * line.n_out];
    let dot =
        |a: &[Complex64], b: &[Complex64]| a.iter().zip(b).map(|(a, b)| a.conj() * b).sum::<Complex64>();
    let (mut jacobian, mut gram) = (vec![Complex64::ZERO; n * n_p], vec![Complex64::ZERO; n * n]);
    for i in 0..n {
        for (answer, row) in h(i).iter().zip(line.j.chunks_exact(n_p.max(1))) {
            let own = &mut jacobian[i * n_p..(i + 1) * n_p];
            own.iter_mut().zip(row).for_each(|(sum, j)| *sum += answer.conj() * j);
        }
        (i..n).for_each(|j| gram[i * n + j] = dot(h(i), h(j)));
    }
    let n_out = line.n_out as f64;
    Products {
        factor: n_out / (n_out - 2.0).max(1.0),
        squares: line.e.iter().map(Complex64::norm_sqr).sum(),
        residual: (0..n).map(|i| dot(h(i), &line.e)).collect(),
        jacobian,
        gram,
    }
}

/// Costs of direction `i` with each later one.
fn row_of(i: usize, n: usize, lines: &[Products], shared: &Dense, pulled: &[f64], prior: f64) -> Vec<f64> {
    let n_p = pulled.len();
    let mut row = vec![f64::INFINITY; n];
    if lines.iter().any(|line| line.gram[i * n + i].re <= 0.0) {
        return row;
    }
    // what the first force leaves is common to all pairs
    let mut first = Dense::zeros(2 * lines.len(), n_p);
    let (mut g_first, mut squares_first) = (pulled.to_vec(), prior);
    for (k, line) in lines.iter().enumerate() {
        let size = line.gram[i * n + i].re.sqrt();
        let (own, c) = (&line.jacobian[i * n_p..(i + 1) * n_p], line.residual[i] / size);
        for (a, j) in own.iter().enumerate() {
            let b = j / size;
            first.col_mut(a)[2 * k..2 * k + 2].copy_from_slice(&[b.re, b.im]);
            g_first[a] -= (b.conj() * c).re;
        }
        squares_first += line.factor * (line.squares - c.norm_sqr());
    }
    let taken = gram(&first);
    let mut second = Dense::zeros(2 * lines.len(), n_p);
    'pairs: for j in i + 1..n {
        let (mut g, mut squares) = (g_first.clone(), squares_first);
        for (k, line) in lines.iter().enumerate() {
            // the part of h_j across h_i, and its products
            let share = line.gram[i * n + j] / line.gram[i * n + i].re;
            let whole = line.gram[j * n + j].re;
            let across = whole - (share.conj() * line.gram[i * n + j]).re;
            if across <= ACROSS * whole || whole <= 0.0 {
                continue 'pairs;
            }
            let size = across.sqrt();
            let c = (line.residual[j] - share.conj() * line.residual[i]) / size;
            for a in 0..n_p {
                let b = (line.jacobian[j * n_p + a] - share.conj() * line.jacobian[i * n_p + a]) / size;
                second.col_mut(a)[2 * k..2 * k + 2].copy_from_slice(&[b.re, b.im]);
                g[a] -= (b.conj() * c).re;
            }
            squares -= line.factor * c.norm_sqr();
        }
        let mut matrix = gram(&second);
        for (entry, (all, one)) in matrix.data_mut().iter_mut().zip(shared.data().iter().zip(taken.data())) {
            *entry = all - one - *entry;
        }
        if let Some(gain) = quadratic(matrix, &g) {
            row[j] = squares - gain;
        }
    }
    row
}

/// gᵀ A⁻¹ g; where rounding has left A without a factor, of A with its diagonal a little larger.
fn quadratic(mut a: Dense, g: &[f64]) -> Option<f64> {
    let n = g.len();
    for _ in 0..4 {
        if let Ok(x) = a.solve_definite(g) {
            return Some(x.iter().zip(g).map(|(x, g)| x * g).sum()).filter(|v: &f64| v.is_finite());
        }
        let trace: f64 = (0..n).map(|i| a.col(i)[i].abs()).sum();
        (0..n).for_each(|i| a.col_mut(i)[i] += 1e-9 * trace / n as f64);
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn some(seed: &mut u64) -> f64 {
        *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    }

    fn lines(n: usize, n_p: usize) -> Vec<StepLine> {
        let mut seed = 7;
        let mut many = |count: usize| {
            (0..count).map(|_| Complex64::new(some(&mut seed), some(&mut seed))).collect::<Vec<_>>()
        };
        (0..9)
            .map(|k| 4 + k % 2)
            .map(|n_out| StepLine { n_out, h: many(n * n_out), e: many(n_out), j: many(n_out * n_p) })
            .collect()
    }

    /// The cost of a pair by the least squares of everything: forces on every line, and the unknowns with their prior.
    fn by_least_squares(lines: &[StepLine], prior: &StepPrior, pair: (usize, usize)) -> f64 {
        let n_p = prior.curvature.len();
        // P by Gram-Schmidt, then A and g summed as they are written
        let (mut a, mut g, mut squares) = (Dense::zeros(n_p, n_p), vec![0.0; n_p], prior.cost);
        for i in 0..n_p {
            a.col_mut(i)[i] = prior.curvature[i];
            g[i] = -prior.pull[i];
        }
        for line in lines {
            let m = line.n_out;
            let mut basis: Vec<Vec<Complex64>> = Vec::new();
            for i in [pair.0, pair.1] {
                let mut v = line.h[i * m..(i + 1) * m].to_vec();
                for b in &basis {
                    let share: Complex64 = b.iter().zip(&v).map(|(b, v)| b.conj() * v).sum();
                    v.iter_mut().zip(b).for_each(|(v, b)| *v -= share * b);
                }
                let size = v.iter().map(Complex64::norm_sqr).sum::<f64>().sqrt();
                basis.push(v.iter().map(|v| v / size).collect());
            }
            let project = |x: &[Complex64]| {
                let mut x = x.to_vec();
                for b in &basis {
                    let share: Complex64 = b.iter().zip(&x).map(|(b, x)| b.conj() * x).sum();
                    x.iter_mut().zip(b).for_each(|(x, b)| *x -= share * b);
                }
                x
            };
            let e = project(&line.e);
            let columns: Vec<Vec<Complex64>> =
                (0..n_p).map(|p| project(&(0..m).map(|s| line.j[s * n_p + p]).collect::<Vec<_>>())).collect();
            let dot = |a: &[Complex64], b: &[Complex64]| {
                a.iter().zip(b).map(|(a, b)| (a.conj() * b).re).sum::<f64>()
            };
            for p in 0..n_p {
                g[p] += dot(&columns[p], &e);
                (0..n_p).for_each(|q| a.col_mut(q)[p] += dot(&columns[p], &columns[q]));
            }
            squares += m as f64 / (m as f64 - 2.0) * dot(&e, &e);
        }
        squares - quadratic(a, &g).unwrap()
    }

    #[test]
    fn costs_are_those_of_the_projected_least_squares() {
        let (n, n_p) = (5, 3);
        let lines = lines(n, n_p);
        let prior = StepPrior { curvature: vec![2.0, 5.0, 0.1], pull: vec![0.3, -0.2, 0.05], cost: 1.7 };
        let costs = pair_costs(&lines, &prior).unwrap();
        for i in 0..n {
            for j in 0..n {
                if i == j {
                    assert!(costs[i * n + j].is_infinite());
                } else {
                    let expected = by_least_squares(&lines, &prior, (i, j));
                    assert_relative_eq!(costs[i * n + j], expected, max_relative = 1e-10);
                }
            }
        }
    }

    #[test]
    fn directions_that_answer_alike_are_no_pair() {
        let mut lines = lines(3, 2);
        for line in &mut lines {
            let m = line.n_out;
            let doubled: Vec<_> = line.h[..m].iter().map(|h| h * 2.0).collect();
            line.h[m..2 * m].copy_from_slice(&doubled);
            line.h[2 * m..].fill(Complex64::ZERO);
        }
        let prior = StepPrior { curvature: vec![1.0; 2], pull: vec![0.0; 2], cost: 0.0 };
        assert!(pair_costs(&lines, &prior).unwrap().iter().all(|c| c.is_infinite()));
    }

    #[test]
    fn sizes_have_to_fit() {
        let prior = StepPrior { curvature: vec![1.0; 2], pull: vec![0.0; 3], cost: 0.0 };
        assert!(pair_costs(&lines(3, 2), &prior).is_none());
        let prior = StepPrior { curvature: vec![1.0; 3], pull: vec![0.0; 3], cost: 0.0 };
        assert!(pair_costs(&lines(3, 2), &prior).is_none());
        assert_eq!(pair_costs(&[], &prior), Some(vec![]));
    }
}
