"""More than one effect: what is left beside the first law is looked for in the same way, with its force as an input."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.evidence import deviance
from femend.diagnose.fitting.collapse import collapsed
from femend.diagnose.fitting.known_force import Known, forces_of_laws, free_forces
from femend.diagnose.fitting.terms import Terms, follow_terms, refit_terms
from femend.diagnose.locating.alike import with_look_alikes
from femend.diagnose.locating.dressed import with_own
from femend.diagnose.locating.locate import Located, cost_of, locate, shortlist
from femend.diagnose.naming.judge import Given
from femend.diagnose.naming.name import name_physics
from femend.diagnose.naming.ranked import Ranked, told_simply
from femend.diagnose.several.beside import companions
from femend.diagnose.several.best_place import at_the_best_places
from femend.diagnose.several.in_the_model import in_the_model
from femend.diagnose.several.linear_pair import where_both_explain_more
from femend.diagnose.several.named_anew import named_anew
from femend.diagnose.several.noise_of_two import beyond_two_forces
from femend.diagnose.several.one_linear import one_linear
from femend.diagnose.several.other_split import chosen_where_it_shows
from femend.diagnose.several.paired import of_those_found
from femend.diagnose.several.pairs import Searched, likely_pairs, others, pair, plain, with_members
from femend.diagnose.several.parallel import in_parallel
from femend.diagnose.several.together import (
    Scored,
    are_told,
    at_other_places,
    best_of,
    better,
    distinct,
    fitted_together,
    in_order,
    may_be_beaten,
    shows,
    term_of,
    told_plainly,
)
from femend.diagnose.several.two_free import two_free, two_linear
from femend.diagnose.updating.levels import element_depends_on_level
from femend.estimate import Hypothesis
from femend.estimate.fit import STEPS
from femend.model import Place

__all__ = ["Further", "Searched", "hidden_by_each_other", "look_further"]

FloatArray = NDArray[np.float64]

# how much the score of what was found may be above what noise leaves, in `gain_cost`, before anything further is looked
# for
WORTH = 1.5
# share of what is wrong with the updated model from which the best law is taken for one of the two effects
FIRST_SHARE = 0.5
# lines a record on which the terms that are kept are fitted
FINAL_LINES = 600


@dataclass(frozen=True, eq=False)
class Further:
    """Several effects at once: their terms fitted to all records, the laws tried at each in the terms' order, and the
    score on unseen data."""

    terms: Terms
    laws: tuple[tuple[Ranked, ...], ...]
    score: float


def look_further(first: Searched) -> Further | None:
    """Two effects where one law at one place leaves much that two laws explain, at two places or, where the sensors
    cannot tell two, beside each other; None otherwise.

    A law that explains the beginning of the records alone may be one of two that explain them all, but where one free
    force does: its motion cannot be followed to the end. One that was chosen where the other effect does not show
    explains no others. Those are looked for first, and count where both explain more of the records than the law does.
    """
    elsewhere = chosen_where_it_shows(first)
    if elsewhere is not None and _worth_looking(elsewhere):
        both = _explaining(first, _looked_for(elsewhere))
        if both is not None:
            return both
    if first.sigma > 0 and first.ranked:
        whole = first.at(0.0)
        if not first.ranked[0].candidate.nonlinear:
            first = whole  # what a linear law leaves later on is something else, since it is followed all the way
        elif not first.one_force_explains and _worth_looking(whole):
            both = _explaining(first, _looked_for(whole))
            if both is not None and both.terms.sigma < first.sigma:
                return both
    return _looked_for(first)


def _explaining(first: Searched, found: Further | None) -> Further | None:
    """What was found, where it explains unseen data; None otherwise."""
    return found if found is not None and found.terms.chosen <= first.settings.adequate else None


def hidden_by_each_other(first: Searched) -> Further | None:
    """Two effects, one of them linear, that explain the recordings where no law at one place explains anything: free
    forces at two places have to, and not at one. What is wrong with a mesh everywhere, no two explain."""
    if not first.located or first.one_force_explains or not _worth_looking(first):
        return None
    places = pair(first, thorough=False)
    if places is None or places[0].fit.score > first.settings.adequate:
        return None
    return _explaining(first, _one_of_them_linear(first, *places))


def _looked_for(first: Searched) -> Further | None:
    """Two effects in one window."""
    near = _both_linear(first) or _beside(first)
    if near is not None:
        return near
    if not _worth_looking(first):
        return None
    # beside a law that leaves noise alone another at its place has nothing to explain
    one = _in_parallel(first) if _above_noise(first) else None
    if one is None:
        one, first = _at_two_places(first)
    if _one_of_two(first) or _explaining(first, one) is not None:
        return one
    found = of_those_found(first)
    two = None if found is None else _further(*found, first.ranked)
    return _foremost(first, one, two)


def _both_linear(first: Searched) -> Further | None:
    """Two linear laws that explain whole records where the best law is nonlinear, but what acts at its place the same
    at all levels, and the model bends for it or it could be followed in the beginning of the records alone; None
    otherwise. With a spring and dashpot beside it, and a model that bends, a nonlinear law may do as well as both."""
    settings, best = first.settings, first.ranked[0] if first.ranked else None
    if best is None or not best.candidate.nonlinear or best.candidate.joint is None or best.recovered is None:
        return None
    if first.sigma == 0 and best.candidate.prior <= settings.gain_cost:
        return None
    if element_depends_on_level(first.problem, best.candidate.joint, best.recovered.fit.p):
        return None
    whole = first.at(0.0)
    linear = [r for r in whole.ranked if not r.candidate.nonlinear]
    alone = replace(whole, ranked=linear, settings=replace(settings, nonlinear_places=0))
    if not _worth_looking(alone):
        return None
    beaten = best.score if first.sigma == 0 else np.inf
    both = (_explaining(first, f) for f in (_in_parallel(alone), _beside_the_best(alone)[0]))
    return min((f for f in both if f is not None and f.score < beaten), key=lambda f: f.score, default=None)


def _in_parallel(first: Searched) -> Further | None:
    """Two laws at the best law's place, where they explain the recordings."""
    found = in_parallel(first)
    place = first.ranked[0].located.place
    return None if found is None else _further(first, found, [r for r in first.ranked if r.located.place is place])


