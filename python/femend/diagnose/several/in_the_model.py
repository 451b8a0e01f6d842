"""Springs and masses as parts of the model, where they stand beside the law of another effect.

A law that closes around the model leaves its modes as they are drawn, and their damping and what single ones are off by
are those of a structure without it. Of a mass that is a tenth of a plate's that is a per cent of the motion, which
beside the law of another effect is all there is to be explained. As a part of the model the mass makes modes of its
own, and what single modes are off by is theirs.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femend.diagnose.fitting.terms import Term
from femend.diagnose.several.pairs import Searched
from femend.diagnose.several.together import Scored, better, fitted_together, may_be_beaten
from femend.model import Place

__all__ = ["in_the_model"]

# laws of one parameter that can be part of the model
PARTS = ("support_stiffness", "added_mass")
# kinds of places with one coordinate along which a part can act
KINDS = ("ground", "pair")


def in_the_model(first: Searched, found: Scored) -> Scored:
    """Terms fitted together with their springs and masses as parts of the model, one after the other, where that leaves
    less; as they are where nothing is left that could be explained."""
    for term in found[1].terms:
        others = [t for t in found[1].terms if t.located is not term.located]
        alone = not any(t.place is term.place for t in others) and any(not t.member for t in others)
        part = _part(term) if alone else None
        if part is not None and may_be_beaten(first, found):
            found = better(first, found, fitted_together(first, [*others, part], found[1].p)) or found
    return found


def _part(term: Term) -> Term | None:
    """A spring or mass as a part of the model; None for any other law."""
    law, place = term.candidate, term.place
    name = None if law.physics is None else law.physics.law or law.physics.name
    if place is None or name not in PARTS or place.kind not in KINDS or place.n_w != 1 or law.nonlinear:
        return None
    if place.release is not None or place.part:
        return None
    own: Place = (
        replace(place, mass=law.values["m"]) if name == "added_mass" else replace(place, spring=law.values["k"])
    )
    return Term(replace(law, joint=None, x=np.zeros(0), covariance=None), replace(term.located, place=own))
