"""Data objects: immutable, checked, and clear about what is wrong."""

from __future__ import annotations

import json

import numpy as np
import pytest

from femend import FRF, Channel, Dof, ModeSet, Recording, Spectra, Test, TimeData
from femend.data import Geometry, Rotating
from femend.errors import RecordingError

FORCE = Channel(Dof(1, 3), "force", "N", "hammer")
TOP = Channel(Dof(12, 1, -1), "acceleration", "m/s^2", "", "top plate, left")
TACHO = Channel(None, "tacho", "V", "", "tacho node 0 dir 0")


def time_data(values: object = None, channels: tuple[Channel, ...] = (FORCE, TOP), dt: float = 0.01) -> TimeData:
    values = np.arange(1.0, 1.0 + 10 * len(channels)).reshape(len(channels), 10) if values is None else values
    return TimeData("run", dt, values, channels, 1.0)  # type: ignore[arg-type]


def test_time_data_are_read_only_and_owned() -> None:
    values = np.ones((2, 10))
    data = time_data(values)
    values[0, 0] = 5.0
    assert data.values[0, 0] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        data.values[0, 0] = 2.0
    assert (data.rate, data.duration, data.n_samples) == (pytest.approx(100.0), pytest.approx(0.1), 10)
    np.testing.assert_allclose(data.t, 1.0 + 0.01 * np.arange(10))
    json.dumps(data.to_dict())


def test_channels_are_found_by_name_dof_or_label() -> None:
    data = time_data(channels=(FORCE, TOP, TACHO))
    assert [data.index(t) for t in ("hammer", "12:-X", "top plate", "tacho")] == [0, 1, 2 - 1, 2]
    with pytest.raises(RecordingError, match=r"no channel answers to 'speed'; its channels are force 1:\+Z"):
        data.index("speed")
    with pytest.raises(RecordingError, match="2 channels answer to 't'"):
        data.index("t")
    assert data.select([2, 0]).channels == (TACHO, FORCE)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_nan_is_told_with_channel_and_time(bad: float) -> None:
    values = np.ones((2, 10))
    values[1, 4:6] = bad
    with pytest.raises(RecordingError, match=r"acceleration 12:-X .* at 1.04 s \(sample 4; 2 such samples\)") as caught:
        time_data(values)
    assert caught.value.recording == "run"
    assert caught.value.channel is not None


@pytest.mark.parametrize(
    ("values", "dt", "part"),
    [
        (np.ones((3, 10)), 0.01, "do not fit 2 channels"),
        (np.ones(10), 0.01, "do not fit 2 channels"),
        (np.ones((2, 1)), 0.01, "1 samples"),
        (np.ones((2, 10)), 0.0, "time step 0.0 s is not positive"),
        (np.ones((2, 10)), float("nan"), "not positive"),
    ],
)
def test_time_data_that_do_not_fit(values: np.ndarray, dt: float, part: str) -> None:
    with pytest.raises(RecordingError, match=part):
        time_data(values, dt=dt)


def frf(**other: object) -> FRF:
    freq = np.linspace(1.0, 5.0, 5)
    fields: dict[str, object] = {
        "name": "ema", "freq": freq, "H": np.ones((5, 1, 1)), "outputs": (TOP,), "inputs": (FORCE,),
        "kind": "accelerance", "unit": "m/s^2/N",
    }  # fmt: skip
    return FRF(**{**fields, **other})  # type: ignore[arg-type]


def test_frf_axes() -> None:
    data = frf()
    assert data.band(2.0, 3.5).freq.tolist() == [2.0, 3.0]
    assert data.select([0], []).H.shape == (5, 1, 0)
    with pytest.raises(ValueError, match="read-only"):
        data.H[0] = 0
    json.dumps(data.to_dict())


@pytest.mark.parametrize(
    ("other", "part"),
    [
        ({"H": np.ones((1, 1, 5))}, r"is not \(n_freq, n_out, n_in\) = \(5, 1, 1\)"),
        ({"kind": "inertance"}, "none of receptance, mobility, accelerance"),
        ({"freq": np.array([1, 2, 2, 3, 4.0])}, "do not increase"),
        ({"freq": np.array([-1, 2, 2.5, 3, 4.0])}, "do not increase"),
        ({"H": np.array([1, 2, np.nan, 4, 5]).reshape(5, 1, 1)}, "not a number at 3 Hz"),
        ({"coherence": np.ones((5, 1))}, "coherence of shape"),
        (
            {"kind": "receptance"},
            "'ema': the unit of its FRFs, m/s.2/N, is one of accelerance, .* such as m/N: correct",
        ),
        ({"unit": "rad/s/(N*m)"}, "is one of mobility, and their kind is said to be accelerance"),
        ({"kind": "mobility", "unit": "mm/N"}, "is one of receptance"),
    ],
)
def test_frf_that_does_not_fit(other: dict[str, object], part: str) -> None:
    with pytest.raises(RecordingError, match=part):
        frf(**other)


