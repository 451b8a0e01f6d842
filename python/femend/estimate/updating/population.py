"""Nominally equal structures: the mean of the parameters and their scatter from one to the next."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femend.errors import UpdatingError
from femend.estimate.updating.problem import Problem
from femend.estimate.updating.result import UpdateResult
from femend.estimate.updating.update import update
from femend.threads import one_blas_thread

__all__ = ["Population", "update_population"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Population:
    """Mean (n_unknowns,) of p over structures and its deviation `mean_sd`, scatter `sd` (n_unknowns,) from structure to
    structure; the run of every structure inside that population; convergence."""

    names: tuple[str, ...]
    mean: FloatArray
    mean_sd: FloatArray
    sd: FloatArray
    results: tuple[UpdateResult, ...]
    converged: bool
    n_rounds: int


@one_blas_thread
def update_population(problems: Sequence[Problem], *, rounds: int = 100, tolerance: float = 1e-3) -> Population:
    """Mean and scatter of the unknowns over `problems`: the same unknowns, one problem for each structure.

    Parameters of a structure are normal about the mean: p_s ~ N(mean, sd^2). Expectation-maximisation: every structure
    is updated within the population (its posterior by Laplace), then mean and scatter are made anew from the
    posteriors,

        mean = sum p_s / n,   sd^2 = sum((p_s - mean)^2 + C_s) / n + var(mean)

    (Dempster, Laird and Rubin 1977; the last term, (sd^2 - C) / n, as restricted likelihood has it), until both change
    by less than `tolerance` of the scatter, or `rounds` are over. It begins with the problems' own priors. Raises
    UpdatingError for fewer than three structures, different unknowns, or an unknown without prior.
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
    own = np.zeros((n, len(first)))
    converged, turns = False, 0
    for _ in range(rounds):
        turns += 1
        results = []
        for k, problem in enumerate(problems):
            inside = replace(problem.unknowns, mean=mean, precision=np.diag(1 / sd**2))
            result = update(replace(problem, unknowns=inside), starts[k])
            results.append(result)
            starts[k] = result.p
        p = np.array([r.p for r in results])
        own = np.array([np.diag(r.covariance) for r in results])
        new_mean = p.mean(axis=0)
        variance = ((p - new_mean) ** 2 + own).mean(axis=0)
        variance += np.maximum(sd**2 - own.mean(axis=0), 0.0) / n
        new_sd = np.sqrt(variance)
        change = max(float(np.abs((new_mean - mean) / new_sd).max()), float(np.abs(new_sd / sd - 1.0).max()))
        mean, sd = new_mean, new_sd
        if change < tolerance:
            converged = True
            break
    # what the data of one structure say by themselves has the posterior's precision less the population's
    alone = 1.0 / np.maximum(1.0 / own - 1.0 / sd**2, 1e-12 / sd**2)
    mean_sd = np.sqrt(1.0 / (1.0 / (sd**2 + alone)).sum(axis=0))
    return Population(first.names, mean, mean_sd, sd, tuple(results), converged, turns)
