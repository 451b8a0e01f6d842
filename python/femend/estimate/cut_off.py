"""What a record's end cuts off of modes far above the band: they follow the force at once, and so does the cut.

Lines are transforms of as much of a record as there is. Modes of the band ring on beyond its end, and their free decays
are estimated. Those far above it answer the force statically: their acceleration is the second derivative of the force
times a compliance, and its transform up to the end is not s^2 times that of the force, which was cut off at whatever it
stood at: by parts, it is s^2 U + (s f(T) + f'(T)) exp(-s T). At a node of solids, whose local compliance is large, that
shows.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femend import _core

__all__ = ["cut_off", "static_part"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# samples in which a force that is not periodic comes to rest beyond the end, for its derivatives up to there
REST = 64


def static_part(u: FloatArray, period: int, dt: float) -> FloatArray:
    """Second derivative (n_in, n) of band-limited forces u (n_in, n) that go on beyond their end: over again with
    `period` (samples), or to rest."""
    n = u.shape[1]
    beyond = u[:, n - period : n - period + REST] if period >= REST else 2 * u[:, -1:] - u[:, -2 : -2 - REST : -1]
    ends = 0.5 + 0.5 * np.cos(np.pi * (np.arange(beyond.shape[1]) + 0.5) / beyond.shape[1])
    whole = np.concatenate([u, beyond * ends], axis=1)
    size = 2 * whole.shape[1]
    omega = 2 * np.pi * np.fft.rfftfreq(size, dt)
    second = np.fft.irfft(-(omega**2) * np.fft.rfft(whole, size, axis=1), size, axis=1)
    return np.asarray(second[:, :n])


def cut_off(
    s: ComplexArray,
    lacking: ComplexArray,
    modal: tuple[FloatArray, FloatArray, FloatArray],
    rows: tuple[FloatArray, FloatArray],
    n_tuned: int,
    driven_to: float = 0.0,
) -> ComplexArray:
    """Accelerations (K, n_out) on lines s (K,) that modes without free decays have beside those of a force that was cut
    off, which is `lacking` (K, n_in) of the one they follow, and which excites up to `driven_to` rad/s; `modal` are
    omega and zeta (r,) and the modes (r, r) in the basis, `rows` those of the sensors and forces in it."""
    omega, zeta, Q = modal
    n = _core.n_decaying(omega, float(s.imag.max()), n_tuned, driven_to)
    out, into = (np.asarray(at @ Q[:, n:]) for at in rows)
    g = 1.0 / (s[:, None] ** 2 + 2 * (zeta * omega)[n:] * s[:, None] + omega[n:] ** 2)
    return np.asarray(s[:, None] ** 2 * ((g * (lacking @ into)) @ out.T))
