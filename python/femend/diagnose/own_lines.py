"""Whether what a place did is a force from outside, told by its spectrum: a few lines of its own.

A motor, a pump or somebody who walks drives a structure at a few frequencies, whatever else moves it, and may do so in
one recording and not in another. A law answers the motion of its place: where a broadband force moves that at all
frequencies, a law's force has its power where the motion has it or spreads it over many lines (Bussgang 1952), and
never gathers it on a few on which the motion has hardly any.
"""

from __future__ import annotations

import numpy as np

from femend.diagnose.recovered import Recovered

__all__ = ["on_own_lines"]

# peaks that a force may have, lines to each side of one that belong to it, and the share of what it does at the sensors
# that they hold at least
PEAKS, NEAR, GATHERED = 4, 3, 0.8
# share of the displacement's and of the velocity's power on these lines from which a law may have made the force
MOVED = 0.15
# lines on which the recorded force has its power, as a multiple of those of the peaks: of a sine or few tones a law
# makes a few others
BROADBAND = 2.0
# share of the force's greatest power in any recording below which a recording is taken to be without it
ACTS = 0.05


def on_own_lines(recovered: Recovered) -> list[int]:
    """Numbers of the records in which the recovered force acts, where in all of them it is gathered on a few lines on
    which the place hardly moves; none where it is not so."""
    power = [float(np.mean(f**2)) for f in recovered.f]
    acting = [i for i, own in enumerate(power) if own > ACTS * max(power)]
    return acting if all(_gathered(recovered, i) for i in acting) else []


def _gathered(recovered: Recovered, i: int) -> bool:
    """Whether what the force of record `i` does at the sensors is on lines of its own."""
    shown = recovered.weight[i][:, 0] * np.abs(recovered.F[i][:, 0]) ** 2
    near, left = np.zeros(len(shown), dtype=bool), shown.copy()
    for _ in range(PEAKS):
        top = int(np.argmax(left))
        peak = slice(max(0, top - NEAR), top + NEAR + 1)
        near[peak], left[peak] = True, 0.0
        if shown[near].sum() >= GATHERED * shown.sum():
            break
    else:
        return False
    moved = np.abs(recovered.D[i][:, 0]) ** 2
    shares = [power[near].sum() / power.sum() for power in (moved, moved * recovered.freq[i] ** 2)]
    record = recovered.records[i]
    excited = (np.abs(np.fft.rfft(record.u, axis=1)) ** 2).sum(axis=0)[recovered.index[i]]
    lines = excited.sum() ** 2 / (excited**2).sum()
    return bool(max(shares) < MOVED and lines > BROADBAND * near.sum())
