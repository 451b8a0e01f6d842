"""Shear chains shaken by white noise, or by a sweep, whose modes are known in closed form from K and M."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg
from numpy.typing import NDArray
from scipy import signal

from femend import Channel, Dof, TimeData

Array = NDArray[np.float64]
FINER = 8  # the chain is integrated so many times finer than it is recorded


@dataclass(frozen=True)
class Chain:
    """A chain fixed at one end: stiffnesses and masses, damping ratio of all modes, the highest mode at `top` Hz."""

    k: tuple[float, ...] = (1.0, 1.0, 1.0, 1.0)
    m: tuple[float, ...] = (1.0, 1.0, 1.0, 1.0)
    zeta: float = 0.01
    top: float = 10.0

    @property
    def n(self) -> int:
        return len(self.k)

    def modes(self) -> tuple[Array, Array]:
        """Frequencies in Hz and mass-normalised shapes."""
        k = np.array(self.k)
        K = np.diag(k + np.append(k[1:], 0)) - np.diag(k[1:], 1) - np.diag(k[1:], -1)
        squares, phi = scipy.linalg.eigh(K, np.diag(self.m))
        omega = np.sqrt(squares)
        return self.top * omega / omega[-1], phi

    def accelerations(self, force: Array, rate: float) -> Array:
        """Accelerations at `rate` from forces (n, n_samples) held over steps of 1 / (FINER rate): exact."""
        freq, phi = self.modes()
        q = np.empty_like(force)
        for r, one in enumerate(phi.T @ force):
            omega = 2 * np.pi * freq[r]
            A = np.array([[0.0, 1.0], [-(omega**2), -2 * self.zeta * omega]])
            system = (A, np.array([[0.0], [1.0]]), A[1:], np.array([[1.0]]))
            b, a = signal.ss2tf(*signal.cont2discrete(system, 1 / (FINER * rate))[:4])
            q[r] = signal.lfilter(b[0], a, one)
        return signal.decimate(phi @ q, FINER, ftype="fir", axis=1)


def channels(n: int) -> tuple[Channel, ...]:
    return tuple(Channel(Dof(i + 1, 1), "acceleration", "m/s^2") for i in range(n))


def ambient(chain: Chain, seed: int, seconds: float, rate: float = 32.0, noise: float = 0.02) -> TimeData:
    """White noise on every mass, recorded with white `noise` (a share of each channel's deviation)."""
    rng = np.random.default_rng(seed)
    y = chain.accelerations(rng.standard_normal((chain.n, int(seconds * rate) * FINER)), rate)
    y = y + noise * y.std(axis=1, keepdims=True) * rng.standard_normal(y.shape)
    return TimeData("ambient", 1 / rate, y, channels(chain.n))


def sweep(chain: Chain, seconds: float, start: float, stop: float, rate: float = 64.0) -> tuple[TimeData, Array]:
    """An unbalance on the last mass whose speed rises steadily, recorded with 1 % noise; and the speed in Hz."""
    t = np.arange(int(seconds * rate) * FINER) / (FINER * rate)
    speed = start + (stop - start) * t / seconds
    force = np.zeros((chain.n, t.size))
    force[-1] = speed**2 * np.sin(2 * np.pi * np.cumsum(speed) / (FINER * rate))
    y = chain.accelerations(force, rate)
    y = y + 0.01 * y.std() * np.random.default_rng(1).standard_normal(y.shape)
    return TimeData("run-up", 1 / rate, y, channels(chain.n)), speed[::FINER]


def nearest(found: Array, true: Array) -> NDArray[np.int64]:
    """Position in `found` nearest to each of `true`."""
    return np.argmin(np.abs(found[:, None] - true[None, :]), axis=0)
