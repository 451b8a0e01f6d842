"""Of two effects the linear one is named with the force at the other free; a law at another place does what it did."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from femend.diagnose.fitting.runs import windows
from femend.diagnose.locating.dressed import hypothesis_of
from femend.diagnose.locating.locate import Located, squares_of
from femend.diagnose.locating.recovered import ENDS, without_ends
from femend.diagnose.several import one_linear as one_linear_module
from femend.diagnose.several import together
from femend.diagnose.several.moved import moved
from femend.diagnose.several.one_linear import _beside, _least_linear_first, one_linear
from femend.diagnose.several.pairs import Searched, alike
from femend.diagnose.several.read_beside import read_off_beside
from femend.estimate import Problem
from femend.model import Place
from femend.physics import physics
from femend.study.result.study_run import StudyRun

sys.path.insert(0, str(Path(__file__).parents[1]))
from small_study import searched

DASHPOT, CUBIC = 20.0, 2.0e9


@pytest.fixture
def run(dashpot_and_cubic: StudyRun) -> StudyRun:
    return dashpot_and_cubic


@pytest.fixture
def first(run: StudyRun) -> Searched:
    return searched(run.diagnosis)


def at(first: Searched, node: int) -> Place:
    return next(p for p in first.places if p.kind == "ground" and p.nodes == (node,) and p.direction == "Z")


def fitted_at(first: Searched, second: int, other: int) -> Located:
    """Free forces at two nodes."""
    few = first.problem.sparing(400)
    hypothesis = hypothesis_of(at(first, second), first.reduced, (at(first, other),))
    start = (first.located[0].fit.p, np.zeros(0))
    (fit,) = few.fit([hypothesis], [start])
    assert fit is not None
    return Located(at(first, second), fit, squares_of(few, fit, 0.0))


def test_the_linear_law_is_named_beside_a_free_force(first: Searched) -> None:
    second = fitted_at(first, 7, 13)
    one = _beside(first, at(first, 13), at(first, 7), second.fit.p)
    assert one is not None
    assert one.ranked[0].name == "viscous_damper"
    # where the law is not linear, no linear law does as well as a free force
    assert _beside(first, at(first, 7), at(first, 13), second.fit.p) is None


@pytest.mark.parametrize(("second", "other"), [(7, 13), (13, 7)])
def test_the_linear_law_is_looked_for_first_beside_the_force_that_is_not_linear(
    first: Searched, second: int, other: int
) -> None:
    """The dashpot beside the cubic spring's force, whichever of the two places was found first."""
    (free, linear), turned = _least_linear_first(first, fitted_at(first, second, other), at(first, other))
    assert (free.nodes, linear.nodes) == ((13,), (7,))
    assert turned == (linear, free)


def test_what_the_other_place_did_is_read_off_beside_the_law(first: Searched) -> None:
    second = fitted_at(first, 7, 13)
    one = _beside(first, at(first, 13), at(first, 7), second.fit.p)
    assert one is not None
    read = read_off_beside(one.problem, one.ranked[0], one.free.place)
    for d, f in zip(read.d, read.f, strict=True):
        k3 = float((f * d**3).sum() / (d**6).sum())
        assert k3 == pytest.approx(CUBIC, rel=0.25)


def test_a_jump_where_a_record_begins_again_does_not_show(first: Searched, monkeypatch: pytest.MonkeyPatch) -> None:
    """Beside a force that is free on every line decays are told badly: one sample far above all others, of which a
    product with itself would be all that shows."""
    one = _beside(first, at(first, 13), at(first, 7), fitted_at(first, 7, 13).fit.p)
    assert one is not None
    plainly, fitted = read_off_beside(one.problem, one.ranked[0], one.free.place), Problem.fitted_lines
    height = 5 * max(float(np.abs(d).max()) for d in plainly.d)

    def jumping(*given: Any) -> list[Any]:
        return [(y, D + height, F) for y, D, F in fitted(*given)]

    monkeypatch.setattr(Problem, "fitted_lines", jumping)
    read = read_off_beside(one.problem, one.ranked[0], one.free.place)
    for (d,), (right,), D, index in zip(read.d, plainly.d, read.D, read.index, strict=True):
        assert np.abs(d - right).max() < 0.5 * np.abs(right).max()
        np.testing.assert_allclose(D[:, 0], np.fft.rfft(d)[index], atol=1e-9 * np.abs(D).max())


