"""Laws fitted together, and what more of them have to bring against fewer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from femend import _core
from femend.diagnose.evidence import LEAST, fall
from femend.diagnose.fitting.candidates import SPRINGS
from femend.diagnose.fitting.collapse import collapsed, without_gap
from femend.diagnose.fitting.terms import Term, Terms, fit_terms, judge_terms
from femend.diagnose.naming.ranked import Ranked, score
from femend.diagnose.settings import Settings
from femend.diagnose.several.pairs import Searched, plain
from femend.physics import physics

__all__ = [
    "EVEN",
    "Scored",
    "Try",
    "are_told",
    "at_other_places",
    "best_of",
    "better",
    "brings",
    "distinct",
    "each_of",
    "fitted_together",
    "gained",
    "in_order",
    "may_be_beaten",
    "shows",
    "term_of",
    "told_plainly",
    "unbends",
]

FloatArray = NDArray[np.float64]

# standard deviation (ln units) of the best determined combination of a law's parameters from which its size is unknown
UNDETERMINED = 0.33

# laws of different names at a place that are tried together with those at another, and further places at
# which a law is tried that a free force does not tell from its own
TOGETHER, AS_WELL = 2, 2

# difference of scores of terms that explain as much
EVEN = 2.0

# terms fitted together, with their score
Scored = tuple[float, Terms]
# terms to be fitted together, with the unknowns (n_p,) of the model they start from
Try = tuple[Sequence[Term], FloatArray]


def term_of(first: Searched, law: Ranked) -> Term:
    """A law that was found, as the simplest that does the same."""
    return Term(collapsed(law.candidate, law.recovered, first.settings), law.located)


def fitted_together(first: Searched, terms: Sequence[Term], p: FloatArray, *, simulated: bool = False) -> Scored | None:
    """Terms fitted together from unknowns `p` of the model (with or without factors of members), with their score;
    None where they cannot be judged. Linear ones alone are `simulated` where they are held against nonlinear ones:
    between what lines and what simulations leave lies more than a law has to bring."""
    fitting, start = first.split.fitting, plain(first, p)
    found = fit_terms(fitting, terms, first.reduced, first.g_rows, start, first.sigma, simulated=simulated)
    if found is None:
        return None
    found = judge_terms(first.split.choosing, found)
    value = score(found, first.settings, first.n_values)
    return (value, found) if np.isfinite(value) else None


def gained(first: Searched, gain: float, chosen: float, prior: float, found: Terms) -> bool:
    """Whether terms bring what a law has to bring, against what leaves `chosen` on unseen data with `prior`."""
    return first.settings.wins(gain, fall(chosen, found.chosen), prior - found.prior)


def brings(first: Searched, fewer: Scored, more: Scored) -> bool:
    """Whether more terms bring against fewer what a law has to bring against none."""
    return gained(first, fewer[0] - more[0], fewer[1].chosen, fewer[1].prior, more[1])


def may_be_beaten(first: Searched, found: Scored) -> bool:
    """Whether terms leave so much more than noise does, their parameters aside, that others could bring against them
    what a law has to bring."""
    least = first.floor + first.price * found[1].n_law
    return found[0] - least > first.settings.gain_cost


def in_order(first: Searched, scored: Scored) -> tuple[bool, float, float]:
    """By what terms compare in the windows they are followed in: first what explains unseen data, then what explains
    more of the recordings, then the better score."""
    score, terms = scored
    return terms.chosen > first.settings.adequate, terms.sigma, score


def each_of(first: Searched, tries: Sequence[Try]) -> list[Scored | None]:
    """Several sets of terms, each fitted together."""
    return [fitted_together(first, terms, p) for terms, p in tries]


def best_of(first: Searched, tries: Sequence[Try], fitted: Sequence[Scored | None] | None = None) -> Scored | None:
    """The best of several sets of terms, each `fitted` together, as `each_of` does where they are not yet."""
    best: Scored | None = None
    for one in each_of(first, tries) if fitted is None else fitted:
        best = better(first, best, one)
    if best is not None and len(tries) > 1:
        # once more from where the best came to: a descent that stopped short is no reason for another name
        reached = {(t.candidate.name, id(t.located.place)): t for t in best[1].terms}
        p = plain(first, best[1].p)
        for terms, _ in tries:
            again = [reached.get((t.candidate.name, id(t.located.place)), t) for t in terms]
            best = better(first, best, fitted_together(first, again, p))
    return best


def shows(settings: Settings, one: float, two: float) -> bool:
    """Whether two laws show in unseen data, from what one and both of them leave there: by as much as more freedom
    alone does not bring. What bends the rest of the model may be its mesh, so that relief alone is no second effect."""
    return fall(max(one, LEAST), two) > settings.gain_nonlinear


def unbends(settings: Settings, one: float, two: float) -> bool:
    """Whether the model is about as drawn beside two laws, by their prior cost, where it bends for one of them so much
    that this is no name: no mesh is so wrong."""
    return settings.bends(one) and not settings.strains(two)


def distinct(first: Searched, ranked: Sequence[Ranked]) -> list[Ranked]:
    """The first laws of different names, or clamps soft in different directions, that score about as well as the
    best."""
    kept: list[Ranked] = []
    for r in ranked:
        new = (r.name, r.located.place.springs) not in [(k.name, k.located.place.springs) for k in kept]
        if new and len(kept) < TOGETHER and r.score < ranked[0].score + first.settings.gain_cost:
            kept.append(r)
    return kept


def at_other_places(first: Searched, term: Term, ranked: Sequence[Ranked]) -> list[Ranked]:
    """The law of a term, of those `ranked`, at the next best places that a free force does not tell from its own: which
    of them is right was judged beside a force that was not yet quite the other law's."""
    at = [term.located.place]
    kept: list[Ranked] = []
    for r in ranked:
        even = r.name == term.candidate.name and r.located.cost < term.located.cost + first.settings.margin
        if even and len(kept) < AS_WELL and not any(r.located.place is place for place in at):
            at.append(r.located.place)
            kept.append(r)
    return kept


