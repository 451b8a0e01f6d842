//! Building, assembling and differentiating a block of 8-node solids clamped at one face.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use femend_fem::mesh::{Components, Id, Material, Mesh, Node, Solid, SolidKind, SolidProperty, Spc};
use femend_fem::model::Model;
use femend_fem::parameter::Parameter;

/// Block of m x m x m steel bricks of side 0.1 m, one face held.
fn block(m: usize) -> Mesh {
    let at = |x: usize, y: usize, z: usize| ((x * (m + 1) + y) * (m + 1) + z) as Id + 1;
    let mut mesh = Mesh {
        materials: vec![Material { id: 1, e: Some(2.1e11), g: None, nu: Some(0.3), rho: 7850.0, ge: 0.0 }],
        solid_properties: vec![SolidProperty { id: 1, material: 1, frame: None }],
        ..Mesh::default()
    };
    for x in 0..=m {
        for y in 0..=m {
            for z in 0..=m {
                let xyz = [x, y, z].map(|i| 0.1 * i as f64);
                mesh.nodes.push(Node { id: at(x, y, z), xyz, frame: None });
                if x == 0 {
                    let components = Components::from_list(&[1, 2, 3]);
                    mesh.spc.push(Spc { id: 1, node: at(x, y, z), components });
                }
                if x < m && y < m && z < m {
                    let face =
                        |z| [at(x, y, z), at(x + 1, y, z), at(x + 1, y + 1, z), at(x, y + 1, z)].to_vec();
                    let nodes = [face(z), face(z + 1)].concat();
                    let id = mesh.solids.len() as Id + 1;
                    mesh.solids.push(Solid { id, property: 1, kind: SolidKind::Hexa8, nodes });
                }
            }
        }
    }
    mesh
}

fn benches(c: &mut Criterion) {
    let mesh = block(16);
    let parameters = [Parameter::parse("E", "E", "material", vec![1]).expect("materials have E")];
    let model = Model::new(&mesh, &parameters, &[]).expect("is a model");
    let mut group =
        c.benchmark_group(format!("assembly, {} bricks, {} DOFs", mesh.solids.len(), model.n_a()));
    group.sample_size(10);
    group.bench_function("model and pattern, once", |b| {
        b.iter(|| Model::new(black_box(&mesh), &parameters, &[]).expect("is a model"));
    });
    group.bench_function("K, M and C at new factors", |b| {
        b.iter(|| model.assemble(black_box(&[1.1])).expect("assembles"));
    });
    group.bench_function("derivative by a factor", |b| {
        b.iter(|| model.derivative(0, black_box(&[1.1])).expect("assembles"));
    });
    group.finish();
}

criterion_group!(all, benches);
criterion_main!(all);
