"""What is missing: every law of the catalogue at the best places, judged on a record that no fit has seen."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.fitting.candidates import Candidate, laws_for
from femend.diagnose.fitting.pace import Pace
from femend.diagnose.locating.locate import Located, order
from femend.diagnose.naming.hinges import inside
from femend.diagnose.naming.judge import Given, Tried, again, beaten, compared_in, free_reference, free_score, judge_in
from femend.diagnose.naming.laws_at import (
    Opened,
    each_once,
    linear_at,
    masses_from_afar,
    member_at,
    nonlinear_at,
    on_springs,
)
from femend.diagnose.naming.ranked import Ranked, at_one_level, score
from femend.diagnose.naming.window import followed_on, widest
from femend.diagnose.settings import Settings
from femend.model import Place
from femend.threads import at_once

__all__ = ["linear_alone", "name_physics"]

FloatArray = NDArray[np.float64]


def name_physics(
    given: Given,
    located: Sequence[Located],
    null_score: float = np.inf,
    *,
    tell: Callable[[int], None] = lambda n: None,
    clamps: Sequence[Located] | None = None,
    note: Callable[[list[Ranked]], None] = lambda judged: None,
) -> tuple[list[Ranked], float]:
    """Candidates of all laws at the best places, in rising order of score, and the window they are compared in. Clamps
    among the places `clamps` (`located` without them) are tried on springs of their own. `null_score` is what the
    updated model has by itself, `tell` is told of each place, `note` gets the laws of each as they come.

    Linear laws are tried at every place and its nearest look-alikes; nonlinear ones at the first places, and only where
    no linear law explains the choosing records about as well as a free force does; as long as no law does that, at all
    places that are located as well as the best. All are compared on whole records (sigma = 0), but where the best law's
    motion could only be followed within a window exp(-sigma t) there.
    """
    tried: list[Tried] = []
    opened: list[Opened] = []
    hinged: set[tuple[tuple[int, ...], str]] = set()
    first_look = judge_in(given, 0.0)
    turns = list(each_once(located))
    # members have nothing to do with what was tried before them
    scaled = [one for one, _, _ in turns if one.place.scaled]
    members = dict(zip(map(id, scaled), at_once(partial(member_at, given), scaled), strict=True))
    for one, is_kin, masses_alone in turns:
        if not is_kin:
            tell(1)
        new, at = (members[id(one)], None) if id(one) in members else linear_at(given, one, masses_alone, tried)
        for joint in inside(given, new, hinged):
            new += linear_at(given, joint, False, tried)[0]
        tried += new
        note(first_look.at_once(new))
        opened += [at] if at is not None and not is_kin else []
    tried += masses_from_afar(given, located, opened)
    tried += on_springs(given, located if clamps is None else clamps, tried)
    if not _linear_suffices(given, tried, opened, null_score):
        first, further = _likeliest(opened, tried, given.settings)
        # what a law has to come near to, from which no further places are tried
        least = min((free_reference(given.split, o.recovered) for o in opened), default=1.0) if further else np.inf
        pace = Pace()
        for n, at in enumerate([*first, *further]):
            if n >= len(first) and _adequate(tried, given.settings, least):
                break
            if beaten(given, tried, at.recovered):
                continue
            new = nonlinear_at(given.split, at, pace)
            tried += new
            note(first_look.at_once(new))
    tried = _at_all_levels([t for t in tried if np.isfinite(t.candidate.chosen)], opened, given.settings)
    judge = widest(given, tried)
    ranked = [judge.ranked(t) for t in tried]
    ranked = judge.refined([r for r in ranked if np.isfinite(r.score)])
    if judge.sigma == 0:
        # in its own window a law may be adequate once it is refined
        judge = widest(given, [again(r) for r in ranked])
        if judge.sigma > 0:
            ranked = compared_in(given, ranked, judge.sigma)
    return followed_on(given, ranked, judge.sigma)


def _linear_suffices(given: Given, tried: Sequence[Tried], opened: Sequence[Opened], null_score: float) -> bool:
    """Whether the best linear law, or the model alone, comes so near to a free force that no nonlinear law could win by
    what it has to."""
    split, settings, n_values = given.split, given.settings, given.n_values()
    laws = [t.candidate for t in tried]
    best = min(laws, key=lambda law: score(law, settings, n_values), default=None)
    if best is not None and at_one_level(best, _free(opened), settings):
        return False
    references = [free_reference(split, o.recovered) for o in opened]
    chosen = np.inf if best is None else best.chosen
    if _near(chosen, min(references, default=np.inf), settings):
        return True
    free = [
        free_score(split, o.recovered, reference, n_values) for o, reference in zip(opened, references, strict=True)
    ]
    if null_score - min(free, default=np.inf) < settings.gain_nonlinear * n_values:
        return True
    linear = np.inf if best is None else score(best, settings, n_values)
    return bool(linear - min(free, default=np.inf) < settings.gain_cost)


def _at_all_levels(tried: list[Tried], opened: Sequence[Opened], settings: Settings) -> list[Tried]:
    """The laws without linear ones that explain one level alone, where a nonlinear one explains the records that it is
    fitted to and those it has not seen."""
    free = _free(opened)
    whole = (t.candidate for t in tried if t.candidate.nonlinear and t.candidate.sigma == 0)
    if not any(max(c.chosen, c.fitted) <= settings.adequate * max(free, 1.0) for c in whole):
        return tried
    return [t for t in tried if not at_one_level(t.candidate, free, settings)]


def _free(opened: Sequence[Opened]) -> float:
    """Least misfit that a free force at one of the places leaves on the records that locate."""
    return min((o.recovered.fit.score for o in opened), default=np.inf)


def _near(chosen: float, free: float, settings: Settings) -> bool:
    """Whether a linear law leaves so little more than a free force of what it has not seen that no nonlinear one can
    bring what that has to."""
    return bool(chosen * np.exp(-settings.gain_nonlinear) < free)


def linear_alone(laws: Sequence[Candidate], settings: Settings) -> bool:
    """Whether of the `laws` that were tried, in order of score, none is nonlinear, and the best comes so near to a free
    force that none was tried."""
    best = laws[0] if laws else None
    if best is None or any(law.nonlinear for law in laws):
        return False
    return _near(best.chosen, best.reference, settings)


def _adequate(tried: Sequence[Tried], settings: Settings, least: float) -> bool:
    """Whether some law explains the choosing records, whole, about as well as a free force does, which leaves
    `least`."""
    whole = min((t.candidate.chosen for t in tried if t.candidate.sigma == 0), default=np.inf)
    return bool(whole <= settings.adequate * max(least, 1.0))


def _likeliest(
    opened: Sequence[Opened], tried: Sequence[Tried], settings: Settings
) -> tuple[list[Opened], list[Opened]]:
    """The places where nonlinear laws are tried, of those that may have one: in turns the one a free force fits best
    at, and the one where a linear law comes nearest, since what it stands in for acts there. After the first of them
    those, in a list of their own, that are located as well as the best: a law makes its force of its own motion, which
    differs between places that a free force does not tell apart; those of another kind or direction first."""

    def nearest(at: Opened) -> float:
        return min((t.candidate.chosen for t in tried if t.found.place is at.found.place), default=np.inf)

    opened = [at for at in opened if _has_nonlinear(at.found.place)]
    free, linear = sorted(opened, key=lambda at: order(at.found)), sorted(opened, key=nearest)
    chosen: list[Opened] = []
    for at in (at for pair in zip(free, linear, strict=True) for at in pair):
        chosen += [] if any(at is c for c in chosen) else [at]
    first, rest = chosen[: settings.nonlinear_places], chosen[settings.nonlinear_places :]
    if not first:
        return [], []
    as_well = order(free[0].found) + settings.margin
    rest = [at for at in rest if order(at.found) <= as_well]
    return first, _different_first(first, rest)


def _has_nonlinear(place: Place) -> bool:
    """Whether the catalogue has a nonlinear law for a kind of place; for all nodes of a support it has none."""
    return any(entry.kind == "nonlinear" for _, entry in laws_for(place.kind))


def _different_first(known: Sequence[Opened], places: Sequence[Opened]) -> list[Opened]:
    """Places in order, each kind and direction once before any comes again; those `known` count as come before."""
    seen: Counter[tuple[str, str | None]] = Counter((at.found.place.kind, at.found.place.direction) for at in known)
    turns = []
    for at in places:
        key = at.found.place.kind, at.found.place.direction
        turns.append(seen[key])
        seen[key] += 1
    return [places[i] for i in sorted(range(len(places)), key=lambda i: turns[i])]
