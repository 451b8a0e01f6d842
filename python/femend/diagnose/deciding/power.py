"""What the excitation cannot tell, however good the model is."""

from __future__ import annotations

from collections.abc import Sequence

from femend.diagnose.updating.levels import levels_differ
from femend.estimate import FitRecord
from femend.estimate.noise import noise_in_silence

__all__ = ["untold"]


def untold(records: Sequence[FitRecord]) -> list[str]:
    """Sentences on what fit records cannot tell: those of one level, FRFs, and those without repetition and without a
    rest in which the noise shows; none of what repeats itself at several levels.

    Several levels tell laws that depend on the level from such that do not, and a difference of periods holds noise
    alone, where what random forces leave also holds distortion (Pintelon and Schoukens, System Identification, 2nd ed.,
    ch. 4).
    """
    if all(r.frf is not None for r in records):
        return [
            "FRFs alone hold no level: a hardening or softening stiffness cannot be told from a linear one, nor "
            "friction from a dashpot, and no such law was tried; give time records of two levels or more"
        ]
    said = []
    timed = [r for r in records if r.frf is None]
    if not levels_differ(timed):
        names = ", ".join(r.name for r in timed)
        said.append(
            f"one level only ({names}): a hardening or softening stiffness may pass for a linear one, friction for a "
            "dashpot, and one law that depends on the level for another; record one at least twice as strong or as weak"
        )
    if not any(r.period or noise_in_silence(r.u, r.y) is not None for r in timed):
        said.append(
            "no recording repeats itself: what a weak nonlinearity spreads over all lines counts as noise, so that it "
            "may go unseen; a multisine of two periods or more tells it from noise, and so does a force that ends early"
        )
    return said
