"""A parameter of a model: a factor on values of the deck."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from numbers import Real

from femend.errors import ArgumentError, ModelError

__all__ = ["NOUNS", "Parameter", "check_parameters", "is_of_damping", "prior_fault", "same_target"]

# how the target of a parameter is called in a sentence
NOUNS = {"material": "material", "property_id": "property", "elements": "element", "mass": "mass element"}


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


def check_parameters(parameters: Sequence[Parameter]) -> None:
    """Raises ModelError for a parameter whose 1-sigma or bounds are none, for two of one name, and for two that are a
    factor on the same values; ArgumentError for what is no list of parameters, or ids that are no list."""
    listed = isinstance(parameters, Sequence) and not isinstance(parameters, str)
    for p in parameters if listed else [parameters]:
        if not (listed and isinstance(p, Parameter)):
            takes = "a model takes its parameters as a list of Parameter(name, property, target, ids)"
            raise ArgumentError.given(
                f"{takes} (texts like 'E:1' go to `femend.read_model`)", p if listed else parameters
            )
        if isinstance(p.ids, int):
            raise ArgumentError.given(f"the ids of parameter {p.name!r} are a tuple, ({p.ids},)", p.ids)
        fault = prior_fault(p.prior_sd, p.bounds)
        if fault is not None:
            raise ModelError(f"parameter {p.name!r}, {fault[0]}: {fault[1]}")
    shared = same_target(parameters)
    if shared is not None:
        raise ModelError(shared[1])
    names = [p.name for p in parameters]
    twice = next((n for n in names if names.count(n) > 1), None)
    if twice is not None:
        raise ModelError(f"{names.count(twice)} parameters are named {twice!r}; give each its own name")


def prior_fault(prior_sd: float, bounds: Sequence[float] | None) -> tuple[str, str] | None:
    """What is wrong with the 1-sigma `prior_sd` of a factor, or with its `bounds` (2,), which of them first; None where
    nothing is.

    >>> prior_fault(-0.1, None)
    ('prior_sd', '-0.1 is not positive (10 % is 0.10)')
    """
    if not isinstance(prior_sd, Real):
        return "prior_sd", f"{prior_sd!r} is no number (10 % is 0.10)"
    if not (math.isfinite(prior_sd) and prior_sd > 0):
        return "prior_sd", f"{prior_sd:g} is not positive (10 % is 0.10)"
    if bounds is None:
        return None
    if len(bounds) != 2 or not 0 <= bounds[0] < bounds[1]:
        return "bounds", f"{bounds} is not [lower, upper] with 0 <= lower < upper, relative to the deck's value"
    if not bounds[0] <= 1 <= bounds[1]:
        return "bounds", f"{bounds} leaves out the deck's own value, which is 1; bounds are relative to it"
    return None


def same_target(parameters: Sequence[Parameter]) -> tuple[int, str] | None:
    """Number of the first of the `parameters` that is a factor on the very values of one before it, and what is said of
    the two; None where there is none. Factors on values of which others leave some out can be told apart."""

    def on(p: Parameter) -> tuple[str, str, frozenset[int]]:
        return p.property, p.target, frozenset(p.ids)

    for (_, p), (j, other) in combinations(enumerate(parameters), 2):
        if on(p) == on(other):
            what = f"{p.property} of {NOUNS.get(p.target, p.target)} {', '.join(map(str, p.ids))}"
            both = f"parameters {p.name!r} and {other.name!r} are both a factor on {what}"
            who = f"parameter {p.name!r} ({what}) is given twice" if p.name == other.name else both
            return j, f"{who}: nothing tells two of them apart; leave one out"
    return None
