"""What is missing: every law of the catalogue at the best places, judged on a record that no fit has seen."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.calibration import CALIBRATION
from femend.diagnose.candidates import KINDS, ONLY_GROUND, Candidate, Start, laws_for, starts
from femend.diagnose.collapse import SHARP, collapsed
from femend.diagnose.dressed import own_values
from femend.diagnose.joint import Joint, Recovered, open_joint, recover
from femend.diagnose.linear import companions_alone, fit_linear, fit_mass, judge_linear
from femend.diagnose.locate import Located, order
from femend.diagnose.nonlinear import (
    as_recorded,
    fit_nonlinear,
    judge_nonlinear,
    refit_nonlinear,
    wider_windows,
    windows,
)
from femend.diagnose.settings import Settings
from femend.diagnose.soft_clamp import soft_clamps
from femend.diagnose.split import Split
from femend.estimate import Fit, Hypothesis, Problem
from femend.model import Place, ReducedModel
from femend.model.places import mass_place

FloatArray = NDArray[np.float64]

__all__ = [
    "Ranked",
    "compared_in",
    "effective_values",
    "name_physics",
    "null_candidate",
    "score",
    "tempered",
    "told_simply",
]

# starts of a nonlinear law that are followed
NONLINEAR_STARTS = 3
# starts within this factor of the best regression are followed, at most so many at a place by one equivalent element in
# all records, and by one in each
START_REACH, MOST_STARTS = 1.6, (9, 5)
# look-alikes of a place at which linear laws are tried too, of the nearest so many
ALIKE_TRIED, MOST_ALIKE = 3, 12
# a law that leaves at most so many times what another leaves does as well
NEARLY = 1.15
# candidates of one name among those that are fitted once more
OF_ONE_NAME = 2


@dataclass(frozen=True, eq=False)
class Ranked:
    """A candidate with its place and score (tempered log posterior on unseen data, lower is better); `name` is that of
    the simplest law that does the same."""

    candidate: Candidate
    located: Located
    score: float
    recovered: Recovered | None = None
    name: str = ""


def score(candidate: Candidate, choosing: Problem, settings: Settings, n_values: float) -> float:
    """Tempered squares on unseen data, prior of the model's unknowns, and a price for every parameter of the law."""
    price = settings.price * float(np.log(max(n_values, np.e)))
    return n_values * float(np.log(max(candidate.chosen, 1e-12))) + candidate.prior + price * candidate.n_law


def tempered(ranked: Sequence[Ranked], null_score: float = np.inf) -> list[float]:
    """Softmax of -score/2 over the candidates and nothing, tempered so that no choice looks surer than it is; what none
    of them says keeps the rest to one."""
    if not ranked:
        return []
    scores = np.array([r.score for r in ranked] + [null_score]) / CALIBRATION.temperature
    weights = np.exp(-0.5 * (scores - scores.min()))
    return [CALIBRATION.surest * float(w) for w in (weights / weights.sum())[:-1]]


def effective_values(choosing: Problem, reduced: ReducedModel, sigma: float = 0.0) -> float:
    """Tempered number of values of the choosing records, windowed by exp(-sigma t), as they count in the score: of
    whole records, though of one only a part may choose, so that scores mean the same in every study."""
    lines = choosing.lines(reduced, sigma)
    return float(sum(line.share * line.Y.size * (line.record.n / line.n) for line in lines))


def null_candidate(split: Split, null: Fit, name: str = "none", sigma: float = 0.0) -> Candidate:
    """The model with its parameters alone (or a member's factor, a soft clamp's springs) as a candidate, judged with a
    window of `sigma`."""
    (fitted,) = split.fitting.fit([null.hypothesis], [(null.p, null.x)])
    fitted = null if fitted is None else fitted
    (seen,) = split.choosing.fit([fitted.hypothesis], [(fitted.p, fitted.x)], sigma=sigma, iterations=0)
    n_law = null.hypothesis.reduced.extra
    mean, sd = split.fitting.prior(null.hypothesis.reduced)
    deviations = ((fitted.p - mean) / sd) ** 2
    n = len(null.hypothesis.reduced.names)
    own = slice(n - n_law, n)
    prior = float(deviations.sum() - deviations[own].sum())
    values = own_values(null.hypothesis.reduced, fitted.p)
    chosen = np.inf if seen is None else seen.score
    return Candidate(None, name, None, values, fitted.p, fitted.x, n_law, prior, fitted.score, chosen)


