"""Recordings of one configuration whose modes are those of two structures."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from femend.bench.updating.counted import Counted
from femend.correlate import compare_modes
from femend.data import ModeSet
from femend.numerals import plain

__all__ = ["contradicting"]

# difference of two frequencies of one mode, in its deviations and relative, from which it is of two structures: tests
# of one differ by little, and how much they are known to is often thought less than it is
DEVIATIONS, RELATIVE = 5.0, 0.02
# MAC from which two measured modes are one
SAME = 0.9


def contradicting(counted: Sequence[Counted]) -> list[str]:
    """What has to be said of recordings to be fitted that stand for one configuration and differ in a mode that both
    show; nothing of others, and of those without sensors in common."""
    pairs = itertools.combinations(counted, 2)
    return [text for a, b in pairs if a.configuration == b.configuration and (text := _differ(a, b))]


def _differ(a: Counted, b: Counted) -> str:
    common = {d.unsigned for d in a.dofs} & {d.unsigned for d in b.dofs}
    if len(common) < 2 or not a.freq.size or not b.freq.size:
        return ""
    found = compare_modes(_modes(a), _modes(b), mac_min=SAME)
    worst, said = 0.0, ""
    for pair in found.pairing.pairs:
        i, j = pair.a, pair.b
        off = float(b.freq[j] / a.freq[i] - 1)
        times = abs(float(b.freq[j] - a.freq[i])) / max(float(np.hypot(a.freq_sd[i], b.freq_sd[j])), 1e-300)
        if times < DEVIATIONS or abs(off) < max(RELATIVE, worst):
            continue
        worst = abs(off)
        said = (
            f"recordings {a.name!r} and {b.name!r} are of the configuration {a.configuration!r}, and not of one "
            f"structure: the same mode (MAC {float(found.mac[i, j]):.2f}) is at {plain(float(a.freq[i]), 4)} Hz in the "
            f"first and at {plain(float(b.freq[j]), 4)} Hz in the second ({100 * off:+.1f} %, {plain(times, 2)} times "
            "its deviation). No parameter makes both: give the one with another mass or support a [[configuration]] of "
            "its own, or leave one out"
        )
    return said


def _modes(c: Counted) -> ModeSet:
    return ModeSet(c.freq, c.zeta, c.phi, c.dofs, "max")
