"""A doubt that is told when a run begins and that the result answers is withdrawn where it was told."""

from __future__ import annotations

import io
from types import SimpleNamespace
from typing import Any

import pytest

from femend.app.progress import LineProgress
from femend.correlate.doubts import Doubt
from femend.report.runinfo import RunInfo
from femend.study.doubts.plausible import Doubted
from femend.study.run import _Task
from femend.study.steps import Steps


@pytest.mark.parametrize(("final", "withdrawn"), [(0.021, True), (0.06, False)])
def test_the_terminal_says_what_the_result_says(final: float, withdrawn: bool) -> None:
    """Of a sound sensor it was said that it looks reversed, and result.json had not a word of it."""
    terminal = io.StringIO()
    one = Doubted(Doubt("sensor sign", "13:+Z", "the sensor 13:+Z looks reversed", -1.0), ("high",))
    task: Any = SimpleNamespace(
        right=SimpleNamespace(whole=(), left_out=()), doubted=[one], steps=Steps(RunInfo(), LineProgress(terminal))
    )
    fit = [{"recording": "high", "role": "fit", "noise_floor": 0.02, "final": final}]
    result: dict[str, Any] = {"verdict": "missing-physics", "fit": fit, "parameters": {}, "warnings": ["a", one.text]}
    assert (one.text in _Task._answered(task, result)["warnings"]) is not withdrawn
    told = "no longer in doubt, since the model explains what was recorded as it is: recording 'high': the sensor 13:+Z"
    assert (told in terminal.getvalue()) is withdrawn
    assert terminal.getvalue().count("\n") == withdrawn
