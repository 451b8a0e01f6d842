"""A smooth curve through the pulses of a shaft."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline, make_smoothing_spline

__all__ = ["smooth_curve"]

FloatArray = NDArray[np.float64]


def smooth_curve(x: FloatArray, y: FloatArray, w: FloatArray | None = None, lam: float | None = None) -> BSpline:
    """Cubic smoothing spline through `y` (n,) over `x` (n,) with weights `w` (n,), n >= 6.

    scipy's natural spline (`lam` as there, None for generalised cross validation) of what a cubic polynomial leaves,
    and the polynomial added again: by itself a natural spline has no curvature at its ends, and a shaft that runs up
    would seem to have no acceleration there.
    """
    middle, scale = 0.5 * (x[0] + x[-1]), 0.5 * (x[-1] - x[0])
    s = (x - middle) / scale
    root = np.ones(x.size) if w is None else np.sqrt(w)
    powers = np.vander(s, 4, increasing=True)
    a = np.linalg.lstsq(powers * root[:, None], y * root, rcond=None)[0]
    curve = make_smoothing_spline(x, y - powers @ a, w=w, lam=lam)
    # coefficients of the polynomial on the same knots: its polar form at three knots each (de Boor and Fix)
    u = (curve.t - middle) / scale
    p, q, r = u[1:-3], u[2:-2], u[3:-1]
    own = a[0] + a[1] * (p + q + r) / 3 + a[2] * (p * q + p * r + q * r) / 3 + a[3] * p * q * r
    return BSpline(curve.t, curve.c + own, 3)
