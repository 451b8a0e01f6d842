"""What a law is to a sine: its force's first harmonic over the displacement's, the describing function."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend import _core
from femend.errors import LawParameterError
from femend.physics.entry import Physics

__all__ = ["describing_function"]

# samples of a cycle, and cycles before the one that is read, after which hysteresis repeats itself
SAMPLES, BEFORE = 256, 2


def describing_function(
    physics: Physics, values: Mapping[str, float], amplitude: ArrayLike, omega: ArrayLike
) -> NDArray[np.complex128]:
    """Equivalent dynamic stiffness (n,) in N/m of a law under d = A cos(omega t), A = `amplitude` (n,) in m.

    `omega` (n,) or one number is in rad/s; the real part is the spring and the imaginary part omega times the dashpot
    that do the law's work at that amplitude (Krylov and Bogoliubov; Gelb and Vander Velde 1968, eq. 2.2-19). Raises
    LawParameterError for an amplitude or frequency that is not positive and for parameters the law does not take.

    >>> from femend.physics import physics
    >>> describing_function(physics("cubic_stiffness"), {"k3": 4.0}, [1.0, 2.0], 10.0).real.round(6).tolist()
    [3.0, 12.0]
    """
    A, w = np.broadcast_arrays(np.atleast_1d(np.asarray(amplitude, float)), np.asarray(omega, float))
    if not (A.ndim == 1 and (A > 0).all() and (w > 0).all()):
        raise LawParameterError(f"{physics.name}: amplitudes and frequencies must be positive (n,)", law=physics.name)
    turn = 2 * np.pi * np.arange((BEFORE + 1) * SAMPLES) / SAMPLES
    last = np.exp(-1j * turn[-SAMPLES:]) * 2 / SAMPLES
    out = np.empty(len(A), dtype=np.complex128)
    for i, (a, omega_i) in enumerate(zip(A, w, strict=True)):
        d, v = a * np.cos(turn), -a * omega_i * np.sin(turn)
        dt = 2 * np.pi / (SAMPLES * omega_i)
        f = _core.law_force(physics.law or physics.name, dict(values), d, v, -(omega_i**2) * d, dt)
        out[i] = (f[-SAMPLES:] @ last) / a
    return out
