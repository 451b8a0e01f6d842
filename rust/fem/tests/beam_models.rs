//! Models of beams, rods, springs, bushes and masses: rigid motion, mass, constraints, derivatives, errors.

mod common;

use common::*;
use femend_fem::error::FemError;
use femend_fem::mesh::*;
use femend_fem::model::Model;
use femend_fem::parameter::Parameter;

/// One of every element of this file, skew in space, with offsets, releases, taper, I12 and displacement frames.
fn zoo() -> Mesh {
    let r = turn(0.7);
    let at = |id, x: [f64; 3]| node(id, apply(&r, x));
    let mut mesh = straight(0, 1.0, [0.8, 0.7], true);
    mesh.nodes = vec![
        at(1, [0.0, 0.0, 0.0]),
        at(2, [1.0, 0.2, 0.1]),
        at(3, [1.5, 1.0, 0.3]),
        at(4, [0.2, 0.9, 1.1]),
        at(5, [2.0, 2.0, 2.0]),
    ];
    mesh.nodes[1].frame = Some(turn(1.1));
    mesh.nodes[3].frame = Some(turn(-0.4));
    let mut tip = section(4e-9);
    tip.a *= 0.6;
    tip.i1 *= 0.3;
    mesh.beam_properties.push(BeamProperty {
        id: 2,
        material: 1,
        a: section(8e-9),
        b: Some(tip),
        k1: 0.8,
        k2: 0.6,
    });
    let mut first = beam(1, [1, 2], [0.0, 0.3, 1.0]);
    first.offsets = [[0.05, 0.02, -0.1], [-0.02, 0.04, 0.1]];
    let mut second = beam(2, [2, 3], [0.0, 0.0, 1.0]);
    second.property = 2;
    second.orientation = Orientation::Node(5);
    second.pins[1] = Components::from_list(&[4, 5]);
    mesh.beams = vec![first, second, beam(3, [3, 4], [1.0, 0.0, 0.2])];
    mesh.rod_properties
        .push(RodProperty { id: 3, section: RodSection { material: 1, a: 2e-4, j: 1e-9, nsm: 0.1 } });
    mesh.rods.push(Rod { id: 4, source: RodSource::Property(3), nodes: [1, 4] });
    mesh.bush_properties.push(BushProperty {
        id: 4,
        k: [2e5, 3e5, 4e5, 200.0, 300.0, 400.0],
        c: [5.0; 6],
        ge: [0.1; 6],
    });
    mesh.bushes.push(Bush {
        id: 5,
        property: 4,
        nodes: [Some(2), Some(4)],
        frame: BushFrame::Fixed(turn(0.3)),
        location: 0.3,
        offset: None,
    });
    let inertia = [[0.2, 0.01, 0.0], [0.01, 0.3, 0.02], [0.0, 0.02, 0.25]];
    mesh.masses.push(Mass {
        id: 6,
        node: 4,
        kind: MassKind::Conm2 { m: 3.0, offset: [0.1, 0.2, -0.1], inertia },
    });
    mesh
}

fn free_model_is_free(mesh: &Mesh) {
    let model = Model::new(mesh, &[], &[]).unwrap();
    let s = model.assemble(&[]).unwrap();
    let (k, m) = (dense(&model, &s.k), dense(&model, &s.m));
    let all = rigid_motions(&model);
    let rigid = nalgebra::DMatrix::from_fn(model.n_a(), 6, |i, j| all[(model.a_rows[i], j)]);
    let force = (&k * &rigid).amax();
    assert!(force < 1e-10 * k.amax(), "rigid motion costs {force:e} of {:e}", k.amax());
    let r = nalgebra::SymmetricEigen::new(rigid.transpose() * &m * &rigid);
    assert!(r.eigenvalues.min() > 0.0);
    let mass = rigid.column(1).dot(&(&m * rigid.column(1)));
    assert!((mass - model.total_mass()).abs() < 1e-10 * mass, "{mass} {}", model.total_mass());
    // exactly six motions without stiffness
    let diagonal: Vec<f64> = (0..k.nrows()).map(|i| 1.0 / k[(i, i)].max(1e-300).sqrt()).collect();
    let scaled =
        nalgebra::DMatrix::from_fn(k.nrows(), k.nrows(), |i, j| k[(i, j)] * diagonal[i] * diagonal[j]);
    let mut e: Vec<f64> = nalgebra::SymmetricEigen::new(scaled).eigenvalues.iter().copied().collect();
    e.sort_by(f64::total_cmp);
    assert!(e[5].abs() < 1e-10 && e[6] > 1e-7, "{:?}", &e[..8]);
}

