"""Stretches of spectra, over which a response is a smooth multiple of what drives it, beside a smooth transient."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["FIRST_LINE", "following", "left_over", "of_quieter", "stretches_of", "width_of"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# complex degrees of freedom left in a stretch of the noise estimate, and the quantile of the stretches that is taken
NOISE_FREEDOM, NOISE_QUANTILE = 9, 0.2
# the first line of the first stretch: those before hold the mean and its drift
FIRST_LINE = 2


def width_of(n_in: int) -> int:
    """Lines in a stretch: three unknowns for every force and the transient, and the freedom that is left."""
    return 3 * (n_in + 1) + NOISE_FREEDOM


def stretches_of(n_in: int, n_lines: int) -> list[slice]:
    """Overlapping stretches of a spectrum of `n_lines` lines with `n_in` forces."""
    width = width_of(n_in)
    return [slice(k, k + width) for k in range(FIRST_LINE, n_lines - width, max(1, width // 2))]


def left_over(U: ComplexArray, Y: ComplexArray) -> FloatArray:
    """Power (n_stretches, n_out) per line that local quadratic models of response and transient leave of the spectra Y
    (n_out, n_lines), driven by U (n_in, n_lines)."""
    width = width_of(len(U))
    delta = np.linspace(-1, 1, width)
    powers = np.vstack([np.ones(width), delta, delta**2])
    left = []
    for part in stretches_of(len(U), U.shape[1]):
        A = np.vstack([powers * row[part] for row in U] + [powers]).T
        e = Y[:, part].T - A @ np.linalg.lstsq(A, Y[:, part].T, rcond=None)[0]
        left.append((np.abs(e) ** 2).sum(axis=0) / NOISE_FREEDOM)
    return np.array(left)


def following(U: ComplexArray, Y: ComplexArray) -> float:
    """Share of the power of spectra Y (n_out, n_lines) that follows U (n_in, n_lines), about 0 of noise and 1 of what
    the forces move; NaN where the lines are too few for one stretch, or hold nothing."""
    if not stretches_of(len(U), U.shape[1]):
        return float("nan")
    whole = float((np.abs(Y) ** 2).mean(axis=1).sum())
    return 1.0 - float(left_over(U, Y).mean(axis=0).sum()) / whole if whole > 0 else float("nan")


def of_quieter(left: FloatArray) -> FloatArray:
    """Power (n_out,) of noise from what is left of stretches (n_stretches, n_out), as the quieter ones show it."""
    # a quantile of a gamma variable of NOISE_FREEDOM degrees over its mean
    from scipy.stats import gamma

    share = gamma.ppf(NOISE_QUANTILE, NOISE_FREEDOM) / NOISE_FREEDOM
    return np.asarray(np.quantile(left, NOISE_QUANTILE, axis=0) / share)
