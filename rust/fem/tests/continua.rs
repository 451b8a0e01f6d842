//! Shells and solids (patch tests are in `patch.rs`): rigid motion, mass, bending without locking, derivatives, errors.

mod common;

use common::*;
use femend_fem::mesh::*;
use femend_fem::model::Model;
use femend_fem::parameter::Parameter;
use nalgebra::DMatrix;

const E: f64 = 2.1e11;

fn options(coupled_mass: bool) -> Options {
    Options { coupled_mass, ..Options::default() }
}

/// Corner nodes of a distorted element of each kind, mid-side nodes in the middle.
fn solid(kind: SolidKind, coupled: bool) -> Mesh {
    let hexa = [
        [0.0, 0.0, 0.0],
        [1.1, 0.1, -0.1],
        [1.2, 0.9, 0.1],
        [-0.1, 1.0, 0.0],
        [0.1, 0.0, 0.9],
        [0.9, 0.0, 1.2],
        [1.0, 1.1, 1.0],
        [0.0, 0.8, 1.1],
    ];
    let penta = [0, 1, 3, 4, 5, 7].map(|i: usize| hexa[i]);
    let tetra = [0, 1, 3, 4].map(|i: usize| hexa[i]);
    let pyramid = [0, 1, 2, 3, 6].map(|i: usize| hexa[i]);
    let (mut x, edges): (Vec<[f64; 3]>, &[[usize; 2]]) = match kind {
        SolidKind::Hexa8 => (hexa.to_vec(), &[]),
        SolidKind::Hexa20 => (
            hexa.to_vec(),
            &[[0, 1], [1, 2], [2, 3], [3, 0], [0, 4], [1, 5], [2, 6], [3, 7], [4, 5], [5, 6], [6, 7], [7, 4]],
        ),
        SolidKind::Penta6 => (penta.to_vec(), &[]),
        SolidKind::Penta15 => {
            (penta.to_vec(), &[[0, 1], [1, 2], [2, 0], [0, 3], [1, 4], [2, 5], [3, 4], [4, 5], [5, 3]])
        }
        SolidKind::Pyramid5 => (pyramid.to_vec(), &[]),
        SolidKind::Pyramid13 => {
            (pyramid.to_vec(), &[[0, 1], [1, 2], [2, 3], [3, 0], [0, 4], [1, 4], [2, 4], [3, 4]])
        }
        SolidKind::Tetra4 => (tetra.to_vec(), &[]),
        SolidKind::Tetra10 => (tetra.to_vec(), &[[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]]),
    };
    for [a, b] in edges {
        x.push(std::array::from_fn(|i| 0.5 * (x[*a][i] + x[*b][i])));
    }
    Mesh {
        nodes: x.iter().enumerate().map(|(i, p)| node(i as Id + 1, *p)).collect(),
        materials: vec![steel()],
        solid_properties: vec![SolidProperty { id: 1, material: 1, frame: None }],
        solids: vec![Solid { id: 7, property: 1, kind, nodes: (1..=x.len() as Id).collect() }],
        options: options(coupled),
        ..Mesh::default()
    }
}

const KINDS: [SolidKind; 8] = [
    SolidKind::Tetra4,
    SolidKind::Tetra10,
    SolidKind::Penta6,
    SolidKind::Penta15,
    SolidKind::Hexa8,
    SolidKind::Hexa20,
    SolidKind::Pyramid5,
    SolidKind::Pyramid13,
];

/// Displacement of a linear field at the nodes in the order of the a-set (translations only).
fn linear_field(model: &Model, gradient: &[[f64; 3]; 3]) -> DMatrix<f64> {
    DMatrix::from_fn(model.n_a(), 1, |i, _| {
        let (n, c) = (model.a_rows[i] / 6, model.a_rows[i] % 6);
        let x = model.nodes.xyz(n);
        (0..3).map(|j| gradient[c][j] * x[j]).sum()
    })
}

const GRADIENT: [[f64; 3]; 3] = [[1.0, 0.3, -0.2], [0.5, -0.7, 0.4], [0.1, 0.6, 0.8]];

