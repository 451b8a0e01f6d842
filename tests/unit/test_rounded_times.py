"""Times that an exporter rounded are even times, where their digits tell."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from femend import read_recording
from femend.cli.inspect_table import table_text
from femend.errors import RecordingError
from femend.io.channel_map import ChannelMap
from femend.io.rounded import even_grid, printed_unit


def rounded(form: str, rate: float, seconds: float = 120.0, start: float = 0.0) -> np.ndarray:
    """Even times as a text with these digits holds them."""
    return np.array([float(form % t) for t in start + np.arange(int(rate * seconds)) / rate])


@pytest.mark.parametrize(
    ("form", "rate", "unit"),
    [
        ("%.7g", 256.0, 1e-4),
        ("%.6g", 256.0, 1e-3),
        ("%.3f", 256.0, 1e-3),
        ("%.4f", 2048.0, 1e-4),
        ("%.6e", 512.0, 1e-4),
    ],
)
@pytest.mark.parametrize("start", [0.0, 12.3456])
def test_even_times_are_found_behind_rounded_ones(form: str, rate: float, unit: float, start: float) -> None:
    values = rounded(form, rate, start=start)
    steps = np.diff(values)
    assert np.abs(steps * rate - 1).max() > 0.01  # which was refused
    printed = printed_unit(values)
    assert printed.max() == pytest.approx(unit)
    assert even_grid(values, printed) == pytest.approx((start, 1 / rate), abs=0.5 * unit, rel=1e-12)


def test_a_rate_that_is_no_whole_number() -> None:
    found = even_grid(values := rounded("%.3f", 51.2), printed_unit(values))
    assert found is not None
    assert found[1] * 51.2 == pytest.approx(1.0, abs=1e-7)


def test_uneven_times_are_not_taken_for_rounded_ones() -> None:
    values = rounded("%.7g", 256.0)
    values[9000:] += 0.002  # half a sample late
    assert even_grid(values, printed_unit(values)) is None
    # two samples in every last digit: nothing is told of what is between
    coarse = rounded("%.2f", 256.0)
    assert even_grid(coarse, printed_unit(coarse)) is None


def written(folder: Path, times: np.ndarray, name: str = "time") -> Path:
    path = folder / "run.csv"
    rows = "\n".join(f"{t!r},{i % 7}" for i, t in enumerate(times.tolist()))
    path.write_text(f"{name},a\n{rows}\n")
    return path


CHANNELS = (ChannelMap("a", 1, "+X", "acceleration", "m/s^2"),)


@pytest.mark.parametrize(("name", "scale"), [("time", 1.0), ("time [ms]", 1000.0)])
def test_a_file_with_rounded_times_is_read_and_says_so(tmp_path: Path, name: str, scale: float) -> None:
    times = np.array([float("%.7g" % (scale * t)) for t in np.arange(256 * 120) / 256])
    read = read_recording(written(tmp_path, times, name), CHANNELS, excitation="ambient")
    assert read.time.dt == 1 / 256
    (note,) = [n for n in read.notes if "rounded" in n]
    assert f"{name!r} are rounded to 0.0001 s: each is within half a last digit of an even step of 0.00390625 s" in note


def test_times_with_too_few_digits_ask_for_more(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"worth up to 0\.01 s: export the time with more digits, or resample"):
        read_recording(written(tmp_path, rounded("%.2f", 256.0)), CHANNELS, excitation="ambient")


def test_times_that_are_uneven_in_all_their_digits_are_to_be_resampled(tmp_path: Path) -> None:
    times = rounded("%.9f", 256.0)
    times[500:] += 0.002
    with pytest.raises(RecordingError, match=r"is not even.* on average; resample the recording to an even step"):
        read_recording(written(tmp_path, times), CHANNELS, excitation="ambient")


def test_inspect_doubts_less_than_a_sample_a_second(tmp_path: Path) -> None:
    told = "time [ms]"
    assert told in table_text(written(tmp_path, np.arange(300) * 7.8125)).splitlines()[0]
    assert told not in table_text(written(tmp_path, np.arange(300) * 0.0078125)).splitlines()[0]
