"""Members at the best places are followed from far off where what was tried explains too little."""

from __future__ import annotations

import numpy as np
import pytest
from tests import small_study

from femend.diagnose.locating.dressed import hypothesis_of, own_span
from femend.diagnose.locating.locate import Located
from femend.diagnose.locating.members_there import members_there
from femend.diagnose.locating.own_basis import in_own_basis
from femend.diagnose.updating.update import UpdatedModel, update_model
from femend.estimate import fit_records, pair_test
from femend.model import Place, find_places, read_model
from femend.study import load_study


@pytest.fixture(scope="module")
def half(tmp_path_factory: pytest.TempPathFactory) -> tuple[UpdatedModel, list[Place], list[int]]:
    """A cantilever whose stretch at the clamp is half as stiff, updated; its places; the rows of what was recorded."""
    study = load_study(small_study.write_study(tmp_path_factory.mktemp("half"), small_study.Truth(E=(3.5e10, 7e10))))
    model, test = read_model(study.model_file, parameters=study.parameters), study.read_recordings()
    records = fit_records([r for r in test if r.role == "fit"], model, pair_test(test, model))
    rows = [int(row) for r in records for row in (*r.out_rows, *r.in_rows)]
    return update_model(model, records, study.damping_ratio), find_places(model), rows


def located(start: UpdatedModel, places: list[Place], node: int) -> Located:
    """A place to the ground at a node, as if it were the best."""
    (place,) = [p for p in places if (p.kind, p.nodes, p.direction) == ("ground", (node,), "Z")]
    hypothesis = hypothesis_of(place, start.reduced)
    (fit,) = start.problem.fit([hypothesis], [(start.null.p, np.zeros(0))], iterations=0)
    assert fit is not None
    return Located(place, fit, 0.0)


def test_whole_members_that_hold_the_best_places_are_listed(half: tuple[UpdatedModel, list[Place], list[int]]) -> None:
    start, places, _ = half
    whole = {p.elements for p in places if p.kind == "member" and len(p.elements) > 2}
    inside = located(start, places, 4)
    found = members_there(start.problem, start.reduced, places, [inside], [])
    assert found
    assert {one.place.elements for one in found} <= whole
    assert all(3 in one.place.elements or 4 in one.place.elements for one in found)
    # a place that was tried is not tried again, and without a place there is none
    assert members_there(start.problem, start.reduced, places, [inside], [one.place for one in found]) == []
    assert members_there(start.problem, start.reduced, places, [], []) == []


def test_their_factor_is_found_from_far_off(half: tuple[UpdatedModel, list[Place], list[int]]) -> None:
    start, places, rows = half
    found = members_there(start.problem, start.reduced, places, [located(start, places, 4)], [])
    followed = [in_own_basis(start.problem, start.reduced, rows, one) for one in found]
    best = min(followed, key=lambda one: one.fit.cost)
    assert best.fit.score < 1.3
    assert np.exp(best.fit.p[own_span(best.fit.hypothesis.reduced)][0]) == pytest.approx(0.5, rel=0.1)
