"""Sensors that leave the parameters the least variance."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.pretest.information import PlannedTest
from femend.pretest.placement import Placement, candidates

__all__ = ["parameter_sensors"]

FloatArray = NDArray[np.float64]

# rounds of exchanges: each lowers the variance, and few ever happen
ROUNDS = 20


def parameter_sensors(
    plan: PlannedTest, n_sensors: int, *, allowed: ArrayLike | None = None, placed: Sequence[int] = ()
) -> Placement:
    """`n_sensors` places of `plan` that leave the least mean share of the parameters' prior variance.

    Places are taken one by one, each the best besides those before; then single places are exchanged as long as that
    helps (Fedorov 1972, Theory of Optimal Experiments; the criterion is A-optimality in spans of the prior). The end
    is a local optimum. `allowed`, `placed` as in `effective_independence`; the score is the share left after each step.
    Raises PretestError as there, and as `PlannedTest.covariance`.

    >>> from femend.estimate.updating import Unknowns, affine_matrices, factor, modal_system
    >>> from femend.pretest import planned_test
    >>> two = affine_matrices({"a": np.diag([1.0, 0.0]), "b": [[1.0, -1.0], [-1.0, 1.0]]}, np.eye(2))
    >>> prior = Unknowns.of([factor("a", 0.1), factor("b", 0.1)])
    >>> plan = planned_test(modal_system(two, [0, 1], 2), prior, modes=[0], freq_sd=0.05)
    >>> parameter_sensors(plan, 2).rows.tolist()  # one alone says nothing of a shape without scale
    [0, 1]
    """
    rows, kept = candidates(plan.n_places, n_sensors, allowed, placed)
    blocks = plan.blocks()
    n = len(plan.names)
    F = plan.before_shapes() + blocks[kept].sum(axis=0)
    chosen = [int(r) for r in kept]
    free = [int(r) for r in rows if int(r) not in set(chosen)]
    score = []
    while len(chosen) < n_sensors:
        left = _left(F + blocks[free], plan.size, n)
        k = int(np.argmin(left))
        score.append(float(left[k]))
        F = F + blocks[free[k]]
        chosen.append(free.pop(k))
    for _ in range(ROUNDS):
        best = plan.variance_left(chosen)
        moved = False
        for i in range(len(kept), len(chosen)):
            if not free:
                break
            without = F - blocks[chosen[i]]
            left = _left(without + blocks[free], plan.size, n)
            k = int(np.argmin(left))
            if left[k] < best * (1 - 1e-9):
                F, best, moved = without + blocks[free[k]], float(left[k]), True
                chosen[i], free[k] = free[k], chosen[i]
        if not moved:
            break
    score.append(plan.variance_left(chosen))
    return Placement(
        "parameter variance", np.array(sorted(chosen), dtype=np.int64), kept, np.array(score), "share of variance left"
    )


def _left(F: FloatArray, size: FloatArray, n: int) -> FloatArray:
    """Mean share of variance (n_candidates,) left with informations `F` (n_candidates, n + n_modes, n + n_modes)."""
    P = F[:, :n, :n] - F[:, :n, n:] @ np.linalg.solve(F[:, n:, n:], F[:, n:, :n])
    P = P * np.outer(size, size)
    P = P + 1e-12 * np.trace(P, axis1=1, axis2=2)[:, None, None] * np.eye(n) / n  # what is not determined is just bad
    return np.asarray(np.trace(np.linalg.inv(P), axis1=1, axis2=2) / n)
