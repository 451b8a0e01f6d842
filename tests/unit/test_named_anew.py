"""A linear law of two gives way to a nonlinear one that does better beside the force of the other."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from femend.diagnose.several.named_anew import force_of_the_other, named_anew
from femend.diagnose.several.pairs import Searched
from femend.diagnose.several.together import Scored
from femend.diagnose.updating.update import UpdatedModel

sys.path.insert(0, str(Path(__file__).parents[1]))
from small_study import Truth, laws_together, searched_without_laws, updated

DASHPOT, SPRING = 20.0, {"k_plus": 6.0e3, "k_minus": 2.0e3}
MODULI = (7.3e10, 6.8e10)


@pytest.fixture(scope="module")
def bilinear(tmp_path_factory: pytest.TempPathFactory) -> UpdatedModel:
    laws = [(7, "viscous_damper", {"c": DASHPOT}), (13, "bilinear_stiffness", SPRING)]
    return updated(tmp_path_factory.mktemp("bilinear"), Truth(MODULI, laws=laws))


@pytest.fixture(scope="module")
def elastic(tmp_path_factory: pytest.TempPathFactory) -> UpdatedModel:
    laws = [(7, "viscous_damper", {"c": DASHPOT}), (13, "support_stiffness", {"k": 4.0e3})]
    return updated(tmp_path_factory.mktemp("elastic"), Truth(MODULI, laws=laws))


def pair(first: Searched, start: UpdatedModel) -> Scored:
    """A dashpot at node 7 and an elastic spring at node 13, fitted together."""
    return laws_together(first, start, ("viscous_damper", 7, DASHPOT), ("support_stiffness", 13, 4.0e3))


def test_an_elastic_spring_gives_way_to_one_of_two_stiffnesses(bilinear: UpdatedModel) -> None:
    first = searched_without_laws(bilinear)
    found = pair(first, bilinear)
    assert found[1].chosen > 2.0
    best, compared = named_anew(first, found)
    dashpot, spring = best[1].terms
    assert (dashpot.candidate.name, spring.candidate.name) == ("viscous_damper", "bilinear_stiffness")
    assert dashpot.values(dashpot.x)[0]["c"] == pytest.approx(DASHPOT, rel=0.1)
    # the laws at its place compare as they do beside the dashpot
    assert compared[0].name == "bilinear_stiffness"
    assert "support_stiffness" in [r.name for r in compared]
    assert compared[0].score == best[0] < min(r.score for r in compared[1:]) - first.settings.gain_cost
    values, k, _ = spring.values(spring.x)
    assert values["k_plus"] + k == pytest.approx(SPRING["k_plus"], rel=0.1)
    assert values["k_minus"] + k == pytest.approx(SPRING["k_minus"], rel=0.1)


def test_a_pair_that_leaves_no_more_than_a_law_has_to_bring_stays(bilinear: UpdatedModel) -> None:
    first = searched_without_laws(bilinear)
    found = pair(first, bilinear)
    near = replace(first, floor=found[0] - first.price * found[1].n_law - 0.5 * first.settings.gain_cost)
    assert named_anew(near, found) == (found, [])


def test_a_spring_that_is_elastic_stays(elastic: UpdatedModel) -> None:
    first = searched_without_laws(elastic)
    found = pair(first, elastic)
    # whatever noise leaves: other laws are tried, and none of them wins
    assert named_anew(replace(first, floor=-np.inf), found) == (found, [])


def test_the_force_of_the_other_law_is_the_one_both_have_together(bilinear: UpdatedModel) -> None:
    first = searched_without_laws(bilinear)
    found = pair(first, bilinear)
    known = force_of_the_other(first, found[1], 1)
    assert known is not None
    (place,), ((k, m),) = known.places, known.attached
    assert place.nodes == (7,)
    assert m == 0.0
    problem = first.problem.thinned(None)
    (histories,) = found[1].loop(problem).histories([(found[1].p, found[1].x)])
    c = found[1].terms[0].values(found[1].terms[0].x)[0]["c"]
    for record, history in zip(problem.records, histories, strict=True):
        # what the spring that is part of the model does not do of the dashpot's force
        force, expected = known.forces[record.name][0][0], k * history.d[0] - c * history.v[0]
        inside = slice(len(force) // 8, -len(force) // 8)
        assert np.linalg.norm((force - expected)[inside]) < 0.2 * np.linalg.norm(expected[inside])
