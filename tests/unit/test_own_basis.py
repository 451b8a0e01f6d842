"""A weak member fitted in its own basis: from where it was found, and from the deck's values."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import small_study
from femend.diagnose.locating import own_basis
from femend.diagnose.locating.dressed import hypothesis_of, own_span
from femend.diagnose.locating.locate import Located
from femend.diagnose.locating.own_basis import in_own_basis
from femend.diagnose.updating.update import UpdatedModel, update_model
from femend.estimate import fit_records, pair_test
from femend.model import Place, find_places, read_model
from femend.study import load_study

# what is left of the stretch's stiffness, and logarithms of the two moduli where they had made up for it
LEFT, BENT = 0.05, (-0.5, 0.5)


def weak_member(folder: Path, left: float) -> tuple[UpdatedModel, Place, list[int]]:
    """The model of a cantilever updated on recordings of one whose stretch at the clamp has a share `left` of its
    stiffness, that stretch, and the rows of what was recorded."""
    truth = small_study.Truth(E=(left * 7e10, 7e10))
    study = load_study(small_study.write_study(folder, truth))
    model, test = read_model(study.model_file, parameters=study.parameters), study.read_recordings()
    records = fit_records([r for r in test if r.role == "fit"], model, pair_test(test, model))
    (place,) = [p for p in find_places(model) if p.kind == "member" and p.elements == tuple(range(1, 7))]
    rows = [int(row) for r in records for row in (*r.out_rows, *r.in_rows)]
    return update_model(model, records, study.damping_ratio), place, rows


def found_at(start: UpdatedModel, place: Place, bent: tuple[float, float], factor: float) -> Located:
    """The place as it was found with moduli bent (logarithms) beside a factor."""
    hypothesis = hypothesis_of(place, start.reduced)
    p = start.problem.prior(hypothesis.reduced)[0].copy()
    p[:2] = bent
    p[own_span(hypothesis.reduced)] = np.log(factor)
    (there,) = start.problem.fit([hypothesis], [(p, np.zeros(0))], iterations=0)
    assert there is not None
    return Located(place, replace(there, p=p), 0.0)


@pytest.mark.parametrize("begun", [LEFT, 0.4])
def test_a_member_that_is_broken_is_fitted_though_the_model_had_made_up_for_it(tmp_path: Path, begun: float) -> None:
    """The stretch at the clamp is a twentieth as stiff; where it was found, other unknowns were bent instead, and its
    factor was not yet what it is."""
    start, place, rows = weak_member(tmp_path, LEFT)
    found = in_own_basis(start.problem, start.reduced, rows, found_at(start, place, BENT, begun))
    assert found.fit.score < 2.0
    assert found.fit.hypothesis.reduced.names[-1] == "member"
    assert np.exp(found.fit.p[own_span(found.fit.hypothesis.reduced)][0]) == pytest.approx(LEFT, rel=0.1)


def test_a_member_that_was_found_stiffer_than_it_is_drawn_is_followed_from_weaker_ones(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Beside a factor of 1.5 columns and beams of a frame made up for a member of 0.55, at the noise, with 15 of their
    deviations: a minimum that no steps from there leave."""
    start, place, rows = weak_member(tmp_path, 0.5)
    monkeypatch.setattr(own_basis, "STEPS", 0)
    found = in_own_basis(start.problem, start.reduced, rows, found_at(start, place, (-0.3, 0.2), 1.5))
    assert np.exp(found.fit.p[own_span(found.fit.hypothesis.reduced)][0]) == pytest.approx(0.5, rel=0.1)
