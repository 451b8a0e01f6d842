"""Doubts about recordings that the result answers: where the final model leaves no more than noise of them as they are,
what looked mistaken against the deck was what the deck lacks."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

from femend.report.noise import BEYOND_NOISE, times_noise
from femend.study.doubts.plausible import Doubted

__all__ = ["answered"]

# kinds of doubts that a final model which leaves the noise answers: with a level or a sign that is off, or a sensor at
# another place, it would not
ANSWERED = ("level", "sensor level", "sensor sign", "force sign", "exchanged", "elsewhere", "held")
# factor on a parameter, or its inverse, from which a level may have gone into it
UPDATED = 3.0


def answered(doubts: Sequence[Doubted], result: Mapping[str, Any], left_out: Collection[str] = ()) -> list[Doubted]:
    """The `doubts` that the content of result.json answers: those of recordings that were fitted as they are and of
    which the final model leaves less than 1.5 times the noise, with no parameter three times off. What concerns sensors
    that were `left_out`, by name, is not answered and stays."""
    if result["verdict"] not in ("missing-physics", "parameters-only", "consistent"):
        return []
    if any(max(one["factor"], 1 / one["factor"]) > UPDATED for one in result["parameters"].values() if one["factor"]):
        return []
    left = {row["recording"]: times_noise(row, "final") for row in result["fit"]}
    noise = {name for name, times in left.items() if times is not None and times < BEYOND_NOISE}
    return [
        one
        for one in doubts
        if one.doubt.kind in ANSWERED
        and noise.issuperset(one.recordings)
        and not {one.doubt.channel, *one.doubt.order} & set(left_out)
    ]
