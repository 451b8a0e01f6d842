"""A sensor that stands elsewhere than it is said to moves unlike the model there, and like it at its own place."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from femend import Dof, TimeData, functions_of, read_recording, write_uff
from femend.correlate.exchanged import Shapes
from femend.correlate.misplaced import misplaced
from femend.study.result.study_run import StudyRun
from femend.study.run import diagnose

sys.path.insert(0, str(Path(__file__).parents[1]))
from small_study import LEVELS, NOISE, Truth, write_study

Array = NDArray[np.float64]
MODES = np.arange(1, 7)
FREQ = np.linspace(5.0, 400.0, 600)
X = np.array([0.12, 0.31, 0.45, 0.58, 0.66, 0.77, 0.87])
PLACES = np.linspace(0.05, 0.95, 19)


def shapes(x: Array) -> Array:
    """Modes (n, 6) of a string at `x`."""
    return np.sin(np.pi * np.outer(x, MODES))


def model(x: Array) -> Shapes:
    return Shapes(10.0 * MODES**1.7, np.full(MODES.size, 0.01), shapes(x), shapes(np.array([0.23])))


def measured(x: Array, off: float = 0.0) -> tuple[np.ndarray, Array]:
    """Accelerances (n_freq, n, 1) of a string whose frequencies are `off`, and their noise."""
    at = model(x)
    w, W = 2 * np.pi * FREQ[:, None], 2 * np.pi * at.freq * (1 + off * np.cos(MODES))
    g = -(w**2) / (W**2 - w**2 + 0.02j * W * w)
    H = np.einsum("om,fm,im->foi", at.out, g, at.into)
    noise = np.full(H.shape, 0.01 * np.abs(H).mean())
    rng = np.random.default_rng(3)
    return H + noise * (rng.standard_normal(H.shape) + 1j * rng.standard_normal(H.shape)), noise


def allowed(n: int) -> NDArray[np.bool_]:
    return np.ones((n, PLACES.size), dtype=bool)


@pytest.mark.parametrize("off", [0.0, 0.08])
def test_sensors_that_stand_where_they_are_said_to_are_not_told(off: float) -> None:
    H, noise = measured(X, off)
    assert misplaced(H, noise, FREQ, model(X), shapes(PLACES), allowed(7)) == []


@pytest.mark.parametrize("off", [0.0, 0.08])
def test_a_sensor_that_stands_elsewhere_is_told_with_its_place(off: float) -> None:
    H, noise = measured(X, off)
    said = X.copy()
    said[2] = 0.93  # it stands at 0.45
    (found,) = misplaced(H, noise, FREQ, model(said), shapes(PLACES), allowed(7))
    assert found.sensor == 2
    assert PLACES[found.place] == pytest.approx(0.45)
    assert found.left < 0.6
    # nothing is told where it cannot be, nor of so few that any may be
    no = allowed(7)
    no[2] = False
    assert all(one.sensor != 2 for one in misplaced(H, noise, FREQ, model(said), shapes(PLACES), no))
    few = [0, 2, 5]
    assert misplaced(H[:, few], noise[:, few], FREQ, model(said[few]), shapes(PLACES), allowed(3)) == []


def test_a_sensor_upside_down_stands_where_it_is() -> None:
    H, noise = measured(X)
    H[:, 2] *= -1
    assert all(one.sensor != 2 for one in misplaced(H, noise, FREQ, model(X), shapes(PLACES), allowed(7)))


def test_a_study_leaves_it_out_and_names_it(tmp_path: Path) -> None:
    path = write_study(tmp_path, Truth((7.3e10, 6.8e10)))
    for name in LEVELS:
        file = tmp_path / f"{name}.uff"
        write_uff(file, functions_of(said_elsewhere(read_recording(file).time, 10, 3)))
    run = diagnose(path)
    assert isinstance(run, StudyRun)
    (row,) = run.result["corrections"]
    assert (row["mistake"], row["channels"], row["left_out"]) == ("elsewhere", ["3:+Z"], True)
    assert "3:+Z was left out: the sensor 3:+Z moves as the model does elsewhere" in run.result["advice"]
    assert any("but as it does at about 10:+Z" in text or "at about 9:+Z" in text for text in run.result["warnings"])
    assert run.result["verdict"] == "parameters-only"
    assert max(f["final"] for f in run.result["fit"] if f["role"] == "fit") < 2 * NOISE


def said_elsewhere(data: TimeData, node: int, place: int) -> TimeData:
    """A recording of which the sensor at a node is said to be at another place."""
    there = [c.dof is not None and c.dof.node == node for c in data.channels]
    moved = [replace(c, dof=Dof(place, 3)) if at else c for c, at in zip(data.channels, there, strict=True)]
    return replace(data, channels=tuple(moved))