/// Strain energy density times two of the linear field.
fn energy_density() -> f64 {
    let (lambda, mu) = (E * 0.3 / (1.3 * 0.4), E / 2.6);
    let trace: f64 = (0..3).map(|i| GRADIENT[i][i]).sum();
    let mut sum = lambda * trace * trace;
    for i in 0..3 {
        for j in 0..3 {
            let e = 0.5 * (GRADIENT[i][j] + GRADIENT[j][i]);
            sum += 2.0 * mu * e * e;
        }
    }
    sum
}

#[test]
fn every_solid_has_six_rigid_motions_its_mass_and_the_energy_of_a_constant_strain() {
    for kind in KINDS {
        for coupled in [true, false] {
            let model = Model::new(&solid(kind, coupled), &[], &[]).unwrap();
            assert_eq!(model.n_a(), 3 * kind.n_nodes());
            let s = model.assemble(&[]).unwrap();
            let (k, m) = (dense(&model, &s.k), dense(&model, &s.m));
            let e = nalgebra::SymmetricEigen::new(k.clone());
            let mut values: Vec<f64> = e.eigenvalues.iter().copied().collect();
            values.sort_by(f64::total_cmp);
            assert!(
                values[5].abs() < 1e-10 * values.last().unwrap() && values[6] > 1e-4 * values.last().unwrap(),
                "{kind:?} {values:?}"
            );
            let u = linear_field(&model, &GRADIENT);
            let one = DMatrix::from_fn(model.n_a(), 1, |i, _| f64::from(u8::from(model.a_rows[i] % 6 == 1)));
            let volume = (one.transpose() * &m * &one)[0] / 7850.0;
            let energy = (u.transpose() * &k * &u)[0];
            assert!((energy / (volume * energy_density()) - 1.0).abs() < 1e-11, "{kind:?}");
            assert!((model.total_mass() / (7850.0 * volume) - 1.0).abs() < 1e-12);
            assert!(
                nalgebra::SymmetricEigen::new(m).eigenvalues.min() > 0.0,
                "{kind:?} mass is positive definite"
            );
        }
    }
}

fn isotropic_stiffness() -> [[f64; 6]; 6] {
    let (lambda, mu) = (E * 0.3 / (1.3 * 0.4), E / 2.6);
    let mut c = [[0.0; 6]; 6];
    for i in 0..3 {
        c[i][..3].fill(lambda);
        c[i][i] += 2.0 * mu;
        c[3 + i][3 + i] = mu;
    }
    c
}

#[test]
fn anisotropic_solids_equal_isotropic_ones_and_turn_with_their_axes() {
    for kind in KINDS {
        let mesh = solid(kind, true);
        let k = |mesh: &Mesh| {
            let model = Model::new(mesh, &[], &[]).unwrap();
            dense(&model, &model.assemble(&[]).unwrap().k)
        };
        let mut other = mesh.clone();
        other.materials.clear();
        let stiffness = isotropic_stiffness();
        other.solid_materials = vec![SolidMaterial { id: 1, stiffness, rho: 7850.0, ge: 0.02 }];
        let plain = k(&mesh);
        assert!((k(&other) - &plain).amax() < 1e-12 * plain.amax(), "{kind:?}");
        // fibres along material axis 1: a model turned as a whole has turned forces
        other.solid_materials[0].stiffness[0][0] *= 5.0;
        other.solid_materials[0].stiffness[3][0] = 1e10;
        other.solid_materials[0].stiffness[0][3] = 1e10;
        let straight = k(&other);
        let r = turn(0.8);
        let mut turned = other.clone();
        turned.nodes.iter_mut().for_each(|n| n.xyz = apply(&r, n.xyz));
        // local axis i of the turned material is the turned basic axis i
        turned.solid_properties[0].frame = Some(std::array::from_fn(|i| std::array::from_fn(|j| r[j][i])));
        let n = kind.n_nodes();
        let t = DMatrix::from_fn(3 * n, 3 * n, |i, j| if i / 3 == j / 3 { r[i % 3][j % 3] } else { 0.0 });
        let back = t.transpose() * k(&turned) * &t;
        assert!((back - &straight).amax() < 1e-11 * straight.amax(), "{kind:?}");
        // energy of a constant strain: eps C eps times the volume
        let model = Model::new(&other, &[], &[]).unwrap();
        let u = linear_field(&model, &GRADIENT);
        let g = GRADIENT;
        let e = [g[0][0], g[1][1], g[2][2], g[0][1] + g[1][0], g[1][2] + g[2][1], g[2][0] + g[0][2]];
        let c = other.solid_materials[0].stiffness;
        let density: f64 = (0..36).map(|p| e[p / 6] * c[p / 6][p % 6] * e[p % 6]).sum();
        let exact = density * model.total_mass() / 7850.0;
        assert!(((u.transpose() * &straight * &u)[0] / exact - 1.0).abs() < 1e-10, "{kind:?}");
        let mut broken = other.clone();
        broken.solid_materials[0].stiffness[3][3] = -1.0;
        let error = Model::new(&broken, &[], &[]).expect_err("refused").to_string();
        assert!(error.contains("material 1") && error.contains("positive definite"), "{error}");
    }
}

