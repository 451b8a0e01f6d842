//! Three-node shells, laminates and membrane-bending coupling: patch tests, limits with closed forms, invariance,
//! derivatives, errors.

mod common;

use common::*;
use femend_fem::mesh::*;
use femend_fem::model::{Model, System};
use femend_fem::parameter::Parameter;
use nalgebra::DMatrix;

const E: f64 = 2.1e11;

fn carbon(id: Id) -> PlaneMaterial {
    let law = PlaneLaw::Orthotropic { e1: 140e9, e2: 9e9, nu12: 0.3, g12: 5e9, gz: [5e9, 3e9] };
    PlaneMaterial { id, law, rho: 1600.0, ge: 0.03 }
}

/// n x n cells over an a x b rectangle sheared by `skew`, inner nodes moved by `shake`, split in triangles or not.
fn plate(n: usize, [a, b]: [f64; 2], t: f64, triangles: bool, skew: f64, shake: f64) -> Mesh {
    let mut mesh = Mesh {
        materials: vec![steel()],
        shell_properties: vec![shell_property(t, Some(1))],
        options: Options { coupled_mass: true, ..Options::default() },
        ..Mesh::default()
    };
    let id = |i: usize, j: usize| (1 + i + (n + 1) * j) as Id;
    for j in 0..=n {
        for i in 0..=n {
            let inner = f64::from(u8::from(i > 0 && i < n && j > 0 && j < n)) * shake;
            let noise =
                |c: usize| inner * ((((i * 7 + j * 13 + c * 5) * 31) % 17) as f64 / 8.0 - 1.0) / n as f64;
            let (x, y) = (a * (i as f64 / n as f64 + noise(0)), b * (j as f64 / n as f64 + noise(1)));
            mesh.nodes.push(node(id(i, j), [x + skew * y, y, 0.0]));
        }
    }
    for j in 0..n {
        for i in 0..n {
            let q = [id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)];
            let next = (mesh.quads.len() + mesh.trias.len()) as Id + 1;
            if !triangles {
                mesh.quads.push(shell(next, q));
            } else if (i + j) % 2 == 0 {
                // both directions of the diagonal
                mesh.trias.push(shell(next, [q[0], q[1], q[2]]));
                mesh.trias.push(shell(next + 1, [q[0], q[2], q[3]]));
            } else {
                mesh.trias.push(shell(next, [q[0], q[1], q[3]]));
                mesh.trias.push(shell(next + 1, [q[1], q[2], q[3]]));
            }
        }
    }
    mesh
}

fn laminate(plies: &[(Id, f64, f64)], z0: Option<f64>) -> Laminate {
    let plies = plies.iter().map(|&(material, t, degrees)| Ply { material, t, angle: degrees.to_radians() });
    Laminate { id: 1, plies: plies.collect(), z0, nsm: 0.0, ge: None, parts: LaminateParts::All }
}

fn with_laminate(mut mesh: Mesh, l: Laminate) -> Mesh {
    mesh.shell_properties.clear();
    mesh.laminates = vec![l];
    mesh.plane_materials = vec![carbon(2)];
    mesh
}

/// A field of constant strain, spin and curvature; `w = -(kx x² + ky y² + kxy x y) / 2`.
fn field(model: &Model, membrane: f64, bending: f64) -> DMatrix<f64> {
    let (kx, ky, kxy) = (bending, 0.6 * bending, 0.4 * bending);
    DMatrix::from_fn(model.n_a(), 1, |i, _| {
        let p = model.nodes.xyz(model.a_rows[i] / 6);
        let (x, y) = (p[0], p[1]);
        match model.a_rows[i] % 6 {
            0 => membrane * (1.0 * x + 0.3 * y),
            1 => membrane * (0.5 * x - 0.7 * y),
            2 => -0.5 * (kx * x * x + ky * y * y + kxy * x * y),
            3 => -(ky * y + 0.5 * kxy * x),
            4 => kx * x + 0.5 * kxy * y,
            _ => membrane * 0.5 * (0.5 - 0.3),
        }
    })
}

fn stiffness(model: &Model) -> DMatrix<f64> {
    dense(model, &model.assemble(&[]).unwrap().k)
}

