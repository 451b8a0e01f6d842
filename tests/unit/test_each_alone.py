"""Recordings of a structure that was not the same in them are told as such, and no law is sought that does it."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

import pytest

from femend.diagnose.diagnosis import explain
from femend.diagnose.locating.locate import locate
from femend.diagnose.settings import Settings
from femend.diagnose.updating.each_alone import explained_one_by_one, unlike
from femend.model.places.places import find_places

sys.path.insert(0, str(Path(__file__).parents[1]))
import small_study

COLD, WARM = small_study.Truth((7.3e10, 6.8e10)), small_study.Truth((7.0e10, 6.53e10))


def in_two_states(folder: Path) -> Path:
    """A study whose stronger recordings are of a softer structure than the weakest; the path of its file."""
    warm = small_study.write_study(folder / "warm", WARM).parent
    path = small_study.write_study(folder, COLD)
    for name in ("high", "held"):
        shutil.copy(warm / f"{name}.uff", folder)
    return path


@pytest.fixture(scope="module")
def two_states(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return in_two_states(tmp_path_factory.mktemp("states"))


def test_recordings_of_two_states_are_told_with_what_moved(two_states: Path) -> None:
    start = small_study.updated_on(two_states)
    assert start.null.score > Settings().far
    said = unlike(start, Settings())
    assert "E_root +" in said
    assert " Hz in low and " in said
    low, high = (float(part.split()[-1]) for part in said.split(" Hz in ")[:2] if part)
    assert high / low == pytest.approx((7.0 / 7.3) ** 0.5, abs=0.004)


def test_nothing_is_named_in_recordings_of_two_states(two_states: Path) -> None:
    start = small_study.updated_on(two_states)
    places = [p for p in find_places(start.reduced.model) if p.kind == "ground" and p.nodes == (4,)]
    found = explain(start, locate(start.problem, start.reduced, places, start.null), places, Settings())
    assert (found.verdict, found.place, found.ranked) == ("undetermined", None, [])
    assert found.advice == unlike(start, Settings())


def test_recordings_of_one_state_may_lack_a_law(tmp_path: Path) -> None:
    hardening = small_study.Truth((7.3e10, 6.8e10), laws=[(7, "cubic_stiffness", {"k3": 3e11})])
    start = small_study.updated(tmp_path, hardening)
    assert start.null.score > Settings().far
    assert explained_one_by_one(start, Settings()) is None
    assert unlike(start, Settings()) == ""


def test_a_spring_that_is_missing_is_in_all_recordings(tmp_path: Path) -> None:
    start = small_study.updated(tmp_path, small_study.Truth((7.3e10, 6.8e10), ("CELAS2,900,3.+4,7,3",)))
    assert start.null.score > Settings().far
    assert unlike(start, Settings()) == ""
