"""Whether sensors are believed as they are, or may hold shares of the motion across them."""

from __future__ import annotations

from collections.abc import Sequence

from femend.diagnose.locate import Located, locate
from femend.diagnose.update import AT_NOISE, CLEARLY, UpdatedModel
from femend.model import Place

__all__ = ["as_sensors_are"]

# prior cost of a model beside a free force, in `CLEARLY`, up to which it explains the recordings with that, and what is
# left at most, as a share of its misfit, with what sensors pick up where it does not
WITHIN, MOST = 2.0, 0.5


def as_sensors_are(
    start: UpdatedModel, located: list[Located], places: Sequence[Place]
) -> tuple[UpdatedModel, list[Located]]:
    """An updated model with its places, `located` of all `places`, or both where sensors pick up motion across them.

    Shares of that motion also take away what is missing where a sensor hardly moves. So sensors are believed where the
    model explains the recordings with a free force somewhere (where it does alone with such shares, `update_model` has
    taken them), and where the shares make no great difference.
    """
    best, crossing = located[0].fit if located else start.null, start.crossing
    if crossing is None or (best.score <= AT_NOISE and best.prior <= WITHIN * CLEARLY):
        return start, located
    there = locate(crossing.problem, crossing.reduced, places, crossing.null)
    left = there[0].fit if there else crossing.null
    return (crossing, there) if left.score < MOST * best.score else (start, located)
