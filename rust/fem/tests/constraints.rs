//! Constraints against dense elimination by hand.

mod common;

use common::*;
use femend_fem::error::FemError;
use femend_fem::mesh::*;
use femend_fem::model::Model;
use nalgebra::DMatrix;

/// Two beams not connected to each other.
fn two_parts() -> Mesh {
    let mut mesh = straight(2, 1.0, [0.8; 2], true);
    for (id, x) in [(11, [1.0, 0.3, 0.2]), (12, [1.5, 0.4, 0.2]), (13, [2.0, 0.7, 0.1])] {
        mesh.nodes.push(node(id, x));
    }
    mesh.beams.push(beam(11, [11, 12], [0.0, 0.0, 1.0]));
    mesh.beams.push(beam(12, [12, 13], [0.0, 0.0, 1.0]));
    mesh.nodes[3].frame = Some(turn(0.5));
    mesh.nodes[2].frame = Some(turn(-0.8));
    mesh
}

fn t_dense(model: &Model) -> DMatrix<f64> {
    let mut t = DMatrix::zeros(model.nodes.n_g(), model.n_a());
    for (i, row) in model.t_rows.iter().enumerate() {
        for &(a, v) in row {
            t[(i, a as usize)] = v;
        }
    }
    t
}

/// K_a = Tᵀ K_g T with K_g from the unconstrained model, and the equations `residual * u_g = 0` hold for u_g = T u_a.
fn matches_elimination(mesh: &Mesh, equations: &DMatrix<f64>) {
    let model = Model::new(mesh, &[], &[]).unwrap();
    let mut unconstrained = mesh.clone();
    unconstrained.rbe2.clear();
    unconstrained.rbe3.clear();
    unconstrained.rbar.clear();
    unconstrained.mpc.clear();
    unconstrained.spc.clear();
    let free = Model::new(&unconstrained, &[], &[]).unwrap();
    assert_eq!(free.n_a(), free.nodes.n_g());
    let t = t_dense(&model);
    assert_eq!(model.n_a() + equations.nrows(), free.n_a());
    assert!((equations * &t).amax() < 1e-12);
    let (a, g) = (model.assemble(&[]).unwrap(), free.assemble(&[]).unwrap());
    for (va, vg) in [(&a.k, &g.k), (&a.m, &g.m), (&a.h, &g.h)] {
        let by_hand = t.transpose() * dense(&free, vg) * &t;
        assert!((dense(&model, va) - &by_hand).amax() < 1e-12 * by_hand.amax());
    }
}

#[test]
fn rbar_keeps_its_ends_on_one_rigid_body() {
    let mut mesh = two_parts();
    let set = Components::from_list;
    // three components at one end, three at the other: together they hold the body
    let (a, b) = (set(&[1, 2, 3, 4]), set(&[1, 5]));
    let rest = |c: Components| Components(Components::ALL.0 & !c.0);
    mesh.nodes[3].frame = None;
    mesh.nodes[2].frame = None;
    mesh.rbar.push(Rbar { id: 5, nodes: [3, 11], independent: [a, b], dependent: [rest(a), rest(b)] });
    let model = Model::new(&mesh, &[], &[]).unwrap();
    // u_b - H u_a = 0, all six
    let arm = [0, 1, 2].map(|c| model.nodes.xyz(3)[c] - model.nodes.xyz(2)[c]);
    let h = femend_fem::small::rigid(arm);
    let mut equations = DMatrix::zeros(6, model.nodes.n_g());
    for i in 0..6 {
        equations[(i, 18 + i)] = 1.0;
        for j in 0..6 {
            equations[(i, 12 + j)] = -h[(i, j)];
        }
    }
    matches_elimination(&mesh, &equations);
    // in other frames it is the same body: rigid motion of all stays free of force
    mesh.nodes[2].frame = Some(turn(-0.8));
    mesh.rbar[0].independent = [Components::ALL, Components::default()];
    mesh.rbar[0].dependent = [Components::default(), Components::ALL];
    let model = Model::new(&mesh, &[], &[]).unwrap();
    let (t, g) = (t_dense(&model), rigid_motions(&model));
    let a = DMatrix::from_fn(model.n_a(), 6, |i, j| g[(model.a_rows[i], j)]);
    assert!((&t * a - &g).amax() < 1e-12);
    // components that leave the body free, and too few of them
    let refuse = |independent: [Components; 2], word: &str| {
        let mut mesh = mesh.clone();
        mesh.rbar[0].independent = independent;
        mesh.rbar[0].dependent = independent.map(rest);
        let error = Model::new(&mesh, &[], &[]).expect_err("refused").to_string();
        assert!(error.contains("RBAR 5") && error.contains(word), "{error}");
    };
    refuse([set(&[1, 2, 3]), set(&[1, 2, 3])], "do not determine");
    refuse([set(&[1, 2, 3]), set(&[1, 2])], "six independent");
}

