"""Members at the places that explain most, for factors far below one.

Members are sorted out among all places by few steps from the deck's values and from the updated model's. Where that has
made up for a member of half its stiffness with everything else, such steps lead elsewhere, and its factor has to be
followed from far off (`own_basis`), which is too much for every member of a model. A force at its end, or at a node of
it, explains more than a force anywhere else all the same.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from femend.diagnose.locating.dressed import hypothesis_of
from femend.diagnose.locating.locate import Located, squares_of
from femend.estimate import Problem
from femend.model import Model, Place, ReducedModel

__all__ = ["members_there"]

# best places with one force whose members are followed, and how many members at most
FIRST, MOST = 3, 4


def members_there(
    problem: Problem,
    reduced: ReducedModel,
    places: Sequence[Place],
    located: Sequence[Located],
    tried: Sequence[Place],
) -> list[Located]:
    """Whole members of all `places` that hold a node of the best places `located`, without those `tried`, as the deck
    has them, nothing fitted yet."""
    members = [p for p in places if p.kind == "member"]
    single = [one.place for one in located if one.place.n_w == 1 and one.place.kind != "base"][:FIRST]
    there = {node for place in single for node in place.nodes}
    whole = [p for p in members if not any(set(p.elements) < set(other.elements) for other in members)]
    nodes = _nodes(reduced.model)
    chosen = [
        p
        for p in whole
        if not there.isdisjoint(node for element in p.elements for node in nodes.get(element, ()))
        and not any(p is other for other in tried)
    ][:MOST]
    hypotheses = [hypothesis_of(p, reduced) for p in chosen]
    starts = [(problem.prior(h.reduced)[0], np.zeros(0)) for h in hypotheses]
    fits = problem.fit(hypotheses, starts, iterations=0)
    return [Located(p, f, squares_of(problem, f, 0.0)) for p, f in zip(chosen, fits, strict=True) if f is not None]


def _nodes(model: Model) -> dict[int, tuple[int, ...]]:
    """Nodes of every element that has an id of its own."""
    return {eid: tuple(nodes) for eid, _, nodes in model.as_drawn.fe.elements()}
