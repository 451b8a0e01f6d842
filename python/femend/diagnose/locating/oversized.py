"""What it costs to believe a mass that is much of the structure's own.

Near a clamp the structure hardly moves, and a mass or an absorber there has to be as heavy as the structure to do what
a small one does at its tip: to a few sensors both may be the same. Nobody forgets such a mass.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from femend.model import Model, Place
from femend.physics import Physics

__all__ = ["oversized"]

# a mass that is left out is a tenth of the structure at most, give or take a factor e
SHARE = 0.1
# exponents of force, displacement and time in a mass
_MASS = (1, -1, 2)


def oversized(model: Model, place: Place, entry: Physics, values: Mapping[str, float]) -> float:
    """Prior cost of the masses among the `values` (by name, in the deck's units) of a law at a place: the square of how
    many standard deviations, of one in ln, each is above what may be left out of this structure; 0 below, and for
    inertias of a law that acts on a rotation."""
    if place.direction.startswith("R"):
        return 0.0
    masses = [values[p.name] for p in entry.parameters if p.dims == _MASS]
    total = model.total_mass if masses else 0.0
    if total <= 0:
        return 0.0
    return float(sum(max(0.0, np.log(m / (SHARE * total))) ** 2 for m in masses if m > 0))
