"""Points in the space of the unknowns: designs of experiments and draws from the prior."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from femend.errors import UpdatingError
from femend.estimate.updating.unknown import limits
from femend.model.terms.unknowns import Unknowns

__all__ = ["design", "prior_quantiles"]

FloatArray = NDArray[np.float64]
# a prior without bounds is covered to this many deviations
COVERED = 2.0
# of the way from the mean to a lower limit that is the only one, this share is left between it and the points: with
# next to no stiffness modes are others
KEPT = 0.05


def design(unknowns: Unknowns, n: int, *, over: Literal["bounds", "prior"] = "bounds", seed: int = 0) -> FloatArray:
    """`n` points (n, n_unknowns) of p by a Latin hypercube (McKay, Beckman and Conover 1979).

    `over` "bounds": even over the values between their bounds (over two prior deviations where there are none);
    "prior": by the priors, cut off at the bounds, each unknown by itself. `seed` makes it repeatable. Raises
    UpdatingError for an unknown with neither bounds nor prior.

    >>> from femend.estimate.updating.unknown import factor
    >>> points = design(Unknowns.of([factor("E", 0.1, (0.5, 1.5))]), 4)
    >>> sorted(np.floor((points[:, 0] - 0.5) * 4).tolist())
    [0.0, 1.0, 2.0, 3.0]
    """
    from scipy.stats import qmc

    u = qmc.LatinHypercube(len(unknowns), rng=seed).random(n)
    return prior_quantiles(unknowns, u) if over == "prior" else _even(unknowns, u)


def _ends(unknowns: Unknowns) -> tuple[FloatArray, FloatArray]:
    lower, upper = limits(unknowns)
    sd = np.array([u.sd for u in unknowns.items])
    high = np.where(np.isfinite(upper), upper, unknowns.mean + COVERED * sd)
    least = np.maximum(unknowns.mean - COVERED * sd, (1 - KEPT) * lower + KEPT * unknowns.mean)
    low = np.where(np.isfinite(lower) & np.isfinite(upper), lower, least)
    # a positive unknown with a lower bound of 0 has no lower end of its logarithm
    bad = ~(np.isfinite(low) & np.isfinite(high))
    if bad.any():
        name = unknowns.names[int(np.flatnonzero(bad)[0])]
        raise UpdatingError(f"{name!r} has neither bounds nor a prior: there is no range to put points in; give one")
    return low, high


def _even(unknowns: Unknowns, u: FloatArray) -> FloatArray:
    low, high = _ends(unknowns)
    out = low + u * (high - low)
    for i, x in enumerate(unknowns.items):
        if x.positive and x.bounds is not None:  # even over the value, not over its logarithm
            a, b = np.exp(low[i]), np.exp(high[i])
            out[:, i] = np.log(a + u[:, i] * (b - a))
    return np.asarray(out)


def prior_quantiles(unknowns: Unknowns, u: FloatArray) -> FloatArray:
    """Points p (n, n_unknowns) at quantiles `u` (n, n_unknowns) in (0, 1) of the priors, cut off at the bounds, each by
    itself; even between the bounds where there is no prior."""
    from scipy.stats import norm

    lower, upper = limits(unknowns)
    low, high = _ends(unknowns)
    out = np.empty_like(u)
    for i, sd in enumerate(unknowns.prior_sd):
        if not np.isfinite(sd):
            out[:, i] = low[i] + u[:, i] * (high[i] - low[i])
            continue
        a = float(norm.cdf((lower[i] - unknowns.mean[i]) / sd))
        b = float(norm.cdf((upper[i] - unknowns.mean[i]) / sd))
        out[:, i] = unknowns.mean[i] + sd * norm.ppf(np.clip(a + u[:, i] * (b - a), 1e-300, 1 - 1e-16))
    return np.clip(out, lower, upper)
