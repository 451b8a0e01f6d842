"""Whether sensors are believed as they are, or may hold shares of the motion across them and be off in calibration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from femend.diagnose.fitting.known_force import forces_beside
from femend.diagnose.fitting.soft_clamp import on_all_springs
from femend.diagnose.locating.dressed import hypothesis_of, with_own_unknowns
from femend.diagnose.locating.locate import FINAL_LINES, Located, grounded, locate, refitted, shortlist
from femend.diagnose.locating.screen import is_many
from femend.diagnose.locating.sensed import sensed_places
from femend.diagnose.settings import AT_NOISE, CLEARLY
from femend.diagnose.updating.update import UpdatedModel, sensors_in_doubt
from femend.estimate import Fit
from femend.model import Place
from femend.model.places.places import mass_place

__all__ = ["as_sensors_are", "explains"]

# prior cost of a model beside a free force, in `CLEARLY`, up to which it explains the recordings with that, and what is
# left at most, as a share of its misfit, with what sensors pick up where it does not
WITHIN, MOST = 2.0, 0.5
# the same share of the best places fitted once more with what sensors pick up, and multiple of the noise, beyond which
# places are not all sorted out anew; how many are fitted so
FAR_OFF, FAR_ABOVE, TRIED = 0.75, 1.5, 6
# best places beside which a second force is looked for before shares are taken
FIRSTS = 2
# misfit below which the noise that shares add is none: what moves across under a force that no sensor holds down
BELIEVABLE = 0.25


def as_sensors_are(
    start: UpdatedModel, located: list[Located], places: Sequence[Place]
) -> tuple[UpdatedModel, list[Located]]:
    """An updated model with its places, `located` of all `places`, or both where sensors pick up motion across them or
    are off in calibration.

    Shares of motion also take away what is missing where a sensor hardly moves. So sensors are believed where the
    model explains the recordings with a free force somewhere (where it does alone with such shares, `update_model` has
    taken them), where the shares make no great difference: with them a force neither explains what it does not
    without, nor leaves half as much; and where two forces explain clearly more without them. A clamp or support among
    the best places counts with springs in all its directions, of which one force shows one. The motion is that of the
    model with the best such force.
    """
    best = located[0].fit if located else start.null
    # the update with shares, and fits from afar, are for where they can matter
    if explains(best):
        return start, located
    best = min([best, *_on_springs(start, located)], key=lambda fit: fit.score)
    if explains(best):
        return start, located
    crossing = start.crossing
    if crossing is None or any(explains(fit) for fit in _in_all_directions(start, located)):
        return start, located
    if not _may_come_near(start, crossing, located, best):
        return start, located
    crossing, there = _moved_by_the_best(crossing, locate(crossing.problem, crossing.reduced, places, crossing.null))
    left = there[0].fit if there else crossing.null
    explained = best.score > AT_NOISE and explains(left) and left.cost < best.cost - CLEARLY
    believable = left.score > BELIEVABLE
    if not believable or not (explained or left.score < MOST * best.score):
        return start, located
    return (start, located) if _two_explain(start, located, places, left.cost) else (crossing, there)


def _two_explain(start: UpdatedModel, located: Sequence[Located], places: Sequence[Place], cost: float) -> bool:
    """Whether forces at two of the `places`, one of them among the best `located`, explain the recordings as sensors
    are, and clearly better than one force with shares, which is left with the `cost`; beddings take long to fit, and
    are none of the two."""
    if is_many(places):
        return False
    for one in shortlist(located)[:FIRSTS]:
        aside = [
            p for p in places if p is not one.place and not p.bed and not set(p.elements) & set(one.place.elements)
        ]
        reduced, beside = (one.fit.hypothesis.reduced, ()) if one.place.part else (start.reduced, (one.place,))
        two = locate(start.problem, reduced, aside, one.fit, beside)
        if two and explains(two[0].fit) and two[0].cost < cost - CLEARLY:
            return True
    return False


def _on_springs(start: UpdatedModel, located: Sequence[Located]) -> list[Fit]:
    """Fits with springs in all directions of clamps and supports among the best places `located`."""
    return on_all_springs(start.problem, start.reduced, shortlist(located)[:FIRSTS], start.null.p)


def _may_come_near(start: UpdatedModel, crossing: UpdatedModel, located: list[Located], best: Fit) -> bool:
    """Whether shares make so much of a difference at the best places `located`, or where no force is, that all places
    are worth sorting out anew with them, beside the `best` fit without. What they take away where the model stands with
    a force they take away from there on few lines; each place is also fitted from where the model with shares,
    `crossing`, stands."""
    if not located:
        return True
    enough = max(FAR_ABOVE * AT_NOISE, FAR_OFF * best.score)
    if crossing.null.score <= enough:
        return True
    first = located[0].fit
    few = sensors_in_doubt(start.problem, first, forces_beside(start.problem, first)).sparing(FINAL_LINES)
    hypotheses, begun = [one.fit.hypothesis for one in located[:TRIED]], [one.fit.p for one in located[:TRIED]]
    there, n = crossing.null.p, len(crossing.null.p)
    far = [with_own_unknowns(there, crossing.reduced, np.zeros(len(p) - n)) for p in begun]
    fits = few.fit([*hypotheses, *hypotheses], [(p, np.zeros(0)) for p in (*begun, *far)])
    return any(fit is not None and fit.score <= enough for fit in fits)


def _in_all_directions(start: UpdatedModel, located: Sequence[Located]) -> list[Fit]:
    """Fits with free forces in all directions of the nodes at which one force to the ground explains most: a mass
    leaves what it does in the others, which shares of sensors would make up for. Without these the model is bent for
    them, so that the fits begin from afar."""
    model, problem = start.reduced.model, start.problem.sparing(FINAL_LINES)
    least = min(len(r.y) for r in problem.records)
    at = {one.place.nodes[0]: one.fit.p for one in grounded(located)}
    masses = sensed_places(problem, start.reduced, [mass_place(model, node) for node in at])
    chosen = [(place, at[place.nodes[0]]) for place in masses if 1 < place.n_w < least]
    mean, none = problem.prior(start.reduced)[0], np.zeros(0)
    fits = [problem.continuation(hypothesis_of(place, start.reduced), [(mean, none), (p, none)]) for place, p in chosen]
    return [fit for fit in fits if fit is not None]


def _moved_by_the_best(start: UpdatedModel, located: list[Located]) -> tuple[UpdatedModel, list[Located]]:
    """An updated model and places where sensors pick up, and are off by, shares of the motion of the model with the
    free force that explains most: without it the motion is that of a structure which lacks nothing."""
    if not located:
        return start, located
    best = located[0].fit
    problem = sensors_in_doubt(start.problem, best, forces_beside(start.problem, best))
    null = start.null
    (again,) = problem.fit([null.hypothesis], [(null.p, null.x)])
    return replace(start, problem=problem, null=again or null), refitted(problem, located)


def explains(fit: Fit) -> bool:
    """Whether a model leaves noise alone, near its priors."""
    return fit.score <= AT_NOISE and fit.prior <= WITHIN * CLEARLY
