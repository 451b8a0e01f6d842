"""What a factor of a study may be on, and the prior it has."""

from __future__ import annotations

from femend.model.parameter import prior_fault
from femend.study.file.check import Check

__all__ = ["ALL_PROPERTIES", "OF_TARGET", "TARGETS", "checked_prior", "whose"]

# properties that a factor may be on, by its target
OF_TARGET = {
    "material": ("E", "G", "nu", "rho"),
    "property_id": (
        *("A", "I1", "I2", "J", "t", "eta"),
        *(f"k{i}" for i in range(1, 7)),
        *(f"c{i}" for i in range(1, 7)),
    ),
    "mass": ("m",),
}
ALL_PROPERTIES = tuple(p for properties in OF_TARGET.values() for p in properties)
TARGETS = ("material", "property_id", "elements", "mass")


def whose(name: str) -> str | None:
    """What has the property of this `name`, as a key of the study; None where nothing has.

    >>> whose("E"), whose("weight")
    ('material', None)
    """
    return next((target for target, properties in OF_TARGET.items() if name in properties), None)


def checked_prior(
    check: Check, key: str, who: str, prior_sd: float, bounds: list[float] | None
) -> tuple[float, float] | None:
    """The `bounds` of a factor, after a look at its 1-sigma `prior_sd`; raises StudyError under `key`, naming `who`,
    for a deviation that is not above 0, and bounds that are none or leave out the deck's value."""
    fault = prior_fault(prior_sd, bounds)
    if fault is not None:
        raise check.fail(f"{key}.{fault[0]}", f"{who}: {fault[1]}")
    return None if bounds is None else (bounds[0], bounds[1])
