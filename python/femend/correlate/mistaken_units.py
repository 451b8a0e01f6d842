"""Factors by which units that were mistaken for each other put channels, or a model, off."""

from __future__ import annotations

__all__ = ["FACTORS", "G", "INCH", "MILLI"]

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
