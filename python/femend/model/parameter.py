"""A parameter of a model: a factor on values of the deck."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Parameter"]


@dataclass(frozen=True, slots=True)
class Parameter:
    """A factor on values of the deck: `property` of the `target` ("material", "property_id", "elements", "mass") `ids`.

    `prior_sd` is the relative 1-sigma of what the deck says, `bounds` the relative limits or None.
    """

    name: str
    property: str
    target: str
    ids: tuple[int, ...]
    prior_sd: float = 0.10
    bounds: tuple[float, float] | None = None
