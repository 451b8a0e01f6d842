"""Where something is missing: every place gets a free force, projected out while all parameters stay free.

A free force on every line needs no law and costs every place the same number of unknowns, so that the places compare
fairly. It is done in stages: all places on few, strongly damped lines; the better ones on more; the best ones on all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from femend.estimate import Fit, Hypothesis, Problem
from femend.model import Place, ReducedModel

__all__ = ["Located", "locate", "shortlist"]

# how many places reach the next stage: those with one unknown force a line, and those with several
SECOND_STAGE, SECOND_STAGE_SEVERAL = 24, 8
LAST_STAGE, LAST_STAGE_SEVERAL = 8, 3
FULL_LINES, FULL_LINES_SEVERAL = 5, 2
# how much more a place with one force must leave than one with several for these to be believed
SEVERAL_WORTH = 1.3
# lines a record in the stages before the last: places differ by far more than the lines left out could tell
LINES, FEWEST_LINES = 300, 120
# cost of a place that nothing of the model suggests: it has to explain the records that much better than a joint
UNLIKELY = 4.0
# prior ln standard deviation of a member's own stiffness factor
MEMBER_SD = 1.0


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


def hypothesis_of(place: Place, reduced: ReducedModel) -> Hypothesis:
    """Law-free hypothesis of a place: a free force along its directions, or a factor on a member's own stiffness."""
    if place.kind == "member":
        K = member_stiffness(place, reduced)
        return Hypothesis(reduced.with_part("member", K, place.parameter, MEMBER_SD), np.zeros((0, reduced.r)))
    return Hypothesis(reduced, place.w(reduced.V, reduced.V_a))


def member_stiffness(place: Place, reduced: ReducedModel) -> np.ndarray:
    """Stiffness of a member in the basis (r, r), at the deck's values."""
    model = reduced.model
    ones = np.ones(len(model.parameters))
    K = np.zeros((reduced.r, reduced.r))
    for eid in place.elements:
        rows, Ke, _ = model.fe.element_matrices(eid, ones)
        K += reduced.V[rows].T @ Ke @ reduced.V[rows]
    return K


def squares_of(problem: Problem, fit: Fit, sigma: float) -> float:
    """Tempered squares of a fit scaled to the number of values recorded."""
    lines = problem.lines(fit.hypothesis.reduced, sigma)
    return float(sum(line.share * line.Y.size * misfit for line, misfit in zip(lines, fit.misfit, strict=True)))


def locate(problem: Problem, reduced: ReducedModel, places: Sequence[Place], null: Fit) -> list[Located]:
    """Places in rising order of cost, after the last stage, places with one and with several forces each by themselves
    until there, since more forces explain more; `null` is the fit of the model as it is.

    Places that need as many forces as there are sensors, or more, cannot be judged and are left out.
    """
    n_out = min(r.y.shape[0] for r in problem.records)
    todo = [p for p in places if p.n_w < n_out]
    hypotheses = [hypothesis_of(p, reduced) for p in todo]
    few = problem.thinned(LINES)
    plain = problem.thinned(FEWEST_LINES).untuned()
    stages = (
        (plain, 30.0, 3, len(todo), len(todo)),
        (plain, 8.0, 5, SECOND_STAGE, SECOND_STAGE_SEVERAL),
        (few, 2.0, 6, LAST_STAGE, LAST_STAGE_SEVERAL),
        (few, 0.0, 15, FULL_LINES, FULL_LINES_SEVERAL),
        (problem, 0.0, 8, FULL_LINES, FULL_LINES_SEVERAL),
    )
    keep = [(i, plain.prior(h.reduced)[0]) for i, h in enumerate(hypotheses)]
    ranked: list[tuple[int, Fit]] = []
    for lines, factor, iterations, count, several in stages:
        sigma = factor * problem.scale()
        starts = [(lines.tuned_like(p, hypotheses[i].reduced), np.zeros(0)) for i, p in keep]
        fits = lines.fit([hypotheses[i] for i, _ in keep], starts, sigma=sigma, iterations=iterations)
        ranked = [(i, f) for (i, _), f in zip(keep, fits, strict=True) if f is not None]
        ranked.sort(key=lambda item: _rank(lines, item[1], sigma))
        single = [item for item in ranked if todo[item[0]].n_w <= 1]
        ranked = single[:count] + [item for item in ranked if todo[item[0]].n_w > 1][:several]
        keep = [(i, f.p) for i, f in ranked]
    found = [Located(todo[i], f, squares_of(problem, f, 0.0)) for i, f in ranked]
    return sorted(found, key=lambda found: found.cost)


def _rank(problem: Problem, fit: Fit, sigma: float) -> float:
    return fit.prior + squares_of(problem, fit, sigma)


def shortlist(located: Sequence[Located]) -> list[Located]:
    """Places whose laws are worth fitting, the likeliest first: those with one force, led by the ones with several
    where these leave clearly less; several free forces also explain what no place does."""
    single = [f for f in located if f.place.n_w <= 1 and f.place.kind != "base"]
    several = [f for f in located if f.place.n_w > 1]
    best = single[0].cost if single else np.inf
    better = [f for f in several if SEVERAL_WORTH * f.cost < best]
    return [*better[:2], *single]
