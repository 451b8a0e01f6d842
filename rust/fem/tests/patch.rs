//! Patch tests of every solid, shell, beam and rod: on an irregular mesh a state of constant strain is the solution to
//! rounding, whatever the size of the elements.
//!
//! Three questions each (Taylor, Simo, Zienkiewicz and Chan, Int. J. Numer. Meth. Engng 22 (1986) 39, tests A, B and
//! C): with all nodes where the state has them, no force is left at inner nodes; with the outer nodes there, the inner
//! ones follow; and a free patch has six motions without energy, no more. Springs and bushes have no strain; their free
//! motions are in `beam_models.rs`.

mod common;

use std::collections::BTreeMap;

use common::*;
use femend_fem::mesh::*;
use femend_fem::model::Model;
use nalgebra::DMatrix;

const E: f64 = 2.1e11;
const NU: f64 = 0.3;

/// Force left at inner nodes beside the largest: rounding of sums over some ten elements.
const FORCE: f64 = 1e-12;
/// Displacement of inner nodes beside the largest, and energies: rounding times the condition of a small stiffness.
const EXACT: f64 = 1e-10;

fn stiffness(model: &Model) -> DMatrix<f64> {
    dense(model, &model.assemble(&[]).unwrap().k)
}

/// Tests A and B for the columns of `u` (n_a, states), rows of inner nodes by `inner`.
fn passes(what: &str, k: &DMatrix<f64>, u: &DMatrix<f64>, inner: &[usize]) {
    assert!(!inner.is_empty() && inner.len() < k.nrows(), "{what}: no inner nodes, or no outer ones");
    let outer: Vec<usize> = (0..k.nrows()).filter(|i| !inner.contains(i)).collect();
    for state in 0..u.ncols() {
        let exact = u.columns(state, 1);
        // each row beside the terms that cancel in it: forces and moments differ by the size of an element
        let left = k * exact;
        let terms = k.abs() * exact.abs();
        let force =
            inner.iter().map(|&i| left[i].abs() / terms[i].max(1e-3 * terms.amax())).fold(0.0, f64::max);
        assert!(force < FORCE, "{what}, state {state}: inner nodes are left a force of {force:.1e}");
        let inside = DMatrix::from_fn(inner.len(), inner.len(), |i, j| k[(inner[i], inner[j])]);
        let load = DMatrix::from_fn(inner.len(), 1, |i, _| {
            -outer.iter().map(|&j| k[(inner[i], j)] * exact[j]).sum::<f64>()
        });
        let found = inside.cholesky().expect("the inner nodes are held by the outer ones").solve(&load);
        let miss = (0..inner.len()).map(|i| (found[i] - exact[inner[i]]).abs()).fold(0.0, f64::max);
        assert!(miss < EXACT * exact.amax(), "{what}, state {state}: inner nodes miss by {miss:.1e}");
    }
}

/// Test C: six motions without energy (`motions` where an element has fewer DOFs) and a clear step to the next, after each
/// DOF is scaled by its own stiffness.
fn moves_freely(what: &str, model: &Model, k: &DMatrix<f64>, motions: usize) {
    let all = rigid_motions(model);
    for j in 0..6 {
        let v = DMatrix::from_fn(model.n_a(), 1, |i, _| all[(model.a_rows[i], j)]);
        let (energy, terms) = (v.dot(&(k * &v)).abs(), v.abs().dot(&(k.abs() * v.abs())));
        assert!(energy <= 1e-13 * terms, "{what}: rigid motion {j} stores {energy:.1e} of {terms:.1e}");
    }
    let n = model.n_a();
    let scaled = DMatrix::from_fn(n, n, |i, j| k[(i, j)] / (k[(i, i)] * k[(j, j)]).sqrt());
    let mut e: Vec<f64> = nalgebra::SymmetricEigen::new(scaled).eigenvalues.iter().copied().collect();
    e.sort_by(f64::total_cmp);
    let (last, first) = (e[motions - 1], e[motions]);
    assert!(
        last.abs() < 1e-11 && first > 1e-8,
        "{what}: {motions} motions, eigenvalues {last:.1e}, {first:.1e}"
    );
}

/// The same number in -1..1 for the same integers.
fn noise(at: [usize; 3], c: usize) -> f64 {
    (((at[0] * 7 + at[1] * 13 + at[2] * 29 + c * 5) * 31) % 17) as f64 / 8.0 - 1.0
}

