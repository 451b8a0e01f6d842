"""Parts of a model that spin, and their gyroscopic matrix as a function of the factors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from femend.model.model import Model

__all__ = ["SpinningPart", "gyroscopic", "gyroscopic_slopes"]

FloatArray = NDArray[np.float64]

# step of a factor, a share; G is of fourth order in it at most, but where a modulus stands in a beam's shear
STEP = 0.01


@dataclass(frozen=True, slots=True)
class SpinningPart:
    """A part that turns at `ratio` times the shaft's speed about the direction `axis` (right hand, basic system).

    `elements` are its ids, masses included (None: all); a negative `ratio` turns the other way. `axes` "fixed" or
    "rotating" as in `gyroscopic_matrices`.
    """

    axis: tuple[float, float, float]
    elements: tuple[int, ...] | None = None
    ratio: float = 1.0
    axes: Literal["fixed", "rotating"] = "fixed"


def gyroscopic(model: Model, parts: Sequence[SpinningPart], factors: FloatArray) -> FloatArray:
    """G (nnz,) on the pattern of the `model`, sum of ratio x G of the `parts`, one or more, at `factors`
    (n_parameters,); raises what `gyroscopic_matrices` raises."""

    def of_one(part: SpinningPart) -> FloatArray:
        elements = None if part.elements is None else list(part.elements)
        G, _ = model.fe.gyroscopic(list(part.axis), elements, part.axes == "rotating", factors)
        return part.ratio * G

    return np.asarray(np.sum([of_one(part) for part in parts], axis=0))


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