#[test]
fn moments_of_inertia_of_quadratic_solids_are_exact() {
    // x = linear field: u = x e_y has kinetic energy int rho x² dV, which quadratic shapes hold exactly
    let exact_tetra = |p: &[[f64; 3]]| {
        let v = |i: usize| std::array::from_fn::<f64, 3, _>(|c| p[i][c] - p[0][c]);
        let volume = nalgebra::Matrix3::from_fn(|i, j| v(i + 1)[j]).determinant().abs() / 6.0;
        let mut sum = 0.0;
        for i in 0..4 {
            for j in 0..4 {
                sum += p[i][0] * p[j][0] * volume / if i == j { 10.0 } else { 20.0 };
            }
        }
        sum
    };
    for kind in [SolidKind::Tetra4, SolidKind::Tetra10] {
        let mesh = solid(kind, true);
        let model = Model::new(&mesh, &[], &[]).unwrap();
        let m = dense(&model, &model.assemble(&[]).unwrap().m);
        let u = linear_field(&model, &[[0.0; 3], [1.0, 0.0, 0.0], [0.0; 3]]);
        let corners: Vec<[f64; 3]> = mesh.nodes[..4].iter().map(|n| n.xyz).collect();
        let value = (u.transpose() * m * u)[0];
        assert!((value / (7850.0 * exact_tetra(&corners)) - 1.0).abs() < 1e-12);
    }
}

/// 2 x 2 x 2 (or n) bricks with every node that is not on the surface's corners moved.
fn bricks(n: [usize; 3], size: [f64; 3], shake: f64) -> Mesh {
    let mut mesh = Mesh {
        materials: vec![steel()],
        solid_properties: vec![SolidProperty { id: 1, material: 1, frame: None }],
        options: options(true),
        ..Mesh::default()
    };
    let id = |i: usize, j: usize, k: usize| (1 + i + (n[0] + 1) * (j + (n[1] + 1) * k)) as Id;
    for k in 0..=n[2] {
        for j in 0..=n[1] {
            for i in 0..=n[0] {
                let noise =
                    |c: usize| shake * ((((i * 7 + j * 13 + k * 29 + c * 5) * 31) % 17) as f64 / 8.0 - 1.0);
                let at = [i, j, k];
                let x =
                    std::array::from_fn(|c| size[c] * (at[c] as f64 / n[c] as f64 + noise(c) / n[c] as f64));
                mesh.nodes.push(node(id(i, j, k), x));
            }
        }
    }
    for k in 0..n[2] {
        for j in 0..n[1] {
            for i in 0..n[0] {
                let face = |k| [id(i, j, k), id(i + 1, j, k), id(i + 1, j + 1, k), id(i, j + 1, k)];
                let nodes = [face(k), face(k + 1)].concat();
                let element = mesh.solids.len() as Id + 1;
                mesh.solids.push(Solid { id: element, property: 1, kind: SolidKind::Hexa8, nodes });
            }
        }
    }
    mesh
}