/// Nodes of each element that a cell with its eight corners in the order of a CHEXA, and its centre (8), is cut into.
fn cut(kind: SolidKind) -> Vec<Vec<usize>> {
    let list: &[&[usize]] = match kind {
        SolidKind::Hexa8 | SolidKind::Hexa20 => &[&[0, 1, 2, 3, 4, 5, 6, 7]],
        SolidKind::Penta6 | SolidKind::Penta15 => &[&[0, 1, 2, 4, 5, 6], &[0, 2, 3, 4, 6, 7]],
        // six around the diagonal 0-6, so that diagonals of neighbours' faces meet
        SolidKind::Tetra4 | SolidKind::Tetra10 => {
            &[&[0, 1, 2, 6], &[0, 3, 7, 6], &[0, 4, 5, 6], &[0, 5, 1, 6], &[0, 2, 3, 6], &[0, 7, 4, 6]]
        }
        SolidKind::Pyramid5 | SolidKind::Pyramid13 => &[
            &[0, 1, 2, 3, 8],
            &[4, 7, 6, 5, 8],
            &[0, 4, 5, 1, 8],
            &[3, 2, 6, 7, 8],
            &[0, 3, 7, 4, 8],
            &[1, 5, 6, 2, 8],
        ],
    };
    list.iter().map(|nodes| nodes.to_vec()).collect()
}

/// Ends of the edges that carry nodes, in the order of those nodes.
fn edges(kind: SolidKind) -> &'static [[usize; 2]] {
    match kind {
        SolidKind::Hexa20 => {
            &[[0, 1], [1, 2], [2, 3], [3, 0], [0, 4], [1, 5], [2, 6], [3, 7], [4, 5], [5, 6], [6, 7], [7, 4]]
        }
        SolidKind::Penta15 => &[[0, 1], [1, 2], [2, 0], [0, 3], [1, 4], [2, 5], [3, 4], [4, 5], [5, 3]],
        SolidKind::Tetra10 => &[[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]],
        SolidKind::Pyramid13 => &[[0, 1], [1, 2], [2, 3], [3, 0], [0, 4], [1, 4], [2, 4], [3, 4]],
        _ => &[],
    }
}

/// Block of 2 x 2 x 2 cells with every node moved, inner and outer ones, by `shake` of a cell; `bow` moves the nodes inside
/// edges off their middle. With it, which nodes are inside the block.
fn block(kind: SolidKind, shake: f64, bow: f64) -> (Mesh, Vec<bool>) {
    let cell = [0.5, 0.6, 0.45];
    let mut mesh = Mesh {
        materials: vec![steel()],
        solid_properties: vec![SolidProperty { id: 1, material: 1, frame: None }],
        options: Options { coupled_mass: true, ..Options::default() },
        ..Mesh::default()
    };
    let (mut ids, mut inside) = (BTreeMap::<[usize; 3], Id>::new(), Vec::new());
    // places before they are moved, in quarters of a cell
    let moved = |at: [usize; 3]| -> [f64; 3] {
        std::array::from_fn(|c| cell[c] * (0.25 * at[c] as f64 + shake * noise(at, c)))
    };
    let mut id_at = |at: [usize; 3], xyz: [f64; 3], mesh: &mut Mesh| {
        *ids.entry(at).or_insert_with(|| {
            inside.push(at.iter().all(|&x| x > 0 && x < 8));
            mesh.nodes.push(node(inside.len() as Id, xyz));
            inside.len() as Id
        })
    };
    let corners =
        [[0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0], [0, 0, 4], [4, 0, 4], [4, 4, 4], [0, 4, 4], [2; 3]];
    for low in (0..8).map(|i| [4 * (i % 2), 4 * (i / 2 % 2), 4 * (i / 4)]) {
        let at = corners.map(|up| std::array::from_fn(|c| low[c] + up[c]));
        for nodes in cut(kind) {
            let mut list: Vec<Id> = nodes.iter().map(|&i| id_at(at[i], moved(at[i]), &mut mesh)).collect();
            for [a, b] in edges(kind) {
                let (p, q) = (at[nodes[*a]], at[nodes[*b]]);
                let middle: [usize; 3] = std::array::from_fn(|c| (p[c] + q[c]) / 2);
                let (x, y) = (moved(p), moved(q));
                let xyz = std::array::from_fn(|c| 0.5 * (x[c] + y[c]) + cell[c] * bow * noise(middle, c));
                list.push(id_at(middle, xyz, &mut mesh));
            }
            let id = mesh.solids.len() as Id + 1;
            mesh.solids.push(Solid { id, property: 1, kind, nodes: list });
        }
    }
    (mesh, inside)
}