def test_without_its_ends_a_force_still_follows_its_motion_sample_by_sample() -> None:
    n, index = 400, np.arange(10, 60)
    x = np.random.default_rng(3).standard_normal((1, n))
    (history, lines), (force, _) = without_ends(x, index), without_ends(x**3, index)
    inner = slice(ENDS, -ENDS)
    np.testing.assert_array_equal(force[:, inner], history[:, inner] ** 3)
    assert history[0, 0] == history[0, -1] == 0.0
    np.testing.assert_array_equal(lines[:, 0], np.fft.rfft(history[0])[index])
    short = x[:, : 4 * ENDS - 1]
    assert without_ends(short, index[:20])[0] is short


def test_both_are_fitted_together(first: Searched) -> None:
    found = one_linear(first, fitted_at(first, 7, 13), at(first, 13))
    assert found is not None
    terms = found.both[1]
    values = {t.candidate.name: t.candidate.values for t in terms.terms}
    assert values["viscous_damper"]["c"] == pytest.approx(DASHPOT, rel=0.25)
    assert values["cubic_stiffness"]["k3"] == pytest.approx(CUBIC, rel=0.25)
    assert terms.chosen < first.settings.adequate


def test_what_no_simulation_follows_to_the_end_is_compared_in_the_beginning(
    first: Searched, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As of impacts, whose motion depends on its past without limit: laws that explain a window do not the whole."""
    window, fitted = windows(first.problem)[2], together.fitted_together

    def lost(search: Searched, *given: Any, **options: Any) -> Any:
        found = fitted(search, *given, **options)
        if found is None or search.sigma > 0:
            return found
        score, terms = found
        return score + 1e4, replace(terms, chosen=40.0, followed=window)

    monkeypatch.setattr(together, "fitted_together", lost)
    monkeypatch.setattr(one_linear_module, "fitted_together", lost)
    in_windows = replace(first, in_window=lambda sigma: replace(first, sigma=sigma))
    found = one_linear(in_windows, fitted_at(first, 7, 13), at(first, 13))
    assert found is not None
    assert found.first.sigma == found.both[1].sigma == window
    assert found.both[1].chosen < first.settings.adequate
    assert {t.candidate.name for t in found.both[1].terms} == {"viscous_damper", "cubic_stiffness"}


def test_a_law_moved_does_what_it_did(run: StudyRun, first: Searched) -> None:
    """At a place that moves the sensors alike it does the same work."""
    further = run.diagnosis.further
    assert further is not None
    cubic = next(t for t in further.terms.terms if t.candidate.name == "cubic_stiffness")
    place = cubic.place
    assert place is not None
    other = next(p for p in alike(first, place) if p.kind == "ground")
    there = moved(first, cubic, other)
    assert there.place is other
    assert there.located.alike[0] is place
    ratio = (there.candidate.values["k3"] / cubic.candidate.values["k3"]) ** 0.25
    assert 0.3 < ratio < 3.0
    # a force that does the same work: f d = k3 d^4 is kept
    back = moved(first, there, place)
    assert back.candidate.values["k3"] == pytest.approx(cubic.candidate.values["k3"], rel=1e-9)
    np.testing.assert_allclose(back.candidate.x, cubic.candidate.x, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(
    ("law", "values", "grown"),
    [
        ("clearance", {"k": 2.0, "gap": 3.0, "sides": 1.0}, {"k": 8.0, "gap": 1.5, "sides": 1.0}),
        ("coulomb_friction", {"f": 2.0, "kt": 3.0}, {"f": 4.0, "kt": 12.0}),
        ("tuned_absorber", {"m": 1.0, "k": 2.0, "c": 3.0}, {"m": 4.0, "k": 8.0, "c": 12.0}),
        ("quadratic_damping", {"c": 1.0}, {"c": 8.0}),
        (
            "bouc_wen",
            {"k": 1.0, "alpha": 0.5, "n": 2.0, "beta": 3.0, "gamma": 1.0},
            {"k": 4.0, "alpha": 0.5, "n": 2.0, "beta": 12.0, "gamma": 4.0},
        ),
    ],
)
def test_sizes_of_laws_follow_the_motion(law: str, values: dict[str, float], grown: dict[str, float]) -> None:
    from femend.diagnose.several.moved import _power

    entry = physics(law)
    for q in entry.parameters:
        assert values[q.name] * 2.0 ** _power(q, values) == pytest.approx(grown[q.name])
