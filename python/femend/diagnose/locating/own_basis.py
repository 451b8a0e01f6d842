"""A member or region whose stiffness has a factor of its own, in a basis that holds what the factor does to the modes.

Places are told apart in one basis for all of them. There a member that is half as stiff keeps the shapes it has when it
is whole, but for what static answers to forces elsewhere happen to hold: frequencies come out too high by the square of
what is missing, and the factor, the unknowns beside it and what is left make up for it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.locating.dressed import hypothesis_of, own_span
from femend.diagnose.locating.joint import with_loads
from femend.diagnose.locating.locate import Located, squares_of
from femend.diagnose.locating.region_stiffness import elements_stiffness
from femend.estimate import Fit, Hypothesis, Problem
from femend.estimate.fit import TUNED_ABOVE
from femend.model import Place, ReducedModel
from femend.model.mesh.form_errors import basis_modes

__all__ = ["in_own_basis"]

FloatArray = NDArray[np.float64]

# weighted square left, in units of the noise, and squared deviations of what is unknown beside the factor, from which a
# fit may have ended beside the right one
FAR, STRAINED = 2.0, 25.0
# ln factors from which such a fit is followed from far off too, and lines a record for that
WEAKER, LINES = (-0.3, -1.0), 250
# steps of a fit, which has far to go where the factor is small: resonances have other frequencies in the own basis
STEPS = 60


def in_own_basis(problem: Problem, reduced: ReducedModel, g_rows: list[int], found: Located) -> Located:
    """The place `found` (a member or a region), fitted again in a basis with the answers to the forces by which its
    elements hold the modes of the band; as it was where the model breaks down there. `reduced` is the model without its
    factor.

    Where that stays far from the noise, or strains what else is unknown, the fit begins from the deck's values too,
    beside the factor and beside smaller ones: what else was unknown may have made up for the place while its factor was
    not yet what it is, and then holds the factor in a minimum where the place is stiffer than it is drawn.
    """
    own = with_loads(reduced, _forces(found.place, reduced, problem.band[1]), problem.band[1], g_rows)
    hypothesis, nothing = hypothesis_of(found.place, own), np.zeros(0)
    (fit,) = problem.fit([hypothesis], [(found.fit.p, nothing)], iterations=STEPS)
    if fit is None or fit.score > FAR or fit.prior > STRAINED:
        fits = [fit, *_from_the_deck(problem, hypothesis, found)]
        fit = min((f for f in fits if f is not None), key=lambda f: f.cost, default=None)
    if fit is None:
        return found
    return replace(found, fit=fit, squares=squares_of(problem, fit, 0.0))


def _from_the_deck(problem: Problem, hypothesis: Hypothesis, found: Located) -> list[Fit | None]:
    """Fits of a place's factor with what else is unknown from the deck's values: beside the factor as it was `found`,
    and, of what may be weaker, the best of smaller ones that are followed from far off."""
    deck, own, nothing = problem.prior(hypothesis.reduced)[0], own_span(hypothesis.reduced), np.zeros(0)

    def beside(value: FloatArray | float) -> tuple[FloatArray, FloatArray]:
        p = deck.copy()
        p[own] = value
        return p, nothing

    starts = [beside(found.fit.p[own])]
    if not found.place.bed:
        followed = problem.sparing(LINES).continuation(hypothesis, [beside(value) for value in WEAKER])
        starts += [] if followed is None else [(followed.p, nothing)]
    return problem.fit([hypothesis] * len(starts), starts, iterations=STEPS)


def _forces(place: Place, reduced: ReducedModel, f_max: float) -> FloatArray:
    """Forces (n_a, n) of the place's elements in the modes up to a little beyond `f_max` (Hz), of about one size."""
    omega, Q = basis_modes(reduced)
    shapes = reduced.V @ Q[:, (omega > 0) & (omega <= TUNED_ABOVE * 2 * np.pi * f_max)]
    forces = elements_stiffness(place, reduced.model) @ shapes
    loads = np.asarray(reduced.model.transformation().T @ forces)
    size = np.linalg.norm(loads, axis=0)
    return loads[:, size > 0] / size[size > 0]
