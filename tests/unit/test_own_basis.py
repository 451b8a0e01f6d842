"""A weak member fitted in its own basis: from where it was found, and from the deck's values."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import small_study
from femend.diagnose.locating.dressed import hypothesis_of, own_span
from femend.diagnose.locating.locate import Located
from femend.diagnose.locating.own_basis import in_own_basis
from femend.diagnose.updating.update import update_model
from femend.estimate import fit_records, pair_test
from femend.model import find_places, read_model
from femend.study import load_study

# what is left of the stretch's stiffness, and logarithms of the two moduli where they had made up for it
LEFT, BENT = 0.05, (-0.5, 0.5)


@pytest.mark.parametrize("begun", [LEFT, 0.4])
def test_a_member_that_is_broken_is_fitted_though_the_model_had_made_up_for_it(tmp_path: Path, begun: float) -> None:
    """The stretch at the clamp is a twentieth as stiff; where it was found, other unknowns were bent instead, and its
    factor was not yet what it is."""
    truth = small_study.Truth(E=(LEFT * 7e10, 7e10))
    study = load_study(small_study.write_study(tmp_path, truth))
    model, test = read_model(study.model_file, parameters=study.parameters), study.read_recordings()
    records = fit_records([r for r in test if r.role == "fit"], model, pair_test(test, model))
    start = update_model(model, records, study.damping_ratio)
    problem, reduced = start.problem, start.reduced
    (place,) = [p for p in find_places(model) if p.kind == "member" and p.elements == tuple(range(1, 7))]
    hypothesis = hypothesis_of(place, reduced)
    span = own_span(hypothesis.reduced)
    bent = problem.prior(hypothesis.reduced)[0].copy()
    bent[:2] = BENT
    bent[span] = np.log(begun)
    (there,) = problem.fit([hypothesis], [(bent, np.zeros(0))], iterations=0)
    assert there is not None
    rows = [int(row) for r in records for row in (*r.out_rows, *r.in_rows)]
    found = in_own_basis(problem, reduced, rows, Located(place, replace(there, p=bent), 0.0))
    assert found.fit.score < 2.0
    assert np.exp(found.fit.p[span][0]) == pytest.approx(LEFT, rel=0.1)
