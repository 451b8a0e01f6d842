"""What has to be said where a fitted recording is left far from its noise, with nothing told and beside laws."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from femend.numerals import plain
from femend.report.noise import BEYOND_NOISE, farthest_from_noise

__all__ = ["left_beside", "left_over"]

# error beside laws, in units of the noise, from which it is told
BESIDE_LAWS = 3.0


def left_over(verdict: str, fit: Sequence[Mapping[str, Any]]) -> str:
    """What has to be said beside silence where the updated model leaves clearly more than noise."""
    if verdict not in ("consistent", "parameters-only"):
        return ""
    times, worst = farthest_from_noise(fit, "parameters")
    if worst is None or times < BEYOND_NOISE:
        return ""
    return (
        f"the updated model leaves {plain(times, 2)} times the noise of {worst['recording']}, which no law at one "
        "place explains clearly enough to be told; the mesh or the idealisation may leave that much: refine the mesh "
        "and see whether it shrinks, or record more sensors"
    )


def left_beside(verdict: str, fit: Sequence[Mapping[str, Any]]) -> str:
    """What has to be said beside laws that leave much of a recording: what chose them may not show all that is
    there."""
    times, worst = farthest_from_noise(fit, "final")
    if verdict != "missing-physics" or worst is None or times < BESIDE_LAWS:
        return ""
    return (
        f"with what is told the model still leaves {plain(100 * worst['final'], 2)} % of {worst['recording']}, "
        f"{plain(times, 2)} times its noise: something else that was not found shows there, or motion that depends on "
        "its past too much to be followed; predictions of such recordings are that far off"
    )
