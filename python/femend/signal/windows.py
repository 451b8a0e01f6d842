"""Windows, and what an exponential window does to damping."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import get_window

from femend.errors import SignalError

__all__ = [
    "WINDOWS",
    "Window",
    "effective_averages",
    "exponential_window",
    "force_window",
    "make_window",
    "without_window",
]

FloatArray = NDArray[np.float64]

WINDOWS = ("hann", "flattop", "none")


@dataclass(frozen=True, slots=True, eq=False)
class Window:
    """Window `values` (n,); `decay` 1/s is what an exponential one adds to zeta omega of every mode, 0 for others."""

    values: FloatArray
    decay: float = 0.0

    @property
    def power(self) -> float:
        """Sum of squares, by which power spectral densities are scaled."""
        return float((self.values**2).sum())


def make_window(name: str, n: int) -> Window:
    """The window `name` ("hann", "flattop", "none") of `n` samples, periodic; raises SignalError for another name.

    >>> make_window("hann", 4).values
    array([0. , 0.5, 1. , 0.5])
    """
    if name not in WINDOWS:
        raise SignalError(f"window {name!r} is unknown; use one of {', '.join(WINDOWS)}")
    return Window(np.asarray(get_window("boxcar" if name == "none" else name, n), dtype=float))


def exponential_window(n: int, dt: float, end: float = 0.01) -> Window:
    """Window exp(-decay t) of `n` samples every `dt` s that falls to `end` at the last one (ISO 7626-5, 7.4).

    Raises SignalError unless 0 < end <= 1.

    >>> round(exponential_window(101, 0.01, 0.01).decay, 4)
    4.6052
    """
    if not 0 < end <= 1:
        raise SignalError(f"an exponential window cannot end at {end}; give a share between 0 and 1 of its beginning")
    decay = -np.log(end) / ((n - 1) * dt)
    return Window(np.exp(-decay * dt * np.arange(n)), float(decay))


def force_window(n: int, start: int, stop: int, taper: int = 0) -> Window:
    """One from sample `start` to before `stop` of `n`, falling as a half cosine over `taper` samples, zero elsewhere.

    It takes noise between and after hits out of a force record; raises SignalError where nothing is left.
    """
    if not 0 <= start < stop <= n:
        raise SignalError(f"a force window from sample {start} to {stop} does not lie within {n} samples")
    values = np.zeros(n)
    values[start:stop] = 1
    tail = min(taper, n - stop)
    values[stop : stop + tail] = 0.5 + 0.5 * np.cos(np.pi * (np.arange(tail) + 1) / (taper + 1))
    return Window(values)


def without_window(freq: FloatArray, zeta: FloatArray, decay: float) -> tuple[FloatArray, FloatArray]:
    """Natural frequencies (Hz) and damping ratios without the exponential window.

    `freq` and `zeta` (n_modes,) are those found with the window exp(-decay t), which moves every pole from s to
    s - `decay` (1/s), exactly: s = -zeta omega + decay + i omega_d.

    >>> f, z = without_window(np.array([10.0]), np.array([0.02]), 0.628)
    >>> round(float(z[0]), 4)
    0.01
    """
    omega = 2 * np.pi * np.asarray(freq, float)
    zeta = np.asarray(zeta, float)
    real = -zeta * omega + decay
    imaginary = omega * np.sqrt(1 - zeta**2)
    natural = np.hypot(real, imaginary)
    return natural / (2 * np.pi), -real / natural


def effective_averages(values: FloatArray, step: int, count: int) -> float:
    """Independent averages that `count` blocks windowed by `values` (n,) and shifted by `step` samples are worth.

    Welch, IEEE Trans. Audio Electroacoust. 15 (1967) 70, eq. for the variance with overlap.
    """
    power = float((values**2).sum())
    total = 0.0
    for k in range(1, count):
        if k * step >= values.size:
            break
        rho = float((values[k * step :] * values[: values.size - k * step]).sum()) / power
        total += (1 - k / count) * rho**2
    return count / (1 + 2 * total)
