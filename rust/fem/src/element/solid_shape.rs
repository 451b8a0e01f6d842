//! Shape functions of the solids in Nastran's node order, tabulated once at their integration points.

use super::quadrature::{Point, cube, pyramid, tetrahedron, wedge};
use crate::mesh::SolidKind;
use crate::scalar::{Dual, Scalar};
use std::sync::OnceLock;

const HEXA: [[f64; 3]; 8] = [
    [-1.0, -1.0, -1.0],
    [1.0, -1.0, -1.0],
    [1.0, 1.0, -1.0],
    [-1.0, 1.0, -1.0],
    [-1.0, -1.0, 1.0],
    [1.0, -1.0, 1.0],
    [1.0, 1.0, 1.0],
    [-1.0, 1.0, 1.0],
];
/// Corners of the edges that carry mid-side nodes, in the order of those nodes.
const HEXA_EDGES: [[usize; 2]; 12] =
    [[0, 1], [1, 2], [2, 3], [3, 0], [0, 4], [1, 5], [2, 6], [3, 7], [4, 5], [5, 6], [6, 7], [7, 4]];
const TETRA_EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]];
const SQUARE: [[f64; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
const TRIANGLE_EDGES: [[usize; 2]; 3] = [[0, 1], [1, 2], [2, 0]];

/// Shape functions at parent coordinates `p`.
pub fn shapes<S: Scalar>(kind: SolidKind, p: [S; 3]) -> Vec<S> {
    match kind {
        SolidKind::Hexa8 | SolidKind::Hexa20 => hexa(kind == SolidKind::Hexa20, p),
        SolidKind::Tetra4 | SolidKind::Tetra10 => tetra(kind == SolidKind::Tetra10, p),
        SolidKind::Penta6 | SolidKind::Penta15 => penta(kind == SolidKind::Penta15, p),
        SolidKind::Pyramid5 => pyramid5(p),
        SolidKind::Pyramid13 => pyramid13(p),
    }
}

fn hexa<S: Scalar>(quadratic: bool, p: [S; 3]) -> Vec<S> {
    let one = S::c(1.0);
    let term = |i: usize, at: f64| one + p[i] * at;
    let mut out = Vec::with_capacity(20);
    for corner in HEXA {
        let linear = term(0, corner[0]) * term(1, corner[1]) * term(2, corner[2]) * 0.125;
        let correction = p[0] * corner[0] + p[1] * corner[1] + p[2] * corner[2] - S::c(2.0);
        out.push(if quadratic { linear * correction } else { linear });
    }
    if quadratic {
        for [a, b] in HEXA_EDGES {
            let mut n = S::c(0.25);
            for i in 0..3 {
                let middle = 0.5 * (HEXA[a][i] + HEXA[b][i]);
                n = n * if middle == 0.0 { one - p[i] * p[i] } else { term(i, middle) };
            }
            out.push(n);
        }
    }
    out
}

fn tetra<S: Scalar>(quadratic: bool, p: [S; 3]) -> Vec<S> {
    let one = S::c(1.0);
    let l = [one - p[0] - p[1] - p[2], p[0], p[1], p[2]];
    if !quadratic {
        return l.to_vec();
    }
    let mut out: Vec<S> = l.iter().map(|&x| x * (x * 2.0 - one)).collect();
    out.extend(TETRA_EDGES.iter().map(|&[a, b]| l[a] * l[b] * 4.0));
    out
}

fn penta<S: Scalar>(quadratic: bool, p: [S; 3]) -> Vec<S> {
    let one = S::c(1.0);
    let l = [one - p[0] - p[1], p[0], p[1]];
    let faces = [one - p[2], one + p[2]];
    let bubble = one - p[2] * p[2];
    let mut out = Vec::with_capacity(15);
    for face in faces {
        for x in l {
            let linear = x * face * 0.5;
            out.push(if quadratic { linear * (x * 2.0 - one) - x * bubble * 0.5 } else { linear });
        }
    }
    if quadratic {
        let edges = |face: S| TRIANGLE_EDGES.map(|[a, b]| l[a] * l[b] * face * 2.0);
        out.extend(edges(faces[0]));
        out.extend(l.map(|x| x * bubble));
        out.extend(edges(faces[1]));
    }
    out
}

/// Height above a pyramid's base below which its rational shapes are evaluated; at the apex they have no derivative.
const APEX: f64 = 1.0 - 1e-9;

/// Base |x|, |y| <= 1 - z at z = 0, apex at z = 1 (Bedrosian, Int. J. Numer. Meth. Engng 35 (1992) 95).
fn pyramid5<S: Scalar>([x, y, z]: [S; 3]) -> Vec<S> {
    let side = S::c(1.0) - z;
    let mut out: Vec<S> =
        SQUARE.iter().map(|[a, b]| (side + x * *a) * (side + y * *b) * 0.25 / side).collect();
    out.push(z);
    out
}

fn pyramid13<S: Scalar>([x, y, z]: [S; 3]) -> Vec<S> {
    let one = S::c(1.0);
    let side = one - z;
    let mut out: Vec<S> = SQUARE
        .iter()
        .map(|[a, b]| (x * *a + y * *b - one) * (side + x * *a) * (side + y * *b) * 0.25 / side)
        .collect();
    out.push(z * (z * 2.0 - one));
    let along = |p: S, q: S, at: f64| (side + p) * (side - p) * (side + q * at) * 0.5 / side;
    out.extend([along(x, y, -1.0), along(y, x, 1.0), along(x, y, 1.0), along(y, x, -1.0)]);
    out.extend(SQUARE.iter().map(|[a, b]| z * (side + x * *a) * (side + y * *b) / side));
    out
}

/// One integration point: weight, parent coordinates, shape functions and their parent derivatives.
#[derive(Debug, Clone)]
pub struct Station {
    /// Weight.
    pub w: f64,
    /// Parent coordinates.
    pub p: [f64; 3],
    /// Shape functions.
    pub n: Vec<f64>,
    /// Derivatives with respect to the parent coordinates.
    pub d: Vec<[f64; 3]>,
}

/// Stations of one kind of solid.
#[derive(Debug)]
pub struct Stations {
    /// Integration points of the stiffness.
    pub stiffness: Vec<Station>,
    /// Integration points of the mass.
    pub mass: Vec<Station>,
    /// Centre.
    pub centre: Station,
    /// Corner nodes, where the Jacobian is checked.
    pub corners: Vec<Station>,
}

fn station(kind: SolidKind, (p, w): Point) -> Station {
    let along = |i: usize| {
        let q: [Dual; 3] = std::array::from_fn(|j| Dual { v: p[j], d: f64::from(u8::from(i == j)) });
        shapes(kind, q)
    };
    let parts = [along(0), along(1), along(2)];
    let d = (0..kind.n_nodes()).map(|a| [parts[0][a].d, parts[1][a].d, parts[2][a].d]).collect();
    Station { w, p, n: parts[0].iter().map(|x| x.v).collect(), d }
}

/// The tables of a kind of solid.
#[must_use]
pub fn stations(kind: SolidKind) -> &'static Stations {
    static TABLES: [OnceLock<Stations>; 8] = [const { OnceLock::new() }; 8];
    let (slot, k, m) = match kind {
        SolidKind::Tetra4 => (0, tetrahedron(1), tetrahedron(2)),
        // degree 2 is enough where edges are straight; where they are bowed a constant stress asks for degree 3
        SolidKind::Tetra10 => (1, tetrahedron(3), tetrahedron(4)),
        SolidKind::Penta6 => (2, wedge(2, 2), wedge(2, 2)),
        SolidKind::Penta15 => (3, wedge(3, 3), wedge(3, 3)),
        SolidKind::Hexa8 => (4, cube(2), cube(2)),
        SolidKind::Hexa20 => (5, cube(3), cube(3)),
        SolidKind::Pyramid5 => (6, pyramid(2), pyramid(3)),
        SolidKind::Pyramid13 => (7, pyramid(3), pyramid(4)),
    };
    TABLES[slot].get_or_init(|| {
        let table = |points: &[Point]| points.iter().map(|&p| station(kind, p)).collect();
        let centre = match kind {
            SolidKind::Tetra4 | SolidKind::Tetra10 => [0.25; 3],
            SolidKind::Penta6 | SolidKind::Penta15 => [1.0 / 3.0, 1.0 / 3.0, 0.0],
            SolidKind::Hexa8 | SolidKind::Hexa20 => [0.0; 3],
            SolidKind::Pyramid5 | SolidKind::Pyramid13 => [0.0, 0.0, 0.25],
        };
        let corners: Vec<Point> = corner_points(kind).into_iter().map(|p| (p, 0.0)).collect();
        Stations {
            stiffness: table(&k),
            mass: table(&m),
            centre: station(kind, (centre, 0.0)),
            corners: table(&corners),
        }
    })
}

fn corner_points(kind: SolidKind) -> Vec<[f64; 3]> {
    let triangle = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
    match kind {
        SolidKind::Tetra4 | SolidKind::Tetra10 => {
            vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
        }
        SolidKind::Penta6 | SolidKind::Penta15 => {
            [-1.0, 1.0].iter().flat_map(|&z| triangle.map(|[x, y]| [x, y, z])).collect()
        }
        SolidKind::Hexa8 | SolidKind::Hexa20 => HEXA.to_vec(),
        SolidKind::Pyramid5 | SolidKind::Pyramid13 => {
            SQUARE.iter().map(|[x, y]| [*x, *y, 0.0]).chain([[0.0, 0.0, APEX]]).collect()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shape_functions_are_one_at_their_node_and_sum_to_one() {
        use SolidKind::{Hexa8, Hexa20, Penta6, Penta15, Pyramid5, Pyramid13, Tetra4, Tetra10};
        for kind in [Tetra4, Tetra10, Penta6, Penta15, Hexa8, Hexa20, Pyramid5, Pyramid13] {
            let corners = corner_points(kind);
            let edges: Vec<[usize; 2]> = match kind {
                Tetra10 => TETRA_EDGES.to_vec(),
                Hexa20 => HEXA_EDGES.to_vec(),
                Penta15 => vec![[0, 1], [1, 2], [2, 0], [0, 3], [1, 4], [2, 5], [3, 4], [4, 5], [5, 3]],
                Pyramid13 => vec![[0, 1], [1, 2], [2, 3], [3, 0], [0, 4], [1, 4], [2, 4], [3, 4]],
                _ => vec![],
            };
            let mut nodes = corners.clone();
            nodes.extend(
                edges.iter().map(|[a, b]| std::array::from_fn(|i| 0.5 * (corners[*a][i] + corners[*b][i]))),
            );
            assert_eq!(nodes.len(), kind.n_nodes());
            for (a, at) in nodes.iter().enumerate() {
                for (b, n) in shapes(kind, *at).iter().enumerate() {
                    // the apex of a pyramid is approached, not reached
                    assert!((n - f64::from(u8::from(a == b))).abs() < 1e-8, "{kind:?} {a} {b}: {n}");
                }
            }
            let sum: f64 = shapes(kind, [0.21, 0.34, 0.17]).iter().sum();
            assert!((sum - 1.0).abs() < 1e-14);
        }
    }
}
