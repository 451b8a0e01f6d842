"""Whether what a place did is a force from outside, told by its spectrum: a few lines of its own.

A motor, a pump or somebody who walks drives a structure at a few frequencies, whatever else moves it, and may do so in
one recording and not in another. A law answers the motion of its place: where a broadband force moves that at all
frequencies, a nonlinear law's force has its power where the motion has it or spreads it over many lines (Bussgang
1952). What a linear law gathers on a few lines on which the motion has hardly any, as an oscillator at its resonance
does, is as much stronger in another recording as the recorded force is.
"""

from __future__ import annotations

import numpy as np

from femend.diagnose.locating.recovered import Recovered

__all__ = ["on_own_lines"]

# peaks that a force may have, lines to each side of one that belong to it, and the share of what it does at the sensors
# that they hold at least
PEAKS, NEAR, GATHERED = 4, 3, 0.8
# share of what a spring, a dashpot or a mass does at the sensors that these lines hold, from which a law may have made
# the force
MOVED = 0.15
# lines on which the recorded force has its power, as a multiple of those of the peaks: of a sine or few tones a law
# makes a few others
BROADBAND = 2.0
# share of the force's greatest power in any recording below which a recording is taken to be without it; power against
# that of the recorded force, as a share of the most in any recording, below which it does not follow that
ACTS, FOLLOWS = 0.05, 0.1


def on_own_lines(recovered: Recovered) -> list[int]:
    """Numbers of the records in which the recovered force acts, where in all of them it is gathered on a few lines on
    which the place hardly moves, and it does not follow the recorded force from one record to another; none where it is
    not so, and of one record."""
    power = [float(np.mean(f**2)) for f in recovered.f]
    relative = [own / record.level**2 for own, record in zip(power, recovered.records, strict=True)]
    if min(relative) > FOLLOWS * max(relative):
        return []
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
    # what the forces of springs, dashpots and masses, which move as the place does, would do at the sensors
    spring = recovered.weight[i][:, 0] * np.abs(recovered.D[i][:, 0]) ** 2
    made = [spring * recovered.freq[i] ** (2 * order) for order in range(3)]
    shares = [power[near].sum() / power.sum() for power in made]
    record = recovered.records[i]
    excited = (np.abs(np.fft.rfft(record.u, axis=1)) ** 2).sum(axis=0)[recovered.index[i]]
    lines = excited.sum() ** 2 / (excited**2).sum()
    return bool(max(shares) < MOVED and lines > BROADBAND * near.sum())
