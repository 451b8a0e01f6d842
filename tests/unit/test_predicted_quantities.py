"""Held-out recordings of velocity and displacement are compared as accelerations, as those of the fit are."""

import numpy as np
import pytest

from femend import Dof
from femend.data import Channel, Recording, TimeData
from femend.study.predictions import _recorded

N, DT, OMEGA = 400, 0.005, 2 * np.pi * 5.0
UNITS = {"acceleration": "m/s^2", "velocity": "m/s", "displacement": "m", "force": "N"}


def recording(*quantities: str) -> Recording:
    """Sensors at nodes 1, 2, ... that all show one whole number of periods of the same acceleration."""
    t = DT * np.arange(N)
    signals = {
        "acceleration": np.sin(OMEGA * t),
        "velocity": -np.cos(OMEGA * t) / OMEGA,
        "displacement": -np.sin(OMEGA * t) / OMEGA**2,
        "force": np.ones(N),
    }
    channels = tuple(Channel(Dof(i + 1, 3), q, UNITS[q]) for i, q in enumerate(quantities))
    return Recording("a", TimeData("a", DT, np.array([signals[q] for q in quantities]), channels))


def sensors(*nodes: int) -> tuple[Channel, ...]:
    return tuple(Channel(Dof(n, 3), "acceleration", "m/s^2") for n in nodes)


@pytest.mark.parametrize("quantity", ["acceleration", "velocity", "displacement"])
def test_a_sensor_of_any_motion_is_compared(quantity: str) -> None:
    y = _recorded(recording("velocity", quantity, "force"), sensors(2))
    assert y is not None
    np.testing.assert_allclose(y[0], np.sin(OMEGA * DT * np.arange(N)), atol=1e-10)


def test_what_has_no_sensor_is_not_compared() -> None:
    assert _recorded(recording("velocity", "force"), sensors(1, 3)) is None
    assert _recorded(recording("force"), sensors(1)) is None