def _foremost(first: Searched, *found: Further | None) -> Further | None:
    """What comes first of what was found, if anything was."""
    return min((f for f in found if f is not None), key=lambda f: in_order(first, (f.score, f.terms)), default=None)


def _beside(first: Searched) -> Further | None:
    """The best law with a spring or a dashpot beside it, where they explain the recordings."""
    if not first.ranked or any(r.frf is not None for r in first.problem.records):
        return None
    best = first.ranked[0]
    found = companions(first, best)
    if found is None or found[1].chosen > first.settings.adequate:
        return None
    return _further(first, found, [r for r in first.ranked if r.located is best.located])


def _worth_looking(first: Searched) -> bool:
    """Whether more is left than a law can be asked to explain, or the model bends for the law so much that it is no
    name; with sensors enough to tell two forces."""
    records = first.problem.records
    if not first.ranked or min(r.y.shape[0] for r in records) < 3 or any(r.frf is not None for r in records):
        return False
    settings, best = first.settings, first.ranked[0].candidate
    # above what noise leaves, the law's own parameters aside
    left = deviance(best.chosen, first.n_values) + best.prior - first.floor
    # a free force may show that there is less noise than was thought, and the model bend for what a law leaves of it
    bent = best.chosen > settings.adequate * _noise(first) and best.prior > settings.gain_cost
    lacking = best.chosen > settings.adequate or settings.strains(best.prior) or bent
    shown = _above_noise(first) or settings.bends(best.prior)
    return lacking and left > WORTH * settings.gain_cost and shown


def _noise(first: Searched) -> float:
    """What noise leaves of unseen data."""
    return float(np.exp(first.floor / first.n_values))


def _above_noise(first: Searched) -> bool:
    """Whether the best law leaves more than noise of unseen data."""
    return shows(first.settings, first.ranked[0].candidate.chosen, _noise(first))


@dataclass(frozen=True, eq=False)
class _Aside:
    """What is there while one effect is looked for: known forces, members with a factor and springs that are part of
    the model, its unknowns p, which are `held` where another force was free too when they were found."""

    known: Known
    members: tuple[Place, ...]
    p: FloatArray
    held: bool = False


