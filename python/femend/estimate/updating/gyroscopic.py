"""Gyroscopic matrix of a deck's spinning parts as a function of the factors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from femend.analysis.rotor import gyroscopic_matrices
from femend.analysis.turning import SpinningPart
from femend.errors import UpdatingError
from femend.model import Model

__all__ = ["check_parts", "gyroscopic", "gyroscopic_slopes"]

FloatArray = NDArray[np.float64]

# step of a factor, a share; G is of fourth order in it at most, but where a modulus stands in a beam's shear
STEP = 0.01


def check_parts(model: Model, parts: Sequence[SpinningPart]) -> None:
    """Raises UpdatingError for parts of the `model` in turning axes, that are no elements of it, or without polar
    inertia, and what `gyroscopic_matrices` raises."""
    there = {int(eid) for eid, _, _ in model.fe.elements()}
    for i, part in enumerate(parts, start=1):
        who = f"spinning part {i} of {len(parts)}"
        if part.axes != "fixed":
            raise UpdatingError(
                f"{who} is described in {part.axes} axes, but the sensors stand still; take axes='fixed'"
            )
        strange = [e for e in part.elements or () if e not in there]
        if strange:
            raise UpdatingError(
                f"{who} names {len(strange)} elements that the deck does not have: {strange[:8]}; name beams and "
                "concentrated masses of the deck"
            )
        if not np.any(gyroscopic(model, [part], np.ones(len(model.parameters)))):
            raise UpdatingError(
                f"{who} has no polar inertia about {part.axis}: nothing of it acts with the speed; give the beams rho "
                "and I1, I2, the masses their inertia"
            )


def gyroscopic(model: Model, parts: Sequence[SpinningPart], factors: FloatArray) -> FloatArray:
    """G (nnz,) on the pattern of the `model`, sum of ratio x G of the `parts`, at `factors` (n_parameters,)."""
    named = {p.name: float(f) for p, f in zip(model.parameters, factors, strict=True)}
    total = np.zeros(model.fe.assemble()[1].size)
    for part in parts:
        total += part.ratio * gyroscopic_matrices(model, part.axis, elements=part.elements, factors=named)[0].data
    return total


def gyroscopic_slopes(model: Model, parts: Sequence[SpinningPart], factors: FloatArray) -> FloatArray:
    """d G (n_parameters, nnz) of the `parts` of the `model` at `factors` (n_parameters,): differences of fourth order
    over a hundredth (Abramowitz and Stegun, 25.3.6), exact where G is a polynomial of a factor, as it is of rho, of
    inertias and of sections; to 1e-8 where a modulus changes the shear of a thick beam."""
    out = []
    for row in np.diag(STEP * factors):
        one, two = (
            gyroscopic(model, parts, factors + n * row) - gyroscopic(model, parts, factors - n * row) for n in (1, 2)
        )
        out.append((8 * one - two) / (12 * row.sum()))
    return np.array(out).reshape(factors.size, -1)
