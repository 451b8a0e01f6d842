"""What may change: factors on model values with their priors and limits."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from femend.errors import UpdatingError
from femend.model import Model, Morph, Parameter
from femend.model.terms.unknowns import Unknown, Unknowns

__all__ = ["LEAST_FACTOR", "amplitude", "factor", "factors_of", "limits", "smooth", "spans", "unknowns_of"]

FloatArray = NDArray[np.float64]

# a stiffness or mass is above 0; with a thousandth of it, it has no part in what is measured
LEAST_FACTOR = 1e-3


def factor(
    name: str, sd: float = 0.1, bounds: tuple[float, float] | None = None, *, logarithmic: bool = False
) -> Unknown:
    """A factor around 1 with the relative 1-sigma `sd` (infinite: no prior) and `bounds` on the factor.

    Without bounds it is kept at a thousandth or more, since stiffness and mass are above 0. A `logarithmic` factor has
    no such limit and stays positive, and `sd` is that of its logarithm: for values of which only the order of magnitude
    is known. Raises UpdatingError for an `sd` that is not above 0.

    >>> factor("E", 0.05, (0.8, 1.2)).value(1.1)
    1.1
    """
    if not sd > 0:
        raise UpdatingError(f"the prior of {name!r} has a standard deviation of {sd:g}; it takes one above 0")
    if logarithmic:
        return Unknown(name, 1.0, True, 0.0, sd, bounds=bounds)
    return Unknown(name, 1.0, False, 1.0, sd, bounds=bounds or (LEAST_FACTOR, np.inf))


def factors_of(parameters: Iterable[Parameter]) -> Unknowns:
    """One factor for each of a deck's `parameters`, with the prior and bounds it was declared with; a lower bound of 0,
    at which a deck cannot be solved, is taken to be a thousandth."""
    found = []
    for p in parameters:
        bounds = None if p.bounds is None else (p.bounds[0] or min(LEAST_FACTOR, 0.5 * p.bounds[1]), p.bounds[1])
        found.append(factor(p.name, p.prior_sd, bounds))
    return Unknowns.of(found)


def amplitude(morph: Morph) -> Unknown:
    """The amplitude of a `morph` about 0, in its unit, with the prior and bounds it was declared with.

    >>> amplitude(Morph("arm", [7], [(0.0, 0.0, 1.0)], prior_sd=2e-3)).value(0.001)
    0.001
    """
    return Unknown(morph.name, 1.0, False, 0.0, morph.prior_sd, morph.unit, bounds=morph.bounds)


def unknowns_of(model: Model) -> Unknowns:
    """All that may be updated in a deck: a factor for each parameter of `model`, then an amplitude for each morph."""
    return Unknowns.of([*factors_of(model.parameters).items, *(amplitude(m) for m in model.morphs)])


def limits(unknowns: Unknowns) -> tuple[FloatArray, FloatArray]:
    """Lower and upper limits (n,), (n,) of p, infinite where there are none.

    Raises UpdatingError for limits that exclude each other, that a positive unknown cannot have, or that exclude the
    prior's mean, and for a scale that is not above 0, with which a value would never change.

    >>> lower, upper = limits(Unknowns.of([factor("E", 0.1, (0.5, 2.0))]))
    >>> (float(lower[0]), float(upper[0]))
    (0.5, 2.0)
    """
    lower, upper = np.full(len(unknowns), -np.inf), np.full(len(unknowns), np.inf)
    for i, u in enumerate(unknowns.items):
        if not u.sd > 0:
            raise UpdatingError(f"the prior of {u.name!r} has a standard deviation of {u.sd:g}; it takes one above 0")
        if not (np.isfinite(u.scale) and u.scale > 0):
            raise UpdatingError(
                f"the unknown {u.name!r} has a scale of {u.scale:g}, by which its p is multiplied: give one above 0, 1 "
                "where p is the value; where the search starts is `mean`"
            )
        if u.bounds is None:
            continue
        low, high = u.bounds
        if not low < high:
            raise UpdatingError(f"the bounds of {u.name!r} are {low:g} to {high:g}: no value lies between them")
        if u.positive and low < 0:
            raise UpdatingError(f"the lower bound of {u.name!r} is {low:g}; it is positive by definition")
        with np.errstate(divide="ignore"):
            lower[i], upper[i] = (
                np.log(np.array([low, high]) / u.scale) if u.positive else (low / u.scale, high / u.scale)
            )
        if not lower[i] <= unknowns.mean[i] <= upper[i]:
            raise UpdatingError(
                f"the prior of {u.name!r} has its mean at {u.value(unknowns.mean[i]):g}, outside its bounds {low:g} to "
                f"{high:g}; move the one or the other"
            )
    return lower, upper


def spans(unknowns: Unknowns) -> FloatArray:
    """A length (n,) of p for each unknown, by which steps are measured: the prior's 1-sigma, else a quarter of the
    distance between bounds, else 1."""
    lower, upper = limits(unknowns)
    sd = np.array([u.sd for u in unknowns.items])
    width = (upper - lower) / 4.0
    return np.asarray(np.where(np.isfinite(sd), sd, np.where(np.isfinite(width), width, 1.0)))


def smooth(unknowns: Unknowns, neighbours: Sequence[tuple[str, str]], sd: float) -> Unknowns:
    """The same unknowns with a field prior: p of `neighbours` (pairs of names) differ by `sd` (1-sigma).

    Adds to the prior's precision the graph Laplacian of the neighbours over sd^2, about the means, as they are (Rue and
    Held, Gaussian Markov Random Fields, 2005, section 3.3). Raises ModelError for a name that is none and UpdatingError
    for an `sd` that is not positive.

    >>> both = smooth(Unknowns.of([factor("a", 1.0), factor("b", 1.0)]), [("a", "b")], 0.5)
    >>> both.precision.tolist()
    [[5.0, -4.0], [-4.0, 5.0]]
    """
    if not sd > 0:
        raise UpdatingError(f"neighbours are to differ by {sd:g}; give a standard deviation above 0")
    precision = unknowns.precision.copy()
    for a, b in neighbours:
        i, j = unknowns.index(a), unknowns.index(b)
        precision[[i, j], [i, j]] += 1 / sd**2
        precision[[i, j], [j, i]] -= 1 / sd**2
    return replace(unknowns, precision=precision)
