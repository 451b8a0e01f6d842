//! Direct matrices (DMIG): a part given by its matrices is the part itself.

mod common;

use common::*;
use femend_fem::mesh::*;
use femend_fem::model::Model;

/// K and M of some beams as direct matrices; the beams are taken out of the mesh.
fn as_direct(mesh: &Mesh, ids: &[Id]) -> Mesh {
    let mut part = mesh.clone();
    part.beams.retain(|b| ids.contains(&b.id));
    part.spc.clear();
    let used: Vec<Id> = part.beams.iter().flat_map(|b| b.nodes).collect();
    part.nodes.retain(|n| used.contains(&n.id));
    part.options.wtmass = 1.0;
    let model = Model::new(&part, &[], &[]).unwrap();
    let s = model.assemble(&[]).unwrap();
    let mut out = mesh.clone();
    out.beams.retain(|b| !ids.contains(&b.id));
    for (kind, values) in [(DirectKind::K, &s.k), (DirectKind::M, &s.m), (DirectKind::H, &s.h)] {
        let a = dense(&model, values);
        let dof = |i: usize| model.nodes.component(model.a_rows[i]);
        let mut terms = Vec::new();
        for j in 0..model.n_a() {
            for i in j..model.n_a() {
                terms.push((dof(i), dof(j), a[(i, j)]));
            }
        }
        out.direct.push(DirectMatrix { name: "PART".to_owned(), kind, terms });
    }
    out
}

#[test]
fn a_part_given_by_its_matrices_is_the_part_itself() {
    let mut mesh = straight(6, 2.0, [0.8; 2], true);
    mesh.nodes[3].frame = Some(turn(0.4));
    mesh.spc.push(Spc { id: 1, node: 1, components: Components::ALL });
    mesh.options.wtmass = 2.0;
    let whole = Model::new(&mesh, &[], &[]).unwrap();
    let mut direct = as_direct(&mesh, &[3, 4, 5, 6]);
    // WTMASS does not reach direct mass
    direct.direct[1].terms.iter_mut().for_each(|t| t.2 *= 2.0);
    let model = Model::new(&direct, &[], &[]).unwrap();
    let (a, b) = (whole.assemble(&[]).unwrap(), model.assemble(&[]).unwrap());
    for (x, y) in [(&a.k, &b.k), (&a.m, &b.m), (&a.h, &b.h)] {
        let (x, y) = (dense(&whole, x), dense(&model, y));
        assert!((&x - y).amax() < 1e-12 * x.amax());
    }
}

#[test]
fn a_sparse_direct_matrix_does_not_fill_the_pattern() {
    // a chain of springs between many nodes: tridiagonal
    let n = 60;
    let mut mesh = Mesh::default();
    let mut terms = Vec::new();
    let dof = |node| NodeComponent { node, component: 1 };
    for i in 1..=n {
        mesh.nodes.push(node(i, [f64::from(i), 0.0, 0.0]));
        terms.push((dof(i), dof(i), 2.0));
        if i > 1 {
            terms.push((dof(i), dof(i - 1), -1.0));
        }
    }
    mesh.direct.push(DirectMatrix { name: "CHAIN".to_owned(), kind: DirectKind::K, terms });
    let model = Model::new(&mesh, &[], &[]).unwrap();
    assert_eq!((model.n_a(), model.pattern().nnz()), (60, 60 + 2 * 59));
    let k = dense(&model, &model.assemble(&[]).unwrap().k);
    assert_eq!((k[(0, 0)], k[(1, 0)], k[(0, 1)], k[(2, 0)]), (2.0, -1.0, -1.0, 0.0));
    mesh.direct[0].terms[0].0.node = 99;
    let error = Model::new(&mesh, &[], &[]).expect_err("refused").to_string();
    assert!(error.contains("DMIG") && error.contains("node 99"), "{error}");
}
