"""Measured modes above all that a solver of the user's own gives, which no mode of it can be a mate of."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from femend.bench.reading.compared import Compared
from femend.numerals import plain

if TYPE_CHECKING:
    from femend.bench.reading.prepared import Prepared

__all__ = ["beyond_the_solver"]


def beyond_the_solver(prepared: Prepared, compared: Sequence[Compared]) -> list[str]:
    """A sentence for every recording with modes without a mate above the last mode of the study's solver; nothing where
    the deck's own modes are compared, which are computed as far as the test goes."""
    if prepared.solver is None:
        return []
    told = []
    for c in compared:
        paired = {r.a for r in c.comparison.table.rows}
        last = float(np.max(c.modes.freq, initial=0.0))
        above = [i for i, f in enumerate(c.test.freq) if i not in paired and f > last]
        if above:
            n, first = len(above), f"mode {above[0] + 1} at {plain(c.test.freq[above[0]])} Hz"
            told.append(
                f"recording {c.measured.name!r}: the result of the solver ends with its mode {c.modes.n_modes} at "
                f"{plain(last)} Hz, below {n} of the measured modes ({first} is the first of "
                "them), which have no mate for that: ask the solver for more modes"
            )
    return told
