"""Whether models that explain the beginning of the recordings as well part as far as the final model leaves the rest.

Motion that hangs on little, impacts say, can be followed for a while only: what the right law leaves later is how far
models part that explain as much. Where these stay together, what is left is of something else.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from femend.diagnose.deciding.outcome import Diagnosis
from femend.diagnose.deciding.plain_error import left_in_band
from femend.diagnose.deciding.spread import as_good, spread
from femend.estimate import noise_floor
from femend.numerals import plain

__all__ = ["Parting", "parting"]

# how many times as far as models part that explain the beginning as well, one deviation from the final one, and as the
# noise is, a recording is left by something else
BEYOND = 3.0


@dataclass(frozen=True, slots=True)
class Parting:
    """Whether what a law of a beginning leaves of the whole recordings is how far models part that explain the
    beginning as well: it `accounts` for what is left, or `otherwise` is what has to be said; neither where no models
    could be drawn."""

    accounts: bool = False
    otherwise: str = ""


def parting(found: Diagnosis) -> Parting:
    """What is left of each fit recording as a whole, beyond its noise, against how far models part on it that explain
    the window of the diagnosis about as well, both in the band that models are compared in."""
    models = as_good(found)
    if models is None:
        return Parting()
    whole = replace(found, sigma=0.0)
    for record in found.problem.records:
        floor, parted = noise_floor(record, found.problem.band), spread(models, found, record, found.problem.band).share
        left = left_in_band(whole, record)
        if np.sqrt(max(left**2 - floor**2, 0.0)) > BEYOND * max(floor, parted):
            return Parting(
                otherwise="the law explains the beginning of the recordings alone, and leaves "
                f"{plain(100 * left, 2)} % of {record.name!r} as a whole. Models that explain the beginning as well "
                f"part by {plain(100 * parted, 2)} % of it, so that its motion can be followed: something is missing "
                "beside the law, or instead of it. Add sensors where the mismatch map is high, or record the structure "
                "at a weaker level too"
            )
    return Parting(accounts=True)
