"""Doubts about levels and signs go where the final model leaves no more than noise of the recordings as they are."""

from __future__ import annotations

from typing import Any

import pytest

from femend.correlate.doubts import Doubt
from femend.study.doubts.explained import answered
from femend.study.doubts.plausible import Doubted


def doubted(kind: str, channel: str = "", recordings: tuple[str, ...] = ("low", "high")) -> Doubted:
    return Doubted(Doubt(kind, channel, f"{kind} of {channel}", 1000.0), recordings)


def result(final: float = 0.021, verdict: str = "missing-physics", factor: float = 1.1) -> dict[str, Any]:
    fit = [
        {"recording": name, "role": role, "noise_floor": floor, "final": left}
        for name, role, floor, left in (
            ("low", "fit", 0.02, 0.022),
            ("high", "fit", 0.02, final),
            ("held", "validate", None, 0.5),
        )
    ]
    return {"verdict": verdict, "fit": fit, "parameters": {"E": {"factor": factor, "sd": 0.01}}}


def test_what_a_final_model_to_the_noise_explains_is_no_doubt() -> None:
    doubts = [doubted("level"), doubted("sensor sign", "7:+Z"), doubted("held", "8:+Z"), doubted("elsewhere", "9:+Z")]
    assert answered(doubts, result()) == doubts


@pytest.mark.parametrize(
    "left",
    [result(final=0.06), result(verdict="undetermined"), result(verdict="located-not-named"), result(factor=900)],
)
def test_doubts_stay_where_more_than_noise_is_left_or_a_parameter_took_the_level(left: dict[str, Any]) -> None:
    assert answered([doubted("level")], left) == []


def test_a_sensor_that_stands_elsewhere_stays_one_where_it_is_not_explained() -> None:
    """Left out, or what it shows beyond the model taken for its noise, it is explained by no model."""
    one = doubted("elsewhere", "9:+Z")
    assert answered([one], result(final=0.06)) == []
    assert answered([one], result(), {"9:+Z"}) == []


def test_a_recording_to_the_noise_answers_its_own_doubts() -> None:
    low = doubted("level", recordings=("low",))
    assert answered([low, doubted("sensor sign", "7:+Z")], result(final=0.06)) == [low]


def test_what_no_model_explains_and_what_was_left_out_stays() -> None:
    stays = [doubted(kind) for kind in ("short", "slow", "twice", "unrelated", "frequencies", "time axis", "parameter")]
    one = doubted("sensor sign", "7:+Z")
    assert answered([*stays, one], result(), ["7:+Z"]) == []
