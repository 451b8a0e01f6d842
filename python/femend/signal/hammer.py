"""The force of a hammer without the noise of its channel while it is in the air."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femend.data import TimeData
from femend.signal.suited import blows

__all__ = ["blow_force"]

# a blow is where the force stands this many deviations out of its channel's noise
OUT = 8.0
# and this many samples, and seconds, before and after: a recorder's filter rings
SAMPLES, SECONDS = 32, 0.02


def blow_force(force: TimeData) -> NDArray[np.float64]:
    """Values (n_ch, n_samples) of a `force`; where it is blows, 0 away from them and without its offset.

    A hammer in the air exerts no force, and noise of a thousandth of a blow's peak that lasts for a record of seconds
    drives the model as strongly as the blow (force window, ISO 7626-5, 7.4.1). Other forces are as they were recorded.
    """
    if not blows(force).size:
        return np.array(force.values)
    row = force.rows("force")[0]
    x = force.values[row] - np.median(force.values[row])
    noise = 1.4826 * float(np.median(np.abs(x)))
    around = max(SAMPLES, int(SECONDS / force.dt))
    there = np.convolve(np.abs(x) > OUT * noise, np.ones(2 * around + 1), "same") > 0
    values = np.array(force.values)
    values[row] = np.where(there, x, 0.0)
    return values
