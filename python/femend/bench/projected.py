"""Large decks whose matrices are no affine sums (shear areas, thicknesses, sections), in a basis of their modes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from femend import _core
from femend.errors import FemendError, UpdatingError
from femend.estimate.updating import DeckMatrices, DenseSystem, ModalSystem, Problem, Reduction, State, design
from femend.model import Model

__all__ = ["ProjectedSystem", "projected_problem"]

FloatArray = NDArray[np.float64]

# directions with less than this share of the largest part are left out of a basis, as in `reduced_system`
DROP = 1e-7
# points, beside those the basis is made of, at which its frequencies are checked
CHECKED = 5


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
    points = np.vstack([problem.unknowns.mean, design(problem.unknowns, n_points, seed=seed)])
    made, known = [], list[tuple[ModalSystem, FloatArray, ProjectedSystem]]()
    for i, c in enumerate(problem.configurations):
        if not isinstance(c.system, ModalSystem):
            made.append(c)
            continue
        factors = np.array([problem.factors(p, i) for p in points])
        # configurations that have a system in common have its reduction in common
        there = next((r for s, f, r in known if s is c.system and np.array_equal(f, factors)), None)
        known.append((c.system, factors, there or _projected(c.system, factors)))
        made.append(replace(c, system=known[-1][2]))
    small = Problem(problem.unknowns, tuple(made), problem.mac_min)
    return Reduction(small, _error(problem, small, seed + 1))


def _projected(system: ModalSystem, points: FloatArray) -> ProjectedSystem:
    assert isinstance(system.matrices, DeckMatrices)
    shapes = []
    for factors in points:
        K, M = system.matrices.at(factors)
        try:
            shapes.append(_core.modes(system.matrices.indptr, system.matrices.indices, K, M, n_modes=system.n_modes)[1])
        except FemendError:
            continue  # at this corner there is no model; the others hold the modes
    if not shapes:
        raise UpdatingError(f"the model has no modes at any of {len(points)} points; check the bounds")
    V = np.ascontiguousarray(np.hstack(shapes))
    fe = system.matrices.model.fe
    heavy = np.asarray(fe.project(None, V)[0][1])
    size = 1.0 / np.sqrt(np.diag(heavy))
    values, vectors = np.linalg.eigh(heavy * np.outer(size, size))
    keep = values > DROP * values[-1]
    V = np.ascontiguousarray((V * size) @ (vectors[:, keep] / np.sqrt(values[keep])))
    return ProjectedSystem(system.matrices.model, V, np.asarray(system.sensors @ V), system.n_modes, system.defaults)


def _error(problem: Problem, small: Problem, seed: int) -> float:
    """The largest relative error of a frequency of the `small` problem at points that had no part in making it."""
    worst = 0.0
    for p in design(problem.unknowns, CHECKED, seed=seed):
        try:
            pairs = list(zip(problem.states(p), small.states(p), strict=True))
        except FemendError:
            continue
        for full, little in pairs:
            f, g = full.value("freq"), little.value("freq")
            worst = max(worst, float(np.max(np.abs(g - f) / np.maximum(f, 1e-3 * f.max()), initial=0.0)))
    return worst
