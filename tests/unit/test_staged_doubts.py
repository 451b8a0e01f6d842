"""What a staged study does not call settled: a rival clearly better than nothing beside a mode that is far off."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from femend.diagnose.staged import Flow, Stage, StagedSettings
from femend.diagnose.staged.select import Rival, Round
from femend.study.staged.doubts import clear_rival, places_left

SETTINGS = StagedSettings()


def flow(above: float, freq: float = 39.82, mac: float = 0.9996, *, taken: bool = False) -> Flow:
    """A stage with one mode at 40.105 Hz and a spring that has `above` more ln evidence than nothing."""
    scores = np.array([above, 0.0])
    weight = np.exp(scores - scores.max())
    weight /= weight.sum()
    term = cast(Any, SimpleNamespace(physics="support_stiffness"))
    spring = Rival("spring at 18 Z to ground", "support_stiffness", term, cast(Any, None), above, float(weight[0]))
    nothing = Rival("nothing", "", None, cast(Any, None), 0.0, float(weight[1]))
    decision = Round((spring, nothing), spring if taken else None, 1.0, 10.0)
    stage = Stage(
        "output-only modes", "as modelled", ("ambient",), cast(Any, None), 0.001, 0.0005, (), (decision,),
        table=((40.105, 0.01, freq, 0.01, mac, 0.016),),
    )  # fmt: skip
    return Flow((), cast(Any, None), (stage,))


def test_a_clear_rival_beside_a_mode_that_is_off_is_told() -> None:
    said = clear_rival(flow(2.98), SETTINGS)
    assert "spring at 18 Z to ground" in said
    assert "95 %" in said
    assert "40.1 Hz is -0.71 % off, 3.5 times" in said


@pytest.mark.parametrize(
    "silent",
    [flow(2.0), flow(2.98, freq=40.09), flow(2.98, mac=0.3), flow(20.0, taken=True)],
    ids=["no better", "no mode off", "another mode", "named"],
)
def test_nothing_is_told_else(silent: Flow) -> None:
    assert clear_rival(silent, SETTINGS) == ""


def test_nothing_is_said_of_places_where_none_is_named() -> None:
    assert places_left(cast(Any, SimpleNamespace(configurations={})), flow(0.0)) == ""
