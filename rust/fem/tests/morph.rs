//! A model with its nodes elsewhere against one built there.

mod common;

use common::*;
use femend_fem::error::FemError;
use femend_fem::mesh::*;
use femend_fem::model::{Model, System};
use femend_fem::parameter::Parameter;

/// A beam along x with a rigid arm along x at its end, so that terms of T vanish until the arm leaves the axis.
fn with_arm() -> Mesh {
    let mut mesh = straight(3, 1.5, [0.8; 2], true);
    mesh.nodes.push(node(9, [2.0, 0.0, 0.0]));
    mesh.nodes[4].frame = Some(turn(0.4));
    let inertia = [[0.02, 0.0, 0.0], [0.0, 0.03, 0.0], [0.0, 0.0, 0.04]];
    let kind = MassKind::Conm2 { m: 2.0, offset: [0.0; 3], inertia };
    mesh.masses.push(Mass { id: 5, node: 9, kind });
    let end = mesh.nodes[3].id;
    mesh.rbe2.push(Rbe2 { id: 6, independent: end, components: Components::ALL, dependent: vec![9] });
    mesh
}

fn moved(mesh: &Mesh, by: f64) -> Mesh {
    let mut out = mesh.clone();
    for (i, x) in [(2, [0.1, 0.2, -0.3]), (4, [-0.2, 0.5, 0.4])] {
        (0..3).for_each(|c| out.nodes[i].xyz[c] += by * x[c]);
    }
    out
}

fn close(model: &Model, base: &System, change: &System, other: &Model, there: &System) {
    for (a, d, b) in
        [(&base.k, &change.k, &there.k), (&base.m, &change.m, &there.m), (&base.h, &change.h, &there.h)]
    {
        let sum: Vec<f64> = a.iter().zip(d).map(|(a, d)| a + d).collect();
        let (left, right) = (dense(model, &sum), dense(other, b));
        assert!(
            (&left - &right).amax() <= 1e-13 * right.amax(),
            "{}",
            (&left - &right).amax() / right.amax()
        );
    }
}

#[test]
fn a_moved_model_is_the_model_built_there() {
    let mesh = with_arm();
    let parameters = [Parameter::parse("E", "E", "material", vec![1]).unwrap()];
    let model = Model::with_probe(&mesh, Some(&moved(&mesh, 0.01)), &parameters, &[]).unwrap();
    let there = moved(&mesh, 0.3);
    let other = Model::new(&there, &parameters, &[]).unwrap();
    let place = model.moved(&there).unwrap();
    let factors = [1.3];
    let (base, change) = (model.assemble(&factors).unwrap(), model.change(&place, &factors).unwrap());
    close(&model, &base, &change, &other, &other.assemble(&factors).unwrap());
    let (base, change) =
        (model.derivative(0, &factors).unwrap(), model.derivative_change(&place, 0, &factors).unwrap());
    close(&model, &base, &change, &other, &other.derivative(0, &factors).unwrap());
    // the first beam has no node that moves
    assert_eq!(model.reached().iter().map(|&e| model.elements[e].id).collect::<Vec<_>>(), [2, 3, 5]);
    assert!(!model.moved_rows(&there).unwrap().is_empty());
    let zero = model.between(&place, &model.moved(&there).unwrap(), &factors).unwrap();
    assert!(zero.k.iter().chain(&zero.m).all(|v| *v == 0.0));
}

#[test]
fn what_cannot_be_is_said() {
    let mesh = with_arm();
    let plain = Model::new(&mesh, &[], &[]).unwrap();
    assert!(matches!(plain.moved(&moved(&mesh, 0.1)), Err(FemError::NotMade(_))));
    let model = Model::with_probe(&mesh, Some(&moved(&mesh, 0.01)), &[], &[]).unwrap();
    let mut past = mesh.clone();
    past.nodes[2].xyz[0] = 0.2;
    let error = model.moved(&past).unwrap_err();
    assert!(matches!(error, FemError::InsideOut { id: 2, .. }), "{error}");
}
