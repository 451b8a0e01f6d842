"""Two linear laws are moved to the nodes, and take the forms, with which both leave least."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from femend.diagnose.fitting.candidates import Candidate
from femend.diagnose.fitting.terms import Term
from femend.diagnose.locating.joint import open_joint
from femend.diagnose.locating.locate import Located
from femend.diagnose.several.linear_pair import where_both_explain_more
from femend.diagnose.several.pairs import Searched
from femend.diagnose.several.together import Scored, fitted_together
from femend.diagnose.updating.update import UpdatedModel
from femend.physics import physics
from femend.physics.causal import springpot

sys.path.insert(0, str(Path(__file__).parents[1]))
from small_study import Truth, searched_without_laws, updated

ABSORBER = {"m": 0.08, "k": 0.08 * (2 * np.pi * 70.0) ** 2, "c": 2 * 0.03 * 0.08 * 2 * np.pi * 70.0}
DAMPING = springpot(8e3, 0.4, 2 * np.pi * 35.0)


@pytest.fixture(scope="module")
def start(tmp_path_factory: pytest.TempPathFactory) -> UpdatedModel:
    laws = [(6, "tuned_absorber", ABSORBER), (10, "springpot", DAMPING)]
    return updated(tmp_path_factory.mktemp("pair"), Truth((7.3e10, 6.8e10), laws=laws))


def linear(first: Searched, start: UpdatedModel, law: str, node: int, values: dict[str, float]) -> Term:
    """A linear law at a node in Z, beginning with `values`."""
    place = next(p for p in first.places if p.kind == "ground" and p.nodes == (node,) and p.direction == "Z")
    joint = open_joint(place, first.reduced, first.problem.band[1], first.g_rows)
    x = np.log(list(values.values()))
    candidate = Candidate(physics(law), law, joint, values, start.null.p, x, len(x), 0.0, 1.0, 1.0)
    return Term(candidate, Located(place, start.null, 0.0))


def pair(first: Searched, *terms: Term) -> Scored:
    found = fitted_together(first, terms, terms[0].candidate.p)
    assert found is not None
    return found


def test_an_absorber_and_what_it_bent_come_to_where_and_what_they_are(start: UpdatedModel) -> None:
    """It was found heavier at a node that moves less, beside a law of another form."""
    first = searched_without_laws(start)
    heavy = {name: 4 * value for name, value in ABSORBER.items()}
    absorber = linear(first, start, "tuned_absorber", 4, heavy)
    found = pair(first, absorber, linear(first, start, "viscoelastic", 10, {"k0": 4e3, "k1": 6e3, "tau": 5e-3}))
    better = where_both_explain_more(first, found)
    assert better[0] < found[0] - first.settings.margin
    at = {t.candidate.name: t for t in better[1].terms}
    assert {name: t.located.place.nodes for name, t in at.items()} == {
        "tuned_absorber": (6,),
        "structural_damping": (10,),
    }
    assert at["tuned_absorber"].candidate.values["m"] == pytest.approx(ABSORBER["m"], rel=0.1)
    # there they stay
    assert where_both_explain_more(first, better) is better
    # what leaves hardly more than noise is left alone: nothing leaves clearly less
    near = replace(first, floor=found[0] - first.price * found[1].n_law)
    assert where_both_explain_more(near, found) is found


def test_laws_at_one_place_and_nonlinear_ones_stay(start: UpdatedModel) -> None:
    first = searched_without_laws(start)
    one = linear(first, start, "tuned_absorber", 6, ABSORBER)
    found = pair(first, one, replace(linear(first, start, "viscous_damper", 10, {"c": 5.0}), located=one.located))
    here = replace(found[1].terms[1], candidate=replace(found[1].terms[1].candidate, joint=one.candidate.joint))
    same = replace(found[1], terms=(found[1].terms[0], here))
    kept = (found[0], same)
    assert where_both_explain_more(first, kept) is kept
    cubic = replace(here.candidate, physics=physics("cubic_stiffness"))
    kept = (found[0], replace(found[1], terms=(found[1].terms[0], replace(here, candidate=cubic))))
    assert where_both_explain_more(first, kept) is kept