#[test]
fn a_free_structure_has_six_motions_without_stiffness_and_its_mass() {
    let mut mesh = zoo();
    mesh.nodes.pop(); // the orientation node of beam 2 is no part of the structure
    mesh.beams[1].orientation = Orientation::Vector([0.2, 1.0, 0.4]);
    free_model_is_free(&mesh);
    mesh.options.coupled_mass = false;
    free_model_is_free(&mesh);
}

#[test]
fn the_mass_is_that_of_the_parts() {
    let mut mesh = straight(3, 1.2, [0.0, 0.0], true);
    mesh.options.wtmass = 0.5;
    let model = Model::new(&mesh, &[], &[(2, 0.3)]).unwrap();
    let expected = 0.5 * (1.2 * (7850.0 * 6e-4 + 0.4) + 0.3);
    assert!((model.total_mass() - expected).abs() < 1e-12 * expected);
}

#[test]
fn nodes_without_elements_are_held_and_listed() {
    let mesh = zoo();
    let model = Model::new(&mesh, &[], &[]).unwrap();
    let listed: Vec<_> = model.auto_constrained.iter().map(|d| (d.node, d.component)).collect();
    assert_eq!(listed, (1..=6).map(|c| (5, c)).collect::<Vec<_>>());
}

#[test]
fn a_skew_truss_keeps_its_directions_and_loses_only_the_unloaded_rotations() {
    let mut mesh = straight(1, 1.0, [0.0; 2], false);
    mesh.beams.clear();
    mesh.nodes = vec![node(1, [0.0; 3]), node(2, [1.0, 2.0, 2.0])];
    let s = RodSection { material: 1, a: 1e-4, j: 1e-9, nsm: 0.0 };
    mesh.rods = vec![Rod { id: 1, source: RodSource::Inline(s), nodes: [1, 2] }];
    mesh.spc = vec![Spc { id: 1, node: 1, components: Components::ALL }];
    let model = Model::new(&mesh, &[], &[]).unwrap();
    // three translations and the one rotation about the axis, carried by one component
    assert_eq!(model.n_a(), 4);
    let s = model.assemble(&[]).unwrap();
    let k = dense(&model, &s.k);
    let g = 2.1e11 / 2.6;
    assert_eq!(model.a_rows[..3], [6, 7, 8]);
    let share = [1.0, 2.0, 2.0][model.a_rows[3] - 9] / 3.0;
    assert!((k[(3, 3)] - g * 1e-9 / 3.0 * share * share).abs() < 1e-9 * k[(3, 3)]);
}

#[test]
fn derivatives_equal_finite_differences_for_every_quantity() {
    let mut mesh = zoo();
    mesh.spring_properties.push(SpringProperty { id: 5, k: 3e4, ge: 0.05 });
    let end = |node, component| Some(NodeComponent { node, component });
    mesh.springs.push(Spring { id: 7, source: SpringSource::Property(5), ends: [end(2, 2), end(4, 3)] });
    mesh.damper_properties.push(DamperProperty { id: 6, c: 12.0 });
    mesh.dampers.push(Damper { id: 8, source: DamperSource::Property(6), ends: [end(3, 1), None] });
    mesh.spc = vec![Spc { id: 1, node: 1, components: Components::ALL }];
    let on = |name: &str, kind: &str, id: Id| Parameter::parse(name, name, kind, vec![id]).unwrap();
    let list = [
        ("E", "material", 1),
        ("nu", "material", 1),
        ("rho", "material", 1),
        ("eta", "material", 1),
        ("G", "elements", 2),
        ("A", "property_id", 1),
        ("A", "property_id", 2),
        ("I1", "property_id", 1),
        ("I2", "property_id", 2),
        ("J", "property_id", 1),
        ("A", "property_id", 3),
        ("J", "elements", 4),
        ("k1", "property_id", 4),
        ("k5", "property_id", 4),
        ("c3", "property_id", 4),
        ("eta", "property_id", 4),
        ("k", "elements", 7),
        ("eta", "property_id", 5),
        ("c", "property_id", 6),
        ("m", "mass", 6),
    ];
    let parameters: Vec<_> = list.iter().map(|(n, k, id)| on(n, k, *id)).collect();
    let model = Model::new(&mesh, &parameters, &[]).unwrap();
    assert!(!model.is_affine());
    let factors: Vec<f64> = (0..list.len()).map(|i| 0.9 + 0.013 * i as f64).collect();
    derivatives_equal_differences(&model, &parameters, &factors);
}

