//! What does not fit together, and unknowns without a model.

use super::*;
use crate::identify::{IdentifyError, fitted, solve};

/// A change that breaks the sizes of a system, a record or a hypothesis.
type Break = fn(&mut System, &mut RecordLines, &mut Hypothesis, &mut Vec<f64>, &mut Vec<f64>);

#[test]
fn arrays_that_do_not_fit_are_refused() {
    let breaks: [(&str, Break); 17] = [
        ("fixed stiffness", |s, _, _, _, _| s.k_fixed = Dense::zeros(R - 1, R)),
        ("fixed mass", |s, _, _, _, _| s.m_fixed = Dense::zeros(R * R, 1)),
        ("a parameter's part of K or M", |s, _, _, _, _| s.terms[0].k = Some(Dense::zeros(1, R * R))),
        ("parameters", |s, _, _, _, _| s.terms[0].exponents[0].0 = 9),
        ("prior means", |s, _, _, _, _| s.mean.truncate(3)),
        ("prior standard deviations", |s, _, _, _, _| s.sd.push(1.0)),
        ("prior means", |s, _, _, _, _| s.n_tuned = R + 1),
        ("basis rows of the sensors", |_, r, _, _, _| r.out_rows = Dense::zeros(4, R + 1)),
        ("basis rows of the forces", |_, r, _, _, _| r.in_rows = Dense::zeros(1, 0)),
        ("spectra of the forces", |_, r, _, _, _| r.u.truncate(5)),
        ("spectra of the responses", |_, r, _, _, _| r.y.truncate(5)),
        ("weights", |_, r, _, _, _| r.weight.clear()),
        ("direction vectors", |_, _, h, _, _| h.w = Dense::zeros(1, R - 2)),
        ("coordinates of the laws", |_, _, h, _, _| h.what = What::everywhere(&laws().0, 2)),
        ("residual compliances", |_, _, h, _, _| h.compliance.clear()),
        ("start values", |_, _, _, p, _| p.truncate(2)),
        ("start values of the law", |_, _, _, _, x| x.push(0.0)),
    ];
    let (kinds, law) = laws();
    for (wanted, change) in breaks {
        let numbers = &mut Numbers(2);
        let mut system = system(numbers, 3, 0.01);
        let mut record = record(numbers, 4, 1, 0.5);
        let mut hypothesis = closed(numbers, 1, &kinds, &law);
        let (mut p, mut x) = (system.mean.clone(), law.clone());
        change(&mut system, &mut record, &mut hypothesis, &mut p, &mut x);
        let records = [record];
        let solved = solve(&system, &records, &hypothesis, &p, &x, Settings::default()).map(|_| ());
        let told = fitted(&system, &records, &hypothesis, &p, &x).map(|_| ());
        for outcome in [solved, told] {
            match outcome {
                Err(IdentifyError::Shape { what, .. }) => assert_eq!(what, wanted),
                other => panic!("{wanted}: {other:?}"),
            }
        }
    }
}

#[test]
fn unknowns_without_a_model_are_an_error_and_no_panic() {
    let numbers = &mut Numbers(2);
    let system = system(numbers, 3, 0.01);
    let records = [record(numbers, 4, 1, 0.5)];
    let (kinds, law) = laws();
    let hypothesis = closed(numbers, 1, &kinds, &law);
    for (i, value) in [(0, f64::NAN), (1, 1e4), (0, f64::INFINITY)] {
        let mut p = system.mean.clone();
        p[i] = value;
        assert!(
            solve(&system, &records, &hypothesis, &p, &law, Settings::default()).is_err(),
            "unknown {i} = {value}"
        );
    }
    let mut x = law.clone();
    x[0] = f64::NAN;
    assert!(matches!(
        solve(&system, &records, &hypothesis, &system.mean, &x, Settings::default()),
        Err(IdentifyError::Law(_))
    ));
}