fn rotation6(model: &Model, n: usize) -> DMatrix<f64> {
    let r = model.nodes.frame(n).copied().unwrap_or([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    DMatrix::from_fn(6, 6, |i, j| if i / 3 == j / 3 { r[i % 3][j % 3] } else { 0.0 })
}

#[test]
fn rbe2_moves_its_nodes_as_a_rigid_body() {
    let mut mesh = two_parts();
    mesh.rbe2.push(Rbe2 { id: 1, independent: 3, components: Components::ALL, dependent: vec![11] });
    let free = Model::new(&two_parts(), &[], &[]).unwrap();
    let arm: [f64; 3] = std::array::from_fn(|i| free.nodes.xyz(3)[i] - free.nodes.xyz(2)[i]);
    let h = femend_fem::small::rigid(arm);
    let h = DMatrix::from_fn(6, 6, |i, j| h[(i, j)]);
    let motion = rotation6(&free, 3) * h * rotation6(&free, 2).transpose();
    let mut equations = DMatrix::zeros(6, 36);
    for i in 0..6 {
        equations[(i, 18 + i)] = 1.0;
        for j in 0..6 {
            equations[(i, 12 + j)] = -motion[(i, j)];
        }
    }
    matches_elimination(&mesh, &equations);
}

#[test]
fn mpc_and_spc_in_displacement_frames() {
    let mut mesh = two_parts();
    let dof = |node, component| NodeComponent { node, component };
    mesh.mpc.push(Mpc { id: 1, terms: vec![(dof(11, 2), 2.0), (dof(3, 1), -1.0), (dof(2, 5), 0.4)] });
    // a chain: 12:3 depends on 11:2, which depends on others
    mesh.mpc.push(Mpc { id: 1, terms: vec![(dof(12, 3), 1.0), (dof(11, 2), -3.0)] });
    mesh.spc.push(Spc { id: 1, node: 3, components: Components::from_list(&[1, 4]) });
    let mut equations = DMatrix::zeros(4, 36);
    for (i, (j, v)) in [
        (0, (19, 2.0)),
        (0, (12, -1.0)),
        (0, (10, 0.4)),
        (1, (26, 1.0)),
        (1, (19, -3.0)),
        (2, (12, 1.0)),
        (3, (15, 1.0)),
    ] {
        equations[(i, j)] = v;
    }
    matches_elimination(&mesh, &equations);
}

#[test]
fn rbe3_reproduces_rigid_motion_and_least_squares() {
    let mut mesh = two_parts();
    mesh.nodes.push(node(20, [0.9, -0.2, 0.4]));
    mesh.nodes[6].frame = Some(turn(0.2));
    mesh.masses.push(Mass {
        id: 50,
        node: 20,
        kind: MassKind::Conm2 {
            m: 2.0,
            offset: [0.0; 3],
            inertia: [[0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]],
        },
    });
    let group = |weight, c: &[u8], nodes| Rbe3Group { weight, components: Components::from_list(c), nodes };
    let groups = vec![group(1.0, &[1, 2, 3], vec![1, 3]), group(2.5, &[1, 2, 3, 4, 5, 6], vec![12, 13])];
    mesh.rbe3.push(Rbe3 { id: 9, reference: 20, components: Components::ALL, groups, um: vec![] });
    let model = Model::new(&mesh, &[], &[]).unwrap();
    let t = t_dense(&model);
    // any rigid motion of all nodes satisfies T
    let all = rigid_motions(&model);
    let a = DMatrix::from_fn(model.n_a(), 6, |i, j| all[(model.a_rows[i], j)]);
    assert!((&t * a - &all).amax() < 1e-12);
    // normal equations: the weighted residual of the fit is orthogonal to rigid motions about the reference
    let u = DMatrix::from_fn(model.n_a(), 1, |i, _| ((i * 37 % 11) as f64) - 5.0);
    let g = &t * &u;
    let origin = model.nodes.xyz(6);
    let q = rotation6(&model, 6).transpose() * g.rows(36, 6);
    let ids: [(usize, f64, usize); 4] = [(0, 1.0, 3), (2, 1.0, 3), (4, 2.5, 6), (5, 2.5, 6)];
    let arm = |n: usize| -> [f64; 3] { std::array::from_fn(|i| model.nodes.xyz(n)[i] - origin[i]) };
    let mean = ids.iter().map(|i| femend_fem::small::norm3(arm(i.0))).sum::<f64>() / 4.0;
    let mut normal = DMatrix::zeros(6, 1);
    for (n, w, width) in ids {
        let h = femend_fem::small::rigid(arm(n));
        let s = rotation6(&model, n) * DMatrix::from_fn(6, 6, |i, j| h[(i, j)]);
        let residual = g.rows(6 * n, 6) - &s * &q;
        for c in 0..width {
            let w = if c < 3 { w } else { w * mean * mean };
            normal += s.row(c).transpose() * (w * residual[c]);
        }
    }
    assert!(normal.amax() < 1e-11 * u.amax(), "{normal}");
}

#[test]
fn um_moves_the_dependence_and_keeps_the_equations() {
    let mut mesh = two_parts();
    mesh.nodes.push(node(20, [0.9, -0.2, 0.4]));
    let inertia = [[0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]];
    mesh.masses.push(Mass { id: 50, node: 20, kind: MassKind::Conm2 { m: 2.0, offset: [0.0; 3], inertia } });
    let groups = vec![Rbe3Group {
        weight: 1.0,
        components: Components::from_list(&[1, 2, 3]),
        nodes: vec![1, 3, 12, 13],
    }];
    let reference = Components::from_list(&[1, 2, 3]);
    mesh.rbe3.push(Rbe3 { id: 9, reference: 20, components: reference, groups, um: vec![] });
    let plain = t_dense(&Model::new(&mesh, &[], &[]).unwrap());
    mesh.rbe3[0].um = [1, 2, 3].map(|component| NodeComponent { node: 12, component }).to_vec();
    let model = Model::new(&mesh, &[], &[]).unwrap();
    assert!(!model.a_rows.contains(&24) && model.a_rows.contains(&36));
    let moved = t_dense(&model);
    // both T span the same motions
    let both = DMatrix::from_fn(plain.nrows(), plain.ncols() * 2, |i, j| {
        if j < plain.ncols() { plain[(i, j)] } else { moved[(i, j - plain.ncols())] }
    });
    assert_eq!(both.rank(1e-9), plain.ncols());
}

#[test]
fn impossible_constraints_are_refused_by_name() {
    let dof = |node, component| NodeComponent { node, component };
    let rbe2 = |id, independent, dependent| Rbe2 { id, independent, components: Components::ALL, dependent };
    let refuse = |change: &dyn Fn(&mut Mesh)| {
        let mut mesh = two_parts();
        change(&mut mesh);
        Model::new(&mesh, &[], &[]).expect_err("the model is refused")
    };
    let error = refuse(&|m| m.rbe2 = vec![rbe2(1, 3, vec![11]), rbe2(2, 12, vec![11])]);
    assert!(matches!(error, FemError::DoublyDependent { .. }), "{error}");
    assert!(
        error.to_string().contains("RBE2 1")
            && error.to_string().contains("RBE2 2")
            && error.to_string().contains("11:1")
    );
    let error = refuse(&|m| m.rbe2 = vec![rbe2(1, 3, vec![11]), rbe2(2, 11, vec![12]), rbe2(3, 12, vec![3])]);
    assert!(matches!(error, FemError::Circular { .. }), "{error}");
    let error = refuse(&|m| {
        m.rbe2 = vec![rbe2(1, 3, vec![11])];
        m.spc = vec![Spc { id: 4, node: 11, components: Components::from_list(&[3]) }];
    });
    assert!(matches!(error, FemError::DependentHeld { .. }) && error.to_string().contains("11:3"), "{error}");
    let error = refuse(&|m| m.mpc = vec![Mpc { id: 5, terms: vec![(dof(11, 1), 0.0), (dof(1, 1), 1.0)] }]);
    assert!(error.to_string().contains("MPC 5"), "{error}");
    let group = Rbe3Group { weight: 1.0, components: Components::from_list(&[1, 2, 3]), nodes: vec![1, 2] };
    let rbe3 = Rbe3 { id: 6, reference: 11, components: Components::ALL, groups: vec![group], um: vec![] };
    let error = refuse(&|m| m.rbe3 = vec![rbe3.clone()]);
    assert!(
        error.to_string().contains("RBE3 6") && error.to_string().contains("do not determine"),
        "{error}"
    );
}
