"""What has to be said where a fitted recording is left far from its noise, with nothing told and beside laws."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from femend.numerals import plain
from femend.report.headline import BEYOND_NOISE

__all__ = ["left_beside", "left_over"]

# error beside laws, in units of the noise, from which it is told
BESIDE_LAWS = 3.0


def left_over(verdict: str, fit: Sequence[Mapping[str, Any]]) -> str:
    """What has to be said beside silence where the updated model leaves clearly more than noise."""
    if verdict not in ("consistent", "parameters-only"):
        return ""
    times, worst = _farthest(fit, "parameters")
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
    times, worst = _farthest(fit, "final")
    if verdict != "missing-physics" or worst is None or times < BESIDE_LAWS:
        return ""
    return (
        f"with what is told the model still leaves {plain(100 * worst['final'], 2)} % of {worst['recording']}, "
        f"{plain(times, 2)} times its noise: something else that was not found shows there, or motion that depends on "
        "its past too much to be followed; predictions of such recordings are that far off"
    )


def _farthest(fit: Sequence[Mapping[str, Any]], stage: str) -> tuple[float, Mapping[str, Any] | None]:
    """The fitted recording of which a stage leaves most, in units of its noise, and how much; None where there is
    none."""
    rows = [row for row in fit if row["role"] == "fit" and row["noise_floor"] and row[stage]]
    worst = max(rows, key=lambda row: float(row[stage] / row["noise_floor"]), default=None)
    return (0.0, None) if worst is None else (float(worst[stage] / worst["noise_floor"]), worst)