fn solve(k: DMatrix<f64>, f: &DMatrix<f64>) -> DMatrix<f64> {
    k.cholesky().expect("stiffness is positive definite").solve(f)
}

#[test]
fn one_layer_of_bricks_bends_like_a_beam_at_any_poisson_ratio() {
    // a brick without internal modes gives 0.67 at nu = 0.3 and below 0.01 at nu = 0.4999; with one element over the
    // height a varying moment still costs some percent near incompressibility
    for (nu, tolerance) in [(0.0, 1e-3), (0.3, 0.01), (0.4999, 0.06)] {
        let (l, b, h) = (10.0, 1.0, 1.0);
        let mut mesh = bricks([10, 1, 1], [l, b, h], 0.0);
        mesh.materials[0].nu = Some(nu);
        for n in mesh.nodes.iter().filter(|n| n.xyz[0] == 0.0) {
            // free lateral contraction at the clamp: the beam's own boundary condition
            let mut c = vec![1];
            c.extend((n.xyz[1] == 0.0 && n.xyz[2] == 0.0).then_some([2, 3]).into_iter().flatten());
            c.extend((n.xyz[1] > 0.0 && n.xyz[2] == 0.0).then_some(3));
            mesh.spc.push(Spc { id: 1, node: n.id, components: Components::from_list(&c) });
        }
        let model = Model::new(&mesh, &[], &[]).unwrap();
        let tip: Vec<usize> = (0..model.n_a())
            .filter(|&i| model.a_rows[i] % 6 == 2 && model.nodes.xyz(model.a_rows[i] / 6)[0] == l)
            .collect();
        assert_eq!(tip.len(), 4);
        let mut f = DMatrix::zeros(model.n_a(), 1);
        tip.iter().for_each(|&i| f[i] = 0.25);
        let u = solve(dense(&model, &model.assemble(&[]).unwrap().k), &f);
        let deflection = tip.iter().map(|&i| u[i]).sum::<f64>() / 4.0;
        let inertia = b * h.powi(3) / 12.0;
        let shear = 2.0 * (1.0 + nu) * l / (E * b * h * 5.0 / 6.0);
        let exact = l.powi(3) / (3.0 * E * inertia) + shear;
        // ten elements along hold the cubic to 1/(4 n²) = 0.25 %
        assert!((deflection / exact - 1.0).abs() < tolerance + 0.0026, "nu {nu}: {}", deflection / exact);
    }
}

/// n x n shells over an a x b rectangle (sheared by `skew`, inner nodes moved by `shake`), turned in space.
fn plate(n: usize, a: f64, b: f64, t: f64, skew: f64, shake: f64) -> Mesh {
    let mut mesh = Mesh {
        materials: vec![steel()],
        shell_properties: vec![shell_property(t, Some(1))],
        options: options(true),
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
            let nodes = [id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)];
            mesh.quads.push(Shell {
                id: mesh.quads.len() as Id + 1,
                property: 1,
                nodes,
                axis: MaterialAxis::Angle(0.0),
                zoffset: 0.0,
                thickness: [None; 4],
            });
        }
    }
    mesh
}

