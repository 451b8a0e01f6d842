//! From cards to the mesh: frames, offsets, defaults, sets.

use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};

use approx::assert_abs_diff_eq;
use femend_fem::deck::{Choice, Deck, DeckError, Selection, build};
use femend_fem::mesh::{
    BushFrame, Components, DirectKind, LaminateParts, MassKind, MaterialAxis, Mesh, NodeComponent,
    Orientation, PlaneLaw, SCALAR_COMPONENT,
};

static COUNTER: AtomicUsize = AtomicUsize::new(0);

/// A deck file that goes with its guard.
struct Temporary(PathBuf);

impl Temporary {
    fn new(text: &str) -> Self {
        let name =
            format!("femend-deck-{}-{}.bdf", std::process::id(), COUNTER.fetch_add(1, Ordering::Relaxed));
        let path = std::env::temp_dir().join(name);
        std::fs::write(&path, text).unwrap();
        Self(path)
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

fn try_mesh(text: &str, selection: &Selection) -> Result<Mesh, DeckError> {
    let file = Temporary::new(text);
    build(&Deck::read(&file.0)?, selection)
}

fn mesh(text: &str) -> Mesh {
    try_mesh(text, &Selection::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn close(a: [f64; 3], b: [f64; 3]) {
    for i in 0..3 {
        assert_abs_diff_eq!(a[i], b[i], epsilon = 1e-12);
    }
}

const BAR: &str = "MAT1,1,2.1+11,,.3,7850.,,,.02\nPBAR,1,1,1.,2.,3.,4.,5.\n+\n+,.8,.9,.1\n";

#[test]
fn materials_and_bars_keep_every_value() {
    let mesh = mesh(&format!("{BAR}PARAM,WTMASS,.001\nPARAM,COUPMASS,1\nPARAM,G,.03\n"));
    let m = &mesh.materials[0];
    assert_eq!((m.e, m.g, m.nu, m.rho, m.ge), (Some(2.1e11), None, Some(0.3), 7850.0, 0.02));
    let p = &mesh.beam_properties[0];
    assert_eq!((p.a.a, p.a.i1, p.a.i2, p.a.j, p.a.nsm, p.a.i12), (1.0, 2.0, 3.0, 4.0, 5.0, 0.1));
    assert_eq!((p.k1, p.k2, p.b.is_none()), (0.8, 0.9, true));
    assert!(mesh.options.coupled_mass);
    assert_eq!((mesh.options.wtmass, mesh.options.g), (0.001, 0.03));
}

#[test]
fn vectors_and_offsets_are_turned_from_the_nodes_frames() {
    // node 1 moves in a frame whose x is basic y and whose y is basic -x
    let text = "CORD2R,5,,0.,0.,0.,0.,0.,1.\n+,0.,1.,0.\nGRID,1,,0.,0.,0.,5\nGRID,2,,0.,0.,2.\n\
        CBAR,1,1,1,2,1.,0.,0.\n+,45,6,.1,0.,0.,.1,0.,0.\nCBAR,2,1,1,2,1.,0.,0.,BGG\n\
        CBAR,3,1,1,2,1.,0.,0.,BOO\n+,,,.1,.2,.3,.1\nCBAR,4,1,1,2,2\n";
    let mesh = mesh(&format!("{BAR}{text}"));
    let vector = |k: usize| match mesh.beams[k].orientation {
        Orientation::Vector(v) => v,
        Orientation::Node(_) => panic!("a vector was given"),
    };
    close(vector(0), [0.0, 1.0, 0.0]);
    close(mesh.beams[0].offsets[0], [0.0, 0.1, 0.0]);
    close(mesh.beams[0].offsets[1], [0.1, 0.0, 0.0]);
    assert_eq!(mesh.beams[0].pins, [Components::from_list(&[4, 5]), Components::from_list(&[6])]);
    close(vector(1), [1.0, 0.0, 0.0]);
    // element axes: x along basic z, y along basic x, z along basic y
    close(mesh.beams[2].offsets[0], [0.2, 0.3, 0.1]);
    close(mesh.beams[2].offsets[1], [0.0, 0.0, 0.1]);
    assert_eq!(mesh.beams[3].orientation, Orientation::Node(2));
}

#[test]
fn a_cylindrical_frame_is_taken_at_its_node() {
    let mesh = mesh(
        "CORD2C,5,,0.,0.,0.,0.,0.,1.\n+,1.,0.,0.\nGRID,1,5,2.,90.,0.,5,34\nCONM2,1,1,5,2.,.5,0.,0.\n+,1.,0.,3.,0.,0.,5.\n",
    );
    let node = &mesh.nodes[0];
    close(node.xyz, [0.0, 2.0, 0.0]);
    let frame = node.frame.unwrap();
    close(frame[0], [0.0, 1.0, 0.0]);
    close(frame[1], [-1.0, 0.0, 0.0]);
    assert_eq!((mesh.spc[0].id, mesh.spc[0].components), (0, Components::from_list(&[3, 4])));
    let MassKind::Conm2 { m, offset, inertia } = mesh.masses[0].kind else { panic!("CONM2") };
    assert_eq!(m, 2.0);
    close(offset, [0.0, 0.5, 0.0]);
    close([inertia[0][0], inertia[1][1], inertia[2][2]], [3.0, 1.0, 5.0]);
}

#[test]
fn products_of_inertia_change_sign_and_cid_minus_one_is_absolute() {
    let mesh = mesh("GRID,1,,1.,0.,0.\nCONM2,1,1,-1,2.,1.5,0.,.25\n+,1.,.1,3.,.2,.3,5.\n");
    let MassKind::Conm2 { offset, inertia, .. } = mesh.masses[0].kind else { panic!("CONM2") };
    close(offset, [0.5, 0.0, 0.25]);
    assert_eq!(inertia, [[1.0, -0.1, -0.2], [-0.1, 3.0, -0.3], [-0.2, -0.3, 5.0]]);
}

#[test]
fn grdset_and_baror_fill_blank_fields() {
    let text = "GRDSET,,,,,,,345\nBAROR,,1,,,0.,0.,1.\nGRID,1\nGRID,2,,1.,0.,0.,,6\nCBAR,1,,1,2\n";
    let mesh = mesh(&format!("{BAR}{text}"));
    assert_eq!(mesh.spc[0].components, Components::from_list(&[3, 4, 5]));
    assert_eq!(mesh.spc[1].components, Components::from_list(&[6]));
    assert_eq!(mesh.beams[0].property, 1);
    assert_eq!(mesh.beams[0].orientation, Orientation::Vector([0.0, 0.0, 1.0]));
}

#[test]
fn bushes_have_rows_in_any_order_and_need_a_frame_to_ground() {
    let text = "GRID,1\nGRID,2,,1.,0.,0.\nPBUSH,7,B,1.,2.\n+,,GE,.1\n+,,K,10.,20.,30.,,,60.\n\
        CBUSH,1,7,1,,,,,,0\nCBUSH,2,7,1,2,0.,1.,0.\nCBUSH,3,7,,2,,,,0\nCBUSH,4,7,1,2\n";
    assert!(
        try_mesh(text, &Selection::default())
            .unwrap_err()
            .to_string()
            .contains("coordinate system in field 9")
    );
    let mesh = mesh(&text.replace("CBUSH,1,7,1,,,,,,0", "CBUSH,1,7,1,,,,,0"));
    let p = &mesh.bush_properties[0];
    assert_eq!(
        (p.k, p.c, p.ge),
        ([10.0, 20.0, 30.0, 0.0, 0.0, 60.0], [1.0, 2.0, 0.0, 0.0, 0.0, 0.0], [0.1; 6])
    );
    assert_eq!(mesh.bushes[0].nodes, [Some(1), None]);
    assert!(matches!(mesh.bushes[0].frame, BushFrame::Fixed(_)));
    assert_eq!(mesh.bushes[1].frame, BushFrame::Oriented(Orientation::Vector([0.0, 1.0, 0.0])));
    assert_eq!(mesh.bushes[2].nodes, [Some(2), None]);
    assert_eq!(mesh.bushes[3].frame, BushFrame::Axial);
    assert_eq!(mesh.bushes[3].location, 0.5);
}

#[test]
fn a_tapered_pbeam_has_two_ends_and_a_straight_line_between() {
    let text = "MAT1,1,1.,,.3\nPBEAM,1,1,4.,8.,6.,,2.\n+,1.,1.,1.,1.\n+,YES,1.,2.,4.,3.,,1.\n+,0.,0.\n+,NO,.5,3.,6.,4.5,,1.5\n+,.5,.6\n+,,,,,.1,.2\n";
    let property = &mesh(text).beam_properties[0];
    let b = property.b.as_ref().unwrap();
    assert_eq!((property.a.a, b.a, b.i1, b.i2, b.j), (4.0, 2.0, 4.0, 3.0, 1.0));
    assert_eq!((property.k1, property.k2), (0.5, 0.6));
    assert_eq!((property.a.neutral_axis, b.neutral_axis), ([0.1, 0.2], [0.1, 0.2]));
    let bent = text.replace("NO,.5,3.", "NO,.5,3.5");
    assert!(try_mesh(&bent, &Selection::default()).unwrap_err().to_string().contains("split the element"));
}

#[test]
fn rbe3_reads_weights_ranges_and_um() {
    let nodes: String = (1..=6).map(|i| format!("GRID,{i},,{i}.,0.,0.\n")).collect();
    let mesh = mesh(&format!("{nodes}RBE3,9,,6,123456,1.,123,1,2\n+,3,.5,123,4,5,UM,1,13\n+,2,2\n"));
    let rbe3 = &mesh.rbe3[0];
    assert_eq!((rbe3.reference, rbe3.components), (6, Components::ALL));
    assert_eq!((rbe3.groups[0].weight, rbe3.groups[0].nodes.clone()), (1.0, vec![1, 2, 3]));
    assert_eq!((rbe3.groups[1].weight, rbe3.groups[1].nodes.clone()), (0.5, vec![4, 5]));
    let um = [(1, 1), (1, 3), (2, 2)].map(|(node, component)| NodeComponent { node, component });
    assert_eq!(rbe3.um, um);
}

#[test]
fn sets_are_chosen_by_case_control_or_by_hand() {
    let nodes: String = (1..=6).map(|i| format!("GRID,{i},,{i}.,0.,0.\n")).collect();
    let cards = "SPCADD,10,1,2\nSPC1,1,123,1,THRU,3\nSPC,2,4,456,0.,5,1\nSPC1,3,1,6\n\
        MPC,7,1,1,1.,2,1,-1.\n+,,3,2,.5\nMPC,8,4,1,1.,5,1,-1.\nRBE2,1,5,123,6,1.-5\n";
    let text = format!("CEND\nSPC = 10\nMPC = 7\nBEGIN BULK\n{nodes}{cards}");
    let chosen = mesh(&text);
    let spc: Vec<_> = chosen.spc.iter().map(|s| (s.id, s.node, s.components.iter().count())).collect();
    assert_eq!(spc, [(1, 1, 3), (1, 2, 3), (1, 3, 3), (2, 4, 3), (2, 5, 1)]);
    assert_eq!(chosen.mpc.len(), 1);
    assert_eq!(chosen.mpc[0].terms[2], (NodeComponent { node: 3, component: 2 }, 0.5));
    assert_eq!(chosen.rbe2[0].dependent, [6]);
    let other = Selection { spc: Choice::Set(3), mpc: Choice::Nothing };
    let other = try_mesh(&text, &other).unwrap();
    assert_eq!((other.spc.len(), other.mpc.len()), (1, 0));
    let none = Selection { spc: Choice::Set(99), mpc: Choice::Nothing };
    let error = try_mesh(&text, &none).unwrap_err().to_string();
    assert!(error.contains("SPC set 99") && error.contains("1, 2, 3, 10"), "{error}");
}

#[test]
fn shells_and_solids_keep_thicknesses_and_order() {
    let nodes: String = (1..=20).map(|i| format!("GRID,{i},,{i}.,0.,0.\n")).collect();
    let cards = "MAT1,1,1.,,.3\nPSHELL,1,1,.2,1\nPSOLID,2,1\nCQUAD4,1,1,1,2,3,4,,.1\n+,,,.1,.2,.3,.4\n\
        CTRIA3,2,1,1,2,3,,.5\n+,,1,.5\nCTETRA,3,2,1,2,3,4\nCTETRA,4,2,1,2,3,4,5,6\n+,7,8,9,10\n\
        CHEXA,5,2,1,2,3,4,5,6\n+,7,8\n";
    let text = format!("{nodes}{cards}");
    let built = mesh(&text);
    assert_eq!((built.quads[0].zoffset, built.quads[0].thickness), (0.1, [0.1, 0.2, 0.3, 0.4].map(Some)));
    // TFLAG = 1: half the property's thickness at the first corner, all of it at the others
    assert_eq!((built.trias[0].zoffset, built.trias[0].thickness), (0.5, [0.1, 0.2, 0.2].map(Some)));
    assert_eq!(built.solids.iter().map(|s| s.nodes.len()).collect::<Vec<_>>(), [4, 10, 8]);
    let error = try_mesh(&text.replace("+,7,8,9,10", "+,7,8,9"), &Selection::default()).unwrap_err();
    assert!(error.to_string().contains("5 of 6 mid-side nodes"), "{error}");
}

#[test]
fn scalar_elements_find_ground_and_shared_property_cards() {
    let text = "GRID,1\nGRID,2\nPELAS,1,10.,,,2,20.,.1\nPDAMP,1,1.,2,2.,3,3.\nCELAS1,1,2,1,3\nCELAS2,2,5.,1,1,2,1,.01\n\
        CDAMP1,3,3,1,1,2,1\nCMASS2,1,4.,2,2\n";
    let mesh = mesh(text);
    assert_eq!(
        mesh.spring_properties.iter().map(|p| (p.id, p.k, p.ge)).collect::<Vec<_>>(),
        [(1, 10.0, 0.0), (2, 20.0, 0.1)]
    );
    assert_eq!(mesh.damper_properties[2].c, 3.0);
    assert_eq!(mesh.springs[0].ends, [Some(NodeComponent { node: 1, component: 3 }), None]);
    let MassKind::Conm1(matrix) = mesh.masses[0].kind else { panic!("CMASS2") };
    assert_eq!(matrix[1][1], 4.0);
}

#[test]
fn laminates_repeat_blanks_mirror_and_keep_their_frame() {
    let nodes = "GRID,1\nGRID,2,,1.,0.,0.\nGRID,3,,1.,1.,0.\nGRID,4,,0.,1.,0.\nCORD2R,5,,0.,0.,0.,0.,0.,1.\n+,0.,1.,0.\n";
    let cards = "MAT1,1,7.+10,,.3,2700.\nMAT8,2,1.4+11,9.+9,.3,5.+9,5.+9,3.+9,1600.\n+\n+,.02\n\
        PCOMP,1,-.001,2.5,,,,.01,SYM\n+,2,.001,45.,YES,,,-45.\n+,1,.003\n\
        PCOMPG,2,,,,,,,MEM\n+,7,2,.001,30.\n+,9,,.002\n\
        CQUAD4,1,1,1,2,3,4,5\n+,,,.1,.1,.1,.1\nCTRIA3,2,2,1,2,3,60.\nCTRIA3,3,2,1,3,4\n";
    let built = mesh(&format!("{nodes}{cards}"));
    let l = &built.laminates[0];
    assert_eq!((l.z0, l.nsm, l.ge, l.parts), (Some(-0.001), 2.5, Some(0.01), LaminateParts::All));
    let plies: Vec<_> = l.plies.iter().map(|p| (p.material, p.t, p.angle.to_degrees().round())).collect();
    let half = [(2, 0.001, 45.0), (2, 0.001, -45.0), (1, 0.003, 0.0)];
    assert_eq!(plies[..3], half);
    assert_eq!(plies[3..], [half[2], half[1], half[0]]);
    let l = &built.laminates[1];
    assert_eq!(
        (l.parts, l.plies.len(), l.plies[1].material, l.plies[1].t),
        (LaminateParts::Membrane, 2, 2, 0.002)
    );
    assert_eq!((built.plane_materials[0].rho, built.plane_materials[0].ge), (1600.0, 0.02));
    // the system's x axis is basic y; plies have the thickness, not the element
    let MaterialAxis::Along(x) = built.quads[0].axis else { panic!("a system was given") };
    close(x, [0.0, 1.0, 0.0]);
    assert_eq!(built.quads[0].thickness, [None; 4]);
    assert_eq!(built.trias[0].axis, MaterialAxis::Angle(60.0_f64.to_radians()));
    assert_eq!(built.trias[1].axis, MaterialAxis::Angle(0.0));
    let refuse = |text: &str, word: &str| {
        let error = try_mesh(&format!("{nodes}{text}"), &Selection::default()).unwrap_err().to_string();
        assert!(error.contains(word), "{error}");
    };
    refuse(&cards.replace(",SYM", ",SMEAR"), "LAM = SMEAR");
    refuse(&cards.replace("+,2,.001,45.,YES,,,-45.", "+,8,.001,45.,YES,,,-45."), "material 8");
    refuse("MAT8,2,1.,1.\nPBAR,1,2,1.\n", "material 2 is a MAT8; PBAR needs MAT1");
}

#[test]
fn anisotropic_materials_fill_their_triangles() {
    let text = "MAT2,1,11.,12.,13.,22.,23.,33.,7.\n+,,,,,.04\n\
        MAT9,2,11.,12.,13.,14.,15.,16.,22.\n+,23.,24.,25.,26.,33.,34.,35.,36.\n+,44.,45.,46.,55.,56.,66.,8.\n+,,,,,,,.05\n\
        CORD2R,5,,0.,0.,0.,0.,0.,1.\n+,0.,1.,0.\nCORD2C,6,,0.,0.,0.,0.,0.,1.\n+,0.,1.,0.\nPSOLID,1,2,5\nPSOLID,2,2\n";
    let built = mesh(text);
    let PlaneLaw::Anisotropic(g) = built.plane_materials[0].law else { panic!("MAT2") };
    assert_eq!(g, [[11.0, 12.0, 13.0], [12.0, 22.0, 23.0], [13.0, 23.0, 33.0]]);
    assert_eq!((built.plane_materials[0].rho, built.plane_materials[0].ge), (7.0, 0.04));
    let m = &built.solid_materials[0];
    for i in 0..6 {
        for j in 0..6 {
            assert_eq!(m.stiffness[i][j], (10 * (i.min(j) + 1) + i.max(j) + 1) as f64);
        }
    }
    assert_eq!((m.rho, m.ge), (8.0, 0.05));
    close(built.solid_properties[0].frame.unwrap()[0], [0.0, 1.0, 0.0]);
    assert!(built.solid_properties[1].frame.is_none());
    for (field, word) in [("6", "curved"), ("-1", "CORDM = -1")] {
        let error =
            try_mesh(&text.replace("PSOLID,1,2,5", &format!("PSOLID,1,2,{field}")), &Selection::default());
        assert!(error.unwrap_err().to_string().contains(word));
    }
}

#[test]
fn rigid_bars_and_pyramids_are_read() {
    let nodes: String = (1..=13).map(|i| format!("GRID,{i},,{i}.,0.,0.\n")).collect();
    let text = format!(
        "{nodes}MAT1,1,1.,,.3\nPSOLID,1,1\nCPYRAM,1,1,1,2,3,4,5\nCPYRAM,2,1,1,2,3,4,5,6\n+,7,8,9,10,11,12,13\n\
        RBAR,7,1,2,123456\nRBAR,8,1,2,1234,23,,456\n"
    );
    let built = mesh(&text);
    assert_eq!(built.solids.iter().map(|s| s.nodes.len()).collect::<Vec<_>>(), [5, 13]);
    let set = Components::from_list;
    assert_eq!(built.rbar[0].dependent, [Components::default(), Components::ALL]);
    assert_eq!(built.rbar[1].independent, [set(&[1, 2, 3, 4]), set(&[2, 3])]);
    assert_eq!(built.rbar[1].dependent, [Components::default(), set(&[4, 5, 6])]);
}

const DIRECT: &str = "GRID,1\nGRID,2,,1.,0.,0.\nGRID,3,,2.,0.,0.\n\
    DMIG,KS,0,6,2,0\nDMIG,KS,1,1,,1,1,10.\n+,2,1,-10.,,3,1,2.\nDMIG,KS,2,1,,2,1,10.\n\
    DMIG,MS,0,1,1,0\nDMIG,MS,2,3,,2,3,4.,,\n+,3,3,1.\nDMIG,MS,3,3,,2,3,1.\nDMIG,PS,0,9,1,0,,,1\nDMIG,PS,1,0,,1,1,5.\n";

#[test]
fn direct_matrices_are_selected_scaled_and_checked() {
    let with =
        |control: &str| try_mesh(&format!("CEND\n{control}\nBEGIN BULK\n{DIRECT}"), &Selection::default());
    let built = with("K2GG = 2.*KS\nM2GG = MS").unwrap();
    let k = &built.direct[0];
    assert_eq!((k.name.as_str(), k.kind, k.terms.len()), ("KS", DirectKind::K, 4));
    let dof = |node, component| NodeComponent { node, component };
    assert!(
        k.terms.contains(&(dof(2, 1), dof(1, 1), -20.0)) && k.terms.contains(&(dof(3, 1), dof(1, 1), 4.0))
    );
    assert_eq!((built.direct[1].kind, built.direct[1].terms.len()), (DirectKind::M, 2));
    let refuse = |control: &str, word: &str| {
        let error = with(control).unwrap_err().to_string();
        assert!(error.contains(word), "{error}");
    };
    refuse("K2GG = KS", "DMIG MS");
    refuse("K2GG = KX\nM2GG = MS", "no DMIG KX");
    refuse("K2GG = a*KS\nM2GG = MS", "not a number");
    let broken = |from: &str, to: &str, word: &str| {
        let text = DIRECT.replace(from, to);
        let text = format!("CEND\nK2GG = KS\nM2GG = MS\nBEGIN BULK\n{text}");
        let error = try_mesh(&text, &Selection::default()).unwrap_err().to_string();
        assert!(error.contains(word), "{error}");
    };
    broken("DMIG,MS,3,3,,2,3,1.", "DMIG,MS,3,3,,2,3,1.5", "not symmetric");
    broken("DMIG,KS,0,6,2,0", "DMIG,KS,0,6,3,0", "complex");
    broken("DMIG,KS,2,1,,2,1,10.", "DMIG,KS,2,1,,2,1,10.,,\n+,1,1,-10.", "stands twice");
    broken("DMIG,MS,2,3,,2,3,4.", "DMIG,MS,2,3,,9,3,4.", "GRID or SPOINT 9");
}

#[test]
fn scalar_points_have_one_held_free_component() {
    let built = mesh(
        "GRID,5,,2.,0.,0.\nGRID,9,,4.,0.,0.\nSPOINT,6,THRU,7\nCELAS4,1,10.,7,8\nCMASS4,2,3.,8\nCELAS2,3,1.,5,1,6\n",
    );
    assert_eq!(built.scalar_points, [6, 7, 8]);
    assert_eq!(built.nodes.iter().map(|n| n.id).collect::<Vec<_>>(), [5, 6, 7, 8, 9]);
    assert_eq!(built.nodes[1].xyz, [3.0, 0.0, 0.0]);
    let dof = |node| Some(NodeComponent { node, component: SCALAR_COMPONENT });
    assert_eq!(built.springs[1].ends, [dof(7), dof(8)]);
    assert_eq!(built.springs[0].ends[1], dof(6));
    let held: Vec<_> = built.spc.iter().map(|s| (s.node, s.components.iter().count())).collect();
    assert_eq!(held, [(6, 5), (7, 5), (8, 5)]);
    let refuse = |text: &str, word: &str| {
        let error = try_mesh(text, &Selection::default()).unwrap_err().to_string();
        assert!(error.contains(word), "{error}");
    };
    refuse("GRID,5\nCELAS4,1,10.,5\n", "5 is a GRID; CELAS4 connects scalar points");
    refuse("GRID,5\nSPOINT,5\n", "GRID 5");
    refuse("SPOINT,5,THRU,90000000\n", "more than");
    refuse("GRID,4\nSPOINT,5\nCONM2,1,5,,1.\n", "no place");
}
