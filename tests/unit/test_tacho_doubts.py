"""Tachos that are sampled too slowly, and another number of pulses to a turn than was stated."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from femend import Channel, Dof, TimeData
from femend.bench.reading.runs import _lost_peaks
from femend.data import Recording, Rotating
from femend.diagnose.staged.prepare import tacho_warnings
from femend.errors import SignalError
from femend.signal import find_edges, tacho_speed
from femend.signal.tacho_doubts import counted_otherwise, sampled_too_slowly, without_pulses
from femend.study.file.channels_sound import with_warnings

LOW, HIGH, SECONDS = 6.0, 30.0, 40.0


def run(rate: float = 512.0, *, pulses: int = 1, width: float = 0.2, second: float = 0.0) -> TimeData:
    """A run-up whose unbalance two sensors show, the second through a resonance, with forces of order 2 that are
    `second` times as large; pulses last the share `width` of their interval."""
    t = np.arange(int(rate * SECONDS)) / rate
    turns = LOW * t + 0.5 * (HIGH - LOW) / SECONDS * t**2
    speed = LOW + (HIGH - LOW) / SECONDS * t
    force = speed**2 * (np.cos(2 * np.pi * turns) + second * np.cos(4 * np.pi * turns))
    w, W = 2 * np.pi * np.fft.rfftfreq(t.size, 1 / rate), 2 * np.pi * 17.0
    rung = np.fft.irfft(-(w**2) / (W**2 - w**2 + 0.04j * W * w) * np.fft.rfft(force), t.size)
    noise = 0.1 * np.random.default_rng(2).standard_normal((2, t.size))
    y = np.array([force / force.std(), rung / rung.std()]) + noise
    values = [5.0 * ((pulses * turns) % 1 < width), *y]
    channels = [Channel(None, "tacho", "V", "tacho"), *(Channel(Dof(i, 2), "acceleration", "m/s^2") for i in (1, 2))]
    return TimeData("runup", 1 / rate, values, channels)


def recording(data: TimeData, stated: int) -> Recording:
    rotating = Rotating("tacho", (7,), "X", stated)
    return Recording("runup", data, excitation="rotating", rotating=rotating)


@pytest.mark.parametrize(("true", "stated"), [(1, 2), (2, 1), (1, 4), (4, 1), (2, 4)])
def test_another_number_of_pulses_is_told(true: int, stated: int) -> None:
    data = run(2048.0, pulses=true)
    found = counted_otherwise(data, tacho_speed(data, pulses_per_revolution=stated), stated)
    assert found is not None
    assert (found.pulses, found.order) == (true, stated / true)
    assert found.share > 0.9


@pytest.mark.parametrize(("stated", "second"), [(1, 0.0), (2, 0.0), (1, 1.0), (4, 0.3)])
def test_the_right_number_is_not_doubted(stated: int, second: float) -> None:
    data = run(2048.0, pulses=stated, second=second)
    assert counted_otherwise(data, tacho_speed(data, pulses_per_revolution=stated), stated) is None


def test_the_warning_of_a_wrong_number_in_any_order() -> None:
    data = run()
    speed = tacho_speed(data, pulses_per_revolution=2)
    (said,) = tacho_warnings(recording(data, 2), speed)
    assert said.startswith("recording 'runup': its channels hold ")
    assert "% of their power at order 2.00 of the tacho's speed and next to nothing (" in said
    assert said.endswith("is pulses_per_revolution = 1 instead of 2?")
    assert tacho_warnings(recording(data, 2), speed.of_order(1.5), 1.5) == (said,)
    assert tacho_warnings(recording(data, 1), tacho_speed(data)) == ()


def test_an_output_that_toggles_is_told() -> None:
    """A flip-flop behind the sensor: half of the speed, which no whole number of pulses to a turn says."""
    data = run(2048.0)
    turns = np.cumsum(np.diff((data.values[0] > 2.5).astype(int), prepend=0) > 0)
    halved = TimeData("runup", data.dt, np.vstack([5.0 * (turns % 2), data.values[1:]]), data.channels)
    (said,) = with_warnings(recording(halved, 1)).warnings
    assert "of their power at order 2 and next to nothing (" in said
    assert "does the shaft turn 2 times for each pulse (every second pulse lost, an output that toggles" in said
    assert with_warnings(recording(data, 1)).warnings == ()
    assert with_warnings(recording(run(2048.0, second=1.0), 1)).warnings == ()


@pytest.mark.parametrize("teeth", [12, 36])
def test_pulses_of_a_toothed_wheel_are_told(teeth: int) -> None:
    data = run(8192.0, pulses=teeth, width=0.4)
    found = counted_otherwise(data, tacho_speed(data), 1)
    assert found is not None
    assert found.pulses == teeth


@pytest.mark.parametrize(("first", "last"), [(0.0, 0.7), (0.4, 1.0)])
def test_a_tacho_that_covers_a_part_is_told(first: float, last: float) -> None:
    """The speed beside was taken for the rest of the record, without a word."""
    data = run(512.0)
    values = data.values.copy()
    values[0, (data.t < first * SECONDS) | (data.t > last * SECONDS)] = 0.0
    (said,) = with_warnings(recording(TimeData("runup", data.dt, values, data.channels), 1)).warnings
    bare = (0.0, first * SECONDS) if first else (last * SECONDS, SECONDS)
    told = [float(v) for v in re.search(r"holds no pulses from (\S+) to (\S+) s of the record's 40 s", said).groups()]  # type: ignore[union-attr]
    assert told == pytest.approx(bare, abs=0.3)
    assert "cut the record to what the tacho covers" in said


@pytest.mark.parametrize("rises", [0, 1])
def test_a_tacho_of_less_than_two_pulses_has_no_stretch_beside_them(rises: int) -> None:
    """One that only falls ended with an IndexError."""
    data = run(512.0)
    values = data.values.copy()
    values[0] = (data.t < 10) | (rises * (data.t > 20))
    data = TimeData("runup", data.dt, values, data.channels)
    assert without_pulses(data, find_edges(values[0], data.dt)) == []
    assert not any("holds no pulses" in said for said in with_warnings(recording(data, 1)).warnings)


def test_several_turns_to_a_pulse_are_not_told_of_several_pulses_to_a_turn() -> None:
    """One pulse to a turn where the study says two: "turns 2 times for each pulse" denied counted_otherwise."""
    data = run(2048.0)
    assert not any("for each pulse" in said for said in with_warnings(recording(data, 2)).warnings)
    found = counted_otherwise(data, tacho_speed(data, pulses_per_revolution=2), 2)
    assert found is not None
    assert found.pulses == 1


def test_pulses_lost_regularly_from_a_time_on_are_told() -> None:
    data = run(1024.0)
    turns = np.cumsum(np.diff((data.values[0] > 2.5).astype(int), prepend=0) > 0)
    values = data.values.copy()
    values[0, (data.t > 20) & (turns % 2 == 0)] = 0.0
    said = with_warnings(recording(TimeData("runup", data.dt, values, data.channels), 1)).warnings
    assert any(
        re.search(r"has pulses (2|1\.9\d|2\.0\d) times as far apart from about 20\.\d* s on as just before", w)
        for w in said
    )


def test_a_tacho_that_measures_motion_is_told() -> None:
    data = run(512.0)
    named = [data.channels[0], Channel(Dof(1, 2), "acceleration", "m/s^2", "bearing"), data.channels[2]]
    data = TimeData("runup", data.dt, data.values, named)
    sine = Recording("runup", data, excitation="rotating", rotating=Rotating("bearing", (7,), "X", 1))
    (said,) = (w for w in with_warnings(sine).warnings if "named as the tacho" in w)
    assert "measures acceleration [m/s^2]: its cycles are taken as pulses" in said


def test_spikes_are_no_pulses_too_short_for_the_sampling() -> None:
    data = run(1024.0)
    spiked = data.values[0] + 40.0 * (np.random.default_rng(5).random(data.n_samples) < 1e-4)
    assert sampled_too_slowly(spiked, data.dt, HIGH) == ""


def test_lost_pulses_of_a_slow_sampling_say_why() -> None:
    """30 pulses/s of 4.3 ms at 192 samples/s: a sixth of the pulses fall between two samples."""
    data = run(192.0, width=0.13)
    speed = tacho_speed(data)
    said = tacho_warnings(recording(data, 1), speed)[0]
    assert speed.missed > 10
    assert "lost pulses put in" in said
    assert "pulses/s come at 192 samples/s (6.4 samples a pulse, of which the pulse or the gap lasts 0.85)" in said
    assert said.endswith("so that some are not seen: sample the tacho faster, or use fewer or longer pulses")


def test_a_tacho_that_cannot_be_read_for_its_sampling_says_so() -> None:
    with pytest.raises(SignalError, match=r"rev/s \S+ pulses/s come at 256 samples/s \(3 samples a pulse") as caught:
        tacho_speed(run(256.0, pulses=4), pulses_per_revolution=4)
    assert "What shows it first: " in str(caught.value)
    assert "cut the recording" not in str(caught.value)


def test_samples_that_are_enough() -> None:
    data = run()
    assert sampled_too_slowly(data.values[0], data.dt, 30.0) == ""
    assert sampled_too_slowly(data.values[0], data.dt, 200.0, 50.0).startswith("at 50 rev/s 200 pulses/s come at 512")


@pytest.mark.parametrize(
    ("at", "noise", "said"),
    [
        ([], [], []),
        ([3.554], [0.79], ["the peak at 3.554 Hz is not compared, 79 % of its shape is noise"]),
        (
            [3.0, 5.0, 7.25],
            [0.6, 0.9, 0.7],
            ["3 peaks from 3 to 7.25 Hz are not compared, 60 to 90 % of their shapes are noise"],
        ),
    ],
)
def test_peaks_of_noise_are_told_together(at: Any, noise: Any, said: list[str]) -> None:
    assert _lost_peaks(np.array(at), np.array(noise)) == said