def are_told(first: Searched, found: Scored) -> bool:
    """Whether several terms are accepted: they show in unseen data, or by the model that no longer bends, win against
    one law alone, the recordings tell the size of each, and none of them does as well by itself."""
    settings, one = first.settings, first.ranked[0].candidate
    if not (shows(settings, one.chosen, found[1].chosen) or unbends(settings, one.prior, found[1].prior)):
        return False
    return _won(first, *found) and all(map(_determined, found[1].terms)) and not _needless(first, *found)


def told_plainly(first: Searched, found: Scored) -> Scored:
    """Linear laws of several parameters as a spring, dashpot or mass where that does as well beside the other terms: an
    absorber that is heavy and soft is a dashpot. A stop on one side as a bilinear stiffness where its gap is for
    nothing."""
    best = found
    for i, term in enumerate(found[1].terms):
        closed = without_gap(term.candidate)
        if closed is not None:
            terms = [replace(t, candidate=closed) if j == i else t for j, t in enumerate(best[1].terms)]
            tried = fitted_together(first, terms, best[1].p)
            best = tried if tried is not None and tried[0] < best[0] + EVEN else best
        if term.candidate.nonlinear or term.n_x < 2:
            continue
        for plainer in _plain_laws(first, term):
            terms = [plainer if j == i else t for j, t in enumerate(best[1].terms)]
            best = better(first, best, fitted_together(first, terms, best[1].p)) or best
    return best


def _plain_laws(first: Searched, term: Term) -> list[Term]:
    """A spring, a dashpot and, at the ground, a mass with the law's own stiffness in the middle of the band, those that
    are positive."""
    c, kind = term.candidate, term.located.place.kind
    assert c.physics is not None
    omega = 2 * np.pi * float(np.sqrt(first.problem.band[0] * first.problem.band[1]))
    law = c.physics.law or c.physics.name
    stiffness = complex(_core.law_dynamic_stiffness(law, term.values(term.x)[0], np.array([1j * omega]))[0][0])
    sizes = {"support_stiffness": stiffness.real, "viscous_damper": stiffness.imag / omega}
    if kind == "ground":
        sizes["added_mass"] = -stiffness.real / omega**2
    made = []
    for law, size in sizes.items():
        if size > 0:
            entry = physics(law)
            name = SPRINGS.get(kind, law) if law == "support_stiffness" else law
            own = {entry.parameter_names[0]: size}
            plain = replace(c, physics=entry, name=name, values=own, x=np.log([size]), n_law=1, covariance=None)
            made.append(replace(term, candidate=plain))
    return made


def better(first: Searched, best: Scored | None, found: Scored | None) -> Scored | None:
    """The one with the lower score; with fewer parameters unless the other wins by what a law has to bring."""
    if best is None or found is None:
        return found if best is None else best
    if best[1].n_law == found[1].n_law:
        return min(best, found, key=lambda one: one[0])
    simple, rich = sorted((best, found), key=lambda one: one[1].n_law)
    return rich if brings(first, simple, rich) else simple


def _won(first: Searched, value: float, found: Terms) -> bool:
    """Whether several laws bring against one what one has to bring against none: the noise is what they can reach (a
    score of nothing), since free forces at two places leave less than any law where sensors are few. What one law
    leaves near the noise may be the mesh, of which any other takes a part and a second effect nearly all."""
    one, settings = first.ranked[0], first.settings
    share = (one.score - value) / max(one.score, 1e-12)
    whole = (first.null_score - value) / max(first.null_score, 1e-12)
    needed = settings.explained if one.candidate.chosen > settings.far else settings.nearly
    won = gained(first, one.score - value, one.candidate.chosen, one.candidate.prior, found)
    return won and share >= needed and whole >= settings.explained


def _determined(term: Term) -> bool:
    """Whether the recordings tell the size of a law at all: at least one combination of its parameters (ln units),
    since beside another law at the same place none of them may be told by itself."""
    candidate = term.candidate
    if candidate.covariance is None:
        return True
    n = len(candidate.x) if candidate.coordinates is None else len(candidate.x) - 2
    n = term.located.place.n_own if term.member else n
    return bool(n and np.linalg.eigvalsh(candidate.covariance[:n, :n])[0] < UNDETERMINED**2)


def _needless(first: Searched, value: float, found: Terms) -> bool:
    """Whether one of the terms, fitted as thoroughly as all of them together, does as well by itself."""
    simulated = any(t.candidate.nonlinear for t in found.terms)
    for term in found.terms:
        alone = None if term.member else fitted_together(first, [term], found.p, simulated=simulated)
        if alone is not None and not brings(first, alone, (value, found)):
            return True
    return False