#[test]
fn a_warped_offset_shell_has_six_rigid_motions_and_its_mass() {
    for coupled in [true, false] {
        let mut mesh = plate(2, 1.0, 0.8, 0.02, 0.3, 0.2);
        mesh.options.coupled_mass = coupled;
        let r = turn(0.9);
        for (i, n) in mesh.nodes.iter_mut().enumerate() {
            n.xyz[2] += 0.05 * ((i * 5 % 7) as f64 - 3.0);
            n.xyz = apply(&r, n.xyz);
        }
        mesh.quads[1].zoffset = 0.04;
        mesh.nodes[4].frame = Some(turn(0.5));
        let model = Model::new(&mesh, &[], &[]).unwrap();
        let s = model.assemble(&[]).unwrap();
        let (k, m) = (dense(&model, &s.k), dense(&model, &s.m));
        let rigid = rigid_motions(&model);
        assert_eq!(model.n_a(), 54);
        assert!((&k * &rigid).amax() < 1e-11 * k.amax());
        let mass = rigid.column(0).dot(&(&m * rigid.column(0)));
        assert!((mass / model.total_mass() - 1.0).abs() < 1e-12);
        let scale: Vec<f64> = (0..54).map(|i| 1.0 / k[(i, i)].sqrt()).collect();
        let mut e: Vec<f64> =
            nalgebra::SymmetricEigen::new(DMatrix::from_fn(54, 54, |i, j| k[(i, j)] * scale[i] * scale[j]))
                .eigenvalues
                .iter()
                .copied()
                .collect();
        e.sort_by(f64::total_cmp);
        assert!(e[5].abs() < 1e-11 && e[6] > 1e-7, "{:?}", &e[..8]);
    }
}

/// Lowest bending frequencies of a simply supported square plate over Kirchhoff's, hard support.
fn plate_ratio(n: usize, t: f64, skew: f64) -> f64 {
    let mut mesh = plate(n, 1.0, 1.0, t, 0.0, skew);
    for node in &mesh.nodes {
        let (x, y) = (node.xyz[0], node.xyz[1]);
        let mut c = vec![1, 2, 6];
        if x == 0.0 || x == 1.0 {
            c.extend([3, 4]);
        }
        if y == 0.0 || y == 1.0 {
            c.extend([3, 5]);
        }
        mesh.spc.push(Spc { id: 1, node: node.id, components: Components::from_list(&c) });
    }
    let model = Model::new(&mesh, &[], &[]).unwrap();
    let s = model.assemble(&[]).unwrap();
    // by the flexibility: of a thin plate the shear waves are 1e16 times the lowest eigenvalue, which would drown in them
    let flexible = eigenvalues(&dense(&model, &s.m), &dense(&model, &s.k));
    let lowest = 1.0 / flexible.last().unwrap();
    let d = E * t.powi(3) / (12.0 * (1.0 - 0.09));
    let kirchhoff = 2.0 * std::f64::consts::PI.powi(2) * (d / (7850.0 * t)).sqrt();
    lowest.sqrt() / kirchhoff
}

/// Frequency of mode (1, 1) by Mindlin's theory with shear factor 5/6 and rotary inertia, over Kirchhoff's.
fn mindlin_ratio(t: f64) -> f64 {
    let (nu, rho) = (0.3, 7850.0);
    let (d, g) = (E * t.powi(3) / (12.0 * (1.0 - nu * nu)), E / (2.0 * (1.0 + nu)) * t * 5.0 / 6.0);
    let q = 2.0 * std::f64::consts::PI.powi(2); // wave number squared
    let (m, j) = (rho * t, rho * t.powi(3) / 12.0);
    // w and the rotation's potential p: [g q - m w², -g q; -g q, d q² + g q - j q w²]
    let (a, b, c) = (m * j * q, -(g * q * j * q + m * (d * q * q + g * q)), g * q * d * q * q);
    let omega2 = (-b - (b * b - 4.0 * a * c).sqrt()) / (2.0 * a);
    (omega2 * m / (d * q * q)).sqrt()
}

#[test]
fn plates_thin_and_thick_converge_to_mindlin_with_the_square_of_the_mesh_size() {
    for t in [0.2, 0.05, 1e-4] {
        let exact = mindlin_ratio(t);
        let error: Vec<f64> =
            [4, 8, 16].iter().map(|&n| (plate_ratio(n, t, 0.0) / exact - 1.0).abs()).collect();
        assert!(error[2] < 0.005, "t {t}: {error:?}");
        for pair in error.windows(2) {
            let slope = (pair[0] / pair[1]).log2();
            assert!(slope > 1.8 && slope < 2.3, "t {t}: {error:?}");
        }
        // an irregular mesh costs less than halving the number of elements would (four times)
        let irregular = plate_ratio(8, t, 0.4) / exact - 1.0;
        assert!(irregular.abs() < 2.5 * error[1], "t {t}: {irregular}");
    }
}

