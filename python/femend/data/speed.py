"""Speed of a shaft over time, with its angle."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.data._arrays import frozen
from femend.errors import SignalError
from femend.numerals import plain

__all__ = ["Speed"]


@dataclass(frozen=True, slots=True, eq=False)
class Speed:
    """Speed and angle of a shaft: `t` (n,) s increasing, `rev_per_s` (n,) in 1/s, `angle` (n,) in rad, cumulated.

    The angle is a multiple of 2 pi at the tacho's first pulse of every revolution, so that phases against it are phases
    against the tacho. `source` says where it comes from; `n_pulses` counts the pulses used, `missed` those put in and
    `doubled` those thrown out; `notes` say what was repaired. Arrays are read-only. Raises SignalError for shapes that
    do not fit, fewer than two samples, values that are not finite, a time axis that does not increase or an angle that
    turns back.

    >>> Speed([0.0, 1.0, 2.0], [2.0, 2.0, 2.0], 4 * np.pi * np.arange(3)).at(np.array([0.25]))
    (array([2.]), array([3.14159265]))
    """

    t: NDArray[np.float64]
    rev_per_s: NDArray[np.float64]
    angle: NDArray[np.float64]
    source: str = ""
    n_pulses: int = 0
    missed: int = 0
    doubled: int = 0
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for key in ("t", "rev_per_s", "angle"):
            object.__setattr__(self, key, frozen(getattr(self, key), np.float64))
        object.__setattr__(self, "notes", tuple(self.notes))
        if self.t.ndim != 1 or self.t.size < 2 or self.rev_per_s.shape != self.t.shape != self.angle.shape:
            raise SignalError(
                f"speed {self.source!r}: t {self.t.shape}, rev_per_s {self.rev_per_s.shape} and angle "
                f"{self.angle.shape} must be three arrays of one length from 2 on"
            )
        for key in ("t", "rev_per_s", "angle"):
            bad = ~np.isfinite(getattr(self, key))
            if bad.any():
                at = int(np.flatnonzero(bad)[0])
                raise SignalError(f"speed {self.source!r}: {key}[{at}] is not a number; leave the sample out")
        for key, steps in (("t", np.diff(self.t)), ("angle", np.diff(self.angle))):
            if steps.min() < 0 or (key == "t" and steps.min() == 0):
                at = int(np.argmin(steps))
                raise SignalError(
                    f"speed {self.source!r}: {key} falls by {-steps[at]:.6g} after {self.t[at]:.6g} s; a shaft that "
                    "turns back or a time axis that is not sorted has no orders, cut the record there",
                    time=float(self.t[at]),
                )

    @property
    def start(self) -> float:
        """First time in s."""
        return float(self.t[0])

    @property
    def stop(self) -> float:
        """Last time in s."""
        return float(self.t[-1])

    def at(self, t: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Speed (rev/s) and angle (rad) at times `t` (n,) s, by cubic Hermite interpolation of the angle.

        Raises SignalError for a time outside the known ones by more than 1e-9 of their span.
        """
        t = np.asarray(t, dtype=np.float64)
        slack = 1e-9 * (self.stop - self.start)
        if t.size and (t.min() < self.start - slack or t.max() > self.stop + slack):
            raise SignalError(
                f"speed {self.source!r} is known from {self.start:.6g} to {self.stop:.6g} s, asked for "
                f"{t.min():.6g} to {t.max():.6g} s; take the stretch that the tacho covers",
                time=float(t.min()),
            )
        t = np.clip(t, self.start, self.stop)
        k = np.clip(np.searchsorted(self.t, t, side="right") - 1, 0, self.t.size - 2)
        h = self.t[k + 1] - self.t[k]
        u = (t - self.t[k]) / h
        d0, d1 = 2 * np.pi * h * self.rev_per_s[k], 2 * np.pi * h * self.rev_per_s[k + 1]
        a0, rise = self.angle[k], self.angle[k + 1] - self.angle[k]
        # a0 + d0 u + (3 rise - 2 d0 - d1) u^2 + (d0 + d1 - 2 rise) u^3
        c2, c3 = 3 * rise - 2 * d0 - d1, d0 + d1 - 2 * rise
        angle = a0 + u * (d0 + u * (c2 + u * c3))
        return (d0 + u * (2 * c2 + 3 * u * c3)) / (2 * np.pi * h), angle

    def of_order(self, order: float) -> Speed:
        """Speed and angle of a shaft that turns `order` times while this one turns once: its order 1 is that order of
        this shaft. Raises SignalError for an order that is not above 0.

        >>> Speed([0.0, 1.0], [2.0, 2.0], [0.0, 4 * np.pi]).of_order(1.5).band()
        (3.0, 3.0)
        """
        if not (np.isfinite(order) and order > 0):
            raise SignalError(f"speed {self.source!r}: {order:g} is no order; take a number above 0")
        return replace(self, rev_per_s=order * self.rev_per_s, angle=order * self.angle)

    def band(self) -> tuple[float, float]:
        """Lowest and highest speed in rev/s."""
        return float(self.rev_per_s.min()), float(self.rev_per_s.max())

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON, without the samples."""
        return {
            "source": self.source,
            "start": self.start,
            "stop": self.stop,
            "rev_per_s": list(self.band()),
            "n_pulses": self.n_pulses,
            "missed": self.missed,
            "doubled": self.doubled,
            "notes": list(self.notes),
        }

    def __repr__(self) -> str:
        low, high = self.band()
        return (
            f"Speed({self.source!r}: {plain(low)} to {plain(high)} rev/s, {plain(self.start)} to {plain(self.stop)} s, "
            f"{self.n_pulses} pulses, {self.missed} missed, {self.doubled} double)"
        )
