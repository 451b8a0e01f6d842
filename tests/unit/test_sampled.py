"""A record that is sampled too slowly is told by its rate, in place of sensors that folded responses seem to blame."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from femend import Recording, functions_of, write_uff
from femend.bench.correlation.correlate import correlate
from femend.errors import RecordingError
from femend.study.doubts.sampled import too_slow_for_band, too_slow_for_modes

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study


def recorded(rate: float, seconds: float = 60.0) -> Recording:
    noise = np.random.default_rng(1).standard_normal((1 + len(small_study.SENSORS), int(seconds * rate)))
    return Recording("low", small_study.recording("low", noise[0], noise[1:], rate))


def test_a_band_beyond_the_sampling_is_told_with_the_rate_it_takes() -> None:
    (told,) = too_slow_for_band(recorded(32.0), (3.0, 28.0))
    assert told.startswith(
        "recording 'low' is sampled at 32 Hz, so that its Nyquist frequency is 16 Hz and 12.8 Hz can"
    )
    assert "[correlation] band goes to 28 Hz" in told
    assert "sample at 70 Hz or more" in told
    assert "end the band at 12.8 Hz" in told
    assert too_slow_for_band(recorded(70.0), (3.0, 28.0)) == ()
    assert too_slow_for_band(recorded(32.0), None) == ()


def test_a_rate_that_is_far_below_asks_for_the_unit_of_the_axis() -> None:
    slow = recorded(0.512, seconds=1000.0)
    (told,) = too_slow_for_modes(slow, np.array([18.0, 40.0]))
    assert told.startswith(
        "recording 'low' is sampled at 0.512 Hz by its time axis, and the model's lowest mode is at 18"
    )
    assert "is the axis in milliseconds? A column that counts them is called 'time [ms]'" in told


def test_a_rate_that_misses_the_lowest_mode_is_told() -> None:
    # rigid-body modes are at 0 Hz but for rounding
    freq = np.array([1e-5, 2e-5, 30.0, 50.0])
    (told,) = too_slow_for_modes(recorded(64.0), freq)
    assert "Nyquist frequency is 32 Hz" in told
    assert "the model's lowest mode is at 30 Hz" in told
    assert too_slow_for_modes(recorded(128.0), freq) == ()


def refused(folder: Path, seconds: float, tables: str) -> RecordingError:
    """What a correlation says of a record of noise at 8 Hz."""
    path = small_study.write_unrecorded(folder, tables)
    path.write_text(small_study.study_text({"low": "fit"}) + tables)
    write_uff(folder / "low.uff", functions_of(recorded(8.0, seconds).time))
    with pytest.raises(RecordingError) as found:
        correlate(path)
    return found.value


@pytest.mark.parametrize("tables", ["", "\n[correlation]\nband = [1.0, 60.0]\n"])
def test_folded_responses_blame_no_sensor(tmp_path: Path, tables: str) -> None:
    error = refused(tmp_path, 60.0, tables)
    assert "sampled at 8 Hz, so that its Nyquist frequency is 4 Hz" in str(error)
    assert "driving point" not in str(error)


def test_what_fails_on_a_slow_record_is_told_with_its_rate(tmp_path: Path) -> None:
    error = refused(tmp_path, 10.0, "\n[correlation]\nband = [1.0, 60.0]\n")
    assert "Nyquist frequency is 4 Hz" in error.__notes__[0]
