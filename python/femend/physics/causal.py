"""Constant structural damping by a force that follows from the past alone: a springpot.

kappa(s) = c s^alpha has the loss factor eta = tan(pi alpha / 2) at every frequency, and a stiffness
k = c omega^alpha cos(pi alpha / 2) that grows with it as causality asks (Kjartansson, J. Geophys. Res. 84 (1979) 4737).
k (1 + i eta) with one k is the same near one frequency only.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import atan, cos, log, pi, tan

import numpy as np
from numpy.typing import NDArray

__all__ = ["springpot", "structural", "structural_jacobian"]

FloatArray = NDArray[np.float64]

# alpha of a dashpot, whose loss factor has no number
STEEPEST = 0.98


def springpot(k: float, eta: float, omega: float) -> dict[str, float]:
    """Parameters c, alpha of the springpot with stiffness k and loss factor eta at omega (rad/s).

    >>> law = springpot(3.0, 0.1, 1.0)
    >>> round(law["c"], 6), round(law["alpha"], 6)
    (3.014963, 0.063451)
    """
    alpha = 2 / pi * atan(eta)
    return {"c": k / (omega**alpha * cos(pi * alpha / 2)), "alpha": alpha}


def structural(values: Mapping[str, float], omega: float) -> dict[str, float]:
    """k and eta of a springpot at omega (rad/s).

    >>> found = structural(springpot(3.0, 0.1, 50.0), 50.0)
    >>> round(found["k"], 9), round(found["eta"], 9)
    (3.0, 0.1)
    """
    alpha = min(values["alpha"], STEEPEST)
    return {"k": values["c"] * omega**alpha * cos(pi * alpha / 2), "eta": tan(pi * alpha / 2)}


def structural_jacobian(values: Mapping[str, float], omega: float) -> FloatArray:
    """Derivatives (2, 2) of k and eta over ln c and ln alpha."""
    alpha = min(values["alpha"], STEEPEST)
    k, half = structural(values, omega)["k"], pi * alpha / 2
    by_alpha = k * (log(omega) - pi / 2 * tan(half))
    return np.array([[k, alpha * by_alpha], [0.0, alpha * pi / 2 / cos(half) ** 2]])