/// Largest force at the inner nodes of a 3 x 3 plate over the largest of all.
fn inner_force(model: &Model, f: &DMatrix<f64>) -> f64 {
    let inner = |i: usize| [5, 6, 9, 10].contains(&(model.a_rows[i] / 6));
    (0..model.n_a()).filter(|&i| inner(i)).map(|i| f[i].abs()).fold(0.0, f64::max) / f.amax()
}

#[test]
fn triangles_pass_the_membrane_and_bending_patch_tests() {
    for mid3 in [Some(1), None] {
        for t in [1e-3, 0.01, 0.3] {
            let mut mesh = plate(3, [1.0, 0.8], t, true, 0.4, 0.5);
            mesh.shell_properties[0].mid3 = mid3;
            let model = Model::new(&mesh, &[], &[]).unwrap();
            let k = stiffness(&model);
            for u in [field(&model, 1.0, 0.0), field(&model, 0.0, 1.0)] {
                let inner = inner_force(&model, &(&k * u));
                assert!(inner < 1e-9, "t {t} {mid3:?}: {inner:e}");
            }
            // energy of the curvature: D (kx² + ky² + 2 nu kx ky + (1 - nu) kxy² / 2) area
            let u = field(&model, 0.0, 1.0);
            let d = E * t.powi(3) / (12.0 * 0.91);
            let exact = d * (1.0 + 0.36 + 0.6 * 0.6 + 0.35 * 0.16) * 0.8;
            assert!(((u.transpose() * &k * &u)[0] / exact - 1.0).abs() < 1e-9);
        }
    }
}

#[test]
fn laminates_pass_the_patch_test_with_the_energy_of_lamination_theory() {
    // [0 / 90] of equal plies: A, B, D by hand (Jones 1999, eqs 4.22-4.24)
    let (t, e1, e2, nu) = (0.002, 140e9, 9e9, 0.3);
    let c = 1.0 - nu * nu * e2 / e1;
    let (q11, q22, q12, q66) = (e1 / c, e2 / c, nu * e2 / c, 5e9);
    let (sum, difference) = (0.5 * (q11 + q22), q22 - q11);
    let h: f64 = 2.0 * t;
    let (ex, ey, exy) = (1e-3, -0.7e-3, 0.8e-3);
    let (kx, ky, kxy) = (1.0, 0.6, 0.4);
    let form = |d: f64, s: f64, a: [f64; 3], b: [f64; 3]| {
        d * (a[0] * b[0] + a[1] * b[1]) + s * q12 * (a[0] * b[1] + a[1] * b[0]) + s * q66 * a[2] * b[2]
    };
    let (eps, kappa) = ([ex, ey, exy], [kx, ky, kxy]);
    let membrane = form(sum * h, h, eps, eps);
    let bending = form(sum * h.powi(3) / 12.0, h.powi(3) / 12.0, kappa, kappa);
    // B11 = (Q22 - Q11) t² / 2 = -B22
    let coupling = 0.5 * t * t * difference * (ex * kx - ey * ky);
    let exact = (membrane + bending + 2.0 * coupling) * 0.8;
    for triangles in [true, false] {
        let mut mesh = plate(3, [1.0, 0.8], 1.0, triangles, 0.0, 0.5);
        // the axis by a vector: angles from the sides would differ between the elements
        for s in &mut mesh.quads {
            s.axis = MaterialAxis::Along([1.0, 0.0, 0.4]);
        }
        for s in &mut mesh.trias {
            s.axis = MaterialAxis::Along([1.0, 0.0, 0.4]);
        }
        let mesh = with_laminate(mesh, laminate(&[(2, t, 0.0), (2, t, 90.0)], None));
        let model = Model::new(&mesh, &[], &[]).unwrap();
        let k = stiffness(&model);
        let u = field(&model, 1e-3, 1.0);
        assert!(inner_force(&model, &(&k * &u)) < 1e-9);
        let energy = (u.transpose() * &k * &u)[0];
        assert!((energy / exact - 1.0).abs() < 1e-9, "{triangles}: {energy} {exact}");
    }
}

