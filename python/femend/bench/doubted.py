"""Sensors and units of a test that look mistaken against the model."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from femend.bench.compared import Compared
from femend.correlate.doubts import level_doubts
from femend.correlate.exchanged import CLEAR
from femend.data import FRF
from femend.errors import RecordingError
from femend.estimate.frf import frf_lines_of

__all__ = ["MEND_FIRST", "doubted_levels", "doubted_sensors"]

MEND_FIRST = "mend the sensors that look reversed or exchanged before anything is updated"


def doubted_sensors(compared: Sequence[Compared]) -> list[str]:
    """Sensors that look reversed or exchanged in the paired modes of each recording."""
    return [f"recording {c.measured.name!r}: {f.text}" for c in compared for f in c.faults]


def doubted_levels(compared: Sequence[Compared], *, of_all: bool = False) -> list[str]:
    """What the FRFs of a recording are larger or smaller by than the model's, where units explain it: of single
    sensors too, or `of_all` alone."""
    told = []
    for c in compared:
        if c.measured.frf is not None and c.frf is not None:
            names = [str(channel.dof) for channel in c.measured.frf.outputs]
            doubts = level_doubts(c.measured.frf.H, c.frf.H, names, _clear(c.measured.frf))
            told += [f"recording {c.measured.name!r}: {d.text}" for d in doubts if not (of_all and d.channel)]
    return told


def _clear(frf: FRF) -> NDArray[np.bool_] | None:
    """Values (n_freq, n_out, n_in) that stand clear of their noise; None where lines are too few to tell it."""
    try:
        lines = [frf_lines_of(frf, j) for j in range(len(frf.inputs))]
    except RecordingError:
        return None
    clear = np.zeros(frf.H.shape, dtype=np.bool_)
    clear[frf.freq > 0] = np.stack([np.abs(one.H) > CLEAR * one.noise for one in lines], axis=2)
    return clear