/// Rows of the a-set at inner nodes.
fn inner_rows(model: &Model, inside: &[bool]) -> Vec<usize> {
    (0..model.n_a()).filter(|&i| inside[model.nodes.component(model.a_rows[i]).node as usize - 1]).collect()
}

const SOLIDS: [SolidKind; 8] = [
    SolidKind::Tetra4,
    SolidKind::Tetra10,
    SolidKind::Penta6,
    SolidKind::Penta15,
    SolidKind::Hexa8,
    SolidKind::Hexa20,
    SolidKind::Pyramid5,
    SolidKind::Pyramid13,
];

/// Strains xx, yy, zz, xy, yz, zx of one, each with some spin, as gradients of displacement.
const STATES: [[[f64; 3]; 3]; 6] = [
    [[1.0, 0.2, 0.0], [-0.2, 0.0, 0.0], [0.0; 3]],
    [[0.0; 3], [0.0, 1.0, 0.0], [0.0; 3]],
    [[0.0, 0.0, 0.3], [0.0; 3], [-0.3, 0.0, 1.0]],
    [[0.0, 1.0, 0.0], [0.0; 3], [0.0; 3]],
    [[0.0; 3], [0.0, 0.0, 0.5], [0.0, 0.5, 0.0]],
    [[0.0, 0.0, 1.0], [0.0; 3], [0.0; 3]],
];

