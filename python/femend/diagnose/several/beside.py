"""A spring or dashpot beside a nonlinear law at its place: two effects where the sensors tell one place.

A nonlinear law is fitted beside a free linear spring and dashpot, its companion, since the local stiffness of the model
is not known better than the law. Where the companion brings by itself what a law has to bring, it is an effect of its
own: a support that nobody drew beside a stop, at the same node or at one that moves the sensors alike.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.fitting.candidates import KINDS, Candidate
from femend.diagnose.fitting.collapse import collapsed
from femend.diagnose.fitting.terms import Term
from femend.diagnose.naming.ranked import Ranked
from femend.diagnose.several.moved import moved
from femend.diagnose.several.pairs import Searched, alike
from femend.diagnose.several.together import Scored, brings, fitted_together
from femend.physics import physics

__all__ = ["companions"]

FloatArray = NDArray[np.float64]

# deviations from nothing from which it is worth asking what a companion brings
WORTH_ASKING = 3.0
# places that move the sensors alike at which it is tried, too
ELSEWHERE = 4
# laws that no spring is part of: beside another a spring is only a share of its own
LAWS = ("clearance", "cubic_stiffness", "coulomb_friction", "quadratic_damping")


def companions(first: Searched, one: Ranked) -> Scored | None:
    """The law `one` with its companion told as terms of their own, where it brings what a law has to bring against the
    law alone; None otherwise."""
    candidate = collapsed(one.candidate, one.recovered, first.settings)
    if candidate.name not in LAWS or candidate.joint is None or candidate.joint.place.kind not in KINDS:
        return None
    if candidate.sigma > first.sigma:
        return None  # its motion cannot be followed in the window by which terms are compared
    linear = _linear(candidate, one)
    if not linear:
        return None
    law = Term(candidate, one.located, bare=True)
    alone = _alone(first, law)
    best = alone
    for extra in _choices(linear):
        found = fitted_together(first, [law, *extra], candidate.p)
        best = found if found is not None and best is not None and brings(first, best, found) else best
    if best is None or best is alone:
        return None
    plain = _without(first, best)
    if plain is not None:
        return plain
    return best if best[1].chosen <= first.settings.adequate else _elsewhere(first, best)


def _alone(first: Searched, law: Term) -> Scored | None:
    """The law without anything beside it: the model's unknowns may have to go elsewhere, so from the deck's values too,
    lest its descent alone be to blame."""
    starts = (law.candidate.p, first.problem.prior(first.reduced)[0])
    found = [f for p in starts if (f := fitted_together(first, [law], p)) is not None]
    return min(found, key=lambda f: f[0], default=None)


def _without(first: Searched, found: Scored) -> Scored | None:
    """The companions alone where the law beside them does not bring what a law has to: its own fit may have led the
    model to where a spring or dashpot by itself did not come."""
    terms = found[1].terms[1:]
    alone = fitted_together(first, terms, found[1].p, simulated=True)
    if alone is None or brings(first, alone, found):
        return None
    return fitted_together(first, terms, alone[1].p)


def _choices(linear: Sequence[Term]) -> list[list[Term]]:
    """Each by itself, and all together where there are two."""
    each = [[term] for term in linear]
    return each if len(each) == 1 else [*each, list(linear)]


def _linear(candidate: Candidate, one: Ranked) -> list[Term]:
    """The companion's spring and dashpot as terms, those that are positive and not lost in their deviations."""
    c = candidate if candidate.covariance is not None else one.candidate
    sd = np.full(2, 0.0) if c.covariance is None else np.sqrt(np.maximum(np.diag(c.covariance)[-2:], 0.0))
    sizes = {"support_stiffness": (candidate.k, sd[0] * c.extra["k_scale"]),
             "viscous_damper": (candidate.c, sd[1] * c.extra["c_scale"])}  # fmt: skip
    return [
        Term(_law(candidate, name, value), one.located)
        for name, (value, deviation) in sizes.items()
        if value > 0 and value > WORTH_ASKING * deviation
    ]


def _law(candidate: Candidate, name: str, value: float) -> Candidate:
    """A linear law of one parameter at the place of a candidate."""
    entry = physics(name)
    values, x = {entry.parameter_names[0]: value}, np.log([value])
    return Candidate(
        entry, name, candidate.joint, values, candidate.p, x, 1, candidate.prior, candidate.fitted, candidate.chosen,
        reference=candidate.reference,
    )  # fmt: skip


def _elsewhere(first: Searched, found: Scored) -> Scored:
    """The same terms with the linear ones at places that move the sensors alike, where that explains more."""
    best, law = found, found[1].terms[0]
    assert law.place is not None
    near = [p for p in alike(first, law.place) if p.kind == "ground"]
    for place in sorted(near, key=lambda p: p.unlikely)[:ELSEWHERE]:
        terms = [law, *(moved(first, term, place) for term in found[1].terms[1:])]
        tried = fitted_together(first, terms, found[1].p)
        best = tried if tried is not None and tried[0] < best[0] else best
    return best