def _at_two_places(first: Searched) -> tuple[Further | None, Searched]:
    """Names both of two effects, each with the force of the other as an input; fitted together they have to win against
    one law alone. Beside it the search, with the noise in which that was looked for.

    Where the best law leaves little it is one of the two. Where it leaves much it may be neither, and so it may where
    nothing beside its force explains the rest: that force was read off a model which the other effect had bent. Then
    two places are looked for whose forces leave clearly less than one, what they leave counting as noise: a linear law
    is named with the force at the other free, and only then the best law is taken for one of the two; at last the force
    read off at the second place. Where no force anywhere explains what the best law leaves, there is no second.
    """
    settled: Further | None = None
    quiet, one = first, _one_of_two(first)
    if one:
        settled, more = _beside_the_best(first)
        if _explaining(first, settled) is not None or not more or _stands_alone(first):
            return settled, first
    pairs = likely_pairs(first)
    places = pairs[0] if pairs else None
    if places is not None:
        louder = beyond_two_forces(first, places[0])
        if louder is not first and not _worth_looking(louder):
            return settled, first
        first = louder
        both = _explaining(first, _one_of_them_linear(first, *places)) or _both_free(first, *places)
        both = both or _linear_at_another_pair(first, pairs[1:])
        if both is not None:
            return both, first
    if one and first is quiet:
        return settled, first
    found, more = _beside_the_best(first)
    found = settled if found is None else found
    if found is not None or not more or places is None:
        return found, first
    return _beside_a_free_force(first, *places), first


def _beside_a_free_force(first: Searched, second: Located, at: Place) -> Further | None:
    """Laws anywhere beside the force read off at the second of two places, and those that follow it."""
    free = _free(first, second, at)
    one = _search(first, free, others(first, second.place))
    if one is None or not one.ranked:
        return None
    aside, beside = _next_to(first, one.ranked[0], free.known)
    return _in_turns(first, one.ranked[0], one.ranked, aside, beside)


def _one_of_them_linear(first: Searched, second: Located, at: Place) -> Further | None:
    """Two places of which one has a linear law, named with the force at the other free. Where that law is a part of
    the model, and both leave more than noise does, what stands beside it is named again as one effect is, at all
    places."""
    found = one_linear(first, second, at)
    if found is None:
        return None
    first, laws = found.first, found.linear
    told = _told(first, found.both, laws)
    if told is not None and not may_be_beaten(first, (told.score, told.terms)):
        return told
    aside = _of_law(first, laws[0], _nothing(first))
    beside = _search(first, aside, others(first, laws[0].located.place)) if aside.members else None
    if beside is None or not beside.ranked or beside.sigma > first.sigma:
        return told
    here = [r for r in laws if r.located.place is laws[0].located.place]
    return _foremost(first, told, _together(first, (here, beside.ranked)))


def _both_free(first: Searched, second: Located, at: Place) -> Further | None:
    """Two places whose laws were read off with the forces at both free, where both explain the recordings."""
    both = two_free(first, second, at)
    return None if both is None else _explaining(first, _told(first, both, []))


def _linear_at_another_pair(first: Searched, pairs: Sequence[tuple[Located, Place]]) -> Further | None:
    """Two linear laws that explain the recordings at one of the pairs: free forces at a pair that bends the model may
    leave a little less than those at the right one, with no laws behind them."""
    for places in pairs:
        both = two_linear(first, *places)
        told = None if both is None else _explaining(first, _told(first, both, []))
        if told is not None:
            return told
    return None


def _one_of_two(first: Searched) -> bool:
    """Whether the best law is one of the two, if there are two: it takes most away and leaves little."""
    best = first.ranked[0]
    return _takes_most(first) and best.candidate.chosen <= first.settings.far


def _stands_alone(first: Searched) -> bool:
    """Whether one force explains the recordings, and nothing says that it stands in for two: the model does not bend
    for the best law, or that leaves noise alone and the model bends by no more than it may beside a name."""
    settings, best = first.settings, first.ranked[0].candidate
    at_noise = best.chosen <= settings.consistent and not settings.bends(best.prior)
    return first.one_force_explains and (at_noise or not settings.strains(best.prior))


def _takes_most(first: Searched) -> bool:
    """Whether the best law takes away the greater part of what is wrong with the updated model."""
    return first.null_score - first.ranked[0].score > FIRST_SHARE * (first.null_score - first.floor)


