"""A part of the only fit recording that no law is fitted to, so that laws are not chosen on what they were fitted to.

The last part in time is held back. Laws are fitted to what comes before it: linear ones on its lines, others simulated
from rest. On the held-back part linear ones have the lines of that part, with a state of every mode at its beginning
that is as free as at the end of any record; others are simulated from rest through the whole recording, so that their
state at the cut is their own, and compared from there on.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femend.estimate import FitRecord, Problem
from femend.numerals import plain

__all__ = ["HELD_BACK", "HeldBack", "before", "hold_back", "since"]

FloatArray = NDArray[np.float64]

# share of the recording that is held back
HELD_BACK = 0.35
# lines of the held-back part a mode of the band, and its cycles of the band's lower end, from which it can choose: its
# lines also tell the state of every mode at the cut, which are two unknowns a mode
LINES_A_MODE, CYCLES = 8.0, 8.0
# stretches of the band in which the force is compared, and the least share of its energy in each that both parts have
# to hold, in what they would hold of one that does not change: a sweep excites other modes in each, a blow only one
STRETCHES, EVEN = 6, 0.25


@dataclass(frozen=True, slots=True)
class HeldBack:
    """What is held back of a recording: from sample `cut` on; with a `cut` of 0 nothing is, and `why` says so."""

    name: str
    cut: int
    seconds: float
    why: str = ""

    @property
    def text(self) -> str:
        """On what the laws were chosen, as a sentence for people."""
        if self.cut == 0:
            return f"laws were chosen on recording {self.name!r}, which they were fitted to as well: {self.why}"
        return (
            f"laws were chosen on the last {100 * HELD_BACK:.0f} % ({plain(self.seconds, 3)} s) of recording "
            f"{self.name!r}, which none was fitted to"
        )


def hold_back(problem: Problem) -> HeldBack:
    """What is held back of the only record of `problem`."""
    (record,) = problem.records
    if record.frf is not None:
        return HeldBack(record.name, 0, 0.0, "an FRF has no part in time to hold back; record another")
    if not record.driven:
        return HeldBack(record.name, 0, 0.0, "its force was not recorded; record another")
    cut = int(round((1 - HELD_BACK) * record.n))
    seconds = (record.n - cut) * record.dt
    why = _too_short(problem, seconds) or _uneven(problem, record, cut)
    return HeldBack(record.name, 0 if why else cut, seconds, why)


def before(record: FitRecord, cut: int) -> FitRecord:
    """The record up to sample `cut`."""
    return record.part(0, cut, record.period if 2 * record.period <= cut else 0)


def since(record: FitRecord, cut: int) -> FitRecord:
    """The record as it is compared from sample `cut` on."""
    return replace(record, start=cut)


def _too_short(problem: Problem, seconds: float) -> str:
    """Why a part of so many seconds cannot choose; empty where it can."""
    low, high = problem.band
    modes = max(problem.n_tuned, 1)
    # a band from 0 Hz has no cycles at its lower end
    needed = max(LINES_A_MODE * modes / (high - low), CYCLES / low if low > 0 else 0.0)
    if seconds >= needed:
        return ""
    lines = int(seconds * (high - low))
    cycles = f" and {plain(seconds * low, 2)} cycles of its lower end" if low > 0 else ""
    return (
        f"its last {100 * HELD_BACK:.0f} % are {plain(seconds, 3)} s, {lines} lines of the band {plain(low, 3)} to "
        f"{plain(high, 3)} Hz with {modes} mode(s){cycles}, too few to choose by; record "
        f"{plain(needed / HELD_BACK, 2)} s or more, or another level"
    )


def _uneven(problem: Problem, record: FitRecord, cut: int) -> str:
    """Why the parts of a record before and after the cut show different things; empty where they do not."""
    edges = np.linspace(*problem.band, STRETCHES + 1)
    early, late = (_energy(part, record.dt, edges) for part in (record.u[:, :cut], record.u[:, cut:]))
    whole = np.maximum(early + late, 1e-300)
    # a stretch in which the force hardly has anything tells nothing in either part
    driven = whole > 0.01 * whole.max()
    for share, of in ((late / whole, HELD_BACK), (early / whole, 1 - HELD_BACK)):
        worst = int(np.argmin(np.where(driven, share, np.inf)))
        if share[worst] < EVEN * of:
            part = "last" if of == HELD_BACK else "first"
            return (
                f"its {part} {100 * of:.0f} % hold {plain(100 * share[worst], 2)} % of the force's energy between "
                f"{plain(edges[worst], 3)} and {plain(edges[worst + 1], 3)} Hz, too little to choose by; record a "
                "second one, or a force that goes on through the recording in the whole band"
            )
    return ""


def _energy(u: FloatArray, dt: float, edges: FloatArray) -> FloatArray:
    """Energy (n_stretches,) of forces u (n_in, n) between frequencies `edges` (Hz)."""
    freq = np.fft.rfftfreq(u.shape[1], dt)
    power = (np.abs(np.fft.rfft(u, axis=1)) ** 2).sum(axis=0) / max(u.shape[1], 1)
    return np.asarray(np.histogram(freq, bins=edges, weights=power)[0])
