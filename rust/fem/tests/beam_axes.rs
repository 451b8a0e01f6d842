//! Beams whose neutral axis and non-structural mass are off the shear centre.

mod common;

use common::*;
use femend_fem::mesh::*;
use femend_fem::model::Model;
use nalgebra::DMatrix;

const E: f64 = 2.1e11;
const G: f64 = E / 2.6;

/// A clamped beam along x of `n` elements; neutral axis and mass off the shear centre.
fn channel(n: usize, l: f64, neutral_axis: [f64; 2], nsm_offset: [f64; 2], coupled: bool) -> Mesh {
    let mut mesh = straight(n, l, [0.0; 2], coupled);
    let s = &mut mesh.beam_properties[0].a;
    (s.neutral_axis, s.nsm_offset) = (neutral_axis, nsm_offset);
    mesh
}

fn clamp(mut mesh: Mesh) -> Model {
    mesh.spc.push(Spc { id: 1, node: 1, components: Components::ALL });
    Model::new(&mesh, &[], &[]).unwrap()
}

#[test]
fn a_load_at_the_shear_centre_bends_by_its_arm_to_the_neutral_axis() {
    let (l, y, z, p) = (2.0, 0.03, -0.02, 1000.0);
    let model = clamp(channel(4, l, [y, z], [0.0; 2], true));
    let s = section(0.0);
    let n = model.n_a();
    let k = dense(&model, &model.assemble(&[]).unwrap().k);
    let at = |component: usize| n - 6 + component;
    let solve = |component: usize| {
        let mut f = DMatrix::zeros(n, 1);
        f[at(component)] = p;
        k.clone().cholesky().unwrap().solve(&f)
    };
    // axial force P: moments M_z = y P, M_y = -z P about the neutral axis, constant along the beam
    let u = solve(0);
    let (curvature_z, curvature_y) = (y * p / (E * s.i1), -z * p / (E * s.i2));
    let exact = [
        p * l / (E * s.a) + y * curvature_z * l - z * curvature_y * l,
        curvature_z * l * l / 2.0,
        -curvature_y * l * l / 2.0,
        0.0,
        curvature_y * l,
        curvature_z * l,
    ];
    for (c, e) in exact.iter().enumerate() {
        assert!((u[at(c)] - e).abs() < 1e-9 * exact[1].abs(), "{c}: {} {e}", u[at(c)]);
    }
    // a transverse force at the shear centre does not twist it, a torque does not deflect it
    let u = solve(2);
    assert!(u[at(3)].abs() < 1e-12 && (u[at(2)] / (p * l.powi(3) / (3.0 * E * s.i2)) - 1.0).abs() < 1e-9);
    let u = solve(3);
    assert!(u[at(1)].abs() < 1e-12 && (u[at(3)] / (p * l / (G * s.j)) - 1.0).abs() < 1e-9);
}

#[test]
fn it_moves_freely_and_has_the_mass_moments_of_its_two_lines() {
    let (y, z, my, mz, l) = (0.03, -0.02, -0.01, 0.04, 2.0);
    for coupled in [true, false] {
        let mut mesh = channel(4, l, [y, z], [my, mz], coupled);
        let r = turn(0.7);
        mesh.nodes.iter_mut().for_each(|n| n.xyz = apply(&r, n.xyz));
        mesh.beams.iter_mut().for_each(|b| b.orientation = Orientation::Vector(apply(&r, [0.0, 1.0, 0.0])));
        let model = Model::new(&mesh, &[], &[]).unwrap();
        let s = model.assemble(&[]).unwrap();
        let (k, m) = (dense(&model, &s.k), dense(&model, &s.m));
        let rigid = rigid_motions(&model);
        assert!((&k * &rigid).amax() < 1e-10 * k.amax());
        // rolling about the shear axis: rho (I1 + I2) + rho A (y² + z²) + nsm (my² + mz²) per length
        let axis = apply(&r, [1.0, 0.0, 0.0]);
        let roll = rigid.columns(3, 3) * DMatrix::from_column_slice(3, 1, &axis);
        let sec = section(0.0);
        let inertia = 7850.0 * (sec.i1 + sec.i2 + sec.a * (y * y + z * z)) + sec.nsm * (my * my + mz * mz);
        let value = (roll.transpose() * &m * &roll)[0];
        assert!((value / (inertia * l) - 1.0).abs() < 1e-9, "{coupled}: {value} {}", inertia * l);
    }
}

#[test]
fn bending_and_torsion_couple_as_in_the_closed_form() {
    // Hinged beam, mass off the shear centre by y: w and theta in sin(pi x / l) couple by mu y:
    // (EI q⁴ - w² mu)(GJ q² - w² I) = w⁴ mu² y² with I = mu y² + rho Ip (Weaver, Timoshenko and Young, 5th ed., §5.20);
    // rotary inertia of bending left out, 0.1 % here.
    let (l, y) = (2.0, 0.05);
    let mut mesh = channel(16, l, [0.0; 2], [y, 0.0], true);
    (mesh.materials[0].rho, mesh.beam_properties[0].a.nsm) = (1e-9, 5.0);
    for (id, c) in [(1, [1, 2, 3, 4]), (17, [2, 2, 3, 4])] {
        mesh.spc.push(Spc { id: 1, node: id, components: Components::from_list(&c) });
    }
    let model = Model::new(&mesh, &[], &[]).unwrap();
    let s = model.assemble(&[]).unwrap();
    // the mass has no inertia of its own: by the flexibility
    let flexible = eigenvalues(&dense(&model, &s.m), &dense(&model, &s.k));
    let low: Vec<f64> = flexible.iter().rev().take(4).map(|x| 1.0 / x).collect();
    let sec = section(0.0);
    let (q, mu) = (std::f64::consts::PI / l, 5.0);
    let (kb, kt) = (E * sec.i2 * q.powi(4), G * sec.j * q * q);
    // without Ip the product form has one root
    let exact = kb * kt / (mu * (kt + kb * y * y));
    assert!(low.iter().any(|x| (x / exact - 1.0).abs() < 2e-3), "{low:?} {exact}");
}
