"""A law with its force scale left open, as a regression takes it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from femend.errors import LawParameterError
from femend.physics.entry import Physics

__all__ = ["Shape", "linear_in", "single"]


@dataclass(frozen=True, slots=True)
class Shape:
    """A law with its force scale left open.

    The force is the sum over `terms` of a factor times the force of the law with that term's values; `values(factors)`
    puts the fitted factors back. Laws that are linear in several parameters (Zener at a given tau, bilinear) have as
    many terms.
    """

    physics: Physics
    terms: tuple[Mapping[str, float], ...]
    scaled: tuple[tuple[str, ...], ...]

    def values(self, factors: tuple[float, ...] | list[float]) -> dict[str, float]:
        """Parameter values for one fitted factor a term; raises LawParameterError for another number of `factors`."""
        if len(factors) != len(self.terms):
            raise LawParameterError(
                f"{self.physics.name} has {len(self.terms)} force scales here, {len(factors)} were given",
                law=self.physics.name,
            )
        out = dict(self.terms[0])
        for term, names, factor in zip(self.terms, self.scaled, factors, strict=True):
            for name in names:
                out[name] = term[name] * factor
        return out


def single(physics: Physics, values: Mapping[str, float], *scaled: str) -> Shape:
    """A law whose `scaled` parameters are `values` times one factor."""
    return Shape(physics, (dict(values),), (scaled,))


def linear_in(physics: Physics, fixed: Mapping[str, float]) -> Shape:
    """A law that is linear in all parameters but the fixed ones: a term for each."""
    free = [name for name in physics.parameter_names if name not in fixed]
    terms = tuple({**dict.fromkeys(free, 0.0), name: 1.0, **fixed} for name in free)
    return Shape(physics, terms, tuple((name,) for name in free))
