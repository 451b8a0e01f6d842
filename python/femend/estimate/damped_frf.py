"""FRFs on lines s = sigma + i omega, to the right of those they were measured on.

H is analytic there, so that it is the mean of its values on the imaginary axis under Poisson's kernel,

    H(sigma + i w) = 1/pi ∫ H(i v) sigma / (sigma² + (w - v)²) dv,

which is a window exp(-sigma |t|) on the impulse response, of which a causal one feels the half t > 0. An FRF ends where
it was measured, mostly among modes, and begins above 0 Hz; cut off there it is no longer causal, and was off by as much
as it is large: a model as the structure is left thousands of times the noise on such lines. So what is averaged is its
difference from a model that is about right, whose values on the lines are known; beyond the ends that difference is
taken to be nothing, and may be as large as inside.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from femend.estimate.frf import FrfLines

__all__ = ["damped"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# last part of the impulse response that stands for times before the impulse: lines that are coarse beside the
# resonances bring what rings on past their period round to its beginning
BEFORE = 0.25
# how far the axis is continued with nothing, so that it does not close on itself
PADDED = 2


def damped(
    frf: FrfLines, sigma: float, model: Callable[[ComplexArray], ComplexArray]
) -> tuple[ComplexArray, FloatArray]:
    """Accelerances (K, n_out) of an FRF, whose axis is even, on its lines moved by `sigma` (1/s), and the variance of
    each: of its noise, and of what was not recorded. `model` gives those of a model at s (K,)."""
    at = np.rint(frf.freq / frf.step).astype(np.int64)
    n = 2 * PADDED * int(at[-1])
    t = np.arange(n) / (n * frf.step)
    window = np.exp(-sigma * np.where(t < (1 - BEFORE) / frf.step, t, 1 / frf.step - t))[:, None]

    def averaged(values: ComplexArray | FloatArray) -> ComplexArray:
        full = np.zeros((n // 2 + 1, values.shape[1]), dtype=complex)
        full[at] = values
        return np.asarray(np.fft.rfft(np.fft.irfft(full, n, axis=0) * window, axis=0)[at])

    measured = np.asarray(2j * np.pi * frf.freq, dtype=np.complex128)
    off = frf.H - model(measured)
    inside = np.clip(averaged(np.ones((len(at), 1))).real, 0.0, 1.0)
    beside = np.maximum(averaged(np.abs(off) ** 2).real, 0.0) / np.maximum(inside, 1e-12)
    noise = frf.noise**2 * float((window**2).mean())
    return model(sigma + measured) + averaged(off), noise + (1 - inside) ** 2 * beside
