"""Places that no sensor sees: of planes that do not couple, those in which nothing was recorded.

What a force there does to the sensors is rounding, and the free force that makes up for what is missing elsewhere is
1e12 times too large: it explains everything by rounding, and what moves with it outweighs every noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.locating.linear_costs import directions
from femend.errors import ModelError
from femend.estimate import Problem
from femend.model import Place, ReducedModel

__all__ = ["sensed_places"]

# share of what a direction and the sensors could have in common in a mode from which it is sensed: rounding is 1e-12,
# and planes that couple by a thousandth of each other have as much
SENSED = 1e-7
# share of the sensors' largest motion in a mode below which what a direction moves there is rounding
ROUNDING = 1e-11


def sensed_places(problem: Problem, reduced: ReducedModel, places: Sequence[Place]) -> list[Place]:
    """Those of `places` a force along which moves some sensor in some mode, at the prior means of the model's unknowns,
    with such of their directions; parts of the model, which have no forces, are all there. All as they are where the
    model cannot be solved."""
    try:
        Q = problem.system(reduced).modal(problem.prior(reduced)[0])[2]
    except ModelError:
        return list(places)
    rows = sorted({int(g) for r in problem.records for g in r.out_rows})
    out = np.abs(reduced.rows(rows) @ Q)
    seen = _over_largest(out).max(axis=0)
    into = np.abs(directions(reduced, places) @ Q)
    # what no mode of the basis moves, as along bars, is rounding too
    size = np.array([np.linalg.norm(x) for place in places for x in place.g_values])
    moved = into.max(axis=1, initial=0.0) > ROUNDING * size * out.max()
    sensed = moved & ((_over_largest(into) * seen).max(axis=1, initial=0.0) > SENSED)
    first = np.cumsum([0, *(place.n_w for place in places)])
    found = [_as_sensed(place, sensed[i : i + place.n_w]) for place, i in zip(places, first, strict=False)]
    return [place for place in found if place is not None]


def _as_sensed(place: Place, sensed: NDArray[np.bool_]) -> Place | None:
    """A place with the directions that are `sensed` (n_w,); None without any, and with one of several, which is a place
    of its own."""
    if sensed.all():
        return place
    if sensed.sum() < min(2, place.n_w):
        return None
    kept = np.flatnonzero(sensed)
    return replace(
        place,
        g_rows=tuple(place.g_rows[i] for i in kept),
        g_values=tuple(place.g_values[i] for i in kept),
        release=None if place.release is None else place.release[np.ix_(kept, kept)],
        lets_go=tuple(place.lets_go[i] for i in kept) if place.lets_go else (),
    )


def _over_largest(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    return rows / np.maximum(rows.max(axis=1, keepdims=True, initial=0.0), 1e-300)
