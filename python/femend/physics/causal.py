"""Constant structural damping by a force that follows from the past alone: a springpot, or a box of relaxation rates.

k (1 + i eta) with one k is causal near one frequency only. The springpot kappa(s) = c s^alpha has the loss factor
eta = tan(pi alpha / 2) at every frequency, and a stiffness k = c omega^alpha cos(pi alpha / 2) that grows with it as
causality asks (Kjartansson, J. Geophys. Res. 84 (1979) 4737). The box kappa(s) = c ln(1 + s tau) has the loss c pi / 2
at every frequency far above 1/tau, and a stiffness that grows with the logarithm (Neubert, Aeronautical Quarterly 14
(1963) 187). With little loss they are the same; with much they part over a wide band.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import atan, cos, expm1, hypot, log, pi, tan

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

__all__ = ["CAUSAL", "box_spectrum", "springpot", "structural", "structural_jacobian"]

FloatArray = NDArray[np.float64]

# laws that are told as structural damping in the middle of the band
CAUSAL = ("springpot", "box_spectrum")
# alpha of a dashpot, whose loss factor has no number
STEEPEST = 0.98
# ln(1 + omega tau) between which a box of rates is sought: loss factors from 0.03 to 60
LEAST, MOST = 0.03, 60.0


def springpot(k: float, eta: float, omega: float) -> dict[str, float]:
    """Parameters c, alpha of the springpot with stiffness k and loss factor eta at omega (rad/s).

    >>> law = springpot(3.0, 0.1, 1.0)
    >>> round(law["c"], 6), round(law["alpha"], 6)
    (3.014963, 0.063451)
    """
    alpha = 2 / pi * atan(eta)
    return {"c": k / (omega**alpha * cos(pi * alpha / 2)), "alpha": alpha}


def box_spectrum(k: float, eta: float, omega: float) -> dict[str, float]:
    """Parameters c, tau of the box of rates with stiffness k and loss factor eta (0.03 to 50) at omega (rad/s).

    >>> found = structural(box_spectrum(3.0, 0.4, 50.0), 50.0)
    >>> round(found["k"], 9), round(found["eta"], 9)
    (3.0, 0.4)
    """
    at = brentq(lambda x: _box(expm1(x))[1] - eta * _box(expm1(x))[0], LEAST, MOST)
    return {"c": k / _box(expm1(at))[0], "tau": expm1(at) / omega}


def _box(x: float) -> tuple[float, float]:
    """Real and imaginary part of ln(1 + i x)."""
    return log(hypot(1.0, x)), atan(x)


def structural(values: Mapping[str, float], omega: float) -> dict[str, float]:
    """k and eta at omega (rad/s) of a springpot (c, alpha) or a box of rates (c, tau).

    >>> found = structural(springpot(3.0, 0.1, 50.0), 50.0)
    >>> round(found["k"], 9), round(found["eta"], 9)
    (3.0, 0.1)
    """
    if "tau" in values:
        stored, lost = _box(omega * values["tau"])
        return {"k": values["c"] * stored, "eta": lost / stored}
    alpha = min(values["alpha"], STEEPEST)
    return {"k": values["c"] * omega**alpha * cos(pi * alpha / 2), "eta": tan(pi * alpha / 2)}


def structural_jacobian(values: Mapping[str, float], omega: float) -> FloatArray:
    """Derivatives (2, 2) of k and eta over the logarithms of the law's parameters."""
    found = structural(values, omega)
    k, eta = found["k"], found["eta"]
    if "tau" in values:
        x = omega * values["tau"]
        # d ln(1 + i x) / d ln x = i x / (1 + i x)
        stored, lost = 1 / (1 + x**-2), 1 / (x + 1 / x)
        own = values["c"] / k
        return np.array([[k, values["c"] * stored], [0.0, own * (lost - eta * stored)]])
    alpha = min(values["alpha"], STEEPEST)
    half = pi * alpha / 2
    by_alpha = k * (log(omega) - pi / 2 * tan(half))
    return np.array([[k, alpha * by_alpha], [0.0, alpha * pi / 2 / cos(half) ** 2]])
