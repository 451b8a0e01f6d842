"""Large models in bases that hold their modes all over the range of the unknowns."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femend import _core
from femend.errors import FemendError, UpdatingError
from femend.estimate.updating.dense import DenseSystem
from femend.estimate.updating.design import design
from femend.estimate.updating.modal import ModalSystem
from femend.estimate.updating.problem import Problem
from femend.estimate.updating.state import System

__all__ = ["Reduction", "basis_of_modes", "reduced_problem", "reduced_system"]

FloatArray = NDArray[np.float64]
# directions with less than this share of the largest part are left out of a basis
DROP = 1e-7


def basis_of_modes(system: ModalSystem, points: FloatArray) -> FloatArray:
    """Basis (n_a, r) of the modes of `system` at the factors `points` (n_points, n_parameters or more), orthonormal
    over the mass at factors of one; raises UpdatingError where there are modes at none of them."""
    pattern = system.matrices.indptr, system.matrices.indices
    shapes = []
    n = len(system.matrices.names)
    for factors in points[:, :n]:
        K, M = system.matrices.at(np.ascontiguousarray(factors))
        try:
            shapes.append(_core.modes(*pattern, K, M, n_modes=system.n_modes)[1])
        except FemendError:
            continue  # at this corner there is no model; the others hold the modes
    if not shapes:
        raise UpdatingError(f"the model has no modes at any of {len(points)} points; check the bounds")
    V = np.ascontiguousarray(np.hstack(shapes))
    M = system.matrices.at(np.ones(n))[1]
    heavy = _core.modal_projections(*pattern, M[None], V)[0]
    size = 1.0 / np.sqrt(np.diag(heavy))
    values, vectors = np.linalg.eigh(heavy * np.outer(size, size))
    keep = values > DROP * values[-1]
    return np.ascontiguousarray((V * size) @ (vectors[:, keep] / np.sqrt(values[keep])))


def reduced_system(system: ModalSystem, points: FloatArray) -> DenseSystem:
    """`system` in the span of its modes at the factors `points` (n_points, n_parameters), as full matrices.

    Frequencies from it lie above the full model's (Rayleigh), and coincide at the points (a reduced basis: Hesthaven,
    Rozza and Stamm 2016, chapter 3). Raises UpdatingError for a model that is not affine in its factors, or where it is
    asked for static values or damping ratios.
    """
    if not system.matrices.affine:
        raise UpdatingError(
            "K and M are not affine in the factors (thickness, section, morphs): a basis has to be made anew at each"
        )
    if system.damping:
        raise UpdatingError("a reduced model gives no damping ratios; reduce a configuration without them")
    if system.statics is not None or system.rigid is not None:
        raise UpdatingError("a basis of modes does not hold static displacements; reduce a configuration without them")
    pattern = system.matrices.indptr, system.matrices.indices
    V = basis_of_modes(system, points)
    one = np.ones(len(system.matrices.names))
    K1, M1 = (_core.modal_projections(*pattern, a[None], V)[0] for a in system.matrices.at(one))
    dK, dM = (_core.modal_projections(*pattern, a, V) for a in system.matrices.slopes(one))
    K0, M0 = K1 - dK.sum(axis=0), M1 - dM.sum(axis=0)
    rows = np.asarray(system.sensors @ V)
    return DenseSystem(
        system.matrices.names, K0, M0, dK, dM, rows, system.n_modes, system.frfs, None, dict(system.defaults)
    )


@dataclass(frozen=True, eq=False)
class Reduction:
    """The `problem` in small models, and the largest relative error of a frequency, `error`, at points that had no part
    in making them; infinite where it has a solution at none of these."""

    problem: Problem
    error: float


def reduced_problem(
    problem: Problem,
    n_points: int | None = None,
    *,
    n_check: int = 5,
    seed: int = 0,
    reduced: Callable[[ModalSystem, FloatArray], System] = reduced_system,
) -> Reduction:
    """The same problem with every large model reduced, from modes at `n_points` of a Latin hypercube between the bounds
    (twice the unknowns plus 8 by default) and at the prior mean; checked at `n_check` others of the same `seed`.

    `reduced` makes the small model of a large one from the factors (n_points, n_parameters) of these points. Raises
    UpdatingError as it (`reduced_system`, for affine models, unless another is given) and `design` do.
    """
    n_points = 2 * len(problem.unknowns) + 8 if n_points is None else n_points
    points = np.vstack([problem.unknowns.mean, design(problem.unknowns, n_points, seed=seed)])
    made, known = [], list[tuple[ModalSystem, FloatArray, System]]()
    for i, c in enumerate(problem.configurations):
        if not isinstance(c.system, ModalSystem):
            made.append(c)
            continue
        factors = np.array([problem.factors(p, i) for p in points])
        # configurations that have a system in common have its reduction in common
        there = next((r for s, f, r in known if s is c.system and np.array_equal(f, factors)), None)
        known.append((c.system, factors, there or reduced(c.system, factors)))
        made.append(replace(c, system=known[-1][2]))
    small = replace(problem, configurations=tuple(made))
    worst, solved = 0.0, 0
    for p in design(problem.unknowns, n_check, seed=seed + 1):
        try:
            pairs = list(zip(problem.states(p), small.states(p), strict=True))
        except FemendError:
            continue  # at this corner there is no model; the others tell
        solved += 1
        for full, little in pairs:
            if "freq" not in full.values:
                continue  # a rotor at speed, a solver of the user's own: kept as it is
            f, g = full.value("freq"), little.value("freq")
            worst = max(worst, float(np.max(np.abs(g - f) / np.maximum(f, 1e-3 * f.max()), initial=0.0)))
    return Reduction(small, worst if solved or not n_check else np.inf)
