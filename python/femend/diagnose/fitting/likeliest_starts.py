"""Laws that follow what a place did beside another law, the likeliest first."""

from __future__ import annotations

import numpy as np

from femend.diagnose.fitting.candidates import Start, laws_for, starts
from femend.diagnose.locating.joint import Joint
from femend.diagnose.locating.recovered import Recovered

__all__ = ["likeliest_starts"]

# nonlinear laws that are tried, the starts of each law that are looked at, and how much more than the best of them one
# may leave of the force
NONLINEAR, STARTS, REACH = 3, 2, 2.0


def likeliest_starts(joint: Joint, recovered: Recovered) -> dict[str, Start]:
    """The best start of each law that follows the recovered force about as well as the best one, by its name: of linear
    laws all, of nonlinear ones as many as `NONLINEAR`."""
    begun = [
        (name, start)
        for name, entry in laws_for(joint.place.kind)
        for start in starts(entry, joint, recovered, STARTS)
        if np.isfinite(start.left)
    ]
    begun.sort(key=lambda item: item[1].left)
    kept: dict[str, Start] = {}
    for name, start in begun:
        many = sum(other.physics.kind == "nonlinear" for other in kept.values())
        if start.left < REACH * begun[0][1].left and (start.physics.kind == "linear" or many < NONLINEAR):
            kept.setdefault(name, start)
    return kept
