//! A dynamic stiffness that is given, against the law it is of.

use super::*;
use crate::identify::model_columns;

#[test]
fn columns_with_a_given_stiffness_are_those_with_its_law() {
    let numbers = &mut Numbers(29);
    let (kinds, x) = laws();
    let system = system(numbers, 3, 0.02);
    // an FRF, which has no decays
    let record = RecordLines { dt: 0.0, ..record(numbers, 4, 2, 0.0) };
    let hypothesis = Hypothesis { compliance: vec![0.0; 2], ..closed(numbers, 2, &kinds, &x) };
    let z = start(&system, &x);
    let (columns, _) = columns_and_residual(&system, &record, &hypothesis, &z);
    let kappa = hypothesis.stiffness(&x, &record.s).expect("laws").kappa;
    let p = &z[..system.n_unknowns()];
    let both = vec![kappa[0].clone(), kappa[0].clone()];
    let given = model_columns(&system, &record, hypothesis.w, both, p).expect("columns");
    for j in 0..system.n_unknowns() {
        let off = given.col(j).iter().zip(columns.col(j)).fold(0.0_f64, |a, (g, c)| a.max((g - c).abs()));
        let size = columns.col(j).iter().fold(0.0_f64, |a, c| a.max(c.abs()));
        assert!(off < 1e-12 * size, "unknown {j}: off by {off:e} of {size:e}");
    }
}

#[test]
fn a_stiffness_on_other_lines_is_refused() {
    let numbers = &mut Numbers(3);
    let system = system(numbers, 3, 0.02);
    let record = record(numbers, 4, 2, 0.0);
    let (w, p) = (numbers.dense(1, R), system.mean.clone());
    let short = vec![vec![Complex64::default(); N_LINES - 1]];
    let error = model_columns(&system, &record, w.clone(), short, &p).expect_err("too few lines");
    assert_eq!(error.to_string(), "lines of the stiffness has 13 entries, 14 expected");
    let two = vec![vec![Complex64::default(); N_LINES]; 2];
    let error = model_columns(&system, &record, w, two, &p).expect_err("too many coordinates");
    assert_eq!(error.to_string(), "stiffness of the coordinates has 2 entries, 1 expected");
}
