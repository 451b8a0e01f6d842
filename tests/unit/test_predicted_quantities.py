"""Recordings are predicted and compared in what their sensors measure: velocities, displacements, accelerations."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from femend import Dof, read_uff
from femend.data import FRF, Channel, Recording, Test, TimeData
from femend.diagnose.deciding.interrupted import undecided
from femend.diagnose.deciding.so_far import SoFar
from femend.diagnose.updating.update import update_model
from femend.estimate import fit_records, pair_test
from femend.model import read_model
from femend.study.result.predictions import STAGES, Prediction, motion_error, predict_all, rows_of, write_predictions
from femend.study.result.result import result_of

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study

N, DT = 400, 0.005
UNITS = {"acceleration": "m/s^2", "velocity": "m/s", "displacement": "m", "force": "N"}


def channel(node: int, quantity: str) -> Channel:
    return Channel(Dof(node, 3), quantity, UNITS[quantity])


def recording(*channels: Channel) -> Recording:
    return Recording("a", TimeData("a", DT, np.ones((len(channels), N)), channels))


def test_a_channel_is_compared_with_the_sensor_at_its_place_that_measures_the_same() -> None:
    held = recording(
        channel(9, "force"), channel(1, "displacement"), channel(2, "displacement"), channel(2, "velocity"),
        channel(2, "acceleration"),
    )  # fmt: skip
    # numbers are those of sensors, the force not counted
    assert rows_of(held, [channel(2, "velocity"), channel(1, "displacement")]) == [2, 0]
    # of others the one nearest to an acceleration
    assert rows_of(held, [channel(1, "acceleration")]) == [0]
    both = recording(channel(9, "force"), channel(2, "displacement"), channel(2, "velocity"))
    assert rows_of(both, [channel(2, "acceleration")]) == [1]


def test_what_has_no_sensor_is_not_compared() -> None:
    held = recording(channel(9, "force"), channel(1, "velocity"))
    assert rows_of(held, [channel(1, "velocity"), channel(3, "velocity")]) is None


@pytest.mark.filterwarnings("error")
def test_frfs_outside_the_band_have_no_error_and_that_is_told() -> None:
    freq = np.array([300.0, 350.0, 400.0])
    H, outputs, inputs = np.ones((3, 1, 1), complex), (channel(1, "acceleration"),), (channel(9, "force"),)
    frf = FRF("high", freq, H, outputs, inputs, "accelerance", "(m/s^2)/N")
    above = Prediction("high", "validate", 0.0, outputs, dict.fromkeys(STAGES, H), H, frf, (8.0, 150.0))
    assert np.isnan(above.error("final"))
    assert above.outside.startswith(
        "no errors are told of recording 'high': its FRFs (300 to 400 Hz) have no line in the band that was compared "
        "(8 to 150 Hz)"
    )
    within = replace(above, band=(8.0, 350.0))
    assert within.error("final") == 0
    assert within.outside == ""


@pytest.mark.filterwarnings("error")
def test_a_sensor_that_shows_nothing_has_no_error() -> None:
    """Of displacements, whose mean does not count, that is one which stands still."""
    still = np.full((1, N), 2.0)
    assert np.isnan(motion_error([channel(1, "displacement")], np.zeros((1, N)), still))


def test_every_quantity_has_an_error_of_its_own() -> None:
    rng = np.random.default_rng(1)
    y = np.array([[1e3], [1e3], [1.0]]) * rng.standard_normal((3, N))
    channels = [channel(1, "acceleration"), channel(2, "acceleration"), channel(3, "velocity")]
    assert motion_error(channels[:2], 1.1 * y[:2], y[:2]) == pytest.approx(0.1)
    # the velocity, a thousandth of the accelerations as a number, counts as one sensor of three
    off = y * np.array([[1.0], [1.0], [1.3]])
    assert motion_error(channels, off, y) == pytest.approx(0.3 / np.sqrt(3))


def test_the_zero_of_a_displacement_is_its_sensors_own() -> None:
    y = np.random.default_rng(1).standard_normal((1, N))
    assert motion_error([channel(1, "displacement")], 1.1 * y, y + 5.0) == pytest.approx(0.1)
    assert motion_error([channel(1, "velocity")], 1.1 * y, y + 5.0) > 0.9


def integrated(a: NDArray[np.float64], dt: float) -> NDArray[np.float64]:
    """The velocity (n_out, n) of accelerations from rest, by an exponential window."""
    n = a.shape[1]
    sigma = 6.0 / (n * dt)
    decay = np.exp(-sigma * dt * np.arange(n))
    s = sigma + 2j * np.pi * np.fft.rfftfreq(2 * n, dt)
    return np.asarray(np.fft.irfft(np.fft.rfft(a * decay, 2 * n, axis=1) / s, 2 * n, axis=1)[:, :n] / decay)


def test_a_test_with_velocities_is_predicted_as_it_was_recorded(tmp_path: Path) -> None:
    (tmp_path / "model.bdf").write_text(small_study.deck())
    rng = np.random.default_rng(5)
    recordings = []
    for i, (name, (role, level)) in enumerate(small_study.LEVELS.items()):
        u = small_study.force(level, 10 + i, int(small_study.RATE * small_study.SECONDS))
        y = small_study.respond(tmp_path, small_study.Truth((7.7e10, 6.6e10)), u)
        y[1:] = integrated(y[1:], 1 / small_study.RATE)  # behind the first sensor, an accelerometer
        y += small_study.NOISE * y.std(axis=1, keepdims=True) * rng.standard_normal(y.shape)
        data = small_study.recording(name, u, None if role == "predict" else y)
        channels = [replace(c, quantity="velocity", unit="m/s") if k > 1 else c for k, c in enumerate(data.channels)]
        recordings.append(Recording(name, TimeData(name, data.dt, data.values, tuple(channels)), role))
    model, test = read_model(tmp_path / "model.bdf", parameters=small_study.PARAMETERS), Test(tuple(recordings))
    pairing = pair_test(test, model)
    records = fit_records(test.role("fit"), model, pairing)
    diagnosis = undecided(SoFar(start=update_model(model, records, 0.01)), "")
    assert diagnosis is not None
    found = predict_all(diagnosis, test, model, pairing, records)
    rows = {row["recording"]: row for row in result_of(diagnosis, found, records)["fit"]}
    # noise and all: that of a hundredth is what is left
    assert all(row["noise_floor"] == pytest.approx(0.01, rel=0.3) for name, row in rows.items() if name != "held"), rows
    assert all(row["parameters"] == pytest.approx(0.01, rel=0.5) for row in rows.values()), rows
    write_predictions(tmp_path, found)
    for name in ("held", "asked"):
        written = read_uff(tmp_path / "predictions" / "parameters" / f"{name}.uff").functions
        # accelerations and velocities are 12 and 11 in data set 58
        assert [(f.header.ordinate.type, f.header.ordinate.unit) for f in written] == [
            (12, "m/s^2"),
            *3 * [(11, "m/s")],
        ]
