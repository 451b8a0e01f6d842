"""Joints inside a member, which the deck does not have, where a short stretch of it or hardly any stiffness stands for
them.

A bolted flange in the middle of a beam is no joint of the deck. The stretch around it comes out as weaker than the rest
of the beam, down to a few thousandths, which no material is: what gives way there is a joint with a stiffness of its
own, and which of the two it is is for the recordings to tell.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from femend.diagnose.locating.dressed import hypothesis_of, without_own_unknowns
from femend.diagnose.locating.locate import Located, squares_of
from femend.diagnose.naming.judge import Given, Tried
from femend.model import Place
from femend.model.places.places import inner_joints

__all__ = ["inside"]

# factor of a member's stiffness below which joints inside it are tried, elements of a stretch up to which they are
# tried whatever its factor is, and how many of them
WEAK, SHORT, TRIED = 0.2, 4, 3


def inside(given: Given, tried: Sequence[Tried], known: set[tuple[tuple[int, ...], str]]) -> list[Located]:
    """Joints inside the members among what was `tried` that may stand for one, without those `known` by their nodes and
    direction, to which they are added: stretches of a member overlap."""
    members = [t for t in tried if t.found.place.kind == "member"]
    weak = [t.found for t in members if t.candidate.values["factor"] < WEAK or _short(t.found.place, given)]
    found = []
    for joint in (joint for member in weak for joint in _hinges(given, member)):
        key = joint.place.nodes, joint.place.direction
        if key not in known:
            known.add(key)
            found.append(joint)
    return found


def _short(member: Place, given: Given) -> bool:
    """Whether it is a short stretch of a longer member, by the deck's elements."""
    return member.unlikely and len(given.reduced.model.drawn_elements(member.elements)) <= SHORT


def _hinges(given: Given, member: Located) -> list[Located]:
    """The cuts inside a member at which a free force leaves least, from where its factor brought the model's
    unknowns."""
    problem, reduced = given.split.whole, given.reduced
    places = inner_joints(reduced.model, member.place)
    p = without_own_unknowns(member.fit.p, reduced, member.place.n_own)
    few = [place for place in places if place.n_w < min(r.y.shape[0] for r in problem.records)]
    fits = problem.fit([hypothesis_of(place, reduced) for place in few], [(p, np.zeros(0))] * len(few))
    found = [
        Located(place, fit, squares_of(problem, fit, 0.0))
        for place, fit in zip(few, fits, strict=True)
        if fit is not None
    ]
    return sorted(found, key=lambda f: f.cost)[:TRIED]
