//! Linear laws fitted to the free force of a place: a few numbers on lines, before the whole model is.
//!
//! Where the model's unknowns stay as they are, a law of dynamic stiffness κ in place of the free force F leaves
//! e = F + κ D of it, with the motion under the law D = (1 + κ C)⁻¹ (D_F - C F), not the one under the free force, D_F.
//! What the sensors tell of it is eᴴ G e, and its slope de/dκ = (1 + κ C)⁻¹ D.

use crate::laws::{Kind, Law};
use femend_linalg::{Dense, solve_complex_dense};
use num_complex::Complex64;
use rayon::prelude::*;

/// A free force at a place of `n` coordinates on the lines of one record; arrays go line by line, matrices by rows.
#[derive(Clone, Debug)]
pub struct FreeForce {
    n: usize,
    s: Vec<Complex64>,
    without: Vec<Complex64>,
    force: Vec<Complex64>,
    moved: Vec<Complex64>,
    gram: Vec<Complex64>,
}

/// How far and how long a law is followed.
#[derive(Clone, Copy, Debug)]
pub struct Follow {
    /// Steps of each start.
    pub steps: usize,
    /// Longest step of a logarithm.
    pub longest: f64,
    /// How far a logarithm may leave its start.
    pub farthest: f64,
}

/// Share of the cost that a step has to bring for another one.
const WORTH: f64 = 1e-4;
/// Levenberg's damping at the start, after a step that fell and one that did not, and its ends.
const DAMPING: (f64, f64, f64, f64, f64) = (1e-2, 0.2, 10.0, 1e-9, 1e6);

impl FreeForce {
    /// From the lines `s` (K), the motion (K, n) where nothing acts, the free `force` (K, n), what the model moves by
    /// forces of one (K, n, n) and how well the sensors tell a force, the Hermitian `gram` (K, n, n). None for sizes
    /// that do not fit together.
    #[must_use]
    pub fn new(
        s: Vec<Complex64>,
        without: Vec<Complex64>,
        force: Vec<Complex64>,
        moved: Vec<Complex64>,
        gram: Vec<Complex64>,
    ) -> Option<Self> {
        let n = force.len().checked_div(s.len())?;
        let fits = n > 0
            && force.len() == n * s.len()
            && without.len() == force.len()
            && moved.len() == n * force.len()
            && gram.len() == moved.len();
        fits.then_some(Self { n, s, without, force, moved, gram })
    }

    /// How many lines.
    #[must_use]
    pub fn len(&self) -> usize {
        self.s.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.s.is_empty()
    }

    /// What a law of dynamic stiffness `kappa` (K) leaves of the free force, as the sensors tell it.
    #[must_use]
    pub fn left(&self, kappa: &[Complex64]) -> f64 {
        kappa.iter().enumerate().map(|(k, value)| self.at(k, *value).0).sum()
    }

    /// On line `k`: the cost eᴴ G e, eᴴ G de/dκ and de/dκᴴ G de/dκ. A motion without bounds costs without bounds.
    fn at(&self, k: usize, kappa: Complex64) -> (f64, Complex64, f64) {
        let n = self.n;
        if n == 1 {
            // nearly all places have one coordinate
            let inverse = (1.0 + kappa * self.moved[k]).inv();
            let motion = inverse * self.without[k];
            let (left, slope, gram) = (self.force[k] + kappa * motion, inverse * motion, self.gram[k].re);
            let cost = gram * left.norm_sqr();
            let cost = if cost.is_finite() { cost } else { f64::INFINITY };
            return (cost, gram * left.conj() * slope, gram * slope.norm_sqr());
        }
        let (rows, square) = (k * n..(k + 1) * n, k * n * n..(k + 1) * n * n);
        let Some(inverse) = closed(kappa, &self.moved[square.clone()], n) else {
            return (f64::INFINITY, Complex64::ZERO, 0.0);
        };
        let motion = times(&inverse, &self.without[rows.clone()]);
        let slope = times(&inverse, &motion);
        let left: Vec<Complex64> = self.force[rows].iter().zip(&motion).map(|(f, d)| f + kappa * d).collect();
        let gram = &self.gram[square];
        let (told, told_slope) = (times(gram, &left), times(gram, &slope));
        (dot(&left, &told).re, dot(&left, &told_slope), dot(&slope, &told_slope).re)
    }
}