@dataclass(frozen=True, eq=False)
class _Opened:
    """A place opened for laws, with what it did."""

    found: Located
    joint: Joint
    recovered: Recovered


@dataclass(frozen=True, eq=False)
class _Tried:
    """A candidate with where it came from."""

    candidate: Candidate
    found: Located
    recovered: Recovered | None


def name_physics(
    split: Split,
    reduced: ReducedModel,
    located: Sequence[Located],
    g_rows: list[int],
    settings: Settings,
    updated: FloatArray,
    null_score: float = np.inf,
    tell: Callable[[int], None] = lambda n: None,
    clamps: Sequence[Located] | None = None,
    note: Callable[[list[Ranked]], None] = lambda judged: None,
) -> tuple[list[Ranked], float]:
    """Candidates of all laws at the best places, in rising order of score, and the window they are compared in;
    `updated` are the unknowns of the updated model. Clamps among the places `clamps` (`located` without them) are tried
    on springs of their own. `note` gets the laws of each place as they come.

    Linear laws are tried at every place and its nearest look-alikes; nonlinear ones at the first places, and only where
    no linear law explains the choosing records about as well as a free force does. All are compared on whole
    records (sigma = 0), but where the best law's motion could only be followed within a window exp(-sigma t) there.
    """
    tried: list[_Tried] = []
    opened: list[_Opened] = []
    first_look = _Judge(split, settings, effective_values(split.choosing, reduced), 0.0)
    for found in located:
        tell(1)
        for place in (found.place, *_worth_trying(found)):
            one = found if place is found.place else replace(found, place=place, alike=_others(found, place))
            # a brace to a support does what the ground does, but carries no mass
            masses_alone = found.place.kind != "ground" and place is not found.place
            new, at = _linear_at(split, reduced, one, g_rows, masses_alone, updated)
            tried += new
            note(first_look.at_once(new))
            opened += [at] if at is not None and place is found.place else []
    tried += _soft_clamps(split, reduced, located if clamps is None else clamps, updated, tried, settings)
    if not _linear_suffices(split, reduced, tried, opened, null_score, settings):
        for at in _likeliest(opened, tried, settings):
            laws = _nonlinear_laws(split, at)
            new = [_Tried(c, at.found, at.recovered) for c in (*laws, *_companions_alone(split, at, laws))]
            tried += new
            note(first_look.at_once(new))
    tried = [t for t in tried if np.isfinite(t.candidate.chosen)]
    judge = _widest(split, reduced, tried, settings, updated)
    ranked = [judge.ranked(t) for t in tried]
    ranked = judge.refined([r for r in ranked if np.isfinite(r.score)])
    if judge.sigma == 0:
        # in its own window a law may be adequate once it is refined
        judge = _widest(split, reduced, [_again(r) for r in ranked], settings, updated)
        if judge.sigma > 0:
            ranked = compared_in(split, reduced, ranked, judge.sigma, settings)
    return _followed_on(split, reduced, ranked, judge.sigma, settings)


def _followed_on(
    split: Split, reduced: ReducedModel, ranked: list[Ranked], sigma: float, settings: Settings
) -> tuple[list[Ranked], float]:
    """The best law fitted in fine steps in ever wider windows than exp(-sigma t) as long as it explains what it has not
    seen there, and all laws as they compare in the last of them."""
    if sigma == 0 or not ranked or not ranked[0].candidate.nonlinear:
        return ranked, sigma
    best, reached = ranked[0], sigma
    for wider in wider_windows(split.fitting, sigma):
        judge = _Judge(split, settings, effective_values(split.choosing, reduced, wider), wider)
        candidate = refit_nonlinear(split.fitting, replace(best.candidate, sigma=wider))
        there = judge.ranked(_Tried(candidate, best.located, best.recovered), afresh=True)
        if there.candidate.chosen > settings.adequate * max(there.candidate.reference, 1.0):
            break
        best, reached = there, wider
    if reached == sigma:
        return ranked, sigma
    return compared_in(split, reduced, [best, *ranked[1:]], reached, settings), reached