def _beside_the_best(first: Searched) -> tuple[Further | None, bool]:
    """Two effects of which one is the best law, where that explains the greater part; and, where there are none,
    whether there may be two others."""
    best = first.ranked[0]
    if not _takes_most(first):
        return None, True
    aside, beside = _next_to(first, best, _nothing(first))
    return _in_turns(first, best, first.ranked, aside, beside), beside is not None


@dataclass(frozen=True, eq=False)
class _Beside:
    """Laws beside what is known, in order of score, and the window exp(-sigma t) they are compared in."""

    ranked: list[Ranked]
    sigma: float


def _next_to(first: Searched, one: Ranked, given: Known) -> tuple[_Aside, _Beside | None]:
    """The force of the law `one` beside what is `given`, and what the search beside it finds."""
    aside = _of_law(first, one, given)
    return aside, _search(first, aside, others(first, one.located.place))


def _in_turns(
    first: Searched, one: Ranked, laws: Sequence[Ranked], aside: _Aside, two: _Beside | None
) -> Further | None:
    """The law `one`, whose force is `aside`, with those found beside it, `two`; and the first named again beside the
    second. Where the second can be followed in a beginning alone, all are compared there."""
    if two is None or not two.ranked:
        return None
    first = first.at(max(first.sigma, two.sigma))
    here = [r for r in laws if r.located.place is one.located.place]
    found = _together(first, (here, two.ranked))
    if _explaining(first, found) is not None:
        return found
    _, again = _next_to(first, two.ranked[0], aside.known)
    if again is None or not again.ranked:
        return found
    better = _together(first, (again.ranked, two.ranked))
    if better is not None and first.settings.strains(better.terms.prior):
        # the first law is what it is now, and the second may have been found beside one that was not
        _, anew = _next_to(first, again.ranked[0], _nothing(first))
        third = _together(first, (again.ranked, anew.ranked)) if anew is not None and anew.ranked else None
        better = min((f for f in (better, third) if f is not None), key=lambda f: f.score)
    both = [f for f in (found, better) if f is not None]
    return min(both, key=lambda f: f.score, default=None)


def _nothing(first: Searched) -> Known:
    """No force that is known."""
    return Known((), {r.name: () for r in first.problem.records})


def _search(first: Searched, aside: _Aside, places: Sequence[Place]) -> _Beside | None:
    """Laws at the best of the places: the search for one effect again, beside what is known. None where no force at
    any of them explains what a law has to."""
    reduced = first.reduced
    for member in aside.members:
        reduced = with_own(member, reduced)
    reduced, rows = aside.known.basis(reduced, first.problem.band[1], first.g_rows)
    problem = first.problem.on([aside.known.on(r) for r in first.problem.records])
    split = aside.known.split(first.split)
    start = with_members(first, aside.p, sum(m.n_own for m in aside.members))
    # without the other force the model would be bent by what that did
    steps = 0 if aside.held else STEPS
    (null,) = problem.fit([Hypothesis(reduced, np.zeros((0, reduced.r)))], [(start, np.zeros(0))], iterations=steps)
    if null is None:
        return _Beside([], 0.0)
    located = locate(problem, reduced, places, null)
    gained = cost_of(problem, null, 0.0) - min((f.cost for f in located), default=np.inf)
    if gained < first.settings.gain_cost:
        return None
    short = with_look_alikes(problem, reduced, shortlist(located), places, first.settings)
    given = Given(split, reduced, rows, null.p, first.settings)
    ranked, sigma = name_physics(given, short, clamps=[*short, *located])
    return _Beside(told_simply(ranked, first.settings), sigma)


def _free(first: Searched, second: Located, at: Place) -> _Aside:
    """The free force at the second place as the recordings show it."""
    p = plain(first, second.fit.p)
    if second.place.part:
        return _Aside(_nothing(first), (second.place,), p)
    both = [place for place in (second.place, at) if not place.part]
    forces = free_forces(first.problem, second.fit, both)
    known = Known((second.place,), {name: f[:1] for name, f in forces.forces.items()}, forces.attached[:1])
    return _Aside(known, (), p, held=True)


