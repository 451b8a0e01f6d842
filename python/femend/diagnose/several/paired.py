"""Two of the laws that were found one by one: each was bent by what the other does, together they need not be.

In the beginning of a record neither effect has done much yet, paths of motion that later part are still together, and a
fit is quick; so pairs are sorted out there, and the ones that explain it followed to wider windows and whole records.
"""

from __future__ import annotations

import itertools
from dataclasses import replace

from femend.diagnose.fitting.runs import windows
from femend.diagnose.fitting.terms import Term
from femend.diagnose.naming.ranked import Ranked
from femend.diagnose.several.pairs import Searched, alike
from femend.diagnose.several.together import Scored, are_told, fitted_together, term_of
from femend.model import Place

__all__ = ["of_those_found"]

# laws at places apart from each other of which pairs are tried, and pairs that are followed
FOUND, FOLLOWED = 6, 3


def of_those_found(first: Searched) -> tuple[Searched, Scored] | None:
    """Two laws that explain the recordings together, with the search in the widest window in which they do; None where
    no two of those found do."""
    narrow, *wider = windows(first.problem)
    beginning = first.at(narrow)
    laws = [_unaided(term_of(first, r)) for r in _apart(first)]
    p = first.problem.prior(first.reduced)[0]
    begun = [
        found
        for pair in itertools.combinations(laws, 2)
        if (found := fitted_together(beginning, pair, p)) is not None and _explains(beginning, found)
    ]
    if not begun:
        return None
    ahead = [first.at(sigma) for sigma in wider]
    best: tuple[Searched, Scored] | None = None
    for found in sorted(begun, key=lambda f: f[0])[:FOLLOWED]:
        reached = _followed(ahead, found)
        if reached is not None and (best is None or _before(reached, best)):
            best = reached
    return best


def _unaided(term: Term) -> Term:
    """A law that begins without its linear companion, which may stand in for the other effect."""
    c = term.candidate
    if not c.nonlinear:
        return term
    x = c.x.copy()
    x[-2:] = 0.0
    return replace(term, candidate=replace(c, x=x, k=0.0, c=0.0))


def _apart(first: Searched) -> list[Ranked]:
    """The best law at each of the first places that move the sensors otherwise."""
    kept: list[Ranked] = []
    like: set[int] = set()
    for r in first.ranked:
        place = r.located.place
        if len(kept) < FOUND and id(place) not in like and not any(_share(place, k.located.place) for k in kept):
            kept.append(r)
            like |= {id(p) for p in alike(first, place)}
    return kept


def _share(a: Place, b: Place) -> bool:
    """Whether two places are at one element, or one clamp of which one is on springs."""
    return bool(set(a.elements) & set(b.elements)) or (a.kind == b.kind and set(a.nodes) == set(b.nodes))


def _followed(ahead: list[Searched], found: Scored) -> tuple[Searched, Scored] | None:
    """Terms on the widest window in which they explain the recordings; None where that is too narrow, or they do not
    win there."""
    reached: tuple[Searched, Scored] | None = None
    for there in ahead:
        wider = fitted_together(there, found[1].terms, found[1].p)
        if wider is None or not _explains(there, wider):
            break
        reached, found = (there, wider), wider
    return reached if reached is not None and are_told(*reached) else None


def _explains(there: Searched, found: Scored) -> bool:
    """Whether terms explain unseen data without bending the rest of the model."""
    settings = there.settings
    return found[1].chosen <= settings.adequate and not settings.strains(found[1].prior)


def _before(one: tuple[Searched, Scored], other: tuple[Searched, Scored]) -> bool:
    """Whether terms explain more of the recordings than others, or the same by a better score."""
    return (one[0].sigma, one[1][0]) < (other[0].sigma, other[1][0])