#[test]
fn derivatives_of_shells_and_solids_equal_finite_differences() {
    let mut mesh = bricks([1, 1, 2], [1.0, 1.0, 1.0], 0.1);
    let shells = plate(1, 1.0, 1.0, 0.03, 0.2, 0.0);
    for n in &shells.nodes {
        mesh.nodes.push(node(n.id + 100, [n.xyz[0], n.xyz[1], 0.1 * f64::from(n.id % 2)]));
    }
    let mut quad = shells.quads[0].clone();
    quad.id = 101;
    quad.zoffset = 0.01;
    quad.nodes = quad.nodes.map(|n| n + 100);
    mesh.shell_properties.push(ShellProperty {
        id: 2,
        mid2: Some(2),
        nsm: 3.0,
        ..shell_property(0.03, Some(1))
    });
    mesh.materials.push(Material {
        id: 2,
        e: Some(7e10),
        g: Some(2.5e10),
        nu: Some(0.33),
        rho: 2700.0,
        ge: 0.1,
    });
    quad.property = 2;
    mesh.quads.push(quad);
    let p =
        |property: &str, kind: &str, id: Id| Parameter::parse(property, property, kind, vec![id]).unwrap();
    let parameters = [
        p("E", "material", 1),
        p("nu", "material", 1),
        p("rho", "material", 1),
        p("eta", "material", 2),
        p("E", "material", 2),
        p("t", "property_id", 2),
        p("nu", "elements", 101),
        p("E", "elements", 1),
    ];
    let model = Model::new(&mesh, &parameters, &[]).unwrap();
    let factors: Vec<f64> = (0..parameters.len()).map(|i| 0.95 + 0.02 * i as f64).collect();
    derivatives_equal_differences(&model, &parameters, &factors);
    // G of a solid follows from E and nu: a factor on it would change nothing
    let error = Model::new(&bricks([1, 1, 1], [1.0; 3], 0.0), &[p("G", "material", 1)], &[])
        .expect_err("refused")
        .to_string();
    assert!(error.contains("changes nothing"), "{error}");
}

#[test]
fn broken_shells_and_solids_are_refused_by_name() {
    let refuse = |mesh: &Mesh, words: &[&str]| {
        let error = Model::new(mesh, &[], &[]).expect_err("the model is refused").to_string();
        words.iter().for_each(|w| assert!(error.contains(w), "{error}"));
    };
    let with = |mut mesh: Mesh, change: &dyn Fn(&mut Mesh)| {
        change(&mut mesh);
        mesh
    };
    let quad = || plate(1, 1.0, 1.0, 0.01, 0.0, 0.0);
    refuse(&with(quad(), &|m| m.quads[0].nodes = [1, 2, 3, 4]), &["CQUAD4 1", "cross over"]);
    refuse(&with(quad(), &|m| m.nodes[3].xyz = [0.3, 0.3, 0.0]), &["CQUAD4 1", "Jacobian", "node 4"]);
    refuse(&with(quad(), &|m| m.shell_properties[0].t = Some(0.0)), &["CQUAD4 1", "thickness 0"]);
    refuse(&with(quad(), &|m| m.shell_properties[0].mid2 = Some(8)), &["CQUAD4 1", "material 8"]);
    refuse(&with(quad(), &|m| m.quads[0].property = 3), &["CQUAD4 1", "shell property 3"]);
    for kind in KINDS {
        let mesh = solid(kind, true);
        // mirror the element: the node order turns the inside out
        refuse(
            &with(mesh.clone(), &|m| m.nodes.iter_mut().for_each(|n| n.xyz[2] = -n.xyz[2])),
            &["7", "Jacobian"],
        );
        refuse(&with(mesh.clone(), &|m| m.materials[0].nu = Some(0.5)), &["7", "nu = 0.5"]);
        refuse(&with(mesh, &|m| m.solids[0].nodes.truncate(3)), &["7", "nodes"]);
    }
}
