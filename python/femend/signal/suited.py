"""FRFs of a time record by the estimator that suits its force: blow by blow, or averaged over pieces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from femend.data import FRF, TimeData
from femend.errors import SignalError
from femend.signal.frf import estimate_frf
from femend.signal.impact import impact_frf

__all__ = ["blow_block", "blows", "suited_frf"]

# a force is blows where it is above this share of its peak in no more than this share of the samples
RISE, RARE = 0.1, 0.02
# seconds within which samples belong to one blow, and within which one is the rebound of another, where that is also a
# small share of the longest time without a blow
ONE, REBOUND, SOON = 0.05, 0.25, 0.125
# share of the time between two blows that a block takes, and the most of it that lies ahead of the blow
BLOCK, BEFORE = 0.95, 0.02
# blows from which a coherence tells noise
TELLING = 3


def blows(data: TimeData) -> NDArray[np.float64]:
    """Times (n,) in s from the record's beginning at which the one force of `data` strikes; none of another force. A
    blow and its rebound are one.

    >>> from femend.data import Channel
    >>> u = np.zeros(1000)
    >>> u[[100, 101, 600]] = 5.0, 3.0, 4.0
    >>> blows(TimeData("r", 0.01, [u], [Channel(None, "force", "N")])).tolist()
    [1.0, 6.0]
    """
    rows = data.rows("force")
    if len(rows) != 1:
        return np.zeros(0)
    x = np.abs(data.values[rows[0]] - np.median(data.values[rows[0]]))
    above = np.flatnonzero(x > RISE * x.max())
    if not above.size or above.size > max(RARE * x.size, 3):
        return np.zeros(0)
    apart = np.flatnonzero(np.diff(above) * data.dt > ONE)
    at = above[np.concatenate([[0], apart + 1])] * data.dt
    gaps = np.diff([*at, data.duration])
    return np.asarray(at[np.concatenate([[True], gaps[:-1] > min(REBOUND, SOON * float(gaps.max()))])])


def blow_block(data: TimeData, at: NDArray[np.float64]) -> float:
    """Length (s) of the piece of `data` that is taken of each blow at the times `at` (n,) in s."""
    return BLOCK * float(np.diff([*at, data.duration]).min())


def suited_frf(data: TimeData, block: float | None = None) -> tuple[FRF, tuple[str, ...]]:
    """FRFs (H1) of `data`, and what to mind about them.

    A hammer's record is cut at its blows, each with its ringing, without a window that would tear them apart (ISO
    7626-5), in pieces of `block` s, by default as long as the blows are apart; where none is single, with all of the
    force of each piece, which says what the responses answer as well but where two blows cancel each other. Others, and
    blows of which none can be used, are averaged over pieces (`estimate_frf`). A coherence of less than three blows
    says nothing and is left out.
    Raises what `estimate_frf` raises.
    """
    at = blows(data)
    if not at.size:
        return estimate_frf(data).frf, ()
    block = blow_block(data, at) if block is None else block
    before = min(BEFORE, BLOCK * float(at[0]) / max(block, data.dt))
    told: list[str] = []
    try:
        found = impact_frf(data, block, before=before)
    except SignalError as error:
        try:
            found = impact_frf(data, block, before=before, double=np.inf, window_force=False)
        except SignalError:
            return estimate_frf(data).frf, (f"{error}; its FRFs are averaged over pieces, which tear blows apart",)
        times = ", ".join(f"{hit.time:.4f}" for hit in found.hits if hit.kept)
        told = [f"recording {data.name!r}: no hit is single; those at {times} s are taken with all of their force"]
    kept = sum(hit.kept for hit in found.hits)
    told += [*(str(h) for h in found.hits if not h.kept), *found.estimate.notes]
    if kept >= TELLING:
        return found.frf, tuple(dict.fromkeys(told))
    told = [text for text in told if not text.startswith("one average")]
    few = f"{kept} blow{'s' * (kept > 1)} in it: noise is told from line to line alone; strike {TELLING} times or more"
    return replace(found.frf, coherence=None), tuple(dict.fromkeys([*told, few]))