#[test]
fn affine_models_say_so_and_refill_exactly() {
    let mesh = straight(4, 1.0, [0.0, 0.0], true);
    let p = |name: &str, kind: &str, ids: Vec<Id>| Parameter::parse(name, name, kind, ids).unwrap();
    let affine =
        Model::new(&mesh, &[p("E", "elements", vec![1, 2]), p("rho", "material", vec![1])], &[]).unwrap();
    assert!(affine.is_affine());
    // E of the material and E of two of its elements multiply each other
    let product =
        Model::new(&mesh, &[p("E", "elements", vec![1, 2]), p("E", "material", vec![1])], &[]).unwrap();
    assert!(!product.is_affine());
    let mut softer = mesh.clone();
    softer.materials[0].e = Some(0.7 * 2.1e11);
    let direct = Model::new(&softer, &[], &[]).unwrap().assemble(&[]).unwrap();
    let refilled = product.assemble(&[1.0, 0.7]).unwrap();
    for (a, b) in direct.k.iter().zip(&refilled.k) {
        assert!((a - b).abs() <= 1e-13 * direct.k.iter().fold(0.0_f64, |m, v| m.max(v.abs())));
    }
}

#[test]
fn projection_equals_dense_products() {
    let p = |name: &str, kind: &str, ids: Vec<Id>| Parameter::parse(name, name, kind, ids).unwrap();
    let model =
        Model::new(&zoo(), &[p("E", "material", vec![1]), p("I1", "property_id", vec![2])], &[]).unwrap();
    let r = 7;
    let v: Vec<f64> = (0..model.n_a() * r).map(|i| ((i * 7919 % 101) as f64) / 50.0 - 1.0).collect();
    let dv = nalgebra::DMatrix::from_row_slice(model.n_a(), r, &v);
    let (reduced, derivatives) = model.project(&[1.1, 0.8], &v, r).unwrap();
    let compare = |values: &[f64], reduced: &[f64]| {
        let full = dv.transpose() * dense(&model, values) * &dv;
        let error = (full.clone() - nalgebra::DMatrix::from_row_slice(r, r, reduced)).amax();
        assert!(error <= 1e-12 * full.amax());
    };
    let s = model.assemble(&[1.1, 0.8]).unwrap();
    compare(&s.k, &reduced.k);
    compare(&s.m, &reduced.m);
    compare(&s.h, &reduced.h);
    let d = model.derivative(1, &[1.1, 0.8]).unwrap();
    compare(&d.k, &derivatives[1].k);
    compare(&d.m, &derivatives[1].m);
}

fn fails(mesh: &Mesh, words: &[&str]) -> FemError {
    let error = Model::new(mesh, &[], &[]).expect_err("the model is refused");
    for word in words {
        assert!(error.to_string().contains(word), "{error}");
    }
    error
}

#[test]
fn broken_models_are_refused_by_name() {
    let good = straight(2, 1.0, [0.0; 2], true);
    let with = |change: &dyn Fn(&mut Mesh)| {
        let mut mesh = good.clone();
        change(&mut mesh);
        mesh
    };
    fails(&with(&|m| m.nodes[1].xyz = m.nodes[0].xyz), &["CBAR 1", "zero length"]);
    fails(&with(&|m| m.beams[1].orientation = Orientation::Vector([2.0, 0.0, 0.0])), &["CBAR 2", "parallel"]);
    fails(&with(&|m| m.beams[1].property = 77), &["CBAR 2", "beam property 77"]);
    fails(&with(&|m| m.beam_properties[0].material = 9), &["CBAR 1", "material 9"]);
    fails(&with(&|m| m.beams[0].nodes[1] = 44), &["CBAR 1", "node 44"]);
    fails(&with(&|m| m.beams[1].id = 1), &["element 1", "2 times"]);
    fails(&with(&|m| m.beams[0].pins = [Components::from_list(&[4]); 2]), &["CBAR 1", "pin flags"]);
    fails(&with(&|m| m.materials[0].nu = Some(0.9)), &["material 1", "nu"]);
    fails(
        &with(&|m| m.spc = (1..4).map(|n| Spc { id: 1, node: n, components: Components::ALL }).collect()),
        &["no free DOF"],
    );
    let p = |property: &str, kind: &str, id| Parameter::parse("p", property, kind, vec![id]).unwrap();
    for (parameter, words) in [
        (p("E", "material", 5), "no element uses material 5"),
        (p("t", "property_id", 1), "changes nothing"),
        (p("m", "mass", 1), "no element uses mass element 1"),
    ] {
        let error = Model::new(&good, &[parameter], &[]).expect_err("the parameter is refused").to_string();
        assert!(error.contains(words), "{error}");
    }
}