def compared_in(
    split: Split, reduced: ReducedModel, ranked: Sequence[Ranked], sigma: float, settings: Settings
) -> list[Ranked]:
    """Laws that were found one place after the other, all compared in one window exp(-sigma t)."""
    judge = _Judge(split, settings, effective_values(split.choosing, reduced, sigma), sigma)
    return judge.in_order([judge.ranked(_again(r), afresh=True) for r in ranked])


def told_simply(ranked: Sequence[Ranked], settings: Settings) -> list[Ranked]:
    """Ranked laws, each by the name of what it collapses to."""
    return [replace(r, name=collapsed(r.candidate, r.recovered, settings).name) for r in ranked]


def _again(ranked: Ranked) -> _Tried:
    """A law that was judged, to be judged otherwise."""
    return _Tried(ranked.candidate, ranked.located, ranked.recovered)


def _linear_suffices(
    split: Split,
    reduced: ReducedModel,
    tried: Sequence[_Tried],
    opened: Sequence[_Opened],
    null_score: float,
    settings: Settings,
) -> bool:
    """Whether the best linear law, or the model alone, comes so near to a free force that no nonlinear law could win by
    what it has to."""
    n_values = effective_values(split.choosing, reduced)
    scored = [(score(t.candidate, split.choosing, settings, n_values), t.candidate.chosen) for t in tried]
    linear, chosen = min(scored, default=(np.inf, np.inf))
    references = [free_reference(split, o.recovered) for o in opened]
    if chosen * np.exp(-settings.gain_nonlinear) < min(references, default=np.inf):
        return True
    free = [
        n_values * np.log(max(reference, 1e-12)) + split.fitting.prior_cost(o.joint.reduced, o.recovered.fit.p)
        for o, reference in zip(opened, references, strict=True)
    ]
    if null_score - min(free, default=np.inf) < settings.gain_nonlinear * n_values:
        return True
    return bool(linear - min(free, default=np.inf) < settings.gain_cost)


def _likeliest(opened: Sequence[_Opened], tried: Sequence[_Tried], settings: Settings) -> list[_Opened]:
    """The places where nonlinear laws are tried: in turns the one a free force fits best at, and the one where a linear
    law comes nearest, since what it stands in for acts there."""

    def nearest(at: _Opened) -> float:
        return min((t.candidate.chosen for t in tried if t.found.place is at.found.place), default=np.inf)

    free, linear = sorted(opened, key=lambda at: order(at.found)), sorted(opened, key=nearest)
    chosen: list[_Opened] = []
    for at in (at for pair in zip(free, linear, strict=True) for at in pair):
        chosen += [] if any(at is c for c in chosen) else [at]
    return chosen[: settings.nonlinear_places]


def _widest(
    split: Split, reduced: ReducedModel, tried: Sequence[_Tried], settings: Settings, updated: FloatArray
) -> _Judge:
    """The widest window in which some law explains what it has not seen about as well as a free force anywhere does;
    whole records where none does, or none but in the beginning, where the updated model (unknowns `updated`) does
    without any."""
    whole = _Judge(split, settings, effective_values(split.choosing, reduced), 0.0)
    if not any(t.candidate.nonlinear for t in tried):
        return whole
    bare = Hypothesis(reduced, np.zeros((0, reduced.r)))
    for sigma in reversed(windows(split.fitting)):
        judge = whole
        if sigma > 0:
            judge = _Judge(split, settings, effective_values(split.choosing, reduced, sigma), sigma)
            (alone,) = split.choosing.fit([bare], [(updated, np.zeros(0))], sigma=sigma, iterations=0)
            if alone is not None and alone.score <= settings.adequate:
                break
        judged = [(judge.ranked(t).candidate, t.candidate.sigma <= sigma) for t in tried]
        # at a place where a free force explains nothing, a law that explains nothing does as well
        least = min((c.reference for c, _ in judged if np.isfinite(c.reference)), default=1.0)
        # a beginning is explained by much if the model's own unknowns may leave their priors for it
        fair = [c for c, followed in judged if followed and not (sigma > 0 and settings.strains(c.prior))]
        if any(c.chosen <= settings.adequate * max(least, 1.0) for c in fair):
            return judge
    return whole


