"""The problem of a study in small models, for what solves it thousands of times."""

from __future__ import annotations

from femend.bench.reading.projected import projected_problem
from femend.errors import UpdatingError
from femend.estimate.updating import DeckMatrices, ModalSystem, Problem, Reduction, reduced_problem

__all__ = ["small_problem"]

# a reduced model's frequency may be off by this share of the deviation that the test's frequencies have
OFF = 0.2
# bases are made of so many times the usual number of points until they are that good
TIMES = (1, 2, 4)


def small_problem(problem: Problem, freq_sd: float, seed: int = 0) -> Reduction | None:
    """`problem` with its large models in bases of their modes, whose frequencies are off by less than a fifth of
    `freq_sd`, a share of them, all over the bounds; None where that is not to be had, or where the models are small as
    they are.

    A deck whose matrices are no affine sums of its factors (shear areas, thicknesses, sections) is assembled and
    projected at every point. FRFs and damping need more than a basis of modes holds, and positions have none. `seed` is
    that of the points.
    """
    large = [c.system for c in problem.configurations if isinstance(c.system, ModalSystem)]
    if not large or any(s.frfs is not None or s.damping for s in large):
        return None
    affine = all(s.matrices.affine for s in large)
    if not (affine or all(isinstance(s.matrices, DeckMatrices) for s in large)):
        return None  # nodes move: elements at them are evaluated anew, which no basis saves
    reduced = reduced_problem if affine else projected_problem
    points = 2 * len(problem.unknowns) + 8
    for times in TIMES:
        try:
            found = reduced(problem, times * points, seed=seed)
        except UpdatingError:
            return None  # no model at the corners: the full one says so, point by point
        if found.error < OFF * freq_sd:
            return found
    return None
