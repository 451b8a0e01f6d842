"""A clamp that is soft in several directions at once: springs of its own under each DOF that the deck holds there, and
under the support of a shell or solid against each motion of it as a rigid whole.

A law in one direction of a cut cannot say this: the directions of a beam's end are coupled. And a support of shells or
solids is often a hundred times softer than the elements around it, so that what a law takes from these has to be right
to a per cent and to follow what the model's parameters do to them. So the held DOFs are set free and stand on springs,
whose stiffnesses are unknowns of the model beside its parameters. From springs in all directions that the band shows
the one that is missed least where it is rigid is taken away in turns; what is left at each turn, each direction by
itself, and the best of these with one more are candidates like all others. More directions have to win against fewer as
every law has to.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.locating.dressed import hypothesis_of, own_span, with_own_unknowns
from femend.diagnose.locating.locate import Located, squares_of
from femend.diagnose.locating.split import Split
from femend.estimate import Fit, Hypothesis, Problem
from femend.estimate.fit import TUNED_ABOVE
from femend.model import Place, ReducedModel
from femend.model.places.freed import own_stiffness, reactions
from femend.model.places.held_motion import HeldMotion, held_dof
from femend.model.places.place import AXES
from femend.numerals import listed

__all__ = ["SoftClamp", "on_all_springs", "soft_clamps"]

FloatArray = NDArray[np.float64]

# stiffnesses tried first, in units of the one at which a mode of the band would leave its frequency, and how many of
# all starts are followed, and from strongly damped lines on: there the best fit came of the one or two starts that cost
# least in each of 17 calls on generated cases
SIZES, FOLLOWED, CHEAPEST = (1.0, 3.0, 10.0, 30.0, 100.0, 300.0), 4, 12
# clamps at which springs are tried
MOST = 6
# lines a record for trying starts, and the steps of a start, of a fit to all lines
FEW_LINES, FEW_STEPS, STEPS = 150, 10, 20
# stiffness from which a spring is as good as rigid, in the units of `SIZES`
RIGID = 1e3
# share of the stiffness of the elements at the clamp below which a direction takes nothing of the band's motion
IDLE = 1e-12


@dataclass(frozen=True, eq=False)
class SoftClamp:
    """Springs under a clamp after their fit: where, and what a free force in each of the same directions leaves on the
    choosing records, in multiples of the noise."""

    located: Located
    reference: float


def soft_clamps(
    split: Split,
    reduced: ReducedModel,
    found: Sequence[Located],
    updated: FloatArray,
    margin: float,
    beaten: Callable[[Fit], bool] = lambda fit: False,
) -> list[SoftClamp]:
    """Springs in several directions, and in each by itself, under every clamp or support that stands among the places
    `found` and their look-alikes; `updated` are the unknowns of the updated model. Those whose springs in the same
    directions cost at most `margin` more are look-alikes of each other. Where springs in all directions are `beaten`,
    fewer are too."""
    done: list[SoftClamp] = []
    for clamp, near in _clamps(found):
        whole = _all_springs(split.whole, reduced, clamp, updated)
        if whole is None:
            continue
        fits = _fits(split.fitting, reduced, whole, _starts(split.whole, reduced, [*near, updated]), beaten)
        for place, fit in (*fits, *_pairs(split.fitting, reduced, whole, fits, margin)):
            (at,) = split.whole.fit([fit.hypothesis], [(fit.p, fit.x)])
            if at is not None:
                located = Located(place, at, squares_of(split.whole, at, 0.0))
                done.append(SoftClamp(located, _reference(split, reduced, fit)))
    return [replace(soft, located=replace(soft.located, alike=_alike(soft, done, margin))) for soft in done]


def on_all_springs(problem: Problem, reduced: ReducedModel, found: Sequence[Located], updated: FloatArray) -> list[Fit]:
    """What is left with springs in all directions at once under each of the clamps and supports of `soft_clamps`, from
    unknowns `updated` (n_p,) of the model too."""
    fits: list[Fit | None] = []
    for clamp, near in _clamps(found):
        whole = _all_springs(problem, reduced, clamp, updated)
        if whole is not None:
            starts = _starts(problem, reduced, [*near, updated])
            fits.append(_fitted(problem, reduced, whole, _of_all_sizes(starts, reduced, whole)))
    return [fit for fit in fits if fit is not None]


def _starts(problem: Problem, reduced: ReducedModel, known: Sequence[FloatArray]) -> list[FloatArray]:
    """Unknowns of the model from which springs are sought: `known` ones, with and without form errors, the deck's."""
    return [*known, *(_without_form(p, reduced) for p in known), problem.prior(reduced)[0]]


def _of_all_sizes(starts: Sequence[FloatArray], reduced: ReducedModel, place: Place) -> list[FloatArray]:
    return [_started(p, reduced, place, size) for p in starts for size in SIZES]


