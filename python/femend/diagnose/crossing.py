"""Whether sensors are believed as they are, or may hold shares of the motion across them and be off in calibration."""

from __future__ import annotations

from collections.abc import Sequence

from femend.diagnose.locate import Located, locate
from femend.diagnose.update import AT_NOISE, CLEARLY, UpdatedModel
from femend.estimate import Fit
from femend.model import Place

__all__ = ["as_sensors_are"]

# prior cost of a model beside a free force, in `CLEARLY`, up to which it explains the recordings with that, and what is
# left at most, as a share of its misfit, with what sensors pick up where it does not
WITHIN, MOST = 2.0, 0.5


def as_sensors_are(
    start: UpdatedModel, located: list[Located], places: Sequence[Place]
) -> tuple[UpdatedModel, list[Located]]:
    """An updated model with its places, `located` of all `places`, or both where sensors pick up motion across them or
    are off in calibration.

    Shares of motion also take away what is missing where a sensor hardly moves. So sensors are believed where the
    model explains the recordings with a free force somewhere (where it does alone with such shares, `update_model` has
    taken them), and where the shares make no great difference: with them a force neither explains what it does not
    without, nor leaves half as much.
    """
    best, crossing = located[0].fit if located else start.null, start.crossing
    if crossing is None or _explains(best):
        return start, located
    there = locate(crossing.problem, crossing.reduced, places, crossing.null)
    left = there[0].fit if there else crossing.null
    explained = best.score > AT_NOISE and _explains(left) and left.cost < best.cost - CLEARLY
    return (crossing, there) if explained or left.score < MOST * best.score else (start, located)


def _explains(fit: Fit) -> bool:
    """Whether a model leaves noise alone, near its priors."""
    return fit.score <= AT_NOISE and fit.prior <= WITHIN * CLEARLY
