"""Two laws read off at once at two places whose forces are free, where neither is found beside the other.

A second effect is mostly found beside the first one's law. Where both are nonlinear and neither explains the greater
part, there is no first: a law alone at either place bends the model, and a force that was read off there and is taken
as known is only as good as that model. Two free forces that explain the recordings leave the model nearly as it is and
show what both places did. Laws that follow it are fitted together, each of one place with the likeliest of the other;
two linear ones, which cost no simulation, before all others and at all nodes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.fitting.candidates import KINDS, Candidate
from femend.diagnose.fitting.likeliest_starts import likeliest_starts
from femend.diagnose.fitting.terms import Term
from femend.diagnose.locating.joint import open_joint, open_joints
from femend.diagnose.locating.locate import Located
from femend.diagnose.locating.recovered import Recovered
from femend.diagnose.several.linear_pair import where_both_explain_more
from femend.diagnose.several.one_linear import located_beside
from femend.diagnose.several.pairs import Searched, plain
from femend.diagnose.several.parallel import starting
from femend.diagnose.several.read_beside import read_off_both
from femend.diagnose.several.together import Scored, best_of, better, may_be_beaten
from femend.model import Place

__all__ = ["two_free", "two_linear"]

FloatArray = NDArray[np.float64]

# steps of the fit of both free forces in the basis that holds the static answers of both places
STEPS = 15


def two_free(first: Searched, second: Located, at: Place) -> Scored | None:
    """Two laws fitted together at two places, the `second` with the fit of a free force at both, and the other one;
    None where these have other than one coordinate each, or no laws follow what they did."""
    read = _read(first, second, at)
    if read is None:
        return None
    linear = _both_linear(first, read)
    if linear is not None and linear[1].chosen <= first.settings.adequate and not may_be_beaten(first, linear):
        return linear
    one, other = (_to_simulate(laws) for laws in read.laws)
    tries = [([a, b], read.p) for i, a in enumerate(one) for j, b in enumerate(other) if min(i, j) == 0]
    return better(first, linear, best_of(first, tries) if tries else None)


def two_linear(first: Searched, second: Located, at: Place) -> Scored | None:
    """The same with linear laws alone, which costs no simulation."""
    read = _read(first, second, at)
    return None if read is None else _both_linear(first, read)


@dataclass(frozen=True, eq=False)
class _Read:
    """Laws that follow what each of two places did, the likeliest first, and the model's unknowns p there."""

    laws: tuple[list[Term], list[Term]]
    p: FloatArray


def _read(first: Searched, second: Located, at: Place) -> _Read | None:
    """None where the places have other than one coordinate each, or the fit breaks down."""
    places = (second.place, at)
    if any(place.part or place.kind not in KINDS or place.n_w != 1 for place in places):
        return None
    did = _what_they_did(first, second, places)
    return None if did is None else _Read((_laws(first, did, 0), _laws(first, did, 1)), did.p)


def _both_linear(first: Searched, read: _Read) -> Scored | None:
    """The best of two linear laws, at the nodes and of the forms in which both leave least."""
    one, other = ([t for t in laws if not t.candidate.nonlinear] for laws in read.laws)
    tries = [([a, b], read.p) for a in one for b in other]
    best = best_of(first, tries) if tries else None
    return None if best is None else where_both_explain_more(first, best)


def _to_simulate(laws: list[Term]) -> list[Term]:
    """Laws to be fitted in simulations, the likeliest first; of linear ones that alone which comes first, since a
    linear law is found beside a free force."""
    return [t for n, t in enumerate(laws) if n == 0 or t.candidate.nonlinear]


@dataclass(frozen=True, eq=False)
class _Did:
    """What two places did, with forces free at both, the model's unknowns p there, and each as it is located beside the
    other."""

    recovered: list[Recovered]
    p: FloatArray
    located: list[Located]


def _what_they_did(first: Searched, second: Located, places: tuple[Place, Place]) -> _Did | None:
    """None where the fit breaks down."""
    problem, start = first.split.reading, plain(first, second.fit.p)
    both = open_joints(places, first.reduced, first.problem.band[1], first.g_rows)
    (fit,) = problem.fit([both.hypothesis(None)], [(start, np.zeros(0))], iterations=STEPS)
    if fit is None:
        return None
    located = [located_beside(first, place, other, fit.p) for place, other in (places, places[::-1])]
    found = [one for one in located if one is not None]
    return _Did(read_off_both(problem, both, fit), fit.p, found) if len(found) == len(places) else None


def _laws(first: Searched, did: _Did, i: int) -> list[Term]:
    """Laws that follow what place i did, the likeliest first."""
    located, recovered = did.located[i], did.recovered[i]
    joint = open_joint(located.place, first.reduced, first.problem.band[1], first.g_rows)
    nothing = Candidate(None, "", joint, {}, did.p, np.zeros(0), 0, 0.0, np.inf, np.inf)
    return [
        Term(starting(first, nothing, name, start, recovered), located)
        for name, start in likeliest_starts(joint, recovered).items()
    ]
