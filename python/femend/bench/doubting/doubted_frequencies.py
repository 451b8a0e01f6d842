"""Measured frequencies that are all off by one factor, and single pairs that are too far apart to be one mode."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from femend.bench.reading.compared import OFF, Compared
from femend.bench.reading.measured import ALONE
from femend.correlate.tables import ModeRow
from femend.numerals import plain

__all__ = ["FREQUENCIES_FIRST", "doubted_frequencies", "far_pairs", "in_another_unit"]

FREQUENCIES_FIRST = "mend the frequencies that are all off by one factor first: parameters cannot make up for it"
# ratios nearer than this to their median, as logarithms, are one factor: a model before its update is off by as much
ONE = 0.2
# pairs that have to tell a factor, and the share of all of them
FEWEST, SHARE = 3, 0.6
# what multiplies frequencies by mistake: factor and what it looks like
KNOWN = (
    (2 * np.pi, "2 pi: they look like rad/s"),
    (60.0, "60: they look like 1/min"),
    (1e3, "1000: they look like mHz, or a time axis in ms"),
    (1 / (2 * np.pi), "1/(2 pi): they look as if Hz had been divided by 2 pi"),
    (1 / 60.0, "1/60: they look as if Hz had been divided by 60"),
    (1e-3, "1/1000: they look like kHz"),
)


def doubted_frequencies(compared: Sequence[Compared]) -> list[str]:
    """Recordings whose modes have the model's shapes at frequencies that are all off by about one factor.

    Of responses alone the time axis is looked at (`doubted_times`), and nothing is told here.
    """
    return [text for c in compared if (text := _told(c)[0])]


def in_another_unit(compared: Sequence[Compared]) -> list[str]:
    """As `doubted_frequencies`, of those alone whose factor is that of a known mistake (rad/s, 1/min, ms): no parameter
    may make up for these."""
    found = [_told(c) for c in compared]
    return [text for text, known in found if known]


def _told(c: Compared) -> tuple[str, bool]:
    """What is told of a recording whose frequencies are off by one factor, "" of others, and is it a known one?"""
    same = _one_factor(c)
    if c.measured.how == ALONE or not same:
        return "", False
    ratios = [1.0 / (1.0 + r.freq_difference) for r in same]
    factor = float(np.exp(np.median(np.log(ratios))))
    near = min(KNOWN, key=lambda known: abs(np.log(known[0] / factor)))
    known = bool(abs(np.log(near[0] / factor)) < ONE)
    looks = (
        f"about {near[1]}; give them in Hz, or check the units of the deck"
        if known
        else "check units, modulus, density and thickness of the deck (frequencies follow the root of stiffness "
        "over mass), and the unit of the measured frequencies"
    )
    text = (
        f"recording {c.measured.name!r}: {len(same)} of {c.n_test} measured modes have the model's shapes at "
        f"{plain(min(ratios), 3)} to {plain(max(ratios), 3)} times its frequencies, {looks}"
    )
    return text, known


def far_pairs(compared: Sequence[Compared]) -> list[str]:
    """Pairs further apart in frequency than a factor of 1.5, where that is not a factor of all frequencies."""
    told = []
    for c in compared:
        same = _one_factor(c)
        for r in c.comparison.table.rows:
            if same or abs(np.log1p(r.freq_difference)) <= np.log(OFF):
                continue
            told.append(
                f"recording {c.measured.name!r}: mode {r.a + 1} at {plain(r.freq_a)} Hz is paired with the model's "
                f"mode {r.b + 1} at {plain(r.freq_b)} Hz, {plain(100 * r.freq_difference, 3, signed=True)} % off: they "
                "hardly are one mode, though they look alike at these sensors; the model's own may lie nearer, where "
                "sensors or directions do not show it"
            )
    return told


def _one_factor(c: Compared) -> list[ModeRow]:
    """The pairs that tell one factor on all frequencies; none where there is no such factor."""
    rows = c.comparison.table.rows
    if len(rows) < FEWEST:
        return []
    off = np.log1p([r.freq_difference for r in rows])
    middle = float(np.median(off))
    same = [r for r, x in zip(rows, off, strict=True) if abs(x - middle) < ONE]
    return same if abs(middle) > np.log(OFF) and len(same) >= max(FEWEST, SHARE * len(rows)) else []