#[test]
fn a_laminate_of_one_material_equals_a_homogeneous_shell() {
    for triangles in [true, false] {
        let plain = plate(2, [1.0, 0.8], 0.03, triangles, 0.2, 0.3);
        let mut layered = with_laminate(plain.clone(), laminate(&[(1, 0.01, 20.0), (1, 0.02, -50.0)], None));
        let a = Model::new(&plain, &[], &[]).unwrap();
        let b = Model::new(&layered, &[], &[]).unwrap();
        let (x, y) = (a.assemble(&[]).unwrap(), b.assemble(&[]).unwrap());
        close(&x, &y, 1e-12);
        // Z0 at the bottom is an offset of half the thickness
        layered.laminates[0].z0 = Some(0.0);
        let mut offset = plain;
        offset.quads.iter_mut().for_each(|s| s.zoffset = 0.015);
        offset.trias.iter_mut().for_each(|s| s.zoffset = 0.015);
        let a = Model::new(&offset, &[], &[]).unwrap();
        let b = Model::new(&layered, &[], &[]).unwrap();
        close(&a.assemble(&[]).unwrap(), &b.assemble(&[]).unwrap(), 1e-12);
    }
}

fn close(x: &System, y: &System, tolerance: f64) {
    for (p, q) in [(&x.k, &y.k), (&x.m, &y.m), (&x.h, &y.h)] {
        let largest = p.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        assert_eq!(p.len(), q.len());
        for (v, w) in p.iter().zip(q) {
            assert!((v - w).abs() <= tolerance * largest, "{v} {w} of {largest}");
        }
    }
}

#[test]
fn mid4_couples_as_the_laminate_it_stands_for() {
    // [0 / 90]: MID1, MID2, MID4 of the equivalent PSHELL as MAT2 with G4 = -B / T²
    let (t, e1, e2, nu) = (0.004_f64, 140e9, 9e9, 0.3);
    let c = 1.0 - nu * nu * e2 / e1;
    let (q11, q22, q12) = (e1 / c, e2 / c, nu * e2 / c);
    let sum = 0.5 * (q11 + q22);
    let plane =
        |id, g: [[f64; 3]; 3]| PlaneMaterial { id, law: PlaneLaw::Anisotropic(g), rho: 1600.0, ge: 0.0 };
    let homogeneous = [[sum, q12, 0.0], [q12, sum, 0.0], [0.0, 0.0, 5e9]];
    let g4 = (q11 - q22) / 8.0;
    let coupling = [[g4, 0.0, 0.0], [0.0, -g4, 0.0], [0.0; 3]];
    for triangles in [true, false] {
        let base = plate(2, [1.0, 0.8], t, triangles, 0.1, 0.3);
        let mut equivalent = base.clone();
        equivalent.plane_materials = vec![plane(11, homogeneous), plane(14, coupling)];
        let p = &mut equivalent.shell_properties[0];
        (p.mid1, p.mid2, p.mid3, p.mid4) = (Some(11), Some(11), None, Some(14));
        let mut layered = with_laminate(base, laminate(&[(2, t / 2.0, 0.0), (2, t / 2.0, 90.0)], None));
        layered.plane_materials[0].ge = 0.0;
        let PlaneLaw::Orthotropic { gz, .. } = &mut layered.plane_materials[0].law else { panic!("MAT8") };
        *gz = [0.0; 2];
        let a = Model::new(&equivalent, &[], &[]).unwrap();
        let b = Model::new(&layered, &[], &[]).unwrap();
        close(&a.assemble(&[]).unwrap(), &b.assemble(&[]).unwrap(), 1e-11);
    }
}

#[test]
fn triangles_have_six_rigid_motions_offset_and_turned() {
    for coupled in [true, false] {
        let mut mesh = plate(2, [1.0, 0.8], 0.02, true, 0.3, 0.2);
        mesh =
            with_laminate(mesh, laminate(&[(2, 0.004, 10.0), (1, 0.01, 0.0), (2, 0.003, 45.0)], Some(0.002)));
        mesh.options.coupled_mass = coupled;
        let r = turn(0.9);
        for (i, n) in mesh.nodes.iter_mut().enumerate() {
            n.xyz[2] += 0.05 * ((i * 5 % 7) as f64 - 3.0);
            n.xyz = apply(&r, n.xyz);
        }
        mesh.trias[1].zoffset = 0.04;
        mesh.nodes[4].frame = Some(turn(0.5));
        let model = Model::new(&mesh, &[], &[]).unwrap();
        let s = model.assemble(&[]).unwrap();
        let (k, m) = (dense(&model, &s.k), dense(&model, &s.m));
        let rigid = rigid_motions(&model);
        assert!((&k * &rigid).amax() < 1e-10 * k.amax());
        let mass = rigid.column(1).dot(&(&m * rigid.column(1)));
        assert!((mass / model.total_mass() - 1.0).abs() < 1e-12);
        let n = model.n_a();
        let scale: Vec<f64> = (0..n).map(|i| 1.0 / k[(i, i)].sqrt()).collect();
        let scaled = DMatrix::from_fn(n, n, |i, j| k[(i, j)] * scale[i] * scale[j]);
        let mut e: Vec<f64> = nalgebra::SymmetricEigen::new(scaled).eigenvalues.iter().copied().collect();
        e.sort_by(f64::total_cmp);
        assert!(e[5].abs() < 1e-11 && e[6] > 1e-8, "{:?}", &e[..8]);
    }
}

