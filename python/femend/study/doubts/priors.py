"""Priors of a study's parameters that are hardly meant: per cent, or values in units, where shares are asked for;
bounds, which a diagnosis does not hold; and values that came out far from what their priors expect."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from femend.model import Parameter
from femend.numerals import plain

__all__ = ["bounds_told", "far_told", "prior_doubts"]

# relative 1-sigma from which a prior says hardly anything: of stiffnesses and dashpots of springs and joints, which may
# be known to an order of magnitude, and of all else
WIDE_JOINT, WIDE = 3.0, 1.0
# and below which a parameter is as good as fixed: nothing of a structure is known as well
NARROW = 1e-3
# what a per cent that was meant stands between
PER_CENT = (1.0, 100.0)
# prior standard deviations beyond which an updated value is not what was expected of it, by chance one of 400
FAR = 3.0


def prior_doubts(parameters: Sequence[Parameter]) -> list[str]:
    """Sentences about `parameters` whose relative `prior_sd` is that of no structure."""
    return [text for p in parameters if (text := _doubt(p))]


def _doubt(parameter: Parameter) -> str:
    sd, who = parameter.prior_sd, f"parameter {parameter.name!r}: prior_sd = {parameter.prior_sd:g}"
    joint = parameter.property[0] in "kc" and parameter.target in ("property_id", "elements")
    usual = (
        "usual are 0.1 to 1 for springs and joints"
        if joint
        else "usual are 0.02 to 0.3 (0.1, which is 10 %, without it)"
    )
    if sd >= (WIDE_JOINT if joint else WIDE):
        within = f"within a factor of {plain(math.exp(sd), 2)}" if sd < 20 else "not at all"
        meant = f"; {sd:g} % is {sd / 100:g}" if PER_CENT[0] <= sd <= PER_CENT[1] else ""
        return (
            f"{who} is a share of the deck's value, {plain(100 * sd)} %, which says that {parameter.property} is known "
            f"{within}, and leaves it to the recordings alone{meant}; {usual}"
        )
    if sd < NARROW:
        return (
            f"{who} is a share of the deck's value, {plain(100 * sd, 2)} %, not a value in its unit: "
            f"{parameter.property} can hardly move, and what is off in it is looked for elsewhere; {usual}, or leave "
            "the parameter out"
        )
    return ""


def bounds_told(parameters: Sequence[Parameter], factors: Mapping[str, float | None] | None = None) -> list[str]:
    """A sentence where `parameters` have bounds, which a diagnosis does not hold, with those whose updated factor, by
    name in `factors`, lies outside of them; none where no parameter has bounds."""
    bounded = [(p, p.bounds) for p in parameters if p.bounds is not None]
    if not bounded:
        return []
    names = ", ".join(repr(p.name) for p, _ in bounded)
    found = {name: factor for name, factor in (factors or {}).items() if factor is not None}
    outside = [
        f"{p.name!r} came to {plain(found[p.name], 4)} times the deck's value, outside of its {low:g} to {high:g}"
        for p, (low, high) in bounded
        if p.name in found and not low <= found[p.name] <= high
    ]
    return [
        f"bounds of parameter{'s' * (len(bounded) > 1)} {names} hold in `femend update`; a diagnosis keeps to "
        "prior_sd: make it smaller where a value must stay near the deck's"
        f"{''.join(f'. {text}' for text in outside)}"
    ]


def far_told(parameters: Sequence[Parameter], factors: Mapping[str, float | None]) -> list[str]:
    """A sentence about those of `parameters` whose updated factor, by name in `factors`, is far outside of its prior,
    furthest first; none where all are within three standard deviations."""
    off = {p: _deviations(p, factors.get(p.name)) for p in parameters}
    far = sorted((p for p in parameters if off[p] > FAR), key=lambda p: -off[p])
    if not far:
        return []
    each = ", ".join(
        f"{p.name!r} came to {plain(factors[p.name] or 0.0)} times the deck's value, {plain(off[p], 2)} of its prior "
        f"standard deviations (prior_sd = {p.prior_sd:g})"
        for p in far
    )
    it = "it has" if len(far) == 1 else "they have"
    return [
        f"parameter{'s' * (len(far) > 1)} {each}: where that is not plausible, {it} taken up something else that the "
        "study does not know (what is missing, a dimension or mass that is no parameter, sensors or forces that are "
        "off), and the updated deck is none to go on with: look for that, or name parameters for it; widen prior_sd "
        "where such a value is plausible"
    ]


def _deviations(parameter: Parameter, factor: float | None) -> float:
    """Prior standard deviations that a `factor` is from the deck's value; 0 of none."""
    if factor is None:
        return 0.0
    return abs(math.log(factor)) / parameter.prior_sd if factor > 0 else math.inf
