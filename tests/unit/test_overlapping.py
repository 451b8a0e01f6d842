"""Recordings that hold the same stretch of time are told: cut out of one file, or cut so that they overlap."""

from __future__ import annotations

import time

import numpy as np
import pytest

from femend import Dof
from femend.data import Channel, Recording, TimeData
from femend.study.doubts.overlapping import overlaps

DT = 1e-3
RECORD = np.random.default_rng(5).standard_normal(20_000).cumsum() * np.hanning(20_000)


def recorded(name: str, values: np.ndarray, role: str = "fit", sign: int = 1, node: int = 4) -> Recording:
    channels = (Channel(Dof(1, 3), "force", "N"), Channel(Dof(node, 3, sign), "acceleration", "m/s^2"))
    force = np.random.default_rng(len(name)).standard_normal(values.size)
    return Recording(name, TimeData(name, DT, np.array([force, sign * values]), channels), role)


@pytest.mark.parametrize(
    ("cut", "said"),
    [
        ((5000, 12_000), "the same 7 s (35 % of 'whole' from 5 s on, all of 'cut' from 0 s on)"),
        ((0, 8000), "the same 8 s (40 % of 'whole' from 0 s on, all of 'cut' from 0 s on)"),
        ((14_000, 20_000), "the same 6 s (30 % of 'whole' from 14 s on, all of 'cut' from 0 s on)"),
        ((0, 20_000), "the same 20 s (all of 'whole' from 0 s on, all of 'cut' from 0 s on)"),
    ],
)
def test_a_part_of_a_file_is_told(cut: tuple[int, int], said: str) -> None:
    (told,) = overlaps([recorded("whole", RECORD), recorded("cut", RECORD[cut[0] : cut[1]])])
    assert told.startswith(f"recordings 'whole' and 'cut' hold {said}: what counts twice makes deviations too narrow")


@pytest.mark.parametrize("turned", [False, True])
def test_stretches_that_overlap_are_told(turned: bool) -> None:
    """Seconds 0 to 9 and 7 to 20, one rounded as an exporter does and its sensor turned; in either order."""
    first = recorded("first", np.round(RECORD[:9000] / 1e-3) * 1e-3)
    second = recorded("second", RECORD[7000:], "validate", sign=-1)
    (told,) = overlaps([second, first] if turned else [first, second])
    assert "hold the same 2 s" in told
    assert "22 % of 'first' from 7 s on" in told
    assert "15 % of 'second' from 0 s on" in told
    assert "'second' is held out, and so much of it is what 'first' is fitted to, which confirms nothing" in told


def test_repeated_and_other_tests_are_none() -> None:
    noise = 0.01 * RECORD.std() * np.random.default_rng(6).standard_normal(RECORD.size)
    again = [recorded("one", RECORD), recorded("two", RECORD + noise)]
    assert overlaps(again) == []
    assert overlaps([recorded("one", RECORD), recorded("back", RECORD[::-1].copy())]) == []
    # two sensors in one test, and what is not used to fit
    assert overlaps([recorded("one", RECORD), recorded("other", RECORD, node=5)]) == []
    assert overlaps([recorded("v1", RECORD, "validate"), recorded("v2", RECORD, "validate")]) == []
    assert overlaps([recorded("still", np.full(3000, 0.1)), recorded("still too", np.full(3000, 0.1))]) == []
    assert overlaps([recorded("short", RECORD[:100]), recorded("short too", RECORD[:100])]) == []


def test_long_records_cost_little() -> None:
    x = np.random.default_rng(7).standard_normal(1_000_000)
    many = [recorded(str(k), x[::-1].copy() if k else x) for k in range(2)]
    begun = time.process_time()
    assert overlaps(many) == []
    assert time.process_time() - begun < 1.0