/// Lowest frequency (rad/s) of the plate, simply supported (hard) on all edges.
fn lowest(mut mesh: Mesh) -> f64 {
    let top = |c: usize| mesh.nodes.iter().map(|n| n.xyz[c]).fold(0.0, f64::max);
    let (a, b) = (top(0), top(1));
    for node in &mesh.nodes {
        let (x, y) = (node.xyz[0], node.xyz[1]);
        let mut c = vec![1, 2, 6];
        if x == 0.0 || x == a {
            c.extend([3, 4]);
        }
        if y == 0.0 || y == b {
            c.extend([3, 5]);
        }
        mesh.spc.push(Spc { id: 1, node: node.id, components: Components::from_list(&c) });
    }
    let model = Model::new(&mesh, &[], &[]).unwrap();
    let s = model.assemble(&[]).unwrap();
    // by the flexibility, in which the lowest frequency is the largest eigenvalue
    let flexible = eigenvalues(&dense(&model, &s.m), &dense(&model, &s.k));
    (1.0 / flexible.last().unwrap()).sqrt()
}

/// What the mass of linear shapes adds to the frequency of mode (1, 1) on an n x n mesh: (pi h)² / 12.
fn linear_mass(n: usize) -> f64 {
    (std::f64::consts::PI / n as f64).powi(2) / 12.0
}

/// Frequency of mode (1, 1) of a unit square plate by Mindlin's theory with shear factor 5/6 and rotary inertia.
fn mindlin(t: f64) -> f64 {
    let (nu, rho) = (0.3, 7850.0);
    let (d, g) = (E * t.powi(3) / (12.0 * (1.0 - nu * nu)), E / (2.0 * (1.0 + nu)) * t * 5.0 / 6.0);
    let q = 2.0 * std::f64::consts::PI.powi(2);
    let (m, j) = (rho * t, rho * t.powi(3) / 12.0);
    let (a, b, c) = (m * j * q, -(g * q * j * q + m * (d * q * q + g * q)), g * q * d * q * q);
    ((-b - (b * b - 4.0 * a * c).sqrt()) / (2.0 * a)).sqrt()
}

#[test]
fn triangular_plates_thin_and_thick_converge_with_the_square_of_the_mesh_size() {
    for t in [0.2, 0.05, 1e-4] {
        let error: Vec<f64> = [4, 8, 16]
            .iter()
            .map(|&n| (lowest(plate(n, [1.0, 1.0], t, true, 0.0, 0.0)) / mindlin(t) - 1.0).abs())
            .collect();
        assert!(error[2] < 2.0 * linear_mass(16), "t {t}: {error:?}");
        for pair in error.windows(2) {
            let slope = (pair[0] / pair[1]).log2();
            assert!(slope > 1.7 && slope < 2.4, "t {t}: {error:?}");
        }
    }
}

