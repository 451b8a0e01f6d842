"""How far a law's sizes differ over places that the recordings do not tell apart."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from femend.physics import physics
from femend.study.result.findings import OPEN_PLACE, _law_parameters
from femend.study.result.open_place import answers_elsewhere, over_places
from femend.study.result.study_run import StudyRun


def test_a_place_that_answers_twice_as_far_asks_for_a_quarter_of_the_stiffness() -> None:
    answers = np.array([2.0])
    one_in_two = np.log(2.0) / np.sqrt(2.0)
    exponents = {
        "support_stiffness": {"k": 2}, "added_mass": {"m": 2}, "clearance": {"k": 2, "gap": 1},
        "cubic_stiffness": {"k3": 4}, "viscoelastic": {"k0": 2, "tau": 0}, "coulomb_friction": {"f": 1},
    }  # fmt: skip
    for law, of in exponents.items():
        told = {p.name: over_places(p, answers) for p in physics(law).parameters}
        for name, times in of.items():
            assert told[name] == pytest.approx(times * one_in_two), (law, name)
        assert over_places(physics(law).parameters[0], np.zeros(0)) == 0.0


def test_answers_are_those_of_the_sensors(dashpot_and_cubic: StudyRun) -> None:
    found = dashpot_and_cubic.diagnosis
    assert found.further is not None
    place = found.further.terms.terms[0].located.place
    longer = replace(place, g_values=tuple(3.0 * v for v in place.g_values))
    assert answers_elsewhere(found, place, [place, longer]) == pytest.approx([1.0, 3.0])
    assert len(answers_elsewhere(found, place, [])) == 0
    several = replace(place, g_rows=place.g_rows * 2, g_values=place.g_values * 2)
    assert len(answers_elsewhere(found, several, [place])) == 0


def test_deviations_are_no_less_than_the_places_are_apart(dashpot_and_cubic: StudyRun) -> None:
    """An absorber of a solid was told with 84 ± 25 g near the clamp, where 16 g stood at its tip."""
    found = dashpot_and_cubic.diagnosis
    assert found.further is not None
    law = next(t.candidate for t in found.further.terms.terms if t.candidate.nonlinear)

    def relative(answers: np.ndarray | None) -> float:
        (k3,) = [v for name, v in _law_parameters(found, law, answers).items() if name == "k3"]
        return float(abs(k3["sd"] / k3["value"]))

    sure, near, far = relative(None), relative(np.array([1.0])), relative(np.array([2.0]))
    assert sure < OPEN_PLACE <= near < 0.4
    assert far == pytest.approx(np.hypot(4 * np.log(2.0) / np.sqrt(2.0), np.sqrt(near**2 - OPEN_PLACE**2)), rel=0.02)
