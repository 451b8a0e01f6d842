"""Forces of a rotor's unbalance: their course over a run, and the pattern in which they act on the bearings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.data import Speed
from femend.model.terms.unknowns import Unknown

__all__ = ["DELAY", "Run", "Unbalance", "run_of", "unbalance_unknowns"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# unknown: by how much the tacho's channel is late against the accelerations
DELAY = "tacho: delay"
# the force fades out over this time after the record's end, so that its spectrum ends too
FADE = 1.0


@dataclass(frozen=True, eq=False)
class Unbalance:
    """Unbalance U = m r at bearings of a shaft along `axis` (0, 1, 2 for X, Y, Z), turning in the sense `sense`.

    At shaft angle theta, bearing b pulls with Omega^2 U_b in the direction e_u cos(theta + phi_b) + sense e_v
    sin(theta + phi_b), where (e_u, e_v, shaft) are right-handed in this order: sense +1 turns about +axis by the right
    hand. Unknowns are U cos(phi) and U sin(phi) of each bearing.
    """

    nodes: tuple[int, ...]
    axis: int
    sense: int = 1

    @property
    def plane(self) -> tuple[int, int]:
        """Components 0..2 of e_u and e_v."""
        return (self.axis + 1) % 3, (self.axis + 2) % 3

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the unknowns, two for each bearing."""
        return tuple(f"unbalance at {n}: {part}" for n in self.nodes for part in ("U cos(phi)", "U sin(phi)"))

    def speed(self, freq: FloatArray) -> FloatArray:
        """Speed (K,) in rad/s, positive about +axis, at which a run is heard on lines `freq` (K,) Hz: the shaft turned
        that often per second when it drove them. A run has to be slow against the decay of its modes."""
        return np.asarray(self.sense * 2 * np.pi * np.asarray(freq, dtype=np.float64))

    def pattern(self, direction_rows: FloatArray) -> FloatArray:
        """Forces on the basis (2 n_bearings, 2, r): by unknown and by course (Omega^2 cos, Omega^2 sin).

        `direction_rows` (n_bearings, 3, r) are rows of the basis in X, Y, Z of each bearing.
        """
        u, v = self.plane
        done = []
        for rows in direction_rows:
            e_u, e_v = rows[u], self.sense * rows[v]
            # cos(theta + phi) = cos(phi) cos - sin(phi) sin; sin(theta + phi) = cos(phi) sin + sin(phi) cos
            done += [np.stack([e_u, e_v]), np.stack([e_v, -e_u])]
        return np.array(done)


def unbalance_unknowns(unbalance: Unbalance, size: float, step: float) -> list[Unknown]:
    """Unknowns of an unbalance of the order `size` (mass times length), and of a delay of the tacho.

    The delay is of the order of half a sampling step `step` (s): pulses are seen when a sample is taken, accelerations
    behind their filters.
    """
    found = [Unknown(n, size, positive=False, sd=10.0, unit="m_r", owner="unbalance") for n in unbalance.names]
    return [*found, Unknown(DELAY, step, positive=False, sd=0.5, unit="s", owner="tacho")]


@dataclass(frozen=True, eq=False)
class Run:
    """The courses Omega^2 cos(theta), Omega^2 sin(theta) of a run as spectra.

    `freq` (K,) Hz are the lines of a record of `n` samples at `dt` s and of silence behind it, `F` (K, 2) the courses'
    transforms there. `lead` samples at the first speed come before the record. `omega` (padded,) rad/s is the speed at
    every sample, the last one's in the silence.
    """

    freq: FloatArray
    F: ComplexArray
    n: int
    dt: float
    lead: int
    omega: FloatArray

    def back(self, Y: ComplexArray) -> FloatArray:
        """Time records (..., n) of spectra Y (..., K') on the run's first K' lines; the others are taken as zero."""
        y = np.fft.irfft(Y, self.padded, axis=-1)
        return np.asarray(y[..., self.lead : self.lead + self.n])

    @property
    def padded(self) -> int:
        """Samples of record, lead, fading and silence together."""
        return 2 * (len(self.freq) - 1)


def run_of(
    speed: Speed,
    n: int,
    dt: float,
    steady: float = 0.0,
    onset: float = 0.0,
    tail: float = 20.0,
    power: tuple[float, float] = (2.0, 1.0),
) -> Run:
    """The run of a record of `n` samples at `dt` s from the tacho's `speed`, whose time counts from its first sample.

    For `steady` seconds before the record the shaft turns at the speed it begins with; without, the force sets in with
    the record, growing linearly for `onset` seconds. `tail` seconds of silence follow, in which the motion dies away
    before the transform repeats itself. With a `power` (n, reference in rev/s) other than 2 the courses grow with
    Omega^n, and are Omega^2 at the reference.
    """
    lead, fade = int(round(steady / dt)), int(round(FADE / dt))
    t = dt * np.arange(n)
    rev, angle = speed.at(np.clip(t, speed.t[0], speed.t[-1]))
    angle = angle + 2 * np.pi * rev * (t - np.clip(t, speed.t[0], speed.t[-1]))
    before = -dt * np.arange(lead, 0, -1)
    behind = dt * np.arange(1, fade + 1)
    theta = np.concatenate([angle[0] + 2 * np.pi * rev[0] * before, angle, angle[-1] + 2 * np.pi * rev[-1] * behind])
    omega = 2 * np.pi * np.concatenate([np.full(lead, rev[0]), rev, np.full(fade, rev[-1])])
    window = np.ones(len(theta))
    window[lead + n :] = 0.5 * (1 + np.cos(np.pi * np.arange(1, fade + 1) / (fade + 1)))
    if lead:
        rise = min(lead, fade)
        window[:rise] = 0.5 * (1 - np.cos(np.pi * np.arange(rise) / rise))
    elif onset > 0.0:
        window = window * np.minimum(1.0, dt * np.arange(len(window)) / onset)
    n_speed, reference = power
    grown = omega**2 * (omega / (2 * np.pi * reference)) ** (n_speed - 2.0)
    courses = window * grown * np.stack([np.cos(theta), np.sin(theta)])
    full = len(theta) + int(round(tail / dt))
    full += full % 2
    F = np.fft.rfft(courses, full, axis=1).T
    freq = np.asarray(np.fft.rfftfreq(full, dt), dtype=np.float64)
    return Run(freq, np.asarray(F), n, dt, lead, np.pad(omega, (0, full - len(omega)), "edge"))
