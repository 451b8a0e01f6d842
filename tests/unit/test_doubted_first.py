"""Where nothing is named, what is doubtful of the whole test or deck comes first in the advice."""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from femend.correlate.doubts import Doubt
from femend.dof import Dof
from femend.model import read_model
from femend.study import load_study
from femend.study.doubts.plausible import Doubted
from femend.study.result.study_run import StudyRun
from femend.study.run import _Task, diagnose

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


@pytest.mark.parametrize(
    ("kind", "factor", "first"), [("level", 3.5, False), ("level", 500.0, True), ("unrelated", None, True)]
)
def test_a_level_that_a_structure_may_have_is_nothing_to_settle_first(
    tmp_path: Path, kind: str, factor: float | None, first: bool
) -> None:
    """Places were looked for beside it, since a soft foot scales all responses as much."""
    study = load_study(write_study(tmp_path, Truth()))
    one = Doubted(Doubt(kind, "", "what is doubted", factor), ("low",))
    task: Any = SimpleNamespace(study=study, model=read_model(study.model_file), doubted=[one], test=[])
    task._contradictions = lambda **sure: _Task._contradictions(task, **sure)
    result: dict[str, Any] = {"verdict": "undetermined", "warnings": [one.text], "advice": "run it again"}
    told = _Task._doubted_first(task, result)["advice"]
    assert told.startswith("settle this first") is first
    assert told.endswith("run it again")
    # a law that was read at a place whose force explains the recordings needs nothing settled
    assert _Task._doubted_first(task, {**result, "findings": [{"as_read": True}]})["advice"] == "run it again"


def test_sensors_that_the_fit_left_out_or_called_noise_are_not_explained() -> None:
    def channel(name: str) -> Any:
        return SimpleNamespace(dof=Dof.parse(name))

    sensors = [channel("4:+Z"), channel("7:-Z"), channel("10:+Z")]
    own = [SimpleNamespace(role="fit", sensors=sensors)]
    rows = {4: 20, 7: 38, 10: 56}
    task: Any = SimpleNamespace(
        right=SimpleNamespace(test=own),
        model=SimpleNamespace(row=lambda dof: rows[dof.node]),
        pairing={c.dof: SimpleNamespace(dof=c.dof) for c in sensors},
    )

    def found(*records: tuple[Any, Any]) -> Any:
        return SimpleNamespace(
            problem=SimpleNamespace(records=[SimpleNamespace(crossed=a, loud=b) for a, b in records])
        )

    assert _Task._unexplained(task, found(((), ()))) == set()
    assert _Task._unexplained(task, found((((38, 20.0, 1.0),), ()), ((), ((56, 30.0, 50.0),)))) == {"7:-Z", "10:+Z"}
