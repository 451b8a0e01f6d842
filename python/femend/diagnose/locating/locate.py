"""Where something is missing: every place gets a free force, projected out while all parameters stay free.

A free force on every line needs no law and costs every place the same number of unknowns, so that the places compare
fairly. It is done in stages: all places on few, strongly damped lines, the better ones on more; beside them all places
in few steps on whole records; the best of both on all.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.locating.beddings import likely_beddings
from femend.diagnose.locating.classes import similarity
from femend.diagnose.locating.dressed import hypothesis_of, with_form, with_own_unknowns, without_own_unknowns
from femend.diagnose.locating.preference import preference
from femend.diagnose.locating.screen import is_many, screened, without_poor_regions
from femend.diagnose.settings import AT_NOISE, CLEARLY
from femend.estimate import Fit, Hypothesis, Problem
from femend.model import Place, ReducedModel

__all__ = [
    "FINAL_LINES",
    "HEATS",
    "Kin",
    "Located",
    "cost_of",
    "fitted",
    "grounded",
    "locate",
    "order",
    "refitted",
    "shortlist",
    "squares_of",
]

FloatArray = NDArray[np.float64]

# decay of the first stage, in units of `Problem.scale`, and its steps
FIRST_SIGMA, FIRST_STEPS = 8.0, 4
# how many places reach the next stage: members, places with one unknown force a line, places with several
FIRST_STAGE, SECOND_STAGE, LAST_STAGE, FULL_LINES = (40, 60, 16), (16, 28, 8), (8, 16, 3), (4, 10, 2)
# beddings that go on from the last stages to all lines
BEDDINGS = 2
# places that come to the last stage from whole records, the lines and steps by which they are chosen
LATE, LATE_LINES, LATE_STEPS = (4, 14, 0), 100, 3
# of these steps the first is taken from all places, the others from this share of them, and so many at least
LATE_FIRST, LATE_SHARE, LATE_LEAST = 1, 0.25, 60
# the same quotas where places were screened before: one place's fit takes longer there, and what is left is sorted out
FEW_SECOND, FEW_LAST, FEW_LATE = (6, 14, 4), (3, 8, 2), (2, 6, 0)
# mean squared correlation of what two places do to the sensors, from which they count as one at the start, and from
# which only one of them goes on later
TWINS, ALIKE = 0.999, 0.97
# share of elements in common from which only one of two members goes on
OVERLAP = 0.7
# the lines that places are compared on, and how many like a kept one are fitted at the end
COMPARED_LINES, EXPANDED = 60, 8
# after a screen, of how many kept ones the like are fitted
FEW_EXPANDED = 4
# places fitted on all lines beside the best of their kind: those within this cost of the best, and this share of it
FULL_ALIKE, NEAR, NEARLY = 12, 60.0, 0.25
# places race each other: after so many steps those go on that leave at most this multiple of the least. On calibration
# cases none that ended within twice the least was behind by more than 8 and 6 times then
HEATS = ((2, 25.0), (4, 12.0))
# how much more a place with one force must leave than one with several for these to be believed
SEVERAL_WORTH = 1.3
# lines a record in the stages, the first ones, and the last: places differ by more than the lines left out could tell
LINES, FEWEST_LINES, FINAL_LINES = 250, 120, 500
# cost of a place that nothing of the model suggests: it has to explain the records that much better than a joint
UNLIKELY = 4.0
# cost by which places that fit as well are put in the order of `preference`
TIE = 0.5
# nodes at which a mass is thought of, which acts in all directions
MASSES = 4


@dataclass(frozen=True, eq=False)
class Located:
    """A place with its law-free fit; `cost` is comparable between places whatever number of forces they have.

    `alike` are places that the sensors cannot tell from it, the closest first, where they were asked for.
    """

    place: Place
    fit: Fit
    squares: float
    alike: tuple[Place, ...] = ()

    @property
    def cost(self) -> float:
        """Prior of unknowns and place, plus tempered squares as if no force had been projected out."""
        return self.fit.prior + self.squares + (UNLIKELY if self.place.unlikely else 0.0)


def squares_of(problem: Problem, fit: Fit, sigma: float) -> float:
    """Tempered squares of a fit scaled to the number of values recorded."""
    lines = problem.lines(fit.hypothesis.reduced, sigma)
    return float(sum(line.share * line.Y.size * misfit for line, misfit in zip(lines, fit.misfit, strict=True)))


def locate(
    problem: Problem, reduced: ReducedModel, places: Sequence[Place], null: Fit, beside: Sequence[Place] = ()
) -> list[Located]:
    """Places in rising order of cost, after the last stage, places with one and with several forces each by themselves
    until there, since more forces explain more; `null` is the fit of the model as it is. At the places `beside` forces
    are free all the time.

    Of places that move the sensors alike one goes on at a time, so that the stages sort out what can be told apart; at
    the end those like the best ones are fitted too. Places that need as many forces as there are sensors, or more,
    cannot be judged and are left out.
    """
    n_out = min(r.y.shape[0] for r in problem.records)
    free = sum(b.n_w for b in beside) + problem.n_free
    # with a force nobody recorded free too, several more explain much at any place
    most = n_out - 1 if problem.load is None else max(n_out // 2, 1 + free)
    todo = [p for p in places if p.n_w + free <= most and not p.bed]
    many = is_many(todo)
    second, last, late_quota = (FEW_SECOND, FEW_LAST, FEW_LATE) if many else (SECOND_STAGE, LAST_STAGE, LATE)
    free_too = [*beside, *([] if problem.load is None else [problem.load])]
    todo = (screened if many else without_poor_regions)(problem, reduced, todo, null, free_too)
    few = problem.sparing(LINES)
    plain, damped = problem.sparing(FEWEST_LINES).untuned().pressed(), few.pressed()
    beds = likely_beddings(plain, few, reduced, [p for p in places if p.bed], beside)
    todo += [place for place, _ in beds]
    hypotheses = [hypothesis_of(p, reduced, beside) for p in todo]
    kin = Kin.of(problem, reduced, todo, null)
    stages = (
        (plain, 8.0, 5, second),
        (damped, 2.0, 6, last),
    )
    keep = _first_glance(plain, reduced, todo, kin, null, beside)
    ranked: list[tuple[int, Fit]] = []
    for lines, factor, iterations, quota in stages:
        ranked = fitted(lines, hypotheses, keep, factor * problem.scale(), iterations, todo)
        ranked = _best(ranked, todo, kin, quota)
        keep = [(i, f.p) for i, f in ranked]
    keep += [(todo.index(place), p) for place, p in beds]
    late = problem.sparing(LATE_LINES)
    keep += _late(late, hypotheses, todo, kin, null.p, reduced, late_quota)
    ranked = fitted(few, hypotheses, keep, 0.0, 15, todo)
    if ranked:
        # a place near the right one has brought the model's unknowns near the truth, whatever it lacks itself
        _, fit = ranked[0]
        n_own = len(fit.hypothesis.reduced.names) - len(reduced.names)
        near_truth = without_own_unknowns(fit.p, reduced, n_own)
        kept = _late(late, hypotheses, todo, kin, near_truth, reduced, late_quota)
        again = fitted(few, hypotheses, kept, 0.0, 15, todo)
        ranked = sorted([*ranked, *again], key=lambda item: _order(few, item, 0.0, todo))
    keep = [(i, f.p) for i, f in _best(ranked, todo, kin, FULL_LINES)]
    start = _with_their_kin(keep, todo, kin, null, FEW_EXPANDED if many else None)
    ranked = fitted(few, hypotheses, start, 0.0, 8, todo)
    first = {i for i, _ in _best(ranked, todo, kin, FULL_LINES)}
    near = NEAR + (1 + NEARLY) * min((f.cost for i, f in ranked if todo[i].n_w <= 1), default=0.0)
    chosen = [
        (i, f.p)
        for n, (i, f) in enumerate(ranked)
        if i in first or (f.cost < near and (n < FULL_ALIKE or todo[i].kind == "base"))
    ]
    ranked = fitted(problem.sparing(FINAL_LINES), hypotheses, chosen, 0.0, 5, todo)
    return _in_order(problem, [(todo[i], f) for i, f in ranked])


def _with_their_kin(
    keep: Sequence[tuple[int, FloatArray]], places: Sequence[Place], kin: Kin, null: Fit, expanded: int | None
) -> list[tuple[int, FloatArray]]:
    """Starts of the places kept, of those like the first `expanded` of them (of all with None), and of every motion of
    the base: a clamp moves the sensors as that does, and drives out what it cannot be told from."""
    start = dict(keep)
    for i, p in keep[:expanded]:
        start.update({j: p for j in kin.of_place(i, places) if j not in start})
    likely = next((p for i, p in keep if places[i].n_w == 1), null.p)
    start.update({i: likely for i, place in enumerate(places) if place.kind == "base" and i not in start})
    return list(start.items())


def refitted(problem: Problem, located: Sequence[Located]) -> list[Located]:
    """The same places fitted again to another problem of the same records, in its order."""
    few = problem.sparing(FINAL_LINES)
    fits = few.fit([f.fit.hypothesis for f in located], [(f.fit.p, f.fit.x) for f in located])
    return _in_order(problem, [(one.place, f) for one, f in zip(located, fits, strict=True) if f is not None])


def _in_order(problem: Problem, fits: Sequence[tuple[Place, Fit]]) -> list[Located]:
    found = [Located(place, f, squares_of(problem, f, 0.0)) for place, f in fits]
    return sorted(found, key=order)


def order(located: Located) -> float:
    """Cost by which places are put in order: of those that fit as well, the likelier first."""
    return located.cost + TIE * preference(located.place)


def _first_glance(
    plain: Problem, reduced: ReducedModel, places: Sequence[Place], kin: Kin, null: Fit, beside: Sequence[Place]
) -> list[tuple[int, FloatArray]]:
    """Starts of the first place of each kind for the next stage, sorted out on the most strongly damped lines by the
    model without what its members and masses differ in, which does not show there.

    Each is tried from the deck's values and from the updated model's: the first are nearer to the truth where the
    update has made up for much with the wrong parameters, the second where the deck itself is far off.
    """
    bare = reduced if reduced.form is None else reduced.bare()
    hypotheses = {i: hypothesis_of(places[i], bare, beside) for i in kin.first(places) if not places[i].bed}
    own, form = len(reduced.model.parameters), len(reduced.names) - len(bare.names)
    updated = np.concatenate([null.p[:own], null.p[own + form :]])
    starts = [
        (i, p) for i, h in hypotheses.items() for p in (plain.prior(h.reduced)[0], _with_own(updated, bare, h.reduced))
    ]
    found = fitted(plain, hypotheses, starts, FIRST_SIGMA * plain.scale(), FIRST_STEPS, places)
    kept = _best(found, places, kin, FIRST_STAGE)
    return [(i, with_form(f.p, bare, reduced)) for i, f in kept]


def _late(
    lines: Problem,
    hypotheses: Sequence[Hypothesis],
    places: Sequence[Place],
    kin: Kin,
    p: FloatArray,
    of: ReducedModel,
    quota: tuple[int, int, int],
) -> list[tuple[int, FloatArray]]:
    """Further places for the last stage, with their starts: the best after few steps from unknowns `p` of the model
    `of` on whole records. Strongly damped lines see the beginning of a record alone, where what is small or late does
    not show; the updated model is near enough to the truth just where it is small."""
    first = [i for i in kin.first(places) if places[i].n_w <= 1 and not places[i].bed]
    keep = [(i, _with_own(p, of, hypotheses[i].reduced)) for i in first]
    ranked = fitted(lines, hypotheses, keep, 0.0, LATE_FIRST, places)
    keep = [(i, f.p) for i, f in ranked[: max(LATE_LEAST, round(LATE_SHARE * len(ranked)))]]
    ranked = fitted(lines, hypotheses, keep, 0.0, LATE_STEPS - LATE_FIRST, places)
    return [(i, f.p) for i, f in _best(ranked, places, kin, quota)]


def _with_own(p: FloatArray, of: ReducedModel, to: ReducedModel) -> FloatArray:
    """Unknowns `p` of the model `of` as a place has them, which may have one more: the factor of a member, as it is."""
    return with_own_unknowns(p, of, np.zeros(len(to.names) - len(of.names)))


def _order(lines: Problem, item: tuple[int, Fit], sigma: float, places: Sequence[Place]) -> float:
    """Cost by which fits of places are put in order."""
    return cost_of(lines, item[1], sigma) + (UNLIKELY if places[item[0]].unlikely else 0.0)


def fitted(
    lines: Problem,
    hypotheses: Sequence[Hypothesis] | Mapping[int, Hypothesis],
    keep: Sequence[tuple[int, FloatArray]],
    sigma: float,
    iterations: int,
    places: Sequence[Place],
) -> list[tuple[int, Fit]]:
    """Fits of the places `keep` (index, start), in rising order of cost."""
    starts = [(lines.tuned_like(p, hypotheses[i].reduced), np.zeros(0)) for i, p in keep]
    fits = lines.fit([hypotheses[i] for i, _ in keep], starts, sigma=sigma, iterations=iterations, heats=HEATS)
    ranked = [(i, f) for (i, _), f in zip(keep, fits, strict=True) if f is not None]
    return sorted(ranked, key=lambda item: _order(lines, item, sigma, places))


def _best(
    ranked: Sequence[tuple[int, Fit]], places: Sequence[Place], kin: Kin, quota: tuple[int, int, int]
) -> list[tuple[int, Fit]]:
    """The first of the members, of the places with one force and of those with several, as many of each as `quota`
    says, and of the beddings, none of them like another."""
    kept: list[tuple[int, Fit]] = []
    left = [*quota, BEDDINGS]
    for i, fit in ranked:
        group = 3 if places[i].bed else min(places[i].n_w, 2)
        if left[group] > 0 and not any(kin.alike(i, j) for j, _ in kept):
            kept.append((i, fit))
            left[group] -= 1
    return kept


@dataclass(frozen=True, eq=False)
class Kin:
    """How alike places with one force move the sensors, `position` of each place in `matrix`; members are alike by the
    elements they share, beddings by their rows of the g-set."""

    position: dict[int, int]
    matrix: FloatArray
    elements: dict[int, frozenset[int]]

    @classmethod
    def of(cls, problem: Problem, reduced: ReducedModel, places: Sequence[Place], null: Fit) -> Kin:
        """The kin of `places`, compared at the unknowns of the fit `null`."""
        single = [i for i, p in enumerate(places) if p.n_w == 1]
        elements = {i: _held_by(p) for i, p in enumerate(places) if p.scaled}
        if not single:
            return cls({}, np.zeros((0, 0)), elements)
        few = problem.on(problem.records[:1]).thinned(COMPARED_LINES)
        matrix = similarity(few, reduced, [places[i] for i in single], null.p)
        return cls({i: n for n, i in enumerate(single)}, matrix, elements)

    def first(self, places: Sequence[Place]) -> list[int]:
        """One place of each kind that no sensor can tell apart, the likeliest, and all that are not compared."""
        kept: list[int] = []
        for i in sorted(self.position, key=lambda i: preference(places[i])):
            if not (self.matrix[self.position[i], [self.position[j] for j in kept]] > TWINS).any():
                kept.append(i)
        return sorted([*kept, *(i for i in range(len(places)) if i not in self.position)])

    def shared(self, i: int, j: int) -> float:
        """Share of the elements of two members that both have."""
        a, b = self.elements[i], self.elements[j]
        return len(a & b) / max(len(a | b), 1)

    def alike(self, i: int, j: int) -> bool:
        """Whether one of two places stands for both while places are sorted out."""
        if i in self.elements and j in self.elements:
            return self.shared(i, j) > OVERLAP
        if i not in self.position or j not in self.position:
            return i == j
        return bool(self.matrix[self.position[i], self.position[j]] > ALIKE)

    def of_place(self, i: int, places: Sequence[Place]) -> list[int]:
        """Places like place i, the likest first, at most `EXPANDED`."""
        if i in self.elements:
            like = [j for j in self.elements if j != i and self.shared(i, j) > OVERLAP]
            return sorted(like, key=lambda j: -self.shared(i, j))[:EXPANDED]
        if i not in self.position:
            return []
        row = self.matrix[self.position[i]]
        like = [j for j, n in self.position.items() if j != i and row[n] > ALIKE]
        return sorted(like, key=lambda j: (-round(float(row[self.position[j]]), 2), preference(places[j])))[:EXPANDED]


def _held_by(place: Place) -> frozenset[int]:
    """Elements of a place with a factor; of a bedding its rows, below zero since they are no elements."""
    return frozenset([*place.elements, *(-1 - int(g) for _, rows, _ in place.bed for g in rows)])


def cost_of(problem: Problem, fit: Fit, sigma: float) -> float:
    """Prior of a fit's unknowns plus its tempered squares as if no force had been projected out."""
    return fit.prior + squares_of(problem, fit, sigma)


def shortlist(located: Sequence[Located]) -> list[Located]:
    """Places whose laws are worth fitting, the likeliest first: those with one force, led by the ones with several
    where these leave clearly less; several free forces also explain what no place does. Where one force leaves nothing
    but noise within the priors, its place comes before them."""
    single = [f for f in located if f.place.n_w <= 1 and f.place.kind != "base"]
    several = [f for f in located if f.place.n_w > 1]
    best = single[0] if single else None
    enough = best is not None and best.fit.score <= AT_NOISE and best.fit.prior <= CLEARLY
    better = [f for f in several if best is None or SEVERAL_WORTH * f.cost < best.cost]
    first = single[:1] if enough else []
    return [*first, *better[:2], *single[len(first) :]]


def grounded(located: Sequence[Located]) -> list[Located]:
    """The likeliest place to the ground of each of the first nodes, `MASSES` at most, that have one."""
    first: dict[int, Located] = {}
    for one in located:
        if one.place.kind == "ground":
            first.setdefault(one.place.nodes[0], one)
    return list(first.values())[:MASSES]