def free_reference(split: Split, recovered: Recovered, sigma: float = 0.0) -> float:
    """Misfit a free force at the joint leaves on the choosing records: what the right law can reach at best."""
    fit = recovered.fit
    (seen,) = split.choosing.fit([fit.hypothesis], [(fit.p, fit.x)], sigma=sigma, iterations=0)
    return np.inf if seen is None else seen.score


def _worth_trying(found: Located) -> list[Place]:
    """Look-alikes of a place at which laws are tried too: those to the ground, first where the model has a joint."""
    if found.place.n_w != 1:
        return []
    ground = [p for p in found.alike[:MOST_ALIKE] if p.kind == "ground"]
    return sorted(ground, key=lambda p: p.unlikely)[:ALIKE_TRIED]


def _others(found: Located, place: Place) -> tuple[Place, ...]:
    """Look-alikes of a look-alike: the first place and its other look-alikes."""
    return (found.place, *(p for p in found.alike if p is not place))


def _linear_at(
    split: Split,
    reduced: ReducedModel,
    found: Located,
    g_rows: list[int],
    masses_alone: bool,
    updated: FloatArray,
) -> tuple[list[_Tried], _Opened | None]:
    """All linear laws at a place, or those of a mass alone, and the place opened; a member has its stiffness factor
    alone."""
    if found.place.scaled:
        member = null_candidate(split, found.fit, "joint_stiffness")
        # a member may be weaker than it is drawn; one that would have to be stiffer stands in for something else
        return [_Tried(member, found, None)] if member.values["factor"] < 1.0 else [], None
    joint = open_joint(found.place, reduced, split.whole.band[1], g_rows)
    recovered = recover(split.reading, joint, found.fit.p)
    if recovered is None:
        # a cut member may be as soft there as the model's unknowns go: what the update found is more modest
        recovered = recover(split.reading, joint, updated)
    if recovered is None:
        return [], None
    fitted = [
        fit_linear(split.fitting, split.choosing, joint, recovered, name, entry, updated)
        for name, entry in laws_for(joint.place.kind)
        if entry.kind == "linear" and (name in ONLY_GROUND or not masses_alone)
    ]
    tried = [_Tried(c, found, recovered) for c in fitted if c is not None]
    if found.place.kind == "ground":
        whole = open_joint(mass_place(reduced.model, found.place.nodes[0]), reduced, split.whole.band[1], g_rows)
        mass = fit_mass(split.fitting, split.choosing, whole, found.fit.p, updated)
        tried += [] if mass is None else [_Tried(mass, found, None)]
    return tried, _Opened(found, joint, recovered)


def _soft_clamps(
    split: Split,
    reduced: ReducedModel,
    located: Sequence[Located],
    updated: FloatArray,
    tried: Sequence[_Tried],
    settings: Settings,
) -> list[_Tried]:
    """Clamps among the places on springs of their own in one direction and in several, but for those that even with
    springs in all directions, were they free of charge, come clearly behind the best law `tried` elsewhere."""
    n_values = effective_values(split.choosing, reduced)
    best = min((score(t.candidate, split.choosing, settings, n_values) for t in tried), default=np.inf)

    def soft(fit: Fit) -> Candidate:
        return null_candidate(split, fit, "compliant_support")

    def beaten(fit: Fit) -> bool:
        free_of_charge = replace(soft(fit), n_law=0)
        return score(free_of_charge, split.choosing, settings, n_values) > best + settings.gain_cost

    found = soft_clamps(split, reduced, located, updated, settings.margin, beaten)
    return [_Tried(replace(soft(one.located.fit), reference=one.reference), one.located, None) for one in found]


