"""Modes that speak against an update: recordings of two structures, and modes that do not count and are met worse."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from femend import Dof
from femend.bench.updating.contradicting import contradicting
from femend.bench.updating.counted import Counted
from femend.bench.updating.update_advice import passed_over

PHI = np.array([[1.0, 1.0, 0.3], [0.8, -0.6, 1.0], [0.3, 0.9, -0.8]])
FREQ = np.array([12.0, 55.85, 90.0])


def counted(name: str, freq: np.ndarray, nodes: tuple[int, ...] = (1, 2, 3)) -> Counted:
    sd = np.full(3, 0.01)
    dofs = tuple(Dof(n, 3) for n in nodes)
    return Counted(
        name, "as modelled", dofs, (1, 2, 3), freq, sd * freq, sd, sd, PHI, np.full(PHI.shape, 0.02), (name,)
    )


def test_a_mode_at_two_frequencies_is_of_two_structures() -> None:
    other = FREQ * np.array([1.001, 49.66 / 55.85, 1.0])
    (text,) = contradicting([counted("a", FREQ), counted("b", other)])
    assert "'a' and 'b'" in text
    assert "55.85 Hz in the first and at 49.66 Hz in the second (-11.1 %" in text
    assert "[[configuration]]" in text


@pytest.mark.parametrize("scatter", [0.999, 1.015])
def test_scatter_is_none(scatter: float) -> None:
    assert contradicting([counted("a", FREQ), counted("b", scatter * FREQ)]) == []


def test_other_configurations_and_other_sensors_may_differ() -> None:
    loaded = replace(counted("b", 0.8 * FREQ), configuration="loaded")
    assert contradicting([counted("a", FREQ), loaded]) == []
    assert contradicting([counted("a", FREQ), counted("c", 0.8 * FREQ, (7, 8, 9))]) == []


@pytest.mark.parametrize(("after", "told"), [(-0.016, True), (0.004, False), (0.0029, False)])
def test_modes_that_do_not_count_and_are_met_worse_are_told(after: float, told: bool) -> None:
    rows = [
        {"mode": 1, "freq": 12.0, "error_before": 0.001, "error_after": 0.05},
        {"mode": 2, "freq": 55.85, "error_before": 0.003, "error_after": after},
        {"mode": 3, "freq": 90.0, "error_before": 0.02, "error_after": 0.025},
        {"mode": 4, "freq": 99.0, "error_before": None, "error_after": 0.3},  # it had no mate
    ]
    recordings = [
        {"recording": "a", "role": "fit", "modes": rows},
        {"recording": "b", "role": "validate", "modes": rows},
    ]
    said = passed_over([counted("a", FREQ).select([0])], recordings)
    assert (said != []) is told
    if told:
        assert "mode 2 of 'a' at 55.85 Hz (0.3 % off, now 1.6 %)" in said[0]
