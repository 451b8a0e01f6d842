"""Measured modes that look like another of their own test: one mode identified twice."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from femend.bench.reading.compared import Compared
from femend.numerals import plain

__all__ = ["doubted_twice", "twins", "without_twins"]

# AutoMAC above which two shapes of a test are one, and the share that frequencies of one mode may differ by: a second
# pole lies within some half-power widths, modes further apart look alike where sensors do not tell them apart
ALIKE, NEAR = 0.9, 0.05


def twins(c: Compared) -> dict[int, int]:
    """Modes of the test without a mate in the model, and the one with a mate that each is likely to be once more."""
    paired = [r.a for r in c.comparison.table.rows]
    found = {}
    for i in sorted(set(range(c.n_test)) - set(paired)):
        near = [p for p in paired if abs(c.test.freq[p] / c.test.freq[i] - 1) < NEAR and c.automac[i, p] > ALIKE]
        if near:
            found[i] = max(near, key=lambda p: float(c.automac[i, p]))
    return found


def doubted_twice(compared: Sequence[Compared]) -> list[str]:
    """A sentence for every mode that looks like one identified twice."""
    return [
        f"recording {c.measured.name!r}: mode {i + 1} at {plain(c.test.freq[i])} Hz has the shape of mode {p + 1} at "
        f"{plain(c.test.freq[p])} Hz (MAC {c.automac[i, p]:.2f}), and no mate of its own: one mode identified twice? "
        "`femend update` leaves it out unless [updating] modes names it"
        for c in compared
        for i, p in twins(c).items()
    ]


def without_twins(c: Compared) -> NDArray[np.float64]:
    """AutoMAC (n, n) of the test without modes that stand there twice."""
    keep = sorted(set(range(len(c.automac))) - set(twins(c)))
    return c.automac[np.ix_(keep, keep)]
