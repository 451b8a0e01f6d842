"""Whether a model is further from the recordings outside the band alone, which its mesh is not trusted with."""

from __future__ import annotations

import numpy as np

from femend.data.bands import within_band
from femend.diagnose.deciding.outcome import Diagnosis
from femend.diagnose.deciding.plain_error import counted
from femend.diagnose.deciding.stages import final, updated

__all__ = ["further_outside_alone"]

# share of the power of all recordings that may stand outside the band where it is no part of them that counts
OUTSIDE = 0.1


def further_outside_alone(found: Diagnosis) -> bool:
    """Whether the final model is nearer to the time recordings than the updated one in the band, and where it is
    further off, outside, little was recorded and a model that does not move would leave more.

    There resonances stand where the mesh puts them, beside those of the structure, and which of two models is nearer is
    chance; a law that does something there which was not recorded leaves more than all that was.
    """
    if any(record.frf is not None for record in found.problem.records):
        return False
    sums = np.zeros((3, 2))
    for record in found.problem.records:
        before = updated(found, record)
        after = final(found, record, before)
        inside = within_band(np.fft.rfftfreq(record.n, record.dt), found.problem.band)
        for row, y in zip(sums, (before - record.y, after - record.y, record.y), strict=True):
            power = (np.abs(np.fft.rfft(counted(found, record, y), axis=1)) ** 2).sum(axis=0)
            row += power[inside].sum(), power[~inside].sum()
    (in_before, _), (in_after, out_after), (in_band, outside) = sums
    nearer = in_before > found.settings.worse**2 * in_after
    return bool(nearer and out_after < outside < OUTSIDE * (in_band + outside))
