"""What every deck simplifies: unknowns that are always there, so that they are not taken for missing physics."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array, csc_array

from femend.errors import DeckError
from femend.model.cards.card_mass import mass_of_card
from femend.model.cards.real_field import real
from femend.model.model import Model
from femend.model.terms.bushes import bush_groups
from femend.model.terms.linear_terms import LinearTerm, TermPart, end_masses
from femend.model.terms.unknowns import Unknown

__all__ = ["idealisation_terms"]

# A third of a spring's own mass moves with each end: as a guess, all springs' ends together carry this share of the
# structure's mass, within a factor of e.
SPRING_SHARE, SPRING_SD = 0.01, 1.0


def idealisation_terms(model: Model, moving_mass: float) -> tuple[LinearTerm, ...]:
    """The inertia tensor of every rigid mass whose mass may be updated, and the own mass of massless springs.

    A mass known to some per cent has an inertia known no better: each of its principal values gets a factor with the
    same prior. `moving_mass` is the mass that the springs carry.
    """
    terms: list[LinearTerm] = []
    for parameter in model.parameters:
        if parameter.target == "mass":
            for eid in parameter.ids:
                term = _inertia(model, eid, parameter.prior_sd)
                if term is not None:
                    terms.append(term)
    for group in bush_groups(model):
        share = SPRING_SHARE * moving_mass / len(group.elements)
        terms.append(end_masses(model, group, share, SPRING_SD))
    return tuple(terms)


def _inertia(model: Model, eid: int, sd: float) -> LinearTerm | None:
    fields = {"11": 12, "22": 14, "33": 17}
    try:
        node = int(real(model.deck.field_text("CONM2", eid, 3)))
        values = {axis: _real(model, eid, f) * mass_of_card(model.deck) for axis, f in fields.items()}
    except (DeckError, ValueError):
        return None
    n = int(model.fe.n_g)
    unknowns: list[Unknown] = []
    parts: list[TermPart] = []
    name = f"inertia of mass {eid}"
    for i, (axis, value) in enumerate(values.items()):
        if value <= 0.0:
            continue
        row = 6 * model.index(node) + 3 + i
        matrix = csc_array(coo_array(([value], ([row], [row])), shape=(n, n)))
        parts += [TermPart("M", matrix, ((len(unknowns), 1),)), TermPart("M", csc_array(-1.0 * matrix), ())]
        unknowns.append(Unknown(f"{name}: I{axis}", 1.0, sd=sd, owner=name))
    if not unknowns:
        return None
    return LinearTerm(name, "", (node,), "", "", tuple(unknowns), tuple(parts))


def _real(model: Model, eid: int, field: int) -> float:
    try:
        text = model.deck.field_text("CONM2", eid, field).strip()
    except DeckError:
        return 0.0
    value = real(text) if text else 0.0
    return value if np.isfinite(value) else 0.0
