//! Stress stiffness of preloaded parts and gyroscopic matrices of spinning ones.

mod common;

use common::*;
use femend_fem::element::spin::SpinAxes;
use femend_fem::mesh::*;
use femend_fem::model::Model;
use femend_fem::rotor::Spin;
use nalgebra::{DMatrix, DVector};
use std::f64::consts::PI;

const E: f64 = 2.1e11;

/// One element of each kind that has stresses, on its own nodes, turned in space; nodes with frames.
fn elements() -> Vec<(&'static str, Mesh)> {
    let r = turn(0.8);
    let base = |nodes: &[[f64; 3]]| Mesh {
        materials: vec![steel()],
        options: Options { coupled_mass: true, ..Options::default() },
        nodes: nodes
            .iter()
            .enumerate()
            .map(|(i, x)| Node { id: i as Id + 1, xyz: apply(&r, *x), frame: (i == 1).then(|| turn(0.3)) })
            .collect(),
        ..Mesh::default()
    };
    let square = [[0.0, 0.0, 0.0], [1.1, 0.1, 0.0], [1.0, 0.9, 0.0], [-0.1, 1.0, 0.0]];
    let mut out = Vec::new();
    let mut mesh = base(&square);
    mesh.shell_properties = vec![shell_property(0.01, Some(1))];
    mesh.quads = vec![shell(1, [1, 2, 3, 4])];
    out.push(("CQUAD4", mesh));
    let mut mesh = base(&square[..3]);
    mesh.shell_properties = vec![shell_property(0.01, Some(1))];
    mesh.trias = vec![shell(1, [1, 2, 3])];
    out.push(("CTRIA3", mesh));
    let cube: Vec<[f64; 3]> = square.iter().copied().chain(square.map(|p| [p[0] + 0.1, p[1], 1.0])).collect();
    for (name, kind, n) in [("CHEXA", SolidKind::Hexa8, 8), ("CPYRAM", SolidKind::Pyramid5, 5)] {
        let mut mesh = base(&cube[..n]);
        mesh.solid_properties = vec![SolidProperty { id: 1, material: 1, frame: None }];
        mesh.solids = vec![Solid { id: 1, property: 1, kind, nodes: (1..=n as Id).collect() }];
        out.push((name, mesh));
    }
    let mut mesh = base(&square[..2]);
    let section = RodSection { material: 1, a: 1e-3, j: 1e-6, nsm: 0.0 };
    mesh.rods = vec![Rod { id: 1, source: RodSource::Inline(section), nodes: [1, 2] }];
    out.push(("CONROD", mesh));
    let mut mesh = straight(1, 1.0, [0.8; 2], true);
    mesh.nodes.iter_mut().for_each(|n| n.xyz = apply(&r, n.xyz));
    out.push(("CBAR", mesh));
    out
}

