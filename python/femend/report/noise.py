"""How far fitted recordings are left from their noise, by the fit rows of result.json."""

from __future__ import annotations

from collections.abc import Sequence

from femend.report.entries import Result, number

__all__ = ["BEYOND_NOISE", "farthest_from_noise", "noise_without", "times_noise"]

# error of an updated model, in units of the noise, from which it cannot be said to explain the recordings
BEYOND_NOISE = 1.5


def times_noise(row: Result, stage: str) -> float | None:
    """What a `stage` (nominal, parameters, final) leaves of a fitted recording, in units of its noise; None of rows
    that tell no error, or were held out, which have no noise to be measured by."""
    floor, left = number(row.get("noise_floor")), number(row.get(stage))
    return None if row.get("role") != "fit" or not floor or left is None else left / floor


def noise_without(times: float, share: float) -> bool:
    """Whether an error of `times` the noise is noise without a `share` of its square."""
    return times * max(1 - share, 0.0) ** 0.5 < BEYOND_NOISE


def farthest_from_noise(fit: Sequence[Result], stage: str) -> tuple[float, Result | None]:
    """The fitted recording of which a `stage` leaves most, in units of its noise, and how much; (0, None) where no row
    tells."""
    known = [(times, row) for row in fit if (times := times_noise(row, stage)) is not None]
    return max(known, key=lambda found: found[0], default=(0.0, None))
