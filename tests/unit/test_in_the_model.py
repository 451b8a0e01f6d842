"""A mass or spring beside another law is a part of the model where that leaves less."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from femend.diagnose.locating.dressed import with_own
from femend.diagnose.several.in_the_model import in_the_model
from femend.diagnose.several.pairs import Searched
from femend.diagnose.several.together import Scored
from femend.diagnose.updating.update import UpdatedModel

sys.path.insert(0, str(Path(__file__).parents[1]))
from small_study import Truth, laws_together, searched_without_laws, updated

DASHPOT, MASS, SPRING = 20.0, 0.3, 4.0e4


@pytest.fixture(scope="module")
def loaded(tmp_path_factory: pytest.TempPathFactory) -> UpdatedModel:
    """A beam with a lump that is not in its model, whose modes are damped as they are with it, beside a dashpot."""
    laws = [(7, "viscous_damper", {"c": DASHPOT})]
    return updated(tmp_path_factory.mktemp("loaded"), Truth((7.3e10, 6.8e10), (f"CONM2,900,13,,{MASS}",), laws=laws))


def pair(first: Searched, start: UpdatedModel, other: str, size: float) -> Scored:
    """A dashpot at node 7 and another law at node 13, fitted together."""
    return laws_together(first, start, ("viscous_damper", 7, DASHPOT), (other, 13, size))


def test_a_mass_beside_a_dashpot_makes_modes_of_its_own(loaded: UpdatedModel) -> None:
    first = searched_without_laws(loaded)
    found = pair(first, loaded, "added_mass", MASS)
    best = in_the_model(first, found)
    assert best[0] < found[0] - first.settings.gain_cost
    assert best[1].n_law == found[1].n_law
    dashpot, mass = best[1].terms
    assert (dashpot.member, mass.member) == (False, True)
    assert mass.candidate.name == "added_mass"
    assert mass.candidate.values["m"] == pytest.approx(MASS, rel=0.03)
    assert dashpot.values(dashpot.x)[0]["c"] == pytest.approx(DASHPOT, rel=0.1)
    # what is known of it is that of the logarithm of its mass
    assert mass.candidate.covariance is None or np.sqrt(mass.candidate.covariance[0, 0]) < 0.1


def test_two_laws_that_leave_no_more_than_a_law_has_to_bring_stay(loaded: UpdatedModel) -> None:
    first = searched_without_laws(loaded)
    found = pair(first, loaded, "added_mass", MASS)
    near = replace(first, floor=found[0] - first.price * found[1].n_law - 0.5 * first.settings.gain_cost)
    assert in_the_model(near, found) is found


def test_laws_that_are_no_springs_or_masses_stay(loaded: UpdatedModel) -> None:
    first = searched_without_laws(loaded)
    found = pair(first, loaded, "viscous_damper", DASHPOT)
    assert in_the_model(first, found) is found


def test_a_place_says_what_it_adds_to_the_model(loaded: UpdatedModel) -> None:
    first = searched_without_laws(loaded)
    for part, key, size in (("mass", "m", MASS), ("spring", "k", SPRING)):
        at = next(p for p in first.places if p.kind == "ground" and p.nodes == (13,) and p.direction == "Z")
        own = replace(at, **{part: size})
        assert (own.n_own, own.part, own.inside) == (1, True, True)
        assert own.values(np.log([1.5])) == {key: pytest.approx(1.5 * size)}
        assert own.logarithms({key: 1.5 * size}) == pytest.approx(np.log([1.5]))
        model = with_own(own, first.reduced)
        B = own.w(first.reduced.V, first.reduced.V_a)
        term = model.terms[-1]
        added = term.M if part == "mass" else term.K
        assert added is not None
        np.testing.assert_allclose(added, size * B.T @ B)
        assert (term.K is None) == (part == "mass")
        assert model.names[-1] == part
