"""FRFs of one structure that differ from recording to recording: of a linear one they do not depend on the force."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from femend.data import FRF, Recording, Test
from femend.estimate.frf import FrfLines, frf_lines_of
from femend.numerals import plain

__all__ = ["frf_levels"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# difference of two recordings, as a share of their size and in their noise, from which it is told: channels that are
# calibrated anew, and sensors that are mounted anew, differ by a few per cent
DIFFER, NOISE = 0.1, 3.0
# as far as a resonance is looked for around the line where the difference is largest, relative, and the shift of it
# that is told
AROUND, SHIFT = 0.08, 0.002


def frf_levels(test: Test) -> list[str]:
    """A sentence for every two fit recordings of FRFs, of one configuration and on the same lines, that differ by far
    more than their noise at the sensors and inputs that they share."""
    fit = [r for r in test if r.role == "fit" and isinstance(r.data, FRF)]
    told = []
    for a, b in combinations(fit, 2):
        if a.configuration == b.configuration and (text := _difference(a, b)):
            told.append(text)
    return told


def _difference(a: Recording, b: Recording) -> str:
    """What is said of two recordings; nothing where they agree or share nothing."""
    one, other = a.data, b.data
    assert isinstance(one, FRF)
    assert isinstance(other, FRF)
    shared = _shared(one, other)
    if shared is None:
        return ""
    x, y = shared
    freq = x.freq
    apart = np.sum(np.abs(x.H - y.H) ** 2, axis=1)
    noise = np.sum(x.noise**2 + y.noise**2)
    size = 0.5 * np.sum(np.abs(x.H) ** 2 + np.abs(y.H) ** 2)
    share, times = float(np.sqrt(apart.sum() / size)), float(np.sqrt(apart.sum() / noise))
    if share < DIFFER or times < NOISE:
        return ""
    f = float(freq[np.argmax(apart)])
    peaks = [_peak(freq, H, f) for H in (x.H, y.H)]
    where = f"most near {plain(f, 4)} Hz"
    if abs(peaks[1] / peaks[0] - 1) > SHIFT:
        at_a, at_b = (plain(peak, 4) for peak in peaks)
        where += f", where a resonance stands at {at_a} Hz in the one and at {at_b} Hz in the other"
    return (
        f"FRFs of {a.name!r} and {b.name!r} differ by {plain(100 * share, 2)} % at the sensors that they share, "
        f"{plain(times, 2)} times their noise, {where}: those of a linear structure do not depend on the force. If it "
        "is the same structure, stiffness or damping depends on the level, which FRFs average over: record force and "
        "responses in time at both levels, from which such laws are named; if something was changed between, give each "
        "its configuration"
    )


def _shared(one: FRF, other: FRF) -> tuple[FrfLines, FrfLines] | None:
    """The lines of both at the pairs of sensors and inputs that they share, side by side; None where there is none, or
    they stand at other frequencies."""
    if one.freq.shape != other.freq.shape or not np.allclose(one.freq, other.freq, rtol=1e-9, atol=0.0):
        return None
    inputs = [(i, j) for i, x in enumerate(one.inputs) for j, y in enumerate(other.inputs) if x.dof == y.dof]
    outputs = [(i, j) for i, x in enumerate(one.outputs) for j, y in enumerate(other.outputs) if x.dof == y.dof]
    if not inputs or not outputs:
        return None
    sides = []
    for side, frf in enumerate((one, other)):
        rows = [pair[side] for pair in outputs]
        columns = [frf_lines_of(frf, pair[side]) for pair in inputs]
        H, noise = (np.hstack([v[:, rows] for v in values]) for values in zip(*((c.H, c.noise) for c in columns)))
        sides.append(FrfLines(columns[0].freq, H, noise, columns[0].step, columns[0].allowance))
    return sides[0], sides[1]


def _peak(freq: FloatArray, H: ComplexArray, f: float) -> float:
    """Frequency (Hz) of the largest response within a few per cent of `f`."""
    near = np.flatnonzero(np.abs(freq / f - 1) < AROUND)
    return float(freq[near[np.argmax((np.abs(H[near]) ** 2).sum(axis=1))]])