#[test]
fn a_cross_ply_plate_has_the_frequency_of_lamination_theory() {
    // [0/90/90/0], a / h = 1000 and 10, simply supported. Thin: Jones 1999, eq. 5.92 (specially orthotropic plate).
    let (h, rho) = (1e-3_f64, 1600.0);
    let plies = |h: f64| {
        laminate(&[(2, h / 4.0, 0.0), (2, h / 4.0, 90.0), (2, h / 4.0, 90.0), (2, h / 4.0, 0.0)], None)
    };
    let c = 1.0 - 0.09 * 9.0 / 140.0;
    let (q11, q22, q12, q66) = (140e9 / c, 9e9 / c, 2.7e9 / c, 5e9);
    // outer plies hold 7/8 of h³ / 12
    let i = h.powi(3) / 12.0;
    let (d11, d22) = (i * (0.875 * q11 + 0.125 * q22), i * (0.875 * q22 + 0.125 * q11));
    let (d12, d66) = (i * q12, i * q66);
    let pi4 = std::f64::consts::PI.powi(4);
    let exact = (pi4 * (d11 + 2.0 * (d12 + 2.0 * d66) + d22) / (rho * h)).sqrt();
    for triangles in [true, false] {
        let square = |n| {
            let mut mesh = plate(n, [1.0, 1.0], 1.0, triangles, 0.0, 0.0);
            mesh.trias.iter_mut().for_each(|s| s.axis = MaterialAxis::Along([1.0, 0.0, 0.0]));
            with_laminate(mesh, plies(h))
        };
        let error: Vec<f64> = [6, 12].iter().map(|&n| (lowest(square(n)) / exact - 1.0).abs()).collect();
        assert!(error[1] < 2.0 * linear_mass(12) && error[0] / error[1] > 3.2, "{triangles}: {error:?}");
    }
}

#[test]
fn transverse_shear_of_a_sandwich_is_that_of_its_core() {
    // stiff thin faces, soft core: G d² / c with the distance d of the faces' middles (Allen 1969, §2.3)
    let mut mesh = plate(1, [1.0, 1.0], 1.0, false, 0.0, 0.0);
    mesh.materials.push(Material { id: 3, e: Some(1e6), g: Some(4e7), nu: None, rho: 50.0, ge: 0.0 });
    let (f, c) = (0.0005, 0.02);
    mesh.materials[1].nu = Some(0.3);
    let mesh = with_laminate(mesh, laminate(&[(1, f, 0.0), (3, c, 0.0), (1, f, 0.0)], None));
    let model = Model::new(&mesh, &[], &[]).unwrap();
    let k = stiffness(&model);
    // rotations zero, w = x: a constant shear strain
    let u = DMatrix::from_fn(model.n_a(), 1, |i, _| match model.a_rows[i] % 6 {
        2 => model.nodes.xyz(model.a_rows[i] / 6)[0],
        _ => 0.0,
    });
    let exact = 4e7 * (c + f).powi(2) / c;
    let value = (u.transpose() * k * u)[0];
    assert!((value / exact - 1.0).abs() < 2e-3, "{value} {exact}");
}

#[test]
fn turned_and_renumbered_models_have_the_same_frequencies() {
    let mut mesh = plate(3, [1.0, 0.7], 0.02, true, 0.2, 0.3);
    mesh.trias.iter_mut().step_by(3).for_each(|s| s.zoffset = 0.01);
    mesh = with_laminate(mesh, laminate(&[(2, 0.004, 10.0), (1, 0.01, 0.0), (2, 0.003, 45.0)], None));
    for id in [1, 5, 9] {
        mesh.spc.push(Spc { id: 1, node: id, components: Components::ALL });
    }
    let frequencies = |mesh: &Mesh| {
        let model = Model::new(mesh, &[], &[]).unwrap();
        let s = model.assemble(&[]).unwrap();
        let mut e = eigenvalues(&dense(&model, &s.m), &dense(&model, &s.k));
        e.reverse();
        e.truncate(12);
        e
    };
    let before = frequencies(&mesh);
    let mut other = mesh.clone();
    let r = turn(1.1);
    let new = |id: Id| (id * 7) % 17 + 100;
    for n in &mut other.nodes {
        let p = apply(&r, n.xyz);
        n.xyz = [p[0] + 3.0, p[1] - 2.0, p[2] + 0.5];
        n.id = new(n.id);
        n.frame = Some(turn(0.1 * f64::from(n.id)));
    }
    other.nodes.sort_by_key(|n| n.id);
    other.spc.iter_mut().for_each(|s| s.node = new(s.node));
    other.trias.iter_mut().for_each(|s| s.nodes = s.nodes.map(new));
    other.trias.reverse();
    for (a, b) in before.iter().zip(frequencies(&other)) {
        assert!((a / b - 1.0).abs() < 1e-8, "{a} {b}");
    }
}