def _of_law(first: Searched, ranked: Ranked, given: Known) -> _Aside:
    """A law that was found: a spring as part of the model, since what it was fitted to was not it alone, any other by
    its force."""
    nothing, candidate = _nothing(first), ranked.candidate
    p = plain(first, candidate.p)
    if ranked.name == "support_stiffness" and candidate.joint is not None and not given.places:
        k = collapsed(candidate, ranked.recovered, first.settings).values["k"]
        return _Aside(nothing, (replace(candidate.joint.place, spring=k),), p)
    if candidate.joint is None:
        return _Aside(nothing, (ranked.located.place,), p)
    known = forces_of_laws(first.problem.on([given.on(r) for r in first.problem.records]), candidate)
    return _Aside(nothing if known is None else known, (), p)


def _together(first: Searched, laws: Sequence[Sequence[Ranked]]) -> Further | None:
    """The best of the laws at each place fitted together; None where they do not win against less."""
    tries = [
        (
            [term_of(first, r) for r in chosen],
            plain(first, chosen[-1].candidate.p),
        )
        for chosen in itertools.product(*(distinct(first, ranked) for ranked in laws))
    ]
    best = best_of(first, tries)
    if best is not None and may_be_beaten(first, best):
        best = _at_other_places(first, best, laws)
    return None if best is None else _told(first, best, [r for every in laws for r in every])


def _at_other_places(first: Searched, found: Scored, laws: Sequence[Sequence[Ranked]]) -> Scored:
    """Laws that were fitted together, each of them where it is or at another place that a free force does not tell from
    that one, in turn."""
    for ranked in laws:
        here = [i for i, t in enumerate(found[1].terms) if any(r.located.place is t.located.place for r in ranked)]
        for i in here[:1]:
            for r in at_other_places(first, found[1].terms[i], ranked):
                terms = [term_of(first, r) if j == i else t for j, t in enumerate(found[1].terms)]
                found = better(first, found, fitted_together(first, terms, found[1].p)) or found
    return found


def _told(first: Searched, best: Scored, tried: Sequence[Ranked]) -> Further | None:
    """Laws that were fitted together, as plainly as they can be told, a linear one beside the other's force against all
    laws, and at the places where they leave least; None where they do not win against less."""
    best, anew = named_anew(first, told_plainly(first, best))
    best = in_the_model(first, best)
    tried = [*anew, *(r for r in tried if not any(r.located.place is a.located.place for a in anew))]
    if not are_told(first, best):
        return None
    placed = at_the_best_places(first, where_both_explain_more(first, best))
    for before, after in zip(best[1].terms, placed[1].terms, strict=True):
        tried = _carried(tried, before.located, after.located)
    return _further(first, placed, tried)


def _carried(tried: Sequence[Ranked], before: Located, after: Located) -> Sequence[Ranked]:
    """Laws that were tried, those at a place whose law was moved as they compared there."""
    if before.place is after.place:
        return tried
    others = (r for r in tried if r.located.place is not after.place)
    return [replace(r, located=after) if r.located.place is before.place else r for r in others]


def _further(first: Searched, found: Scored, tried: Sequence[Ranked]) -> Further:
    """The terms followed as far as they explain and fitted to all records, each with the laws `tried` at its place: of
    two at one place the first, a law beside it stands by itself."""
    score, terms = found
    terms = follow_terms(first.split.fitting, first.split.choosing, terms, first.settings.adequate)
    whole = refit_terms(first.problem.thinned(FINAL_LINES), terms)
    laws: list[tuple[Ranked, ...]] = []
    named: list[Place] = []
    for term in whole.terms:
        here = tuple(r for r in tried if r.located.place is term.located.place)
        own = Ranked(term.candidate, term.located, score, name=term.candidate.name)
        if not here or any(term.located.place is p for p in named):
            here = (own,)
        elif term.candidate.n_law < here[0].candidate.n_law and own.name != here[0].name:
            # told more plainly than it was found: ahead by what the parameters cost that it does without
            saved = first.price * (here[0].candidate.n_law - term.candidate.n_law)
            here = (replace(own, score=here[0].score - saved), *(r for r in here if r.name != own.name))
        elif own.name != here[0].name:
            # of another form beside the second law than beside a free force: ahead by what that had to win by
            won = first.settings.margin
            here = (replace(own, score=here[0].score - won), *(r for r in here if r.name != own.name))
        laws.append(here)
        named.append(term.located.place)
    return Further(whole, tuple(laws), score)
