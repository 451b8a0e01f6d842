"""A force that nobody recorded and a motion of the base are both told where sensors hardly tell them apart."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from femend.diagnose.calibration import CALIBRATION
from femend.diagnose.settings import Settings
from femend.study.findings import _load_alternatives


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
