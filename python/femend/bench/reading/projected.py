"""Large decks whose matrices are no affine sums (shear areas, thicknesses, sections), in a basis of their modes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from femend.estimate.updating import (
    DeckMatrices,
    DenseSystem,
    ModalSystem,
    Problem,
    Reduction,
    State,
    basis_of_modes,
    reduced_problem,
)
from femend.model import Model

__all__ = ["ProjectedSystem", "projected_problem"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ProjectedSystem:
    """A deck in the span of `basis` (n_a, r), seen through `sensors` (n_sensors, r): "freq" and "phi" of the lowest
    `n_modes`. K, M and their exact derivatives are assembled and projected anew at every point, since they are no
    affine sums; what is saved is the solution for the modes, and the derivatives of their shapes."""

    model: Model
    basis: FloatArray
    sensors: FloatArray
    n_modes: int
    defaults: Mapping[str, float] = field(default_factory=dict)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the deck's parameters."""
        return tuple(p.name for p in self.model.parameters)

    def solve(self, factors: FloatArray) -> State:
        """Results at `factors` (n_parameters,); raises ModelError for a mass that is not positive definite."""
        own = np.ascontiguousarray(factors, dtype=np.float64)
        (K, M, _, _), (dK, dM, _, _) = self.model.fe.project(own, self.basis)
        # the affine sum that touches the matrices at this point has their derivatives there
        K0, M0 = K - np.tensordot(own, dK, 1), M - np.tensordot(own, dM, 1)
        return DenseSystem(self.names, K0, M0, dK, dM, self.sensors, self.n_modes).solve(own)


def projected_problem(problem: Problem, n_points: int, *, seed: int = 0) -> Reduction:
    """The same problem with every deck in a basis of its modes at `n_points` of a Latin hypercube between the bounds
    and at the prior mean; checked at others of the same `seed`.

    Frequencies from it lie above the full model's (Rayleigh), and coincide at the points (a reduced basis: Hesthaven,
    Rozza and Stamm 2016, chapter 3). Raises UpdatingError where a deck has no modes at any point.
    """
    return reduced_problem(problem, n_points, seed=seed, reduced=_projected)


def _projected(system: ModalSystem, points: FloatArray) -> ProjectedSystem:
    assert isinstance(system.matrices, DeckMatrices)
    V = basis_of_modes(system, points)
    return ProjectedSystem(system.matrices.model, V, np.asarray(system.sensors @ V), system.n_modes, system.defaults)