#[test]
fn a_preloaded_element_turned_as_a_whole_turns_its_forces() {
    // (K + K_sigma) theta x r = theta x f: K_sigma times a rigid rotation is theta x (K u)
    for (name, mesh) in elements() {
        let model = Model::new(&mesh, &[], &[]).unwrap();
        let k = dense(&model, &model.assemble(&[]).unwrap().k);
        let rigid = rigid_motions(&model);
        let all = DMatrix::from_fn(model.n_a(), 6, |i, j| rigid[(model.a_rows[i], j)]);
        // a preload without moments: membrane or axial motion alone
        let stretch = DMatrix::from_fn(model.n_a(), 1, |i, _| {
            let (n, c) = (model.a_rows[i] / 6, model.a_rows[i] % 6);
            let x = model.nodes.xyz(n);
            let r = turn(0.8);
            let local = [0, 1, 2].map(|i| (0..3).map(|j| r[j][i] * x[j]).sum::<f64>());
            let own = [1e-3 * local[0] + 2e-4 * local[1], -4e-4 * local[1], 0.0];
            // shells turn with the membrane, so that the drilling stiffness is at rest
            let spin = apply(&r, [0.0, 0.0, if name == "CQUAD4" || name == "CTRIA3" { -1e-4 } else { 0.0 }]);
            let own = if name == "CBAR" || name == "CONROD" { [1e-3 * local[0], 0.0, 0.0] } else { own };
            let basic = apply(&r, own);
            let frame = model.nodes.frame(n).copied();
            let moved = [basic, spin].map(|v| frame.map_or(v, |f| apply(&f, v)));
            moved[c / 3][c % 3]
        });
        let f = &k * &stretch;
        let sigma = dense(&model, &model.stress_stiffness(&[], stretch.as_slice()).unwrap());
        assert!((&sigma - sigma.transpose()).amax() < 1e-12 * sigma.amax(), "{name}");
        assert!((&sigma * all.columns(0, 3)).amax() < 1e-9 * f.amax(), "{name}: translations are free");
        for axis in 0..3 {
            let theta = [0, 1, 2].map(|c| f64::from(u8::from(c == axis)));
            let turned = &sigma * all.column(3 + axis);
            for i in (0..model.n_a()).filter(|&i| model.a_rows[i].is_multiple_of(6)) {
                let n = model.a_rows[i] / 6;
                let frame = model.nodes.frame(n).copied().unwrap_or([
                    [1.0, 0.0, 0.0],
                    [0.0, 1.0, 0.0],
                    [0.0, 0.0, 1.0],
                ]);
                let back = |v: [f64; 3]| [0, 1, 2].map(|c| (0..3).map(|j| frame[j][c] * v[j]).sum::<f64>());
                let force = back([f[i], f[i + 1], f[i + 2]]);
                let value = back([turned[i], turned[i + 1], turned[i + 2]]);
                let exact = femend_fem::small::cross3(theta, force);
                for c in 0..3 {
                    assert!((value[c] - exact[c]).abs() < 1e-7 * f.amax(), "{name}: {value:?} {exact:?}");
                }
            }
        }
    }
}

/// Lowest eigenvalues of a stiffness that may be indefinite, by the mass.
fn omega2(k: &DMatrix<f64>, m: &DMatrix<f64>) -> Vec<f64> {
    eigenvalues(k, m)
}

#[test]
fn a_tensioned_beam_has_the_frequency_of_the_closed_form_and_buckles_at_eulers_load() {
    // hinged: omega² = q² (EI q² + P) / mu (Blevins 1979, Table 8-1 with axial load)
    let (n, l) = (10, 1.0);
    let mut mesh = straight(n, l, [0.0; 2], true);
    for id in 1..=n as Id + 1 {
        let end = id == 1 || id == n as Id + 1;
        let mut c = vec![3, 4, 5];
        if id == 1 {
            c.push(1);
        }
        if end {
            c.push(2);
        }
        mesh.spc.push(Spc { id: 1, node: id, components: Components::from_list(&c) });
    }
    let model = Model::new(&mesh, &[], &[]).unwrap();
    let s = model.assemble(&[]).unwrap();
    let (k, m) = (dense(&model, &s.k), dense(&model, &s.m));
    let sec = section(0.0);
    let q = PI / l;
    let euler = E * sec.i1 * q * q;
    let mu = 7850.0 * sec.a + sec.nsm + 7850.0 * sec.i1 * q * q;
    for p in [0.5 * euler, -0.5 * euler, -0.999 * euler] {
        let mut f = DVector::zeros(model.n_a());
        let tip = (0..model.n_a()).rev().find(|&i| model.a_rows[i].is_multiple_of(6)).unwrap();
        f[tip] = p;
        let u = k.clone().cholesky().unwrap().solve(&f);
        let sigma = dense(&model, &model.stress_stiffness(&[], u.as_slice()).unwrap());
        let low = omega2(&(&k + sigma), &m)[0];
        let exact = q * q * (euler + p) / mu;
        assert!((low - exact).abs() < 1e-4 * q * q * euler / mu, "{p}: {low} {exact}");
    }
}

