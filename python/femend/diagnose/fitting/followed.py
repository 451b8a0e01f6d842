"""Starts of a linear law fitted to the free force of a place before the whole model is: a few numbers on lines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from femend import _core
from femend.diagnose.locating.free_force import FreeForce
from femend.physics import Physics

__all__ = ["followed"]

FloatArray = NDArray[np.float64]

# lines in all on which a law is fitted to the free force, steps of the fit
LINES, STEPS = 600, 12
# a step of a logarithm at most, and how far a parameter may leave its start
LARGEST, FARTHEST = 1.5, 12.0
# starts that end within this of each other (logarithms) are one
APART = 0.1


def followed(
    free: Sequence[FreeForce], entry: Physics, starts: Sequence[Mapping[str, float]], count: int
) -> list[dict[str, float]]:
    """The `count` best of the starts after a least-squares fit of the law to the free force on every record.

    Only the law moves, the model's other unknowns stay where the free force has them.
    """
    names, law = entry.parameter_names, entry.law or entry.name
    few = [one.thinned(max(1, LINES // (len(free) * one.D.shape[1]))).core for one in free]
    begun = [np.log([max(start[n], 1e-12) for n in names]).tolist() for start in starts]
    ends = [end for end in _core.follow_free_force(law, begun, few, STEPS, LARGEST, FARTHEST) if end is not None]
    kept: list[FloatArray] = []
    for _, x in sorted(ends, key=lambda end: end[0]):
        if len(kept) < count and all(np.abs(np.subtract(x, other)).max() > APART for other in kept):
            kept.append(np.array(x))
    return [dict(zip(names, np.exp(x).tolist(), strict=True)) for x in kept]