/// (1 + κ C)⁻¹ by rows of C (n, n) by rows; None where it has none.
fn closed(kappa: Complex64, moved: &[Complex64], n: usize) -> Option<Vec<Complex64>> {
    // rows of the matrix are columns of its transpose, and so are those of the inverse
    let mut unit = vec![Complex64::ZERO; n * n];
    (0..n).for_each(|i| unit[i * n + i] = Complex64::ONE);
    let matrix: Vec<Complex64> = unit.iter().zip(moved).map(|(one, c)| one + kappa * c).collect();
    solve_complex_dense(n, &matrix, &unit).ok()
}

/// A x of a matrix by rows.
fn times(a: &[Complex64], x: &[Complex64]) -> Vec<Complex64> {
    a.chunks_exact(x.len()).map(|row| row.iter().zip(x).map(|(a, x)| a * x).sum()).collect()
}

/// xᴴ y.
fn dot(x: &[Complex64], y: &[Complex64]) -> Complex64 {
    x.iter().zip(y).map(|(x, y)| x.conj() * y).sum()
}

/// Cost of a law's parameters (as logarithms), half its gradient and the lower half of the Gauss-Newton matrix.
struct Evaluated {
    cost: f64,
    g: Vec<f64>,
    h: Dense,
}

fn evaluate(kind: Kind, x: &[f64], free: &[FreeForce]) -> Option<Evaluated> {
    let values: Vec<f64> = x.iter().map(|x| x.exp()).collect();
    let law = Law::new(kind, &values).ok()?;
    let n_p = x.len();
    let (mut cost, mut g, mut h) = (0.0, vec![0.0; n_p], Dense::zeros(n_p, n_p));
    for one in free {
        for (k, s) in one.s.iter().enumerate() {
            let (kappa, by) = law.dynamic_stiffness(*s).ok()?;
            let (left, mixed, steep) = one.at(k, kappa);
            cost += left;
            for i in 0..n_p {
                let slope = by[i] * values[i];
                g[i] += (mixed * slope).re;
                for j in 0..=i {
                    h.col_mut(j)[i] += steep * (slope.conj() * by[j] * values[j]).re;
                }
            }
        }
    }
    let sound = cost.is_finite() && g.iter().chain(h.data()).all(|v| v.is_finite());
    sound.then_some(Evaluated { cost, g, h })
}

/// Levenberg-Marquardt in the logarithms of a law's parameters on all records, from each of the `starts`: cost and end
/// of each, None where the law does not allow its start or its motion has no bounds there.
///
/// The law alone moves; what else the free force was found with stays.
#[must_use]
pub fn follow(
    kind: Kind,
    starts: &[Vec<f64>],
    free: &[FreeForce],
    how: Follow,
) -> Vec<Option<(f64, Vec<f64>)>> {
    starts.par_iter().map(|start| descend(kind, start, free, how)).collect()
}

fn descend(kind: Kind, start: &[f64], free: &[FreeForce], how: Follow) -> Option<(f64, Vec<f64>)> {
    let (begin, fallen, risen, least, most) = DAMPING;
    let (mut x, mut damping) = (start.to_vec(), begin);
    let mut at = evaluate(kind, &x, free)?;
    for _ in 0..how.steps {
        let Some(step) = damped(&at, damping) else { break };
        let to: Vec<f64> = (x.iter().zip(&step).zip(start))
            .map(|((x, step), first)| {
                let to = x + step.clamp(-how.longest, how.longest);
                to.clamp(first - how.farthest, first + how.farthest)
            })
            .collect();
        match evaluate(kind, &to, free).filter(|there| there.cost < at.cost) {
            Some(there) => {
                let done = at.cost - there.cost < WORTH * at.cost;
                (x, at, damping) = (to, there, (damping * fallen).max(least));
                if done {
                    break;
                }
            }
            None if damping * risen > most => break,
            None => damping *= risen,
        }
    }
    Some((at.cost, x))
}