def _companions_alone(split: Split, at: _Opened, laws: Sequence[Candidate]) -> list[Candidate]:
    """What stands beside the best of nonlinear `laws` at a place, without it; none at a cut, of which it is part."""
    whole = [c for c in laws if c.sigma == 0 and np.isfinite(c.chosen)]
    if not whole or at.joint.place.kind not in KINDS:
        return []
    return companions_alone(split.fitting, split.choosing, min(whole, key=lambda c: c.chosen))


def _nonlinear_laws(split: Split, at: _Opened) -> list[Candidate]:
    # they show in time records alone, and are simulated under the force
    if split.whole.load is not None or any(r.frf is not None for r in split.whole.records):
        return []
    lines = split.reading.lines(at.joint.reduced)
    s = [np.asarray(2j * np.pi * line.freq, dtype=np.complex128) for line in lines]
    worth: list[tuple[str, Start]] = []
    # by one element in all records and by one in each: which of them comes nearer is not known beforehand
    readings: list[Recovered | None] = [at.recovered]
    if len(split.reading.records) > 1:
        readings.append(recover(split.reading, at.joint, at.found.fit.p, by_record=True))
    for recovered, most in zip(readings, MOST_STARTS, strict=False):
        if recovered is None:
            continue
        begun = [
            (name, start)
            for name, entry in laws_for(at.joint.place.kind)
            if entry.kind == "nonlinear"
            for start in starts(entry, at.joint, recovered, s, NONLINEAR_STARTS)
        ]
        untold = [b for b in begun if np.isnan(b[1].left) and recovered is at.recovered]
        told = sorted((b for b in begun if not np.isnan(b[1].left)), key=lambda item: item[1].left)
        worth += [*untold, *(b for b in told if b[1].left < START_REACH * told[0][1].left)][: most + len(untold)]
    return fit_nonlinear(split.fitting, split.choosing, at.joint, at.recovered, worth)


