"""Sensors and units of a test that look mistaken against the model."""

from __future__ import annotations

from collections.abc import Sequence

from femend.bench.compared import Compared
from femend.correlate.doubts import level_doubts

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
            doubts = level_doubts(c.measured.frf.H, c.frf.H, names)
            told += [f"recording {c.measured.name!r}: {d.text}" for d in doubts if not (of_all and d.channel)]
    return told
