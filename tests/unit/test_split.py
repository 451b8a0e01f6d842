"""Which recordings choose between laws: the middle one; where it shows nothing of what is missing, one that does."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from femend.diagnose.locating.split import Split, split_records, weaker_first
from femend.estimate import FitRecord, Problem

LEVELS = {"mid": 3.0, "high": 10.0, "low": 1.0}


def problem(levels: dict[str, float]) -> Problem:
    rows, rng = np.array([0]), np.random.default_rng(0)
    u = {name: level * rng.standard_normal((1, 64)) for name, level in levels.items()}
    records = [FitRecord(n, v, v, 0.01, rows, rows, np.ones(1), np.ones(1), np.ones(1)) for n, v in u.items()]
    return Problem(records, (1.0, 20.0), 0.01, 0)


def split(null: list[float], free: list[float]) -> Split:
    """The split where the updated model and a free force leave so much in each record of `LEVELS`."""
    left: Any = SimpleNamespace(misfit=np.array(null))
    best: Any = SimpleNamespace(fit=SimpleNamespace(misfit=np.array(free)))
    return split_records(problem(LEVELS), left, [best])


def names(part: Problem) -> list[str]:
    return [r.name for r in part.records]


def test_the_middle_level_chooses() -> None:
    found = split([5.0, 9.0, 2.0], [1.0, 1.0, 1.0])
    assert (names(found.fitting), names(found.choosing)) == (["high", "low"], ["mid"])
    assert [r.name for r in found.unseen] == ["mid"]
    assert names(split_records(problem(LEVELS)).choosing) == ["mid"]


def test_what_the_highest_alone_shows_is_fitted_to_it_and_leaves_the_middle_as_it_is() -> None:
    found = split([1.0, 9.0, 1.0], [0.9, 1.0, 0.9])
    assert (names(found.fitting), names(found.choosing)) == (["high", "low"], ["mid", "high"])
    assert [r.name for r in found.unseen] == ["mid"]


def test_the_lowest_that_shows_it_chooses_where_there_are_several() -> None:
    found = split([1.0, 9.0, 8.0], [0.9, 1.0, 1.0])
    assert (names(found.fitting), names(found.choosing)) == (["mid", "high"], ["low"])


def test_what_the_middle_one_alone_shows_is_fitted_to_it_and_leaves_another_as_it_is() -> None:
    """A record struck at another place, or across it, shows nothing of it."""
    found = split([9.0, 1.0, 1.0], [1.0, 0.9, 0.9])
    assert (names(found.fitting), names(found.choosing)) == (["mid", "high"], ["mid", "low"])
    assert [r.name for r in found.unseen] == ["low"]


def test_a_model_that_lacks_nothing_keeps_the_middle_one() -> None:
    assert names(split([1.0, 1.0, 1.0], [1.0, 1.0, 1.0]).choosing) == ["mid"]


def test_a_single_recording_too_short_for_a_part_does_both_and_it_is_told() -> None:
    found = split_records(problem({"only": 1.0}))
    assert names(found.fitting) == names(found.choosing) == ["only"]
    assert found.unseen == []
    assert found.told().startswith("laws were chosen on recording 'only', which they were fitted to as well: its last")
    assert "0.22 s" in found.told()


@pytest.mark.parametrize("null", [[5.0, 9.0, 2.0], [1.0, 9.0, 1.0]])
def test_the_same_split_of_the_recordings_with_other_noise(null: list[float]) -> None:
    found, other = split(null, [1.0, 1.0, 1.0]), problem(LEVELS)
    again = found.of(other)
    for part, expected in ((again.fitting, found.fitting), (again.choosing, found.choosing)):
        assert names(part) == names(expected)
        assert all(any(r is o for o in other.records) for r in part.records)


def test_the_weaker_recordings_are_fitted_first_where_no_law_could_be_followed_in_the_strongest() -> None:
    found = weaker_first(split_records(problem(LEVELS)))
    assert found is not None
    assert (sorted(names(found.fitting)), names(found.choosing)) == (["low", "mid"], ["high"])
    # there is nothing else to try then, nor with a single recording
    assert weaker_first(found) is None
    assert weaker_first(split_records(problem({"only": 1.0}))) is None
