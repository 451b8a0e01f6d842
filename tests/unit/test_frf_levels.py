"""FRFs that depend on the level are told: no linear model follows both."""

from __future__ import annotations

import numpy as np
import pytest

from femend.data import FRF, Channel, Recording, Test
from femend.dof import Dof
from femend.study.doubts.frf_levels import frf_levels

FREQ = np.arange(200) * 0.1


def frf(name: str, f: float, zeta: float = 0.01, inputs: str = "1:+Z", seed: int = 0) -> Recording:
    """Accelerances of one mode at two sensors with half a per cent of noise."""
    w, w0 = 2 * np.pi * FREQ, 2 * np.pi * f
    h = -(w**2) / (w0**2 - w**2 + 2j * zeta * w0 * w)
    H = np.stack([h, 0.5 * h], axis=1)[:, :, None]
    draw = np.random.default_rng(seed).standard_normal((2, *H.shape))
    H = H + 0.005 * np.sqrt((np.abs(H) ** 2).mean()) * (draw[0] + 1j * draw[1])
    sensors = tuple(Channel(Dof.parse(d), "acceleration", "m/s^2") for d in ("1:+Z", "2:+Z"))
    force = (Channel(Dof.parse(inputs), "force", "N"),)
    return Recording(name, FRF(name, FREQ, H, sensors, force, "accelerance", "m/s^2/N"))


def test_a_resonance_that_moves_with_the_level_is_told() -> None:
    (said,) = frf_levels(Test((frf("low", 10.0), frf("high", 9.7, seed=1))))
    assert "'low' and 'high' differ by" in said
    assert "at 10 Hz in the one and at 9.7 Hz in the other" in said
    assert "record force and responses in time at both levels" in said


@pytest.mark.parametrize("other", [frf("again", 10.0, seed=1), frf("elsewhere", 9.0, inputs="2:+Z", seed=1)])
def test_nothing_is_said_of_a_repetition_or_of_other_inputs(other: Recording) -> None:
    assert frf_levels(Test((frf("low", 10.0), other))) == []