/// Levenberg's step; None where the matrix is none of a fit.
fn damped(at: &Evaluated, damping: f64) -> Option<Vec<f64>> {
    let n = at.g.len();
    let trace: f64 = (0..n).map(|i| at.h.col(i)[i]).sum();
    let mut a = at.h.clone();
    for i in 0..n {
        let own = at.h.col(i)[i];
        a.col_mut(i)[i] = own + damping * (own + 1e-12 * trace + 1e-300);
    }
    let step = a.solve_definite(&at.g).ok()?;
    step.iter().all(|v| v.is_finite()).then(|| step.iter().map(|v| -v).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    const N: usize = 2;

    /// A force that some springs with a dashpot make at two coordinates, and what it moves, on lines up to 300 rad/s.
    fn of_a_law(values: &[f64]) -> FreeForce {
        let law = Law::new(Kind::from_name("viscoelastic").unwrap(), values).unwrap();
        let lines: Vec<Complex64> = (1..60).map(|k| Complex64::new(0.3, 5.0 * f64::from(k))).collect();
        let (mut without, mut force, mut moved, mut gram) = (vec![], vec![], vec![], vec![]);
        for (k, s) in lines.iter().enumerate() {
            let k = k as f64;
            let c = [(1.0, 0.3), (0.3, 0.5)]
                .map(|(a, b)| [a, b].map(|g| Complex64::from(g) / (s * s + 4.0 * s + 1.0e4)));
            let d = [Complex64::new((0.7 * k).cos(), k.sin()), Complex64::new(0.2, (1.3 * k).cos())];
            let (kappa, _) = law.dynamic_stiffness(*s).unwrap();
            // the motion under the law is d, so that without it is d - C F with F = -kappa d
            let f = d.map(|d| -kappa * d);
            for i in 0..N {
                without.push(d[i] - c[i][0] * f[0] - c[i][1] * f[1]);
                force.push(f[i]);
                for j in 0..N {
                    moved.push(c[i][j]);
                    gram.push(Complex64::from(if i == j { 2.0 + k } else { 0.5 }));
                }
            }
        }
        FreeForce::new(lines, without, force, moved, gram).unwrap()
    }

    #[test]
    fn the_law_that_made_a_force_leaves_nothing_of_it() {
        let truth = [900.0, 700.0, 0.02];
        let free = of_a_law(&truth);
        let law = Law::new(Kind::from_name("viscoelastic").unwrap(), &truth).unwrap();
        let kappa: Vec<_> = free.s.iter().map(|s| law.dynamic_stiffness(*s).unwrap().0).collect();
        let none = vec![Complex64::ZERO; free.len()];
        assert!(free.left(&kappa) < 1e-20 * free.left(&none));
        let how = Follow { steps: 40, longest: 1.5, farthest: 12.0 };
        let start: Vec<f64> = [300.0_f64, 300.0, 0.05].iter().map(|v| v.ln()).collect();
        let ends = follow(
            Kind::from_name("viscoelastic").unwrap(),
            &[start.clone(), start],
            std::slice::from_ref(&free),
            how,
        );
        let (cost, x) = ends[1].clone().unwrap();
        assert!(cost < 1e-12 * free.left(&none), "{cost}");
        x.iter().zip(&truth).for_each(|(x, v)| assert_relative_eq!(x.exp(), *v, max_relative = 1e-4));
    }

    #[test]
    fn slopes_are_those_of_the_cost() {
        let kind = Kind::from_name("viscoelastic").unwrap();
        let free = [of_a_law(&[900.0, 700.0, 0.02])];
        let x: Vec<f64> = [500.0_f64, 400.0, 0.06].iter().map(|v| v.ln()).collect();
        let at = evaluate(kind, &x, &free).unwrap();
        for i in 0..3 {
            let moved = |by: f64| {
                let mut x = x.clone();
                x[i] += by;
                evaluate(kind, &x, &free).unwrap().cost
            };
            assert_relative_eq!(2.0 * at.g[i], (moved(1e-4) - moved(-1e-4)) / 2e-4, max_relative = 1e-6);
        }
    }

    #[test]
    fn sizes_have_to_fit_and_starts_to_be_allowed() {
        let one = vec![Complex64::ONE; 2];
        assert!(FreeForce::new(vec![], vec![], vec![], vec![], vec![]).is_none());
        assert!(
            FreeForce::new(one.clone(), one.clone(), one.clone(), one.clone(), vec![Complex64::ONE])
                .is_none()
        );
        let free = [FreeForce::new(one.clone(), one.clone(), one.clone(), one.clone(), one).unwrap()];
        let how = Follow { steps: 3, longest: 1.0, farthest: 2.0 };
        let kind = Kind::from_name("support_stiffness").unwrap();
        let ends = follow(kind, &[vec![f64::INFINITY], vec![0.0, 1.0], vec![0.0]], &free, how);
        assert!(ends[0].is_none() && ends[1].is_none() && ends[2].is_some());
    }
}
