"""How far fitted recordings are left from their noise, by the fit rows of result.json."""

from __future__ import annotations

from collections.abc import Sequence

from femend.report.entries import Result, number

__all__ = ["BEYOND_NOISE", "farthest_from_noise"]

# error of an updated model, in units of the noise, from which it cannot be said to explain the recordings
BEYOND_NOISE = 1.5


def farthest_from_noise(fit: Sequence[Result], stage: str) -> tuple[float, Result | None]:
    """The fitted recording of which a `stage` (nominal, parameters, final) leaves most, in units of its noise, and how
    much: rows that were held out have no noise to be measured by. (0, None) where no row tells."""
    known = [
        (left / floor, row)
        for row in fit
        if row.get("role") == "fit" and (floor := number(row.get("noise_floor"))) and (left := number(row.get(stage)))
    ]
    return max(known, key=lambda found: found[0], default=(0.0, None))
