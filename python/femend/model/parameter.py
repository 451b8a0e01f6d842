"""A parameter of a model: a factor on values of the deck."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Parameter", "is_of_damping"]


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


def is_of_damping(parameter: Parameter) -> bool:
    """Whether a `parameter` is one of damping alone: of dashpots (c1 to c6) or a loss factor (eta)."""
    return parameter.property == "eta" or parameter.property.startswith("c")
