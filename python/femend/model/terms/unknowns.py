"""Unknowns of an estimate that spans several configurations: names, scales and Gaussian priors."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femend.errors import ModelError

__all__ = ["Unknown", "Unknowns", "covariance_of"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Unknown:
    """One unknown: its value is `scale` * exp(p) where `positive`, else `scale` * p.

    p has a Gaussian prior `mean`, `sd` (infinite: nothing is known). `unit` is that of the value ("" for a factor);
    `owner` is the term it belongs to, "" for parameters and damping. `bounds` are limits of the value, None where there
    are none; `femend.estimate.updating` keeps them.
    """

    name: str
    scale: float
    positive: bool = True
    mean: float = 0.0
    sd: float = 1.0
    unit: str = ""
    owner: str = ""
    bounds: tuple[float, float] | None = None

    def value(self, p: float) -> float:
        """The value at p."""
        return float(self.scale * (np.exp(p) if self.positive else p))


@dataclass(frozen=True, eq=False)
class Unknowns:
    """An ordered set of unknowns with a joint Gaussian prior: `mean` (n,) and `precision` (n, n) of p.

    >>> Unknowns.of([Unknown("k", 2.0, sd=0.5)]).precision
    array([[4.]])
    """

    items: tuple[Unknown, ...]
    mean: FloatArray
    precision: FloatArray

    @classmethod
    def of(cls, items: list[Unknown] | tuple[Unknown, ...]) -> Unknowns:
        """Independent priors as the items say; raises ModelError for a name that stands twice."""
        names = [u.name for u in items]
        for name in names:
            if names.count(name) > 1:
                raise ModelError(f"two unknowns are called {name!r}; give the parameters and terms different names")
        return cls(
            tuple(items), np.array([u.mean for u in items]), np.diag([1 / u.sd**2 for u in items]).astype(np.float64)
        )

    def __len__(self) -> int:
        return len(self.items)

    @property
    def names(self) -> tuple[str, ...]:
        """Names in order."""
        return tuple(u.name for u in self.items)

    @property
    def prior_sd(self) -> FloatArray:
        """Standard deviations (n,) that the joint prior has for each p by itself; infinite where it says nothing."""
        return np.sqrt(np.diag(covariance_of(self.precision)))

    def strengthened(self, strength: float) -> Unknowns:
        """These unknowns with a prior of `strength` times the precision; their own `sd` stays what was stated."""
        return replace(self, precision=strength * self.precision)

    def index(self, name: str) -> int:
        """Position of an unknown; raises ModelError for a name that is none."""
        if name not in self.names:
            raise ModelError(f"no unknown is called {name!r}; there are {', '.join(self.names)}")
        return self.names.index(name)

    def values(self, p: FloatArray) -> FloatArray:
        """Values (n,) at p (n,)."""
        return np.array([u.value(x) for u, x in zip(self.items, p, strict=True)])

    def value_sd(self, p: FloatArray, covariance: FloatArray) -> FloatArray:
        """Standard deviations (n,) of the values, to first order, from the covariance (n, n) of p."""
        sd = np.sqrt(np.maximum(np.diag(covariance), 0.0))
        slope = np.array([u.value(x) if u.positive else u.scale for u, x in zip(self.items, p, strict=True)])
        return np.asarray(np.abs(slope) * sd)

    def extended(self, more: list[Unknown] | tuple[Unknown, ...]) -> Unknowns:
        """These unknowns with independent further ones behind them."""
        new = Unknowns.of([*self.items, *more])
        n = len(self)
        mean, precision = new.mean.copy(), new.precision.copy()
        mean[:n], precision[:n, :n] = self.mean, self.precision
        return replace(new, mean=mean, precision=precision)

    def with_posterior(self, p: FloatArray, precision: FloatArray) -> Unknowns:
        """The same unknowns with a Gaussian of mean `p` (n,) and `precision` (n, n): what one stage settled, for the
        next."""
        return replace(self, mean=np.asarray(p, dtype=np.float64).copy(), precision=0.5 * (precision + precision.T))


def covariance_of(precision: FloatArray) -> FloatArray:
    """Covariance (n, n) of a `precision` (n, n); infinite variance where it says nothing."""
    diag = np.sqrt(np.maximum(np.diag(precision), 0.0))
    scale = np.where(diag > 0, diag, 1.0)
    values, vectors = np.linalg.eigh(precision / np.outer(scale, scale))
    blind = values <= values.max(initial=0.0) * len(values) * 1e-13
    inverse = (vectors[:, ~blind] / values[~blind]) @ vectors[:, ~blind].T
    inverse = inverse / np.outer(scale, scale)
    unseen = (vectors[:, blind] ** 2).sum(axis=1) > 1e-9
    inverse[unseen, unseen] = np.inf
    return np.asarray(inverse)
