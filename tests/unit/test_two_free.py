"""Two nonlinear effects of which neither is found beside the other are read off at once, with both forces free."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from femend.diagnose.fitting.descent import Descent
from femend.diagnose.locating.dressed import hypothesis_of
from femend.diagnose.locating.joint import open_joints
from femend.diagnose.locating.locate import Located, squares_of
from femend.diagnose.several.pairs import Searched
from femend.diagnose.several.read_beside import read_off_both
from femend.diagnose.several.together import told_plainly
from femend.diagnose.several.two_free import two_free
from femend.model import Place

sys.path.insert(0, str(Path(__file__).parents[1]))
from small_study import Truth, searched_without_laws, updated

FRICTION, STICKING, CUBIC = 4.0, 1.0e5, 2.0e9


@pytest.fixture(scope="module")
def first(tmp_path_factory: pytest.TempPathFactory) -> Searched:
    """Friction of 4 N behind 1e5 N/m at node 7 and a cubic spring of 2e9 N/m^3 at node 13."""
    laws = [(7, "coulomb_friction", {"f": FRICTION, "kt": STICKING}), (13, "cubic_stiffness", {"k3": CUBIC})]
    return searched_without_laws(updated(tmp_path_factory.mktemp("both"), Truth((7.3e10, 6.8e10), laws=laws)))


def at(first: Searched, node: int) -> Place:
    return next(p for p in first.places if p.kind == "ground" and p.nodes == (node,) and p.direction == "Z")


def fitted_at(first: Searched, node: int, other: int) -> Located:
    """A node with the fit of a free force there and at another one."""
    few = first.problem.sparing(400)
    hypothesis = hypothesis_of(at(first, node), first.reduced, (at(first, other),))
    (fit,) = few.fit([hypothesis], [(few.prior(first.reduced)[0], np.zeros(0))])
    assert fit is not None
    return Located(at(first, node), fit, squares_of(few, fit, 0.0))


@pytest.fixture(scope="module")
def second(first: Searched) -> Located:
    """Node 13 with the fit of a free force there and at node 7."""
    return fitted_at(first, 13, 7)


def test_what_both_places_did_is_read_off_with_both_forces_free(first: Searched, second: Located) -> None:
    problem = first.split.reading
    joint = open_joints([at(first, 13), at(first, 7)], first.reduced, first.problem.band[1], first.g_rows)
    (fit,) = problem.fit([joint.hypothesis(None)], [(second.fit.p, np.zeros(0))], iterations=15)
    assert fit is not None
    cubic, slider = read_off_both(problem, joint, fit)
    assert len(cubic.d) == len(slider.d) == len(problem.records)
    # the recording with most of it: a force that grows with the third power, and one that is held back by a slider
    d, f = max(zip(cubic.d, cubic.f, strict=True), key=lambda history: float(np.abs(history[0]).max()))
    assert float((f * d**3).sum() / (d**6).sum()) == pytest.approx(CUBIC, rel=0.3)
    assert max(float(np.quantile(np.abs(f), 0.9)) for f in slider.f) == pytest.approx(FRICTION, rel=0.25)


def test_both_laws_are_named_with_their_sizes(first: Searched, second: Located) -> None:
    found = two_free(first, second, at(first, 7))
    assert found is not None
    values = {t.located.place.nodes: (t.candidate.name, t.candidate.values) for t in found[1].terms}
    (name, sizes), (other, of_other) = values[(13,)], values[(7,)]
    assert (name, other) == ("cubic_stiffness", "coulomb_friction")
    assert sizes["k3"] == pytest.approx(CUBIC, rel=0.1)
    assert of_other["f"] == pytest.approx(FRICTION, rel=0.1)
    assert of_other["kt"] == pytest.approx(STICKING, rel=0.2)
    assert found[1].chosen < first.settings.adequate


def test_members_are_left_to_other_searches(first: Searched, second: Located) -> None:
    member = next(p for p in first.places if p.part)
    assert two_free(first, second, member) is None
    assert two_free(first, replace(second, place=member), at(first, 7)) is None


def test_two_linear_laws_are_fitted_at_their_nodes_without_a_simulation(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From a force free at a node beside that of one of them."""
    laws = [(7, "viscous_damper", {"c": 20.0}), (13, "support_stiffness", {"k": 4.0e4})]
    first = searched_without_laws(updated(tmp_path, Truth((7.3e10, 6.8e10), laws=laws)))

    def never(*given: object) -> None:
        raise AssertionError("a law was simulated")

    monkeypatch.setattr(Descent, "run", never)
    found = two_free(first, fitted_at(first, 12, 7), at(first, 7))
    assert found is not None
    plain = told_plainly(first, found)
    told = {t.located.place.nodes: (t.candidate.name, t.candidate.values) for t in plain[1].terms}
    assert told[(13,)][0] == "support_stiffness"
    assert told[(13,)][1]["k"] == pytest.approx(4.0e4, rel=0.1)
    assert told[(7,)][0] == "viscous_damper"
    assert told[(7,)][1]["c"] == pytest.approx(20.0, rel=0.1)