#[test]
fn derivatives_of_laminates_and_triangles_equal_finite_differences() {
    let mut mesh = plate(2, [1.0, 0.8], 0.02, true, 0.2, 0.3);
    let quad = plate(1, [1.0, 0.8], 0.02, false, 0.1, 0.0);
    for n in &quad.nodes {
        mesh.nodes.push(node(n.id + 100, [n.xyz[0], n.xyz[1], 0.5]));
    }
    let mut q = quad.quads[0].clone();
    (q.id, q.property, q.nodes) = (101, 2, q.nodes.map(|n| n + 100));
    mesh.quads.push(q.clone());
    (q.id, q.property) = (102, 3);
    mesh.quads.push(q);
    let mut homogeneous = shell_property(0.03, Some(2));
    (homogeneous.id, homogeneous.mid2, homogeneous.nsm) = (2, Some(2), 2.0);
    mesh.laminates.push(Laminate {
        id: 3,
        ge: Some(0.02),
        ..laminate(&[(2, 0.003, 30.0), (1, 0.002, 0.0)], Some(0.0))
    });
    mesh.shell_properties.push(homogeneous);
    mesh.plane_materials = vec![carbon(2)];
    mesh.shell_properties[0].mid3 = Some(1);
    let p =
        |property: &str, kind: &str, id: Id| Parameter::parse(property, property, kind, vec![id]).unwrap();
    let parameters = [
        p("E", "material", 1),
        p("nu", "material", 1),
        p("E", "material", 2),
        p("G", "material", 2),
        p("nu", "material", 2),
        p("rho", "material", 2),
        p("eta", "material", 2),
        p("t", "property_id", 1),
        p("t", "property_id", 2),
        p("t", "property_id", 3),
        p("E", "elements", 1),
    ];
    check_derivatives(&mesh, &parameters);
}

fn check_derivatives(mesh: &Mesh, parameters: &[Parameter]) {
    let factors: Vec<f64> = (0..parameters.len()).map(|i| 0.95 + 0.01 * i as f64).collect();
    derivatives_equal_differences(&Model::new(mesh, parameters, &[]).unwrap(), parameters, &factors);
}

#[test]
fn broken_shells_and_laminates_are_refused_by_name() {
    let refuse = |mesh: &Mesh, words: &[&str]| {
        let error = Model::new(mesh, &[], &[]).expect_err("the model is refused").to_string();
        words.iter().for_each(|w| assert!(error.contains(w), "{error}"));
    };
    let with = |change: &dyn Fn(&mut Mesh)| {
        let mut mesh = plate(1, [1.0, 1.0], 0.01, true, 0.0, 0.0);
        mesh.plane_materials = vec![carbon(2)];
        change(&mut mesh);
        mesh
    };
    let layered = |change: &dyn Fn(&mut Mesh)| {
        with(&|m| {
            m.shell_properties.clear();
            m.laminates = vec![laminate(&[(2, 0.1, 0.0)], None)];
            change(m);
        })
    };
    refuse(&with(&|m| m.trias[0].nodes = [1, 2, 1]), &["CTRIA3 1", "lie on a line"]);
    refuse(&with(&|m| m.shell_properties[0].t = None), &["CTRIA3 1", "thickness 0"]);
    refuse(&with(&|m| m.shell_properties[0].mid2 = Some(8)), &["CTRIA3 1", "material 8"]);
    refuse(&with(&|m| m.trias[1].property = 3), &["CTRIA3 2", "shell property 3"]);
    refuse(
        &with(&|m| {
            m.shell_properties[0].mid2 = None;
            m.shell_properties[0].mid4 = Some(1);
        }),
        &["CTRIA3 1", "MID4"],
    );
    refuse(&with(&|m| m.trias[0].axis = MaterialAxis::Along([0.0, 0.0, 2.0])), &["CTRIA3 1", "upright"]);
    refuse(&layered(&|m| m.laminates[0].plies[0].t = 0.0), &["PCOMP 1", "ply 1", "thickness 0"]);
    refuse(&layered(&|m| m.laminates[0].plies.clear()), &["PCOMP 1", "no plies"]);
    refuse(&layered(&|m| m.laminates[0].plies[0].material = 9), &["CTRIA3 1", "material 9"]);
    let unstable = PlaneLaw::Orthotropic { e1: 1e9, e2: 9e9, nu12: 0.4, g12: 1e9, gz: [0.0; 2] };
    refuse(&layered(&|m| m.plane_materials[0].law = unstable.clone()), &["material 2", "positive definite"]);
}