@dataclass(frozen=True, eq=False)
class _Judge:
    """Scores on the choosing records, all in one window; `n_values` as they count there."""

    split: Split
    settings: Settings
    n_values: float
    sigma: float

    def at_once(self, tried: Sequence[_Tried]) -> list[Ranked]:
        """Candidates that were followed over whole records, with their scores as they are, nothing judged anew."""
        whole = [t for t in tried if t.candidate.sigma == 0 and np.isfinite(t.candidate.chosen)]
        scores = [score(t.candidate, self.split.choosing, self.settings, self.n_values) for t in whole]
        return [Ranked(t.candidate, t.found, value, t.recovered) for t, value in zip(whole, scores, strict=True)]

    def ranked(self, tried: _Tried, afresh: bool = False) -> Ranked:
        """A candidate with its score; judged `afresh` where it may have been in another window."""
        candidate, choosing = tried.candidate, self.split.choosing
        if afresh or self.sigma > 0 or candidate.sigma > 0:
            if candidate.nonlinear:
                candidate = judge_nonlinear(choosing, candidate, self.sigma)
            elif candidate.joint is not None:
                candidate = judge_linear(choosing, candidate, self.sigma)
            else:
                candidate = null_candidate(self.split, tried.found.fit, candidate.name, self.sigma)
        if tried.recovered is not None:
            candidate = replace(candidate, reference=free_reference(self.split, tried.recovered, self.sigma))
        value = score(candidate, choosing, self.settings, self.n_values)
        return Ranked(candidate, tried.found, value, tried.recovered)

    def refined(self, ranked: list[Ranked]) -> list[Ranked]:
        """In rising order of score, the best nonlinear candidates fitted once more in fine steps, all unknowns free."""
        best: list[Ranked] = []
        for r in sorted((r for r in ranked if r.candidate.nonlinear), key=lambda r: r.candidate.chosen):
            again = sum(r.candidate.name == b.candidate.name for b in best)
            best += [r] if again < OF_ONE_NAME and len(best) < self.settings.refined else []
        rest = [r for r in ranked if not any(r is b for b in best)]
        recorder, settings = self.split.fitting.recorder, self.settings
        filters, done = recorder.filters, []
        for r in best:
            inside = replace(r.candidate, sigma=max(r.candidate.sigma, self.sigma))
            candidate = refit_nonlinear(self.split.fitting, inside)
            if r is best[0]:
                candidate = as_recorded(self.split.fitting, candidate, settings.margin, settings.adequate)
            done.append(self.judged(candidate, r))
        if recorder.filters != filters:
            rest = [self.judged(r.candidate, r) if r.candidate.nonlinear else r for r in rest]
        return self.in_order([*rest, *done])

    def judged(self, candidate: Candidate, tried: Ranked) -> Ranked:
        """A nonlinear candidate judged anew where it was `tried`."""
        return self.ranked(_Tried(judge_nonlinear(self.split.choosing, candidate), tried.located, tried.recovered))

    def in_order(self, ranked: Sequence[Ranked]) -> list[Ranked]:
        """In rising order of score, a simple law before one that is hardly better."""
        return self.simple_first(sorted((r for r in ranked if np.isfinite(r.score)), key=lambda r: r.score))

    def simple_first(self, ranked: list[Ranked]) -> list[Ranked]:
        """Puts the best linear law before nonlinear ones that leave hardly less: what is wrong with the rest of the
        model gives a law with more freedom that much by itself."""
        ranked = self.simplest_linear(_friction_first(ranked))
        linear = next((r for r in ranked if not r.candidate.nonlinear), None)
        if linear is None or linear is ranked[0]:
            return ranked
        worth = float(np.exp(-self.settings.gain_nonlinear))
        reach = [r for r in ranked if r.candidate.nonlinear and r.candidate.chosen < worth * linear.candidate.chosen]
        if any(r.score < linear.score for r in reach):
            return ranked
        # they lack as much evidence as a law has to bring
        enough = linear.score + self.settings.gain_cost
        behind = [
            replace(r, score=max(r.score, enough)) if r.candidate.nonlinear else r for r in ranked if r is not linear
        ]
        return [linear, *sorted(behind, key=lambda r: r.score)]

    def simplest_linear(self, ranked: list[Ranked]) -> list[Ranked]:
        """Puts a linear law with fewer parameters before the best one at the same place, where this does not bring
        against it what a law has to bring against none."""
        for r in ranked:
            first = next((f for f in ranked if not f.candidate.nonlinear), None)
            if first is None or r.candidate.nonlinear or not _same_place(r.located.place, first.located.place):
                continue
            if r.candidate.n_law < first.candidate.n_law and not self.won(first, r):
                ahead = replace(r, score=first.score)
                # what the other lacks of the evidence that a law has to bring
                lacks = max(self.settings.gain_cost - (r.score - first.score), 0.0)
                behind = [replace(f, score=f.score + lacks) if f is first else f for f in ranked if f is not r]
                ranked = sorted([ahead, *behind], key=lambda o: o.score)
        return ranked

    def won(self, rich: Ranked, simple: Ranked) -> bool:
        """Whether a law brings against a simpler one what a law has to bring."""
        less = float(np.log(simple.candidate.chosen / max(rich.candidate.chosen, 1e-12)))
        relieved = simple.candidate.prior - rich.candidate.prior
        return self.settings.wins(simple.score - rich.score, less, relieved)


def _same_place(a: Place, b: Place) -> bool:
    """Whether laws at two places can stand for each other: it is one place, or one clamp of which one is on springs."""
    return a is b or (bool(a.springs or b.springs) and a.kind == b.kind and a.nodes == b.nodes)


def _friction_first(ranked: list[Ranked]) -> list[Ranked]:
    """Puts friction before a Bouc-Wen loop at the same place whose knee is as sharp and that leaves hardly less."""
    if not ranked or ranked[0].candidate.name != "bouc_wen" or ranked[0].candidate.values["n"] <= SHARP:
        return ranked
    loop = ranked[0]
    for r in ranked[1:]:
        same = r.candidate.name == "coulomb_friction" and r.located.place is loop.located.place
        if same and r.candidate.chosen < NEARLY * loop.candidate.chosen:
            first = replace(r, score=loop.score)
            return [first, *(other for other in ranked if other is not r)]
    return ranked
