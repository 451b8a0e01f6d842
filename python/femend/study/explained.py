"""Doubts about recordings that the result answers: where the final model leaves no more than noise of them as they are,
what looked mistaken against the deck was what the deck lacks."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

from femend.report.headline import BEYOND_NOISE
from femend.study.plausible import Doubted

__all__ = ["answered"]

# kinds of doubts that a final model which leaves the noise answers: with a level or a sign that is off it would not
ANSWERED = ("level", "sensor level", "sensor sign", "force sign", "exchanged", "held")
# factor on a parameter, or its inverse, from which a level may have gone into it
UPDATED = 3.0


def answered(doubts: Sequence[Doubted], result: Mapping[str, Any], left_out: Collection[str] = ()) -> list[Doubted]:
    """The `doubts` that the content of result.json answers: those of recordings that were fitted as they are and of
    which the final model leaves less than 1.5 times the noise, with no parameter three times off. What concerns sensors
    that were `left_out`, by name, was confirmed and stays."""
    if result["verdict"] not in ("missing-physics", "parameters-only", "consistent"):
        return []
    if any(max(one["factor"], 1 / one["factor"]) > UPDATED for one in result["parameters"].values() if one["factor"]):
        return []
    noise = {row["recording"] for row in result["fit"] if _to_the_noise(row)}
    return [
        one
        for one in doubts
        if one.doubt.kind in ANSWERED
        and noise.issuperset(one.recordings)
        and not {one.doubt.channel, *one.doubt.order} & set(left_out)
    ]


def _to_the_noise(row: Mapping[str, Any]) -> bool:
    floor, final = row["noise_floor"], row["final"]
    return row["role"] == "fit" and bool(floor) and final is not None and final < BEYOND_NOISE * floor
