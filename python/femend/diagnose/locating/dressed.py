"""A reduced model with what a search added to it: form errors, unknowns of members and soft clamps, known forces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.locating.region_stiffness import region_stiffness
from femend.estimate import Hypothesis
from femend.model import Place, ReducedModel
from femend.model.places.freed import freed, with_springs
from femend.model.reduced.reduction import ritz_frequencies

__all__ = [
    "dressed",
    "hypothesis_of",
    "member_stiffness",
    "own_span",
    "own_values",
    "with_attached",
    "with_form",
    "with_own",
    "with_own_unknowns",
    "without_own_unknowns",
]

FloatArray = NDArray[np.float64]

# prior ln standard deviation of a member's own stiffness factor, and of a spring's stiffness or a mass
MEMBER_SD, SPRING_SD = 1.0, 3.0


def dressed(bare: ReducedModel, like: ReducedModel) -> ReducedModel:
    """The `bare` model, which has its parameters alone in a basis of its own, with all that `like` has beside them."""
    own = bare if like.form is None else like.form.on(bare)
    for place in like.members:
        own = with_own(place, own)
    for place, k, m in like.attached:
        own = with_attached(place, k, m, own)
    return own


def with_own(place: Place, reduced: ReducedModel) -> ReducedModel:
    """The model with the unknowns of a place that are part of it: a factor on a member's, region's or bedding's
    stiffness, a spring's stiffness, a mass, or the springs of a soft clamp under DOFs set free.

    Raises ModelError for a clamp that no SPC set holds.
    """
    if place.springs:
        loose = freed(reduced, [motion for motion, _ in place.springs], place.motions)
        return with_springs(place, dressed(loose, reduced))
    if place.spring:
        B = place.w(reduced.V, reduced.V_a)
        K = place.spring * (B.T @ B)
        sprung = replace(reduced, K_fixed=reduced.K_fixed + K).with_part("spring", K, None, SPRING_SD)
        return replace(sprung, members=(*sprung.members, place))
    if place.mass:
        B = place.w(reduced.V, reduced.V_a)
        loaded = reduced.with_mass(place.mass * (B.T @ B), SPRING_SD)
        return replace(loaded, members=(*loaded.members, place))
    sd = SPRING_SD if place.bed else MEMBER_SD
    split = reduced.with_part("member", member_stiffness(place, reduced), place.parameter, sd)
    return replace(split, members=(*reduced.members, place))


def hypothesis_of(place: Place, reduced: ReducedModel, beside: Sequence[Place] = ()) -> Hypothesis:
    """Law-free hypothesis of a place: a free force along its directions, or unknowns of a part of the model (a member's
    factor, a soft clamp's springs); with free forces at the places `beside` too."""
    if place.part:
        reduced = with_own(place, reduced)
    w = [b.w(reduced.V, reduced.V_a) for b in beside]
    if place.part:
        return Hypothesis(reduced, np.vstack([np.zeros((0, reduced.r)), *w]))
    return Hypothesis(reduced, np.vstack([place.w(reduced.V, reduced.V_a), *w]))


def member_stiffness(place: Place, reduced: ReducedModel) -> FloatArray:
    """Stiffness of a member, region or bedding in the basis (r, r), at the deck's values."""
    if place.kind in ("region", "bed"):
        return region_stiffness(place, reduced)
    model = reduced.model
    ones = np.ones(len(model.parameters))
    K = np.zeros((reduced.r, reduced.r))
    for eid in place.elements:
        rows, Ke, _ = model.fe.element_matrices(eid, ones)
        K += reduced.V[rows].T @ Ke @ reduced.V[rows]
    return K


def with_attached(place: Place, k: float, m: float, reduced: ReducedModel) -> ReducedModel:
    """The model with a spring `k` and a mass `m` (deck units) on every coordinate of a place; a motion that the deck
    holds is set free for them, and the model's frequencies are those with them.

    Raises ModelError for one that no SPC set holds.
    """
    loose = bool(place.motions) and not place.springs
    if loose:
        reduced = dressed(freed(reduced, place.motions), reduced)
    B = place.w(reduced.V, reduced.V_a)
    carried = replace(
        reduced,
        K_fixed=reduced.K_fixed + k * (B.T @ B),
        M_fixed=reduced.M_fixed + m * (B.T @ B),
        attached=(*reduced.attached, (place, k, m)),
    )
    return replace(carried, freq=ritz_frequencies(carried)) if loose else carried


def with_own_unknowns(p: FloatArray, reduced: ReducedModel, own: FloatArray) -> FloatArray:
    """Unknowns `p` (n_p,) of the model with those of places that are added to it, `own` (n_own,), where these stand:
    after all others of the model, before those of single modes."""
    n = len(reduced.names)
    return np.concatenate([p[:n], own, p[n:]])


def without_own_unknowns(p: FloatArray, reduced: ReducedModel, n_own: int) -> FloatArray:
    """Unknowns `p` (n_p,) of a model with `n_own` of places that were added to it, as the model `reduced` without them
    has them."""
    n = len(reduced.names)
    return np.concatenate([p[:n], p[n + n_own :]])


def with_form(p: FloatArray, bare: ReducedModel, reduced: ReducedModel) -> FloatArray:
    """Unknowns `p` (n_p,) of the `bare` model, without form errors, and of places that were added to it, as the model
    `reduced` with form errors has them: none, where these stand after the parameters."""
    own = len(bare.model.parameters)
    return np.concatenate([p[:own], np.zeros(len(reduced.names) - len(bare.names)), p[own:]])


def own_span(reduced: ReducedModel) -> slice:
    """Where the unknowns of the place added last stand among the model's; an empty one where none was."""
    n = len(reduced.names)
    return slice(n - (reduced.members[-1].n_own if reduced.members else 0), n)


def own_values(reduced: ReducedModel, p: FloatArray) -> dict[str, float]:
    """What the place added last comes to at unknowns `p` of the model (factor, or k1 to k6); nothing without one."""
    return reduced.members[-1].values(p[own_span(reduced)]) if reduced.members else {}
