"""Describing functions against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from femend.errors import LawParameterError
from femend.physics import physics
from femend.physics.harmonic import describing_function

A, OMEGA = np.array([0.5, 1.0, 2.5]), 7.0


@pytest.mark.parametrize(
    ("law", "values", "expected"),
    [
        ("cubic_stiffness", {"k3": 4.0}, 0.75 * 4.0 * A**2 + 0j),
        ("quadratic_stiffness", {"k2": 4.0}, 0 * A + 0j),
        ("viscous_damper", {"c": 3.0}, 0 * A + 3.0j * OMEGA),
        # Gelb and Vander Velde 1968, table of describing functions: square-law damping
        ("quadratic_damping", {"c": 3.0}, 8 / (3 * np.pi) * 3.0j * OMEGA**2 * A),
        ("bilinear_stiffness", {"k_plus": 6.0, "k_minus": 2.0}, 0 * A + 4.0 + 0j),
    ],
)
def test_smooth_laws(law: str, values: dict[str, float], expected: np.ndarray) -> None:
    found = describing_function(physics(law), values, A, OMEGA)
    # 256 samples of a cycle: kinks cost 1e-4
    assert found == pytest.approx(expected, abs=2e-4 * max(1.0, float(np.abs(expected).max())))


def test_dead_zone_and_dry_friction() -> None:
    amplitude, gap = np.array([0.4, 0.8, 2.0]), 0.5
    share = np.clip(gap / amplitude, 0, 1)
    dead = 10 * (1 - 2 / np.pi * (np.arcsin(share) + share * np.sqrt(1 - share**2)))
    found = describing_function(physics("clearance"), {"k": 10.0, "gap": gap, "sides": 2.0}, amplitude, OMEGA)
    assert found == pytest.approx(dead + 0j, abs=5e-3)
    # all but rigid before it slips: the work of a cycle is 4 f A
    slip = describing_function(physics("coulomb_friction"), {"f": 2.0, "kt": 1e4}, amplitude, OMEGA)
    assert slip.imag == pytest.approx(4 * 2.0 / (np.pi * amplitude), rel=0.01)


def test_misuse_is_refused() -> None:
    with pytest.raises(LawParameterError, match="must be positive"):
        describing_function(physics("cubic_stiffness"), {"k3": 1.0}, [0.0, 1.0], OMEGA)
