"""Where nothing is named, what is doubtful of the whole test or deck comes first in the advice."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from femend.study.run import diagnose
from femend.study.study_run import StudyRun

sys.path.insert(0, str(Path(__file__).parents[1]))
from small_study import Truth, deck, write_study


@pytest.mark.parametrize("selected", [True, False])
def test_supports_that_are_not_selected_come_first(tmp_path: Path, selected: bool) -> None:
    path = write_study(tmp_path, Truth())
    if not selected:
        (tmp_path / "model.bdf").write_text(deck().replace("SPC = 1\n", ""))
    found = diagnose(path, time_limit=12.0)  # no law explains a free beam, after a minute of search
    assert isinstance(found, StudyRun)
    first = "settle this first"
    if selected:
        assert first not in found.result["advice"]
        return
    assert found.result["verdict"] in ("located-not-named", "undetermined")
    assert found.result["advice"].startswith(f"{first}, since no place and no law can be told beside it: the deck has ")