def _alike(soft: SoftClamp, others: Sequence[SoftClamp], margin: float) -> tuple[Place, ...]:
    """Other clamps that do as well or better with springs in the same directions, the best first."""
    own = _components(soft.located.place)
    near = [
        other.located
        for other in others
        if other is not soft
        and _components(other.located.place) == own
        and other.located.cost - soft.located.cost < margin
    ]
    return tuple(one.place for one in sorted(near, key=lambda one: one.cost))


def _components(place: Place) -> list[int]:
    return [motion.component for motion, _ in place.springs]


def _clamps(found: Sequence[Located]) -> list[tuple[Place, list[FloatArray]]]:
    """One place of the first `MOST` clamps and supports among the places found and their look-alikes, each with the
    unknowns of the model at the fits it stands by."""
    at_node: dict[tuple[int, ...], tuple[Place, list[FloatArray]]] = {}
    for one in found:
        for place in (one.place, *one.alike):
            if place.kind in ("clamp", "support") and not place.springs and not one.place.part:
                at_node.setdefault(place.nodes, (place, []))[1].append(one.fit.p)
    return list(at_node.values())[:MOST]


def _fits(
    problem: Problem,
    reduced: ReducedModel,
    whole: Place,
    starts: Sequence[FloatArray],
    beaten: Callable[[Fit], bool],
) -> list[tuple[Place, Fit]]:
    """Springs in all directions, then in one less at each turn, and each direction by itself; none where those in all
    directions are `beaten`."""
    fits: list[tuple[Place, Fit]] = []
    place, begun = whole, _of_all_sizes(starts, reduced, whole)
    while len(place.springs) > 1:
        fit = _fitted(problem, reduced, place, begun)
        if fit is None:
            break
        if not fits and beaten(fit):
            return []
        fits.append((place, fit))
        least, rigid = _least_missed(problem, fit)
        place = _without(place, least)
        begun = [np.delete(p, own_span(fit.hypothesis.reduced).start + least) for p in (fit.p, rigid)]
    for spring in whole.springs:
        alone = _labelled(whole, (spring,))
        fit = _fitted(problem, reduced, alone, _of_all_sizes(starts, reduced, alone))
        fits += [] if fit is None else [(alone, fit)]
    return fits


def _least_missed(problem: Problem, fit: Fit) -> tuple[int, FloatArray]:
    """Which of a fit's springs costs least where it is rigid in place of it, and the unknowns then. How well a
    stiffness is known does not say: that of one so soft that it hardly holds anything is not, either."""
    own, few = own_span(fit.hypothesis.reduced), problem.sparing(FEW_LINES)
    starts = [fit.p.copy() for _ in range(own.start, own.stop)]
    for p, i in zip(starts, range(own.start, own.stop), strict=True):
        p[i] = max(p[i], np.log(RIGID))
    begun = [(p, fit.x) for p in starts]
    tries = few.fit([fit.hypothesis] * len(starts), begun, iterations=FEW_STEPS)
    least = int(np.argmin([np.inf if t is None else t.cost for t in tries]))
    found = tries[least]
    return least, starts[least] if found is None else found.p


def _pairs(
    problem: Problem, reduced: ReducedModel, whole: Place, fits: Sequence[tuple[Place, Fit]], margin: float
) -> list[tuple[Place, Fit]]:
    """The best single direction of `fits` with each other one; nothing where all directions together cost hardly less
    than it (`margin`), so that no two could win."""
    alone = min((f for f in fits if len(f[0].springs) == 1), key=lambda f: f[1].cost, default=None)
    least = min((fit.cost for _, fit in fits), default=np.inf)
    if alone is None or alone[1].cost - least < margin:
        return []
    (first,), p = alone[0].springs, alone[1].p
    at = own_span(alone[1].hypothesis.reduced)
    found: list[tuple[Place, Fit]] = []
    for spring in whole.springs:
        both = _labelled(whole, tuple(s for s in whole.springs if s in (first, spring)))
        if spring == first or any(both.springs == place.springs for place, _ in fits):
            continue
        begun = [np.insert(p, at.stop if spring > first else at.start, np.log(size)) for size in SIZES]
        fit = _fitted(problem, reduced, both, begun)
        found += [] if fit is None else [(both, fit)]
    return found


