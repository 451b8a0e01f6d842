"""Measured shapes that are mostly noise, since the test hardly moved the mode: what a low MAC of theirs tells."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from femend.bench.reading.compared import Compared
from femend.numerals import plain

__all__ = ["faint_shapes"]

# 1 - MAC that the deviations of a shape may make by themselves, from which it is told; a MAC that is told
LOSS, LOW = 0.1, 0.95


def faint_shapes(compared: Sequence[Compared]) -> list[str]:
    """A sentence for every mode of a low MAC, or without a mate, whose shape is known to no better than that."""
    told = []
    for c in compared:
        best = {r.a: r.mac for r in c.comparison.table.rows}
        for i, lost in enumerate(_lost_to_noise(c)):
            own = best.get(i, float(np.nanmax(c.comparison.mac[i], initial=0.0)))
            if lost > LOSS and own < LOW:
                share = f"{plain(100 * np.sqrt(lost), 2)} %" if lost < 1 else "100 % and more"
                mode = f"the shape of mode {i + 1} at {plain(c.test.freq[i])} Hz"
                told.append(
                    f"recording {c.measured.name!r}: the deviation of {mode} is {share} of it, since the test hardly "
                    f"moves it: a MAC of {own:.2f} says little of the model, and the shape counts little in an "
                    "update; to have it, excite the mode elsewhere (`femend pretest`)"
                )
    return told


def _lost_to_noise(c: Compared) -> NDArray[np.float64]:
    """What deviations of the shapes take from a MAC of 1, (n_test,): their squares over those of the shape."""
    m = c.measured
    if m.shape_sd is None:
        return np.zeros(c.n_test)
    square = np.sum(np.abs(m.modes.shapes) ** 2, axis=0)
    return np.asarray(np.minimum(np.nansum(m.shape_sd**2, axis=0) / np.where(square > 0, square, np.inf), 1.0))
