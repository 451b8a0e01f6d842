"""How much of a change the sensors of a recording see, those that hardly move counting for nothing."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femend.estimate.cross_axis import STILL
from femend.selftest.plan import Replay

__all__ = ["Visible", "visible_beside"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Visible:
    """What a change of a recording is compared with: `noise` (n_out,) of every sensor in its own quantity, and `size`,
    the RMS motion over the sensors that move, each in units of its noise.

    A sensor that hardly moves adds its change to the sum like any other, but is not counted among those that the sum is
    shared by: noise is all that most of them record, and there may be many.
    """

    noise: FloatArray
    n_moving: int
    size: float

    def times(self, change: FloatArray) -> float:
        """RMS of a change (n_out, n) in units of the noise, over the sensors that move."""
        return self.of_moving(float(np.sqrt(np.mean((change / self.noise[:, None]) ** 2))))

    def of_moving(self, rms: float) -> float:
        """An RMS over all sensors as one over those that move."""
        return float(rms * np.sqrt(len(self.noise) / self.n_moving))

    def share(self, times: float) -> float:
        """How much of the motion a change of so many `times` the noise is, over all sensors."""
        return times / self.size

    def replay(self, replay: Replay) -> Replay:
        """The replay with the noise that changes are compared with."""
        return replace(replay, noise=self.noise)


def visible_beside(base: FloatArray, replay: Replay) -> Visible:
    """What changes of the responses `base` (n_out, n) of a replay are compared with.

    Noise below the share of the liveliest sensor's motion that is rounding counts as that share: two simulations differ
    by as much, and a recording that was itself simulated shows no other noise.
    """
    moved = np.sqrt(np.mean(base**2, axis=1))
    noise = np.array(replay.noise)
    for order in np.unique(replay.order):  # of one quantity, whose values compare
        own = replay.order == order
        noise[own] = np.maximum(noise[own], max(STILL * float(moved[own].max()), 1e-300))
    n_moving = max(int((moved > noise).sum()), 1)
    size = float(np.sqrt(np.sum((moved / noise) ** 2) / n_moving))
    return Visible(noise, n_moving, max(size, 1e-300))
