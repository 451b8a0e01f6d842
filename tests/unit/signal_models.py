"""Structures that answer sampled forces exactly, for tests of estimators (forces held between samples)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import cont2discrete, dfreqresp, dlti, lfilter

from femend.data import Channel, TimeData
from femend.dof import Dof

# natural frequency in Hz, damping ratio, mass-normalised shape at two DOFs
MODES = ((12.0, 0.02, (0.8, 0.5)), (31.0, 0.015, (0.5, -0.9)))


def force(node: int) -> Channel:
    return Channel(Dof(node, 3), "force", "N", f"f{node}")


def acceleration(node: int) -> Channel:
    return Channel(Dof(node, 3), "acceleration", "m/s^2", f"a{node}")


def _mode(freq: float, zeta: float, dt: float) -> tuple[NDArray, NDArray]:
    w = 2 * np.pi * freq
    system = (np.array([[0, 1], [-w * w, -2 * zeta * w]]), np.array([[0.0], [1.0]]))
    out = (np.array([[-w * w, -2 * zeta * w]]), np.array([[1.0]]))
    A, B, C, D, _ = cont2discrete((*system, *out), dt)
    # the transfer function of one mode, numerator over denominator
    den = np.poly(A)
    num = np.poly(A - B @ C) + (D[0, 0] - 1) * den
    return num, den


def respond(forces: NDArray, dt: float, modes: tuple = MODES) -> NDArray:
    """Accelerations (2, n) to forces (n_in, n) at the first n_in DOFs, held constant between samples."""
    out = np.zeros((2, forces.shape[1]))
    for freq, zeta, shape in modes:
        num, den = _mode(freq, zeta, dt)
        modal = sum(shape[i] * f for i, f in enumerate(forces))
        out += np.outer(shape, lfilter(num, den, modal))
    return out


def accelerance(freq: NDArray, dt: float, n_in: int, modes: tuple = MODES) -> NDArray:
    """What `respond` has as FRF (n_freq, 2, n_in), exactly."""
    H = np.zeros((freq.size, 2, n_in), complex)
    for f, zeta, shape in modes:
        num, den = _mode(f, zeta, dt)
        h = dfreqresp(dlti(num, den, dt=dt), 2 * np.pi * freq * dt)[1]
        H += h[:, None, None] * np.outer(shape, shape[:n_in])
    return H


def measured(forces: NDArray, dt: float, noise: float = 0.0, noise_in: float = 0.0, seed: int = 0) -> TimeData:
    """Record of forces and both accelerations, with white noise of the given standard deviations."""
    rng = np.random.default_rng(seed)
    y = respond(forces, dt)
    values = np.vstack(
        [forces + noise_in * rng.standard_normal(forces.shape), y + noise * rng.standard_normal(y.shape)]
    )
    names = (*(force(i + 1) for i in range(len(forces))), acceleration(1), acceleration(2))
    return TimeData("test", dt, values, names)
