"""Nominally equal structures: the mean of the parameters and their scatter from one to the next."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femend.errors import UpdatingError
from femend.estimate.updating.problem import Problem
from femend.estimate.updating.result import UpdateResult
from femend.estimate.updating.unknown import limits
from femend.estimate.updating.update import update
from femend.threads import one_blas_thread

__all__ = ["Population", "update_population"]

FloatArray = NDArray[np.float64]

# steps at most from one round of updates to the next, which cost no model, and what they settle within
MOST, FINER = 5000, 0.1


@dataclass(frozen=True, eq=False)
class Population:
    """Mean (n_unknowns,) of p over structures and its deviation `mean_sd`, scatter `sd` (n_unknowns,) from structure to
    structure, and the deviation `alone_sd` (n_unknowns,) that the data of one structure (the middle one) leave by
    themselves; the run of every structure inside that population; convergence."""

    names: tuple[str, ...]
    mean: FloatArray
    mean_sd: FloatArray
    sd: FloatArray
    alone_sd: FloatArray
    results: tuple[UpdateResult, ...]
    converged: bool
    n_rounds: int


@one_blas_thread
def update_population(
    problems: Sequence[Problem],
    *,
    rounds: int = 100,
    tolerance: float = 1e-3,
    told: Callable[[], None] | None = None,
) -> Population:
    """Mean and scatter of the unknowns over `problems`: the same unknowns, one problem for each structure.

    Parameters of a structure are normal about the mean: p_s ~ N(mean, sd^2). Expectation-maximisation: every structure
    is updated within the population (its posterior by Laplace), then mean and scatter are made anew from the
    posteriors, as often as they change with the data as they are about there,

        mean = sum p_s / n,   sd^2 = sum((p_s - mean)^2 + C_s) / n + var(mean)

    (Dempster, Laird and Rubin 1977; the last term, (sd^2 - C) / n, as restricted likelihood has it), until both change
    by less than `tolerance` of the scatter, or `rounds` are over. It begins with the problems' own priors. `told` is
    called for every round. A scatter far below what the data of one structure tell (`alone_sd`) has settled where it
    changes by less than `tolerance` of that: it goes to 0 ever more slowly. Raises UpdatingError for fewer than three
    structures, different unknowns, or an unknown without prior.
    """
    n = len(problems)
    if n < 3:
        raise UpdatingError(f"{n} structures tell no scatter; give three or more")
    first = problems[0].unknowns
    if any(p.unknowns.names != first.names for p in problems):
        raise UpdatingError("the structures have different unknowns; they are to be nominally equal")
    sd = np.array([u.sd for u in first.items])
    if not np.isfinite(sd).all():
        name = first.names[int(np.flatnonzero(~np.isfinite(sd))[0])]
        raise UpdatingError(f"{name!r} has no prior; the population begins with one")
    mean = first.mean.copy()
    starts: list[FloatArray | None] = [None] * n
    results: list[UpdateResult] = []
    alone = np.full((n, len(first)), np.inf)
    converged, turns = False, 0
    for _ in range(rounds):
        turns += 1
        if told is not None:
            told()
        results = []
        for k, problem in enumerate(problems):
            inside = replace(problem.unknowns, mean=mean, precision=np.diag(1 / sd**2))
            result = update(replace(problem, unknowns=inside), starts[k])
            results.append(result)
            starts[k] = result.p
        new_mean, new_sd, alone = _settled(results, mean, sd, tolerance)
        scale = np.maximum(new_sd, np.sqrt(np.median(alone, axis=0)))
        change = float(max(np.abs((new_mean - mean) / scale).max(), np.abs((new_sd - sd) / scale).max()))
        mean, sd = new_mean, new_sd
        if change < tolerance:
            converged = True
            break
    mean_sd = np.sqrt(1.0 / (1.0 / (sd**2 + alone)).sum(axis=0))
    alone_sd = np.sqrt(np.median(alone, axis=0))
    return Population(first.names, mean, mean_sd, sd, alone_sd, tuple(results), converged, turns)


def _settled(
    results: Sequence[UpdateResult], mean: FloatArray, sd: FloatArray, tolerance: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Mean and scatter (n_unknowns,) that expectation-maximisation settles at from `mean` and `sd`, with the data of
    every structure as they are about where its update ended, and the variances (n, n_unknowns) that the data of each
    leave by themselves."""
    lower, upper = limits(results[0].problem.unknowns)
    jacobians = [r.after.jacobian for r in results if r.after.jacobian is not None]
    H = np.array([J.T @ J for J in jacobians])
    b = np.array([h @ r.p - J.T @ r.after.residual for h, J, r in zip(H, jacobians, results, strict=True)])
    for _ in range(MOST):
        inverse = np.linalg.inv(H + np.diag(1 / sd**2))
        p = np.clip(np.einsum("nij,nj->ni", inverse, b + mean / sd**2), lower, upper)
        own = np.einsum("nii->ni", inverse)
        new_mean = p.mean(axis=0)
        variance = ((p - new_mean) ** 2 + own).mean(axis=0)
        variance += np.maximum(sd**2 - own.mean(axis=0), 0.0) / len(results)
        new_sd = np.sqrt(variance)
        # what the data of one structure say has the posterior's precision less the population's
        alone = 1.0 / np.maximum(1.0 / own - 1.0 / sd**2, 1e-12 / sd**2)
        scale = np.maximum(new_sd, np.sqrt(np.median(alone, axis=0)))
        change = float(max(np.abs((new_mean - mean) / scale).max(), np.abs((new_sd - sd) / scale).max()))
        mean, sd = new_mean, new_sd
        if change < FINER * tolerance:
            break
    return mean, sd, np.asarray(alone)