#[test]
fn a_stretched_plate_and_bar_have_the_frequencies_of_their_closed_forms() {
    // plate hinged on all sides, tension N along x: omega² = (D (2 q²)² + N q²) / (rho t); thin
    let (n, t) = (10_usize, 1e-3);
    for triangles in [false, true] {
        let mut mesh = Mesh {
            materials: vec![Material { nu: Some(0.0), ..steel() }],
            shell_properties: vec![shell_property(t, Some(1))],
            options: Options { coupled_mass: true, ..Options::default() },
            ..Mesh::default()
        };
        let id = |i: usize, j: usize| (1 + i + (n + 1) * j) as Id;
        for j in 0..=n {
            for i in 0..=n {
                mesh.nodes.push(node(id(i, j), [i as f64 / n as f64, j as f64 / n as f64, 0.0]));
                let mut c = vec![6];
                c.extend((i == 0).then_some(1));
                c.extend((j == 0).then_some(2));
                if i == 0 || i == n {
                    c.extend([3, 4]);
                }
                if j == 0 || j == n {
                    c.extend([3, 5]);
                }
                mesh.spc.push(Spc { id: 1, node: id(i, j), components: Components::from_list(&c) });
            }
        }
        for j in 0..n {
            for i in 0..n {
                let q = [id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)];
                let next = (mesh.quads.len() + mesh.trias.len()) as Id + 1;
                if triangles {
                    mesh.trias.push(shell(next, [q[0], q[1], q[2]]));
                    mesh.trias.push(shell(next + 1, [q[0], q[2], q[3]]));
                } else {
                    mesh.quads.push(shell(next, q));
                }
            }
        }
        let model = Model::new(&mesh, &[], &[]).unwrap();
        let s = model.assemble(&[]).unwrap();
        let (k, m) = (dense(&model, &s.k), dense(&model, &s.m));
        let q = PI;
        let bending = E * t.powi(3) / 12.0 * (2.0 * q * q).powi(2);
        let strain = 5.0 * bending / (q * q) / (E * t);
        let u: Vec<f64> = (0..model.n_a())
            .map(|i| {
                if model.a_rows[i].is_multiple_of(6) {
                    strain * model.nodes.xyz(model.a_rows[i] / 6)[0]
                } else {
                    0.0
                }
            })
            .collect();
        let sigma = dense(&model, &model.stress_stiffness(&[], &u).unwrap());
        let flexible = |k: &DMatrix<f64>| 1.0 / eigenvalues(&m, k).last().unwrap();
        let (free, loaded) = (flexible(&k), flexible(&(&k + sigma)));
        // bending is one sixth of the whole; both parts of the mesh error are of the size of (pi h)² / 12 = 0.8 %
        assert!((loaded / free / 6.0 - 1.0).abs() < 0.02, "{triangles}: {}", loaded / free);
    }
}

fn spin(axis: [f64; 3], axes: SpinAxes) -> Spin {
    Spin { axis, axes, elements: None }
}

