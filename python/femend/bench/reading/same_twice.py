"""Recordings of a study that are one and the same test, listed twice."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from femend.bench.reading.measured import MeasuredModes

__all__ = ["same_twice"]

# two tests of one structure agree less in all their frequencies, and damping ratios, relative to these
FREQ, ZETA = 1e-6, 1e-3
# modes that have to agree
FEWEST = 2


def same_twice(measured: Sequence[MeasuredModes]) -> list[str]:
    """Pairs of recordings of one configuration whose modes are the same to all digits: a file that is listed twice, or
    in two formats, counts twice in a fit, and holds nothing out."""
    told = []
    for one, other in combinations(measured, 2):
        if not _same(one, other):
            continue
        both = f"recordings {one.name!r} and {other.name!r} hold the same {one.modes.freq.size} modes to all digits"
        roles = {one.role, other.role}
        if roles == {"fit"}:
            told.append(f"{both}: one test that counts twice makes deviations too narrow; leave one of them out")
        elif roles == {"fit", "validate"}:
            held, fitted = (one, other) if one.role == "validate" else (other, one)
            told.append(
                f"{both}: {held.name!r} is held out and is what {fitted.name!r} was fitted to, so that it confirms "
                "nothing; hold out a test of its own"
            )
    return told


def _same(one: MeasuredModes, other: MeasuredModes) -> bool:
    a, b = one.modes, other.modes
    if one.configuration != other.configuration or a.freq.size != b.freq.size or a.freq.size < FEWEST:
        return False
    sensors = {d.unsigned for d in a.dofs} == {d.unsigned for d in b.dofs}
    return bool(
        sensors
        and np.allclose(a.freq, b.freq, rtol=FREQ, atol=0.0)
        and np.allclose(a.zeta, b.zeta, rtol=ZETA, atol=1e-12)
    )
