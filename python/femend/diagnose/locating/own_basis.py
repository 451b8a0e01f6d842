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
from femend.estimate import Problem
from femend.estimate.fit import TUNED_ABOVE
from femend.model import Place, ReducedModel
from femend.model.mesh.form_errors import basis_modes

__all__ = ["in_own_basis"]

FloatArray = NDArray[np.float64]

# weighted square left, in units of the noise, from which a fit may have ended beside the right one
FAR = 2.0
# steps of a fit, which has far to go where the factor is small: resonances have other frequencies in the own basis
STEPS = 60


def in_own_basis(problem: Problem, reduced: ReducedModel, g_rows: list[int], found: Located) -> Located:
    """The place `found` (a member or a region), fitted again in a basis with the answers to the forces by which its
    elements hold the modes of the band; as it was where the model breaks down there. `reduced` is the model without its
    factor.

    Where that stays far from the noise, the fit begins from the deck's values too, beside the factor: what else was
    unknown may have made up for the place while its factor was not yet what it is.
    """
    own = with_loads(reduced, _forces(found.place, reduced, problem.band[1]), problem.band[1], g_rows)
    hypothesis, nothing = hypothesis_of(found.place, own), np.zeros(0)
    (fit,) = problem.fit([hypothesis], [(found.fit.p, nothing)], iterations=STEPS)
    if fit is None or fit.score > FAR:
        p = problem.prior(hypothesis.reduced)[0].copy()
        own_unknowns = own_span(hypothesis.reduced)
        p[own_unknowns] = found.fit.p[own_unknowns]
        (again,) = problem.fit([hypothesis], [(p, nothing)], iterations=STEPS)
        fit = min((f for f in (fit, again) if f is not None), key=lambda f: f.cost, default=None)
    if fit is None:
        return found
    return replace(found, fit=fit, squares=squares_of(problem, fit, 0.0))


def _forces(place: Place, reduced: ReducedModel, f_max: float) -> FloatArray:
    """Forces (n_a, n) of the place's elements in the modes up to a little beyond `f_max` (Hz), of about one size."""
    omega, Q = basis_modes(reduced)
    shapes = reduced.V @ Q[:, (omega > 0) & (omega <= TUNED_ABOVE * 2 * np.pi * f_max)]
    forces = elements_stiffness(place, reduced.model) @ shapes
    loads = np.asarray(reduced.model.transformation().T @ forces)
    size = np.linalg.norm(loads, axis=0)
    return loads[:, size > 0] / size[size > 0]