#[test]
fn in_rotating_axes_a_moving_part_feels_coriolis_and_centrifugal_force() {
    let axis = [0.3, -0.5, 0.8];
    let length = femend_fem::small::norm3(axis);
    let a = axis.map(|x| x / length);
    let mut parts = elements();
    let mut mesh = straight(1, 1.0, [0.8; 2], true);
    let inertia = [[2.0, 0.1, 0.0], [0.1, 1.0, 0.0], [0.0, 0.0, 1.5]];
    mesh.masses.push(Mass {
        id: 9,
        node: 2,
        kind: MassKind::Conm2 { m: 3.0, offset: [0.1, 0.2, 0.0], inertia },
    });
    parts.push(("CONM2", mesh));
    for (name, mesh) in parts {
        let model = Model::new(&mesh, &[], &[]).unwrap();
        let out = model.gyroscopic(&[], &spin(axis, SpinAxes::Rotating)).unwrap();
        let (g, s) = (dense(&model, &out.g), dense(&model, &out.softening));
        assert!((&g + g.transpose()).amax() < 1e-12 * g.amax(), "{name}");
        let rigid = rigid_motions(&model);
        let move3 = DMatrix::from_fn(model.n_a(), 3, |i, j| rigid[(model.a_rows[i], j)]);
        let m = model.total_mass();
        let force = move3.transpose() * &g * &move3;
        let pull = move3.transpose() * &s * &move3;
        for j in 0..3 {
            let e = [0, 1, 2].map(|c| f64::from(u8::from(c == j)));
            let coriolis = femend_fem::small::cross3(a, e);
            let centrifugal = femend_fem::small::cross3(a, coriolis);
            for i in 0..3 {
                assert!((force[(i, j)] - 2.0 * m * coriolis[i]).abs() < 1e-9 * m, "{name}");
                assert!((pull[(i, j)] - m * centrifugal[i]).abs() < 1e-9 * m, "{name}");
            }
        }
    }
}

/// Imaginary parts (positive) of the eigenvalues of `M u'' + G u' + K u = 0`, ascending.
fn whirl(k: &DMatrix<f64>, g: &DMatrix<f64>, m: &DMatrix<f64>) -> Vec<f64> {
    let n = k.nrows();
    let inverse = m.clone().cholesky().expect("mass is positive definite").inverse();
    let mut a = DMatrix::zeros(2 * n, 2 * n);
    // displacements in a unit that balances the two halves
    let own = -&inverse * k;
    let unit = own.norm().sqrt();
    a.view_mut((0, n), (n, n)).fill_diagonal(unit);
    a.view_mut((n, 0), (n, n)).copy_from(&(own / unit));
    a.view_mut((n, n), (n, n)).copy_from(&(-&inverse * g));
    let mut out: Vec<f64> = a.complex_eigenvalues().iter().map(|z| z.im).filter(|x| *x > 0.0).collect();
    out.sort_by(f64::total_cmp);
    out
}

/// A hinged round shaft along x with a disc in the middle or none; axial and torsional motion held.
fn shaft(disc: Option<[f64; 3]>) -> Model {
    let (n, l) = (8, 1.0);
    let mut mesh = straight(n, l, [0.0; 2], true);
    let (d, a) = (0.1_f64, PI * 0.01 / 4.0);
    let i = PI * d.powi(4) / 64.0;
    let s = &mut mesh.beam_properties[0].a;
    (s.a, s.i1, s.i2, s.j, s.nsm) = (a, i, i, 2.0 * i, 0.0);
    for id in 1..=n as Id + 1 {
        let c: &[u8] = if id == 1 || id == n as Id + 1 { &[1, 2, 3, 4] } else { &[1, 4] };
        mesh.spc.push(Spc { id: 1, node: id, components: Components::from_list(c) });
    }
    if let Some([m, jp, jt]) = disc {
        let inertia = [[jp, 0.0, 0.0], [0.0, jt, 0.0], [0.0, 0.0, jt]];
        mesh.masses.push(Mass { id: 99, node: 3, kind: MassKind::Conm2 { m, offset: [0.0; 3], inertia } });
    }
    Model::new(&mesh, &[], &[]).unwrap()
}