@pytest.mark.parametrize(
    ("kind", "unit"),
    [("accelerance", "g/N"), ("accelerance", "in/s^2/lbf"), ("accelerance", "rad/s^2/N"), ("accelerance", "1/kg"),
     ("mobility", "(mm/s)/N"), ("receptance", "rad/(N*m)"), ("receptance", "V/N"), ("accelerance", "?")],
)  # fmt: skip
def test_units_of_the_kind_and_of_none_are_taken(kind: str, unit: str) -> None:
    assert frf(kind=kind, unit=unit).unit == unit


def test_spectra_and_modes() -> None:
    spectra = Spectra("s", [0.0, 1.0], np.ones((1, 2)), (TOP,), "psd")  # type: ignore[arg-type]
    assert spectra.references == (None,)
    json.dumps(spectra.to_dict())
    with pytest.raises(RecordingError, match="none of"):
        Spectra("s", [0.0, 1.0], np.ones((1, 2)), (TOP,), "power")  # type: ignore[arg-type]
    with pytest.raises(RecordingError, match="not a number at 1 Hz"):
        Spectra("s", [0.0, 1.0], [[1.0, np.nan]], (TOP,), "psd")  # type: ignore[arg-type]
    modes = ModeSet([1.0, 2.0], [0.01, 0.02], np.ones((1, 2)), (Dof(1, 1),))  # type: ignore[arg-type]
    assert modes.n_modes == 2
    json.dumps(modes.to_dict())
    with pytest.raises(RecordingError, match="do not fit"):
        ModeSet([1.0], [0.01, 0.02], np.ones((1, 2)), (Dof(1, 1),))  # type: ignore[arg-type]
    with pytest.raises(RecordingError, match="zeta of mode 2"):
        ModeSet([1.0, 2.0], [0.01, np.nan], np.ones((1, 2)), (Dof(1, 1),))  # type: ignore[arg-type]
    with pytest.raises(RecordingError, match="node 4 are not finite"):
        Geometry([3, 4], [[0, 0, 0], [0, np.nan, 0]])  # type: ignore[arg-type]


def test_recording_splits_force_and_response() -> None:
    recording = Recording("run", time_data(channels=(FORCE, TOP, TACHO)))
    assert recording.force is not None
    assert recording.force.channels == (FORCE,)
    assert recording.response is not None
    assert recording.response.channels == recording.sensors == (TOP,)
    assert recording.inputs == (FORCE,)
    with pytest.raises(RecordingError, match="holds no FRFs"):
        _ = recording.frf
    assert Recording("ema", frf()).sensors == (TOP,)
    json.dumps(recording.to_dict())


def test_measured_excitation_needs_a_force() -> None:
    data = time_data(channels=(TOP,))
    with pytest.raises(RecordingError, match='excitation = "measured" but none of its 1 channels is a force'):
        Recording("run", data)
    assert Recording("run", data, excitation="ambient").force is None


def test_dead_channel() -> None:
    values = np.ones((2, 10))
    values[1] = 0.0
    with pytest.raises(
        RecordingError, match=r"acceleration 12:-X .* is 0 in all 10 samples; leave the dead channel out"
    ):
        Recording("run", time_data(values))
    with pytest.raises(RecordingError, match=r"force 1:\+Z .* is 0 in all"):
        Recording("run", time_data(values[::-1]))
    second = Channel(Dof(2, 1), "force", "N")
    both = TimeData("run", 0.01, np.vstack([values, np.ones(10)])[[1, 2, 0]], (FORCE, second, TOP))
    assert Recording("run", both).force is not None  # one of two shakers at rest is no fault


@pytest.mark.parametrize(("key", "value"), [("role", "train"), ("excitation", "hammer")])
def test_role_and_excitation(key: str, value: str) -> None:
    with pytest.raises(RecordingError, match=f"{key} '{value}' is none of"):
        Recording("run", time_data(), **{key: value})  # type: ignore[arg-type]


def test_tacho() -> None:
    data = time_data(channels=(TOP, TACHO))
    recording = Recording("run", data, excitation="rotating", rotating=Rotating("tacho", (1,), "X"))
    np.testing.assert_array_equal(recording.tacho, data.values[1])
    with pytest.raises(RecordingError, match="no channel answers to 'keyphasor'"):
        Recording("run", data, excitation="rotating", rotating=Rotating("keyphasor", (1,), "X"))


def test_names_of_a_test_differ() -> None:
    one = Recording("run", time_data())
    test = Test((one, Recording("other", time_data(), role="predict")))
    assert [r.name for r in test.role("fit")] == ["run"]
    assert test["other"].role == "predict"
    assert test.sensors == (TOP,)
    with pytest.raises(KeyError, match="no recording is named 'x'"):
        test["x"]
    with pytest.raises(RecordingError, match="two recordings are named 'run'"):
        Test((one, one))
