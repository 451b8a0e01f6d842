"""Orders of a run beside that of its unbalance are told and taken off before it is fitted; nothing else is."""

from __future__ import annotations

import numpy as np
import pytest

from femend import Channel, Dof, TimeData
from femend.data import Recording, Rotating, Test
from femend.diagnose.staged import staged_data
from femend.diagnose.staged.other_orders import without_other_orders
from femend.diagnose.staged.prepare import RunData, run_data

RATE, SECONDS = 256.0, 40.0
LOW, HIGH = 3.0, 24.0


def recording(first: float, second: float, noise: float = 0.0) -> Recording:
    """A run-up, two sensors that show order 1 and order 2 in these amplitudes, each about a resonance of 11 Hz."""
    t = np.arange(int(RATE * SECONDS)) / RATE
    turns = LOW * t + 0.5 * (HIGH - LOW) / SECONDS * t**2
    speed = LOW + (HIGH - LOW) / SECONDS * t

    def shown(order: float) -> np.ndarray:
        return np.real(np.exp(2j * np.pi * order * turns) / (1 - (order * speed / 11.0) ** 2 + 0.06j))

    rng = np.random.default_rng(3)
    moved = np.array([1.0, 0.6])[:, None] * first * shown(1.0) + np.array([0.4, 1.0])[:, None] * second * shown(2.0)
    moved = moved + noise * rng.standard_normal(moved.shape)
    channels = [Channel(None, "tacho", "V", "tacho")]
    channels += [Channel(Dof(n, 2), "acceleration", "m/s^2") for n in (1, 2)]
    data = TimeData("run", 1 / RATE, [np.where(turns % 1 < 0.2, 5.0, 0.0), *moved], channels)
    return Recording("run", data, excitation="rotating", rotating=Rotating("tacho", (7,), "X", 1))


def run(first: float, second: float, noise: float = 0.0) -> RunData:
    return run_data(recording(first, second, noise))


def counted(data: RunData) -> np.ndarray:
    """Samples away from the ends, where no run counts."""
    return data.y[:, data.slips == 1.0]


def test_order_two_is_taken_off_and_order_one_stays() -> None:
    data, alone = run(1.0, 0.4), run(1.0, 0.0)
    found, said = without_other_orders(data)
    before, after = (
        np.linalg.norm(counted(d) - counted(alone)) / np.linalg.norm(counted(alone)) for d in (data, found)
    )
    assert before > 0.25
    assert after < 0.05
    assert "% of its power at order 2 of the speed, which unbalance does not drive" in said
    # what the form of a model leaves goes with what is left of the channels
    assert found.envelope.mean() < data.envelope.mean()


@pytest.mark.parametrize("noise", [0.0, 0.05, 1.5])
def test_a_run_of_order_one_is_left_as_it_is(noise: float) -> None:
    """With noise of half of its power, too: what is tracked there stands half an order beside as well."""
    data = run(1.0, 0.0, noise)
    assert without_other_orders(data) == (data, "")


def test_pulses_counted_wrongly_are_not_taken_for_another_order() -> None:
    """All at order 2 of the tacho's speed: the warning of the pulses is what helps, and its power stays."""
    data = run(0.0, 1.0)
    assert without_other_orders(data) == (data, "")


def test_the_stages_fit_what_is_left_and_tell_it() -> None:
    data = staged_data(Test((recording(1.0, 0.4),)))
    ((own,),) = data.runs.values()
    assert np.linalg.norm(counted(own)) < 0.98 * np.linalg.norm(counted(run(1.0, 0.4)))
    assert any("at order 2 of the speed" in text for text in data.warnings)