def _fitted(problem: Problem, reduced: ReducedModel, place: Place, begun: Sequence[FloatArray]) -> Fit | None:
    """The best of some starts, tried on few lines, from strongly damped ones on too, and followed on all."""
    hypothesis, nothing = hypothesis_of(place, reduced), np.zeros(0)
    few, starts = problem.sparing(FEW_LINES), [(p, nothing) for p in begun]
    looked = few.fit([hypothesis] * len(begun), starts, iterations=0)
    first = sorted((f for f in looked if f is not None), key=lambda f: f.cost)[:FOLLOWED]
    tries = few.fit([hypothesis] * len(first), [(f.p, nothing) for f in first], iterations=FEW_STEPS)
    tries.append(few.continuation(hypothesis, starts, FEW_STEPS, FOLLOWED, CHEAPEST))
    done = [t for t in tries if t is not None]
    if not done:
        return None
    best = min(done, key=lambda t: t.cost)
    return problem.fit([hypothesis], [(best.p, nothing)], iterations=STEPS)[0]


def _without_form(p: FloatArray, reduced: ReducedModel) -> FloatArray:
    """Unknowns `p` of the model without form errors: what these take from a mass elsewhere may be more than there is of
    it in a basis that moves at the clamp too, and there is no solution then."""
    form = slice(len(reduced.model.parameters), len(reduced.names) - reduced.extra)
    return np.concatenate([p[: form.start], np.zeros(form.stop - form.start), p[form.stop :]])


def _started(p: FloatArray, reduced: ReducedModel, place: Place, size: float) -> FloatArray:
    """Unknowns `p` of the model with all springs of a place, of one relative size."""
    return with_own_unknowns(p, reduced, np.full(len(place.springs), np.log(size)))


def _all_springs(problem: Problem, reduced: ReducedModel, clamp: Place, updated: FloatArray) -> Place | None:
    """The clamp or support with springs in all directions that take something of the band's motion, each sought around
    the stiffness at which a mode of the band would leave its frequency; None where there are none."""
    motions = [m for m in _held(reduced, clamp) if not reduced.V[list(m.rows)].any()]
    own = own_stiffness(reduced.model, motions)
    held = own > 0  # not by more than the clamp, nor by nothing but its lack of stiffness
    motions, own = [m for m, there in zip(motions, held, strict=True) if there], own[held]
    if not motions:
        return None
    omega, _, Q, _ = problem.system(reduced).modal(updated)
    inside = omega < TUNED_ABOVE * 2 * np.pi * problem.band[1]
    inside[0] = True
    K, M = reactions(reduced, motions)
    force = (K @ Q - (M @ Q) * omega**2)[:, inside]
    # to first order a compliance 1/k lowers a mode's omega^2 by R^2/k
    scale = (force**2 / np.maximum(omega[inside], 1e-3 * omega.max()) ** 2).max(axis=1)
    springs = tuple((m, float(k)) for m, k, s in zip(motions, scale, own, strict=True) if k > IDLE * s)
    return _labelled(replace(clamp, motions=tuple(m for m, _ in springs)), springs) if springs else None


def _held(reduced: ReducedModel, clamp: Place) -> Sequence[HeldMotion]:
    """Motions in which a clamp, at its node, or a support may give way."""
    if clamp.motions or clamp.kind == "support":
        return clamp.motions
    first = 6 * reduced.model.index(clamp.nodes[0])
    return [held_dof(row) for row in range(first, first + 6)]


def _without(place: Place, i: int) -> Place:
    return _labelled(place, tuple(s for j, s in enumerate(place.springs) if j != i))


def _labelled(clamp: Place, springs: tuple[tuple[HeldMotion, float], ...]) -> Place:
    """The clamp or support on springs, with its directions in words."""
    axes = [AXES[motion.component] for motion, _ in springs]
    words = axes[0] if len(axes) == 1 else f"{', '.join(axes[:-1])} and {axes[-1]}"
    nodes = f"node{'s' if len(clamp.nodes) > 1 else ''} {listed(clamp.nodes, 4)}"
    return Place(
        clamp.kind, clamp.nodes, axes[0] if len(axes) == 1 else "", "ground", elements=clamp.elements,
        label=f"{clamp.kind} at {nodes}, springs in {words}", springs=springs,
        motions=clamp.motions,
    )  # fmt: skip


def _reference(split: Split, reduced: ReducedModel, springs: Fit) -> float:
    """What a free force in each direction of fitted springs leaves on the choosing records, but not less than the
    noise: with several directions and few sensors it explains anything."""
    place, n_out = springs.hypothesis.reduced.members[-1], min(r.y.shape[0] for r in split.whole.records)
    if len(place.springs) >= n_out:
        return 1.0
    w, _ = reactions(reduced, [motion for motion, _ in place.springs])
    hypothesis, nothing = Hypothesis(reduced, w), np.zeros(0)
    plain = np.delete(springs.p, np.r_[own_span(springs.hypothesis.reduced)])
    (fit,) = split.fitting.fit([hypothesis], [(plain, nothing)])
    if fit is None:
        return 1.0
    (seen,) = split.choosing.fit([hypothesis], [(fit.p, nothing)], iterations=0)
    return 1.0 if seen is None else max(seen.score, 1.0)
