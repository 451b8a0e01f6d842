"""A force that nobody recorded and a motion of the base are both told where sensors hardly tell them apart."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from femend.diagnose.loads.loads import LoadFinding
from femend.diagnose.naming.calibration import CALIBRATION
from femend.diagnose.settings import Settings
from femend.study.result.findings import _finding, _load_alternatives, _load_finding


def told(physics: str, costs: dict[str, float], force: Any = None) -> dict[str, float]:
    located = [SimpleNamespace(place=SimpleNamespace(kind=kind), cost=cost) for kind, cost in costs.items()]
    diagnosis = cast(Any, SimpleNamespace(located=located, settings=Settings()))
    return _load_alternatives(diagnosis, cast(Any, SimpleNamespace(physics=physics, force=force)))


def test_the_other_one_has_half_of_the_probability_where_both_fit_alike() -> None:
    other = told("unmeasured_force", {"ground": 100.0, "base": 100.0, "clamp": 90.0})
    assert other == {"base_motion": pytest.approx(CALIBRATION.surest / 2)}
    (p,) = told("base_motion", {"ground": 104.0, "base": 100.0}).values()
    assert 0.05 < p < 0.2


@pytest.mark.parametrize(
    ("physics", "costs", "force"),
    [
        ("unmeasured_force", {"ground": 100.0, "base": 150.0}, None),
        ("unmeasured_force", {"ground": 100.0}, None),
        ("load_misplaced", {"ground": 100.0, "base": 100.0}, None),
        # the same in every recording: it is known as a force
        ("unmeasured_force", {"ground": 100.0, "base": 100.0}, (0, np.zeros(4))),
    ],
)
def test_elsewhere_nothing_else_is_told(physics: str, costs: dict[str, float], force: Any) -> None:
    assert told(physics, costs, force) == {}


def test_a_misplaced_force_keeps_where_it_was_recorded() -> None:
    records = [SimpleNamespace(in_rows=np.array([8]), in_signs=np.array([-1.0]))] * 2
    model = SimpleNamespace(node_ids=np.array([1217, 2017]), units="SI")
    parts = {"problem": SimpleNamespace(records=records), "reduced": SimpleNamespace(model=model), "place": None}
    load = cast(
        LoadFinding,
        SimpleNamespace(
            physics="load_misplaced", nodes=(1217,), direction="+Z", force=None,
            values={"node": (1217, ""), "direction": ("+Z", "")},
        ),
    )  # fmt: skip
    found = _load_finding(cast(Any, SimpleNamespace(**parts)), load)
    assert found["recorded"] == [{"node": 2017, "direction": "-Z"}]


def test_laws_tried_in_vain_share_what_is_left(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("femend.study.result.findings._not_told_apart", lambda *_: ([], []))
    monkeypatch.setattr("femend.study.result.findings._location", lambda *_: {})
    diagnosis = cast(Any, SimpleNamespace(rival=None, read=None))
    found = _finding(diagnosis, cast(Any, None), None, {"joint_stiffness": 0.9, "added_mass": 0.05})
    assert (found["physics"], found["probability"]) == ("", 0.0)
    assert [a["physics"] for a in found["alternatives"]] == ["joint_stiffness", "added_mass"]
    assert 0 < sum(a["probability"] for a in found["alternatives"]) <= 1 - CALIBRATION.surest
