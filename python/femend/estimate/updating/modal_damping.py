"""Damping ratios of real modes to first order, and as a response."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.estimate.updating.responses import Compared, Mates, deviation, needed
from femend.estimate.updating.state import State

__all__ = ["DampingRatios", "ratio_slopes", "ratios"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class DampingRatios:
    """Modal damping ratios `zeta` (n_test,), fractions, with deviations `sd` (n_test,), fractions too.

    The system has to be asked for them (`damping=True` of `deck_system`, `modal_system`). Raises UpdatingError for a
    deviation that is not above 0.
    """

    zeta: FloatArray
    sd: FloatArray
    name: str = "damping"

    def __post_init__(self) -> None:
        object.__setattr__(self, "zeta", np.asarray(self.zeta, dtype=np.float64))
        object.__setattr__(self, "sd", deviation(self.sd, self.zeta.shape, self.name))

    @property
    def n_modes(self) -> int:
        """Number of measured modes."""
        return self.zeta.size

    def compare(self, state: State, mates: Mates | None, slopes: bool) -> Compared:
        """Residuals of the paired modes of `state`, in the order of the test modes of `mates`."""
        pairs = needed(mates, self.name)
        t, m = pairs.test, pairs.mate[pairs.test]
        residual = (state.value("zeta")[m] - self.zeta[t]) / self.sd[t]
        return Compared(residual, state.slope("zeta")[:, m] / self.sd[t] if slopes else None)


def ratios(C: Any, H: Any, omega: FloatArray, phi: FloatArray) -> FloatArray:
    """zeta (n_modes,) = (phi^T C phi + phi^T H phi / omega) / (2 omega) of mass-normalised `phi` (n, n_modes) at
    `omega` (n_modes,) rad/s: exact for proportional damping, else to first order in viscous `C` and hysteretic `H`
    (Geradin and Rixen, Mechanical Vibrations, 2015, section 3.2). 0 for modes of a free body."""
    c, h = (phi * (C @ phi)).sum(axis=0), (phi * (H @ phi)).sum(axis=0)
    w = _above_0(omega)
    return np.asarray(np.where(np.isfinite(w), (c + h / w) / (2 * w), 0.0))


def ratio_slopes(
    C: Any,
    H: Any,
    dC: list[Any],
    dH: list[Any],
    omega: FloatArray,
    domega: FloatArray,
    phi: FloatArray,
    dphi: FloatArray,
) -> FloatArray:
    """Derivatives (n_parameters, n_modes) of `ratios`, from those of the matrices `dC`, `dH` (one a parameter), of
    `omega`, `domega` (n_parameters, n_modes), and of the shapes `phi`, `dphi` (n_parameters, n, n_modes)."""
    w = _above_0(omega)
    Cx, Hx = C @ phi, H @ phi
    c, h = (phi * Cx).sum(axis=0), (phi * Hx).sum(axis=0)
    out = np.zeros((len(dC), omega.size))
    for i, (one_c, one_h) in enumerate(zip(dC, dH, strict=True)):
        change = (phi * (one_c @ phi)).sum(axis=0) + (phi * (one_h @ phi)).sum(axis=0) / w
        change += 2 * (dphi[i] * (Cx + Hx / w)).sum(axis=0)
        out[i] = change / (2 * w) - (c / (2 * w**2) + h / w**3) * domega[i]
    return np.where(np.isfinite(w), out, 0.0)


def _above_0(omega: FloatArray) -> FloatArray:
    """omega with infinity for modes of a free body, whose damping is no ratio."""
    return np.asarray(np.where(omega > 1e-6 * omega.max(initial=0.0), omega, np.inf))
