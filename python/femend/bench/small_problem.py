"""The problem of a study in small models, for what solves it thousands of times."""

from __future__ import annotations

from femend.errors import UpdatingError
from femend.estimate.updating import ModalSystem, Problem, Reduction, reduced_problem

__all__ = ["small_problem"]

# a reduced model's frequency may be off by this share of the deviation that the test's frequencies have
OFF = 0.2
# bases are made of so many times the usual number of points until they are that good
TIMES = (1, 2, 4)


def small_problem(problem: Problem, freq_sd: float, seed: int = 0) -> Reduction | None:
    """`problem` with its large models in bases of their modes, whose frequencies are off by less than a fifth of
    `freq_sd`, a share of them, all over the bounds; None where that is not to be had, or where the models are small as
    they are.

    FRFs and damping need more than a basis of modes holds, and positions, thicknesses and sections have none. `seed` is
    that of the points.
    """
    large = [c.system for c in problem.configurations if isinstance(c.system, ModalSystem)]
    if not large or any(s.frfs is not None or s.damping or not s.matrices.affine for s in large):
        return None
    points = 2 * len(problem.unknowns) + 8
    for times in TIMES:
        try:
            found = reduced_problem(problem, times * points, seed=seed)
        except UpdatingError:
            return None  # no model at the corners: the full one says so, point by point
        if found.error < OFF * freq_sd:
            return found
    return None
