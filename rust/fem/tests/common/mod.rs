//! Meshes and dense helpers shared by the tests.
#![allow(dead_code)]

use femend_fem::mesh::*;
use femend_fem::model::{Model, System};
use femend_fem::parameter::Parameter;
use nalgebra::DMatrix;

pub fn steel() -> Material {
    Material { id: 1, e: Some(2.1e11), g: None, nu: Some(0.3), rho: 7850.0, ge: 0.02 }
}

pub fn section(i12: f64) -> BeamSection {
    BeamSection {
        a: 6e-4,
        i1: 5e-8,
        i2: 2e-8,
        i12,
        j: 3e-8,
        nsm: 0.4,
        neutral_axis: [0.0; 2],
        nsm_offset: [0.0; 2],
    }
}

pub fn node(id: Id, xyz: [f64; 3]) -> Node {
    Node { id, xyz, frame: None }
}

/// A rotation about a skew axis.
pub fn turn(angle: f64) -> Rotation {
    let axis = nalgebra::Unit::new_normalize(nalgebra::Vector3::new(0.3, -0.5, 0.8));
    let r = nalgebra::Rotation3::from_axis_angle(&axis, angle);
    std::array::from_fn(|i| std::array::from_fn(|j| r[(i, j)]))
}

pub fn apply(r: &Rotation, v: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| (0..3).map(|j| r[i][j] * v[j]).sum())
}

pub fn beam(id: Id, nodes: [Id; 2], v: [f64; 3]) -> Beam {
    Beam {
        id,
        kind: BeamKind::Bar,
        property: 1,
        nodes,
        orientation: Orientation::Vector(v),
        offsets: [[0.0; 3]; 2],
        pins: [Components::default(); 2],
    }
}

/// A straight beam of `n` elements and length `l` along x, free at both ends.
pub fn straight(n: usize, l: f64, k: [f64; 2], coupled: bool) -> Mesh {
    let mut mesh = Mesh {
        materials: vec![steel()],
        beam_properties: vec![BeamProperty {
            id: 1,
            material: 1,
            a: section(0.0),
            b: None,
            k1: k[0],
            k2: k[1],
        }],
        options: Options { coupled_mass: coupled, ..Options::default() },
        ..Mesh::default()
    };
    for i in 0..=n {
        mesh.nodes.push(node(i as Id + 1, [l * i as f64 / n as f64, 0.0, 0.0]));
    }
    for i in 0..n as Id {
        mesh.beams.push(beam(i + 1, [i + 1, i + 2], [0.0, 1.0, 0.0]));
    }
    mesh
}

pub fn dense(model: &Model, values: &[f64]) -> DMatrix<f64> {
    let p = model.pattern();
    let mut out = DMatrix::zeros(p.n(), p.n());
    for j in 0..p.n() {
        for (q, &i) in p.range(j).zip(p.column(j)) {
            out[(i as usize, j)] = values[q];
        }
    }
    out
}

/// Eigenvalues omega² ascending; M must be positive definite.
pub fn eigenvalues(k: &DMatrix<f64>, m: &DMatrix<f64>) -> Vec<f64> {
    let l = m.clone().cholesky().expect("mass matrix is positive definite").l();
    let a = l.solve_lower_triangular(k).unwrap();
    let a = l.solve_lower_triangular(&a.transpose()).unwrap();
    let mut e: Vec<f64> =
        nalgebra::SymmetricEigen::new((&a + a.transpose()) * 0.5).eigenvalues.iter().copied().collect();
    e.sort_by(f64::total_cmp);
    e
}

/// Rigid-body motions of the whole model in displacement frames, (n_g, 6).
pub fn rigid_motions(model: &Model) -> DMatrix<f64> {
    let mut out = DMatrix::zeros(model.nodes.n_g(), 6);
    for n in 0..model.nodes.len() {
        let h = femend_fem::small::rigid(model.nodes.xyz(n));
        let basic = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let r = model.nodes.frame(n).copied().unwrap_or(basic);
        for i in 0..6 {
            for j in 0..6 {
                out[(6 * n + i, j)] = (0..3).map(|c| r[i % 3][c] * h[(3 * (i / 3) + c, j)]).sum();
            }
        }
    }
    out
}

/// Checks the derivative of every matrix over every parameter of the model against central differences at `factors`.
pub fn derivatives_equal_differences(model: &Model, parameters: &[Parameter], factors: &[f64]) {
    for i in 0..parameters.len() {
        let exact = model.derivative(i, factors).unwrap();
        let step = 1e-4;
        // fourth order central differences: error about step⁴ and eps / step
        let p = [-2.0, -1.0, 1.0, 2.0].map(|s| {
            let mut f = factors.to_vec();
            f[i] += s * step;
            model.assemble(&f).unwrap()
        });
        let parts: [fn(&System) -> &Vec<f64>; 4] = [|s| &s.k, |s| &s.m, |s| &s.c, |s| &s.h];
        let mut any = false;
        for get in parts {
            let d = get(&exact);
            let largest = |v: &Vec<f64>| v.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            let (size, full) = (largest(d), largest(get(&p[1])));
            any |= size > 0.0;
            for j in 0..d.len() {
                let fd =
                    (8.0 * (get(&p[2])[j] - get(&p[1])[j]) - (get(&p[3])[j] - get(&p[0])[j])) / (12.0 * step);
                assert!(
                    (fd - d[j]).abs() <= 1e-8 * size + 1e-11 * full,
                    "{:?}: {fd} {}",
                    parameters[i],
                    d[j]
                );
            }
        }
        assert!(any, "{:?}", parameters[i]);
    }
}

/// Isotropic property 1 of thickness `t`, with transverse shear where there is a `mid3`.
pub fn shell_property(t: f64, mid3: Option<Id>) -> ShellProperty {
    ShellProperty {
        id: 1,
        mid1: Some(1),
        t: Some(t),
        mid2: Some(1),
        bending_ratio: 1.0,
        mid3,
        shear_ratio: 5.0 / 6.0,
        mid4: None,
        nsm: 0.0,
    }
}

/// A shell of property 1 without offset.
pub fn shell<const N: usize>(id: Id, nodes: [Id; N]) -> Shell<N> {
    Shell { id, property: 1, nodes, axis: MaterialAxis::Angle(0.0), zoffset: 0.0, thickness: [None; N] }
}
