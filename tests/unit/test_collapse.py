"""Laws that do what a simpler one does are told by its name."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from femend.diagnose.fitting.candidates import Candidate
from femend.diagnose.fitting.collapse import collapsed
from femend.diagnose.fitting.terms import Term
from femend.diagnose.settings import Settings
from femend.diagnose.several import together
from femend.physics import FitCoordinates, physics

EMPTY = np.zeros(0)


def stop(gap: float, sides: float) -> Candidate:
    """A stop of 3e4 N/m beside a spring of 2e3 N/m."""
    coordinates = FitCoordinates(physics("clearance"), {"k": 3e4, "gap": gap, "sides": sides})
    x = np.concatenate([coordinates.start(), [2.0, 0.5]])
    return Candidate(
        physics("clearance"), "clearance", None, dict(coordinates.values), EMPTY, x, len(x), 0.0, 1.0, 1.0, 2e3, 0.5,
        coordinates=coordinates, extra={"k_scale": 1e3, "c_scale": 1.0},
    )  # fmt: skip


@pytest.mark.parametrize(("sides", "sprung", "other"), [(1.0, "k_plus", "k_minus"), (-1.0, "k_minus", "k_plus")])
def test_a_stop_without_a_gap_is_a_stiffness_of_two_sides(sides: float, sprung: str, other: str) -> None:
    recovered: Any = SimpleNamespace(d=[np.array([1e-3, -2e-3])])
    told = collapsed(stop(1e-7, sides), recovered, Settings())
    assert told.name == "bilinear_stiffness"
    assert told.values == pytest.approx({sprung: 3e4, other: 0.0}, abs=1e-9)
    assert (told.k, told.c) == (2e3, 0.5)
    np.testing.assert_allclose(told.x[-2:], [2.0, 0.5])
    assert told.coordinates is not None
    assert len(told.x) == len(told.coordinates.free) + 2


def test_a_stop_with_a_gap_stays_one() -> None:
    recovered: Any = SimpleNamespace(d=[np.array([1e-3, -2e-3])])
    assert collapsed(stop(1e-4, 1.0), recovered, Settings()).name == "clearance"
    assert collapsed(stop(1e-7, 2.0), recovered, Settings()).name == "clearance"


@pytest.mark.parametrize(("score", "name"), [(11.0, "bilinear_stiffness"), (60.0, "clearance")])
def test_of_two_laws_a_stop_has_its_gap_where_that_is_for_something(
    monkeypatch: pytest.MonkeyPatch, score: float, name: str
) -> None:
    """Fitted together with the other law, a bilinear stiffness leaves as much as one without, or more."""

    def fitted(first: object, terms: list[Any], p: object) -> Any:
        return score, SimpleNamespace(terms=tuple(terms), p=p)

    monkeypatch.setattr(together, "fitted_together", fitted)
    law = Term(stop(2.4e-9, 1.0), cast(Any, None))
    other = Term(loop(1.5, 3e7, 2e7), cast(Any, None))
    found = 10.0, SimpleNamespace(terms=(law, other), p=EMPTY)
    told = together.told_plainly(cast(Any, None), cast(Any, found))
    assert [t.candidate.name for t in told[1].terms] == [name, "bouc_wen"]


def loop(n: float, beta: float, gamma: float) -> Candidate:
    """A Bouc-Wen loop of 5e5 N/m."""
    values = {"k": 5e5, "alpha": 0.0, "n": n, "beta": beta, "gamma": gamma}
    coordinates = FitCoordinates(physics("bouc_wen"), values)
    x = np.concatenate([coordinates.start(), [0.0, 0.0]])
    return Candidate(
        physics("bouc_wen"), "bouc_wen", None, values, EMPTY, x, len(x), 0.0, 1.0, 1.0,
        coordinates=coordinates, extra={"k_scale": 1e3, "c_scale": 1.0},
    )  # fmt: skip


def test_a_loop_whose_knee_cannot_be_seen_is_friction() -> None:
    recovered: Any = SimpleNamespace(d=[np.array([1e-4, -1e-4])])
    told = collapsed(loop(1.0, 3.9e7, -3.7e7), recovered, Settings())
    assert told.name == "coulomb_friction"
    assert told.values == pytest.approx({"f": 0.25, "kt": 5e5})
    # the same loop where the motion is as small as its yield displacement of 0.5 micrometres
    small: Any = SimpleNamespace(d=[np.array([1e-6, -1e-6])])
    assert collapsed(loop(1.0, 3.9e7, -3.7e7), small, Settings()).name == "bouc_wen"
