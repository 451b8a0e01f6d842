"""Whether models that explain the beginning of the recordings as well part as far as the final model leaves the rest.

Motion that hangs on little, impacts say, can be followed for a while only: what the right law leaves later is how far
models part that explain as much. Where these stay together, what is left is of something else.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femend.diagnose.deciding.outcome import Diagnosis
from femend.diagnose.deciding.plain_error import left_of
from femend.diagnose.deciding.spread import as_good, spread
from femend.estimate import noise_floor
from femend.numerals import plain

__all__ = ["left_by_something_else"]

# how many times as far as models part that explain the beginning as well, one deviation from the final one, and as the
# noise is, a recording is left by something else
BEYOND = 3.0


def left_by_something_else(found: Diagnosis) -> str:
    """What has to be said where a fit recording as a whole is left by far more than its noise and than models part on
    it that explain the window of the diagnosis about as well; "" where none is, or no models could be drawn."""
    models = as_good(found)
    if models is None:
        return ""
    whole = replace(found, sigma=0.0)
    for record in found.problem.records:
        floor, parted = noise_floor(record, found.problem.band), spread(models, found, record).share
        left = left_of(whole, record)
        if np.sqrt(max(left**2 - floor**2, 0.0)) > BEYOND * max(floor, parted):
            return (
                f"the law explains the beginning of the recordings alone, and leaves {plain(100 * left, 2)} % of "
                f"{record.name!r} as a whole. Models that explain the beginning as well part by "
                f"{plain(100 * parted, 2)} % of it, so that its motion can be followed: something is missing beside "
                "the law, or instead of it. Add sensors where the mismatch map is high, or record the structure at a "
                "weaker level too"
            )
    return ""