#[test]
fn a_spinning_shaft_whirls_as_in_the_closed_form() {
    // Rayleigh shaft: w² (mu + rho I q²) -+ 2 w W rho I q² - EI q⁴ = 0 (Lee, Vibration Analysis of Rotors 1993, §4.2)
    let model = shaft(None);
    let s = model.assemble(&[]).unwrap();
    let (k, m) = (dense(&model, &s.k), dense(&model, &s.m));
    let speed = 8000.0;
    let g = dense(&model, &model.gyroscopic(&[], &spin([2.0, 0.0, 0.0], SpinAxes::Fixed)).unwrap().g) * speed;
    let found = whirl(&k, &g, &m);
    let (area, i) = (PI * 0.0025, PI * 1e-4 / 64.0);
    let mut exact = Vec::new();
    for mode in 1..=2 {
        let q = f64::from(mode) * PI;
        let (mu, gyro) = (7850.0 * (area + i * q * q), 2.0 * 7850.0 * i * q * q * speed);
        let root = (gyro * gyro + 4.0 * mu * E * i * q.powi(4)).sqrt();
        exact.extend([(root - gyro) / (2.0 * mu), (root + gyro) / (2.0 * mu)]);
    }
    for (w, e) in found.iter().zip(&exact) {
        assert!((w / e - 1.0).abs() < 1e-3, "{found:?} {exact:?}");
    }
    assert!(exact[1] / exact[0] > 1.05, "the speed splits the pair: {exact:?}");
}

#[test]
fn rotating_axes_see_the_frequencies_of_fixed_ones_less_or_more_the_speed() {
    // a disc away from the middle tilts; flat (jp = 2 jt) and long (jp < jt)
    for disc in [[20.0, 0.5, 0.25], [20.0, 0.1, 0.3]] {
        let model = shaft(Some(disc));
        let s = model.assemble(&[]).unwrap();
        let (k, m) = (dense(&model, &s.k), dense(&model, &s.m));
        let speed = 300.0;
        let fixed = model.gyroscopic(&[], &spin([1.0, 0.0, 0.0], SpinAxes::Fixed)).unwrap();
        let turning = model.gyroscopic(&[], &spin([1.0, 0.0, 0.0], SpinAxes::Rotating)).unwrap();
        let still = whirl(&k, &(dense(&model, &fixed.g) * speed), &m);
        let soft = &k + dense(&model, &turning.softening) * (speed * speed);
        let seen = whirl(&soft, &(dense(&model, &turning.g) * speed), &m);
        for (pair, w) in still.iter().take(6).enumerate() {
            // backward first in each pair
            let expected = if pair % 2 == 0 { w + speed } else { (w - speed).abs() };
            let near = seen.iter().map(|x| (x - expected).abs()).fold(f64::INFINITY, f64::min);
            assert!(near < 1e-6 * expected.max(speed), "{disc:?} {pair}: {expected} not in {:?}", &seen[..8]);
        }
    }
}

#[test]
fn what_cannot_spin_in_fixed_axes_is_refused_by_name() {
    let quad = &elements()[0].1;
    let model = Model::new(quad, &[], &[]).unwrap();
    let error = |model: &Model, spin: &Spin| model.gyroscopic(&[], spin).expect_err("refused").to_string();
    assert!(error(&model, &spin([0.0, 0.0, 1.0], SpinAxes::Fixed)).contains("CQUAD4 1"));
    let shaft = shaft(None);
    assert!(error(&shaft, &spin([0.0, 0.0, 1.0], SpinAxes::Fixed)).contains("CBAR 1"));
    assert!(error(&shaft, &spin([0.0; 3], SpinAxes::Fixed)).contains("spin axis"));
    let unknown = Spin { elements: Some(vec![1, 77]), ..spin([1.0, 0.0, 0.0], SpinAxes::Fixed) };
    assert!(error(&shaft, &unknown).contains("element 77"));
    let one = Spin { elements: Some(vec![1]), ..spin([1.0, 0.0, 0.0], SpinAxes::Fixed) };
    let (part, all) = (
        shaft.gyroscopic(&[], &one).unwrap().g,
        shaft.gyroscopic(&[], &spin([1.0, 0.0, 0.0], SpinAxes::Fixed)).unwrap().g,
    );
    let size = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>();
    assert!(size(&part) > 0.0 && size(&part) < 0.3 * size(&all));
    let error = shaft.stress_stiffness(&[], &[0.0]).expect_err("refused").to_string();
    assert!(error.contains("the array"), "{error}");
}
