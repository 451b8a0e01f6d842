"""A law that came out next to its place is moved to it; one that leaves what a free force does stays."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from femend.diagnose.fitting.nonlinear import judge_nonlinear, refit_nonlinear
from femend.diagnose.fitting.pace import OUTDONE
from femend.diagnose.fitting.terms import Term
from femend.diagnose.several import best_place
from femend.diagnose.several.best_place import at_the_best_place
from femend.diagnose.several.moved import moved
from femend.diagnose.several.pairs import alike
from femend.diagnose.several.together import Scored, fitted_together
from femend.model import Place
from femend.study.result.study_run import StudyRun

sys.path.insert(0, str(Path(__file__).parents[1]))
from small_study import Truth, diagnosed, searched

# strong, and not so strong that the motion hangs on roundings: of 4e8 a ten-thousandth of E changes the end by a half
CUBIC = 1e8


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> StudyRun:
    """A strong cubic spring, named at its place."""
    found = diagnosed(
        tmp_path_factory.mktemp("place"), Truth((7.3e10, 6.8e10), laws=[(13, "cubic_stiffness", {"k3": CUBIC})])
    )
    d = found.diagnosis
    assert d.best is not None
    assert d.place is not None
    assert (d.best.name, d.place.place.nodes) == ("cubic_stiffness", (13,))
    return found


def test_a_law_beside_its_place_is_moved_to_it(run: StudyRun) -> None:
    d = run.diagnosis
    first = replace(searched(d), sigma=d.sigma)
    assert d.best is not None
    assert d.place is not None
    assert d.place.place.nodes == (13,)
    same, there = at_the_best_place(first, d.best, d.place)
    assert same is d.best
    assert there is d.place
    beside = next(p for p in alike(first, d.place.place) if p.kind == "ground" and p.nodes in ((12,), (14,)))
    wrong = moved(first, Term(d.best, d.place), beside)
    fitted = refit_nonlinear(d.problem.thinned(600), wrong.candidate)
    fitted = replace(judge_nonlinear(d.split.choosing, fitted), reference=d.best.reference)
    assert fitted.fitted > 1.3 * d.best.fitted
    law, back = at_the_best_place(first, fitted, wrong.located)
    assert back.place.nodes == (13,)
    assert law.fitted < 0.1 * fitted.fitted
    assert law.values["k3"] == pytest.approx(d.best.values["k3"], rel=0.1)


def test_places_left_behind_in_the_beginning_are_not_followed(run: StudyRun, monkeypatch: pytest.MonkeyPatch) -> None:
    """What a law leaves of the beginnings at a wrong place, where a fit is quick, is told there: no whole fit is made
    of it."""
    d = run.diagnosis
    first = replace(searched(d), sigma=0.0)
    assert d.best is not None
    assert d.place is not None
    term = Term(d.best, d.place)
    near = next(p for p in alike(first, d.place.place) if p.kind == "ground" and p.nodes == (12,))
    far = next(p for p in first.places if p.kind == "ground" and p.nodes == (5,) and p.direction == "Z")
    left = {p.nodes: best_place._in_the_beginning(first, [moved(first, term, p)], d.best.p) for p in (near, far)}
    own = best_place._in_the_beginning(first, [term], d.best.p)
    assert own < 1.5
    assert left[far.nodes] > OUTDONE * max(own, 1.0)
    tried: list[tuple[int, ...]] = []

    def fitted(searched: object, terms: Sequence[Term], p: object) -> None:
        tried.append(terms[0].located.place.nodes)

    monkeypatch.setattr(best_place, "_worth_trying", lambda searched, place: [near, far])
    monkeypatch.setattr(best_place, "fitted_together", fitted)
    found = (1.0, SimpleNamespace(terms=(term,), p=d.best.p, fitted=1.0))
    assert best_place.at_the_best_places(first, cast(Any, found)) is cast(Any, found)
    assert far.nodes not in tried
    assert (near.nodes in tried) == (left[near.nodes] <= OUTDONE * max(own, 1.0))


@pytest.mark.slow
def test_two_laws_on_the_wrong_sides_of_each_other_are_moved_to_their_nodes(
    dashpot_and_cubic: StudyRun, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One of them alone leaves less elsewhere, and then the other."""
    monkeypatch.setattr(best_place, "NEARBY", 4)
    d = dashpot_and_cubic.diagnosis
    first = searched(d)
    assert d.further is not None

    def at(node: int) -> Place:
        return next(p for p in first.places if p.kind == "ground" and p.nodes == (node,) and p.direction == "Z")

    def fitted(nodes: dict[str, int]) -> Scored:
        assert d.further is not None
        terms = [moved(first, t, at(nodes[t.candidate.name])) for t in d.further.terms.terms]
        found = fitted_together(first, terms, d.further.terms.p)
        assert found is not None
        return found

    right = {"viscous_damper": 7, "cubic_stiffness": 13}
    away = fitted({"viscous_damper": 5, "cubic_stiffness": 12})
    assert away[0] > fitted(right)[0] + 10 * first.settings.margin
    back = best_place._at_nearby_nodes(first, away)
    assert {t.candidate.name: t.located.place.nodes for t in back[1].terms} == {k: (n,) for k, n in right.items()}
    # at noise they stay, wherever that is
    told = fitted(right)
    assert best_place._at_nearby_nodes(first, told) is told