fn linear_fields(model: &Model) -> DMatrix<f64> {
    DMatrix::from_fn(model.n_a(), 6, |i, state| {
        let x = model.nodes.xyz(model.a_rows[i] / 6);
        dot(&STATES[state][model.a_rows[i] % 6], &x)
    })
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

#[test]
fn every_solid_passes_the_patch_test_on_a_distorted_mesh() {
    for kind in SOLIDS {
        let (mesh, inside) = block(kind, 0.06, 0.0);
        let model = Model::new(&mesh, &[], &[]).unwrap();
        let (k, u, what) = (stiffness(&model), linear_fields(&model), format!("{kind:?}"));
        passes(&what, &k, &u, &inner_rows(&model, &inside));
        moves_freely(&what, &model, &k, 6);
        // energies of pairs of states: the stress is the material's, not only constant
        let (lambda, mu) = (E * NU / ((1.0 + NU) * (1.0 - 2.0 * NU)), E / (2.0 + 2.0 * NU));
        let volume = model.total_mass() / 7850.0;
        let energy = u.transpose() * &k * &u / volume;
        let exact = DMatrix::from_fn(6, 6, |a, b| match (a, b) {
            (0..3, 0..3) => lambda + if a == b { 2.0 * mu } else { 0.0 },
            _ => {
                if a == b {
                    mu
                } else {
                    0.0
                }
            }
        });
        let miss = (energy - &exact).amax() / exact.amax();
        assert!(miss < EXACT, "{what}: energies of constant strains miss by {miss:.1e}");
    }
}

#[test]
fn quadratic_solids_pass_it_with_bowed_edges() {
    // isoparametric shapes hold every linear field whatever the edges; what can fail is the integration of its stress
    for kind in [SolidKind::Tetra10, SolidKind::Penta15, SolidKind::Hexa20, SolidKind::Pyramid13] {
        let (mesh, inside) = block(kind, 0.06, 0.04);
        let model = Model::new(&mesh, &[], &[]).unwrap();
        let what = format!("{kind:?} with bowed edges");
        let k = stiffness(&model);
        passes(&what, &k, &linear_fields(&model), &inner_rows(&model, &inside));
        moves_freely(&what, &model, &k, 6);
    }
}

/// 3 x 3 cells in the x-y plane with every node moved in it, as CQUAD4 or as CTRIA3 with diagonals both ways.
fn plate(triangles: bool, t: f64, mid3: Option<Id>) -> (Mesh, Vec<bool>) {
    let mut mesh = Mesh {
        materials: vec![steel()],
        shell_properties: vec![shell_property(t, mid3)],
        options: Options { coupled_mass: true, ..Options::default() },
        ..Mesh::default()
    };
    let grid = |i: usize, j: usize| (1 + i + 4 * j) as Id;
    let mut inside = Vec::new();
    for (i, j) in (0..16).map(|n| (n % 4, n / 4)) {
        let at = [i, j, 0];
        let (x, y) = (0.4 * (i as f64 + 0.15 * noise(at, 0)), 0.3 * (j as f64 + 0.15 * noise(at, 1)));
        mesh.nodes.push(node(grid(i, j), [x + 0.3 * y, y, 0.0]));
        inside.push((1..3).contains(&i) && (1..3).contains(&j));
    }
    for (i, j) in (0..9).map(|n| (n % 3, n / 3)) {
        let q = [grid(i, j), grid(i + 1, j), grid(i + 1, j + 1), grid(i, j + 1)];
        let id = 2 * (i + 3 * j) as Id + 1;
        let (a, b) = if (i + j) % 2 == 0 { ([0, 1, 2], [0, 2, 3]) } else { ([0, 1, 3], [1, 2, 3]) };
        if triangles {
            mesh.trias.push(shell(id, a.map(|n| q[n])));
            mesh.trias.push(shell(id + 1, b.map(|n| q[n])));
        } else {
            mesh.quads.push(shell(id, q));
        }
    }
    (mesh, inside)
}

/// Membrane strains xx, yy and xy of one, the last with spin, which drilling rotations follow; then curvatures xx, yy and
/// twist xy of one, `w = -(kx x² + ky y² + kxy x y) / 2`, without transverse shear.
fn shell_fields(model: &Model) -> DMatrix<f64> {
    DMatrix::from_fn(model.n_a(), 6, |i, state| {
        let [x, y, _] = model.nodes.xyz(model.a_rows[i] / 6);
        let one = |n: usize| f64::from(u8::from(state == n));
        let (kx, ky, kxy) = (one(3), one(4), one(5));
        match model.a_rows[i] % 6 {
            0 => one(0) * x + 0.2 * one(2) * y,
            1 => one(1) * y + 0.8 * one(2) * x,
            2 => -0.5 * (kx * x * x + ky * y * y + kxy * x * y),
            3 => -(ky * y + 0.5 * kxy * x),
            4 => kx * x + 0.5 * kxy * y,
            _ => 0.5 * (0.8 - 0.2) * one(2),
        }
    })
}

#[test]
fn shells_pass_the_membrane_bending_and_twist_patch_tests() {
    for (triangles, t, mid3) in [false, true].into_iter().flat_map(|triangles| {
        // thick, thin, very thin; and without transverse shear
        [(0.2, Some(1)), (0.01, Some(1)), (5e-4, Some(1)), (0.01, None)].map(|(t, mid3)| (triangles, t, mid3))
    }) {
        let name = if triangles { "CTRIA3" } else { "CQUAD4" };
        let what = format!("{name}, t = {t}, MID3 {mid3:?}");
        let (mesh, inside) = plate(triangles, t, mid3);
        let model = Model::new(&mesh, &[], &[]).unwrap();
        let (k, u) = (stiffness(&model), shell_fields(&model));
        passes(&what, &k, &u, &inner_rows(&model, &inside));
        moves_freely(&what, &model, &k, 6);
        // membrane E t / (1 - nu²) and bending E t³ / 12 (1 - nu²), nothing between them
        let area = model.total_mass() / (7850.0 * t);
        let c = E * t / (1.0 - NU * NU);
        let plane = [[1.0, NU, 0.0], [NU, 1.0, 0.0], [0.0, 0.0, 0.5 * (1.0 - NU)]];
        let energy = u.transpose() * &k * &u / area;
        // the terms of transverse shear that cancel exceed those of bending by the square of length over thickness
        let tolerance = EXACT.max(1e-14 / (t * t));
        for (a, b) in (0..36).map(|p| (p / 6, p % 6)) {
            let size = [c, c * t * t / 12.0];
            let exact = if a / 3 == b / 3 { size[a / 3] * plane[a % 3][b % 3] } else { 0.0 };
            let miss = (energy[(a, b)] - exact).abs() / (size[a / 3] * size[b / 3]).sqrt();
            assert!(miss < tolerance, "{what}: states {a} and {b} store {:e}, not {exact:e}", energy[(a, b)]);
        }
    }
}

/// Four nodes on a line that is cut unevenly, along `axis`, without elements.
fn line(axis: [f64; 3]) -> Mesh {
    let mut mesh = straight(3, 1.0, [0.0; 2], true);
    mesh.beams.clear();
    for (node, at) in mesh.nodes.iter_mut().zip([0.0, 0.5, 0.7, 1.6]) {
        node.xyz = axis.map(|a| a * at);
    }
    mesh
}

#[test]
fn beams_pass_the_patch_test_of_strain_twist_and_curvature() {
    let r = turn(0.7);
    let local = |i: usize| r.map(|row| row[i]);
    for (k, i12) in [([0.0; 2], 0.0), ([0.6, 0.3], 0.0), ([0.6, 0.3], 1.5e-8)] {
        let what = format!("CBAR, K1 and K2 {k:?}, I12 {i12}");
        let mut mesh = line(local(0));
        mesh.beam_properties[0] =
            BeamProperty { id: 1, material: 1, a: section(i12), b: None, k1: k[0], k2: k[1] };
        mesh.beams = (1..4).map(|id| beam(id, [id, id + 1], local(1))).collect();
        let model = Model::new(&mesh, &[], &[]).unwrap();
        // along the line s: strain, twist, curvature in both planes, each one
        let u = DMatrix::from_fn(model.n_a(), 4, |i, state| {
            let s = nalgebra::Vector3::from(model.nodes.xyz(model.a_rows[i] / 6)).norm();
            let (mut moved, mut turned) = ([0.0; 3], [0.0; 3]);
            match state {
                0 => moved[0] = s,
                1 => turned[0] = s,
                2 => (moved[1], turned[2]) = (0.5 * s * s, s),
                _ => (moved[2], turned[1]) = (0.5 * s * s, -s),
            }
            let part = if model.a_rows[i] % 6 < 3 { moved } else { turned };
            apply(&r, part)[model.a_rows[i] % 3]
        });
        let stiff = stiffness(&model);
        passes(&what, &stiff, &u, &inner_rows(&model, &[false, true, true, false]));
        moves_freely(&what, &model, &stiff, 6);
        // EA, GJ, EI1, EI2 and the product of inertia between both planes, over the length
        let energy = u.transpose() * &stiff * &u / 1.6;
        let p = section(i12);
        let g = E / (2.0 * (1.0 + NU));
        let size = [E * p.a, g * p.j, E * p.i1, E * p.i2];
        for (a, b) in (0..16).map(|n| (n / 4, n % 4)) {
            let product = if a + b == 5 && a > 1 && b > 1 { E * i12 } else { 0.0 };
            let exact = if a == b { size[a] } else { product };
            let miss = (energy[(a, b)] - exact).abs() / (size[a] * size[b]).sqrt();
            assert!(miss < EXACT, "{what}: states {a} and {b} store {:e}, not {exact:e}", energy[(a, b)]);
        }
    }
}

#[test]
fn rods_pass_the_patch_test_of_strain_and_twist() {
    let mut mesh = line([1.0, 0.0, 0.0]);
    let (a, j) = (2e-4, 1e-9);
    mesh.rod_properties.push(RodProperty { id: 1, section: RodSection { material: 1, a, j, nsm: 0.0 } });
    // across the line there is mass without stiffness
    let across = Components::from_list(&[2, 3, 5, 6]);
    mesh.spc = (1..5).map(|node| Spc { id: 1, node, components: across }).collect();
    mesh.rods = (1..4).map(|id| Rod { id, source: RodSource::Property(1), nodes: [id, id + 1] }).collect();
    let model = Model::new(&mesh, &[], &[]).unwrap();
    let stiff = stiffness(&model);
    let u = DMatrix::from_fn(model.n_a(), 2, |i, state| {
        let x = model.nodes.xyz(model.a_rows[i] / 6)[0];
        if model.a_rows[i] % 6 == 3 * state { x } else { 0.0 }
    });
    passes("CROD", &stiff, &u, &inner_rows(&model, &[false, true, true, false]));
    moves_freely("CROD", &model, &stiff, 2);
    let energy = u.transpose() * &stiff * &u / 1.6;
    let exact = [E * a, E / (2.0 * (1.0 + NU)) * j];
    for (p, q) in [(0, 0), (0, 1), (1, 1)] {
        let expected = if p == q { exact[p] } else { 0.0 };
        assert!((energy[(p, q)] - expected).abs() < EXACT * (exact[p] * exact[q]).sqrt(), "CROD {p} {q}");
    }
}
