"""Whether the model's own unknowns move with the level of the recordings, so that what is missing is not linear.

A linear structure has the same frequencies and damping at every level, however wrong its model is. With d_i what the
model's unknowns, fitted to record i alone, are off from a line over the logarithm of its level, H_i the Gauss-Newton
matrix of that fit and T the tempering of the cost, a slope of zero costs

    2 ΔL = (2 / T) [ min_a Σ (p_i - a)ᵀ H_i (p_i - a) - min_ab Σ (p_i - a - b l_i)ᵀ H_i (p_i - a - b l_i) ]

more than the best one, and of a linear structure that is distributed as chi squared with as many degrees of freedom as
there are unknowns (Wilks, Ann. Math. Statist. 9 (1938) 60-62). That asks for no place and no law, and so shows what a
free force, which takes a response of every line, leaves in the noise.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from femend.diagnose.updating.each_alone import fitted_one_by_one, moved_most
from femend.diagnose.updating.levels import levels_differ
from femend.diagnose.updating.update import UpdatedModel
from femend.estimate import Fit
from femend.estimate.lines import TEMPERING

__all__ = ["drift", "drifted", "moves_with_level", "told_of_drift"]

FloatArray = NDArray[np.float64]

# probability with which a linear structure may seem to change with the level
RARE = 1e-6
# how many times what the model leaves beyond the noise counts: an error of the model is alike on the lines of a
# resonance, so that fewer lines than there are tell its unknowns
ALIKE = 20.0


def moves_with_level(start: UpdatedModel) -> list[Fit] | None:
    """The updated model fitted to each of its records alone, where its unknowns move with the level by more than noise
    does; None where they do not, or levels cannot be compared."""
    records = start.problem.records
    if len(records) < 2 or any(r.frf is not None for r in records) or not levels_differ(records):
        return None
    fits = fitted_one_by_one(start)
    return fits if fits is not None and drifted(fits, [r.level for r in records], start.null.score) else None


def drifted(fits: Sequence[Fit], levels: Sequence[float], misfit: float) -> bool:
    """Whether fits of the model to records of these levels differ by more than a linear structure, of whose records the
    model leaves `misfit` times the noise, would let them."""
    allowed = 1.0 + ALIKE * max(misfit - 1.0, 0.0)
    return bool(chdtrc(len(fits[0].p), drift(fits, levels) / allowed) < RARE)


def drift(fits: Sequence[Fit], levels: Sequence[float]) -> float:
    """What a slope over the logarithm of the level is worth (twice the fall of the negative log likelihood); chi
    squared with as many degrees of freedom as there are unknowns where the structure is linear."""
    n = len(fits[0].p)
    over = np.log(levels) - np.log(levels).mean()
    p = [fit.p for fit in fits]
    H = [fit.hessian[:n, :n] for fit in fits]
    sloped = [np.hstack([np.eye(n), t * np.eye(n)]) for t in over]
    return 2.0 / TEMPERING * (_least(p, H, [np.eye(n)] * len(p)) - _least(p, H, sloped))


def _least(p: Sequence[FloatArray], H: Sequence[FloatArray], X: Sequence[FloatArray]) -> float:
    """Least of Σ (p - X z)ᵀ H (p - X z) over z."""
    A = sum((x.T @ h @ x for x, h in zip(X, H, strict=True)), np.zeros((X[0].shape[1],) * 2))
    b = sum((x.T @ h @ q for x, h, q in zip(X, H, p, strict=True)), np.zeros(len(A)))
    z = np.linalg.lstsq(A, b, rcond=None)[0]
    return float(sum((q - x @ z) @ h @ (q - x @ z) for x, h, q in zip(X, H, p, strict=True)))


def told_of_drift(start: UpdatedModel, fits: Sequence[Fit], shown: bool) -> str:
    """What is said where nothing but that shows; `shown` where a free force tells the place all the same."""
    place = "The first place listed is the likeliest" if shown else "Its place hardly shows: the first one is a guess"
    return (
        "something that is not linear is missing, or the structure was not the same in all recordings: fitted to each "
        f"of them alone the model changes with the level by more than noise does, {moved_most(start, fits)}. {place}; "
        "a recording that holds the force would tell far more, and a level recorded twice, first and last, whether the "
        "structure stayed the same"
    )
