"""Modes over speed: branches, critical speeds, limits of stability."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.data._arrays import frozen

__all__ = ["Campbell", "CriticalSpeed", "StabilityLimit"]


@dataclass(frozen=True, slots=True)
class CriticalSpeed:
    """A branch that crosses the line frequency = `order` x speed.

    `speed` in rad/s, `freq` in Hz, `branch` its number from 0, `whirl` from -1 (backward) over 0 (planar) to 1
    (forward), `zeta` the damping fraction there, `residual` of the mode solved at this very speed.
    """

    order: float
    branch: int
    speed: float
    freq: float
    whirl: float
    zeta: float
    residual: float

    @property
    def rpm(self) -> float:
        """Speed in 1/min."""
        return self.speed * 30.0 / np.pi


@dataclass(frozen=True, slots=True)
class StabilityLimit:
    """A branch whose damping changes sign at `speed` (rad/s); `unstable_above` tells on which side motion grows.

    `freq` in Hz. A branch that is unstable at the first speed has its limit there.
    """

    branch: int
    speed: float
    freq: float
    unstable_above: bool


@dataclass(frozen=True, slots=True, eq=False)
class Campbell:
    """Modes followed over speed.

    `speed` (n_speeds,) in rad/s: those asked for and those put between where following was ambiguous (`asked`
    (n_speeds,) tells which). `poles`, `whirl`, `residual`, `follow` (n_speeds, n_branches): poles in rad/s, NaN
    where a branch is not among the modes computed (it left the range or became overdamped); whirl from -1 (backward)
    to 1 (forward), NaN where nothing turns; residual of the whole model; bi-orthogonality with the mode before, 1 where
    the shape went on and near 0.5 where two branches were mixed. `critical` and `limits` as their classes tell.
    `divergent` (n_speeds,): real poles with growing motion. `notes` says what is not complete: fewer modes than asked
    for, branches that were lost, critical speeds of modes that are not followed.
    """

    speed: NDArray[np.float64]
    asked: NDArray[np.bool_]
    poles: NDArray[np.complex128]
    whirl: NDArray[np.float64]
    residual: NDArray[np.float64]
    follow: NDArray[np.float64]
    critical: tuple[CriticalSpeed, ...]
    limits: tuple[StabilityLimit, ...]
    divergent: NDArray[np.int64]
    orders: tuple[float, ...] = (1.0,)
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        kinds: dict[str, Any] = {"poles": np.complex128, "asked": np.bool_, "divergent": np.int64}
        for name in ("speed", "asked", "poles", "whirl", "residual", "follow", "divergent"):
            object.__setattr__(self, name, frozen(getattr(self, name), kinds.get(name, np.float64)))

    @property
    def rpm(self) -> NDArray[np.float64]:
        """Speeds (n_speeds,) in 1/min."""
        return np.asarray(self.speed * (30.0 / np.pi))

    @property
    def freq(self) -> NDArray[np.float64]:
        """Im pole / 2 pi (n_speeds, n_branches) in Hz."""
        return np.asarray(self.poles.imag / (2 * np.pi))

    @property
    def zeta(self) -> NDArray[np.float64]:
        """-Re pole / |pole| (n_speeds, n_branches), 0 for rigid-body modes."""
        size = np.abs(self.poles)
        return np.where(size == 0, 0.0, -self.poles.real / np.where(size == 0, 1.0, size))

    def __repr__(self) -> str:
        listed = ", ".join(f"{c.rpm:.5g}" for c in self.critical[:6]) + (", …" if len(self.critical) > 6 else "")
        unstable = f"; {len(self.limits)} limits of stability" if self.limits else ""
        return (
            f"Campbell({self.poles.shape[1]} branches at {self.speed.size} speeds up to {self.rpm[-1]:.5g} 1/min; "
            f"critical at {listed or 'none'} 1/min{unstable})"
        )
