"""Where nothing is named, what is doubtful of the whole test or deck comes first in the advice."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from femend.study.result.study_run import StudyRun
from femend.study.run import diagnose

sys.path.insert(0, str(Path(__file__).parents[1]))
from small_study import Truth, deck, write_study


@pytest.mark.parametrize("selected", [True, False])
def test_supports_that_are_not_selected_come_first(tmp_path: Path, selected: bool) -> None:
    path = write_study(tmp_path, Truth())
    if not selected:
        (tmp_path / "model.bdf").write_text(deck().replace("SPC = 1\n", ""))
    found = diagnose(path)
    assert isinstance(found, StudyRun)
    first = "settle this first"
    if selected:
        assert first not in found.result["advice"]
        return
    # no force at one place makes up for a clamp, and no law is tried
    assert found.result["verdict"] == "undetermined"
    assert not found.diagnosis.ranked
    assert found.result["advice"].startswith(f"{first}, since no place and no law can be told beside it: the deck has ")


def test_nothing_is_looked_for_where_the_updated_model_follows_nothing(tmp_path: Path) -> None:
    path = write_study(tmp_path, Truth())
    (tmp_path / "model.bdf").write_text(deck((7e10 / 16, 7e10 / 16)))
    found = diagnose(path)
    assert isinstance(found, StudyRun)
    assert found.result["verdict"] == "undetermined"
    assert found.result["status"] != "interrupted"
    assert "times as high as the model's" in found.result["advice"]
    assert found.result["advice"].endswith("nothing was looked for beside that")
    assert not found.diagnosis.located
