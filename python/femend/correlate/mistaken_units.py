"""Factors by which units that were mistaken for each other put channels, or a model, off."""

from __future__ import annotations

from collections.abc import Sequence

__all__ = ["FACTORS", "G", "INCH", "MILLI", "mistaken_as"]

# g in m/s^2; mm to the m, or N to the kN; mm to the inch
G, MILLI, INCH = 9.80665, 1000.0, 25.4
# the factors larger than one, and what they come from
FACTORS = (
    (G, "g and m/s²"),
    (MILLI, "m and mm, or N and kN"),
    (4.44822, "N and lbf"),
    (INCH, "mm and in"),
    (MILLI / INCH, "m and in"),
    (G * MILLI / INCH, "g and in/s²"),
    (G * MILLI, "g and mm/s²"),
)


def mistaken_as(factor: float, near: float, factors: Sequence[tuple[float, str]] = FACTORS) -> tuple[float, str] | None:
    """The first of the `factors` larger than one that a `factor` or its inverse is within `near` times of, and what it
    comes from; None where none is.

    >>> mistaken_as(0.00101, 1.2)
    (1000.0, 'm and mm, or N and kN')
    """
    size = max(factor, 1 / factor)
    return next(((known, of) for known, of in factors if 1 / near < size / known < near), None)
