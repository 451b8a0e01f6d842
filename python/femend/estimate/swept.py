"""Records whose force passes through the band in turn (sweeps), pressed into a pulse for strongly damped lines.

A window exp(-sigma t) is as good as more damping only where the force shows all of the band while it is open: of a
sweep it shows the frequencies that came first. Taking the phase of the force's spectrum off force and responses alike
leaves a linear structure what it is, since both go through one and the same filter, white noise as white as it was, and
makes a pulse of the sweep (pulse compression, Cook and Bernfeld, Radar Signals, 1967, ch. 1).
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from femend.estimate.lines import FitRecord
from femend.estimate.rest import beginning

__all__ = ["in_turn", "pressed"]

FloatArray = NDArray[np.float64]

# stretches of the band in which the force's time is told, and the least energy, in the largest, of one that counts
STRETCHES, DRIVEN = 6, 0.01
# share of a stretch's energy by which the force has come there, and the share of the record by which these times differ
# where the band is passed through in turn: noise and multisines come everywhere at once, a blow too
COME, APART = 0.1, 0.25
# the pulse comes so many periods of the band's low end after the beginning: it is no sharper than the band allows
DELAY = 1.0


def in_turn(record: FitRecord, band: tuple[float, float]) -> bool:
    """Whether the forces of a time record come to parts of the band (Hz) one after the other."""
    if record.frf is not None or not record.driven:
        return False
    freq = np.fft.rfftfreq(record.n, record.dt)
    spectrum = np.fft.rfft(record.u, axis=1)
    edges = np.linspace(*band, STRETCHES + 1)
    energy, come = [], []
    for low, high in pairwise(edges):
        inside = (freq >= low) & (freq < high)
        share = np.cumsum((np.fft.irfft(spectrum * inside, record.n, axis=1) ** 2).sum(axis=0))
        energy.append(float(share[-1]))
        come.append(int(np.searchsorted(share, COME * share[-1])))
    times = np.array(come)[np.array(energy) > DRIVEN * max(energy)]
    return bool(np.ptp(times) > APART * record.n) if len(times) else False


def pressed(record: FitRecord, band: tuple[float, float]) -> FitRecord:
    """The record with its one force pressed into a pulse near the beginning; as it is where there are several forces,
    or where they come to the whole band (Hz) at once.

    What the force's end cuts off the responses is cut off here too, early where it was passed late, so that this is for
    lines on which motion dies away soon (`sigma` > 0).
    """
    if len(record.u) != 1 or not in_turn(record, band):
        return record
    n = 2 * record.n
    U, Y = np.fft.rfft(record.u, n, axis=1), np.fft.rfft(record.y, n, axis=1)
    omega = 2 * np.pi * np.fft.rfftfreq(n, record.dt)
    filtered = U[0].conj() / np.maximum(np.abs(U[0]), 1e-300) * np.exp(-1j * omega * DELAY / band[0])
    u, y = (np.ascontiguousarray(np.fft.irfft(X * filtered, n, axis=1)[:, : record.n]) for X in (U, Y))
    begin = beginning(u)
    return replace(record, u=u[:, begin:], y=y[:, begin:], period=0, start=0, across=None)
