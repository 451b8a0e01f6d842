"""Start values of the laws beyond the contract's names."""

from __future__ import annotations

from functools import partial
from itertools import combinations, product
from math import exp

from femend.physics.entry import Physics
from femend.physics.shape import Shape, linear_in, single

__all__ = ["EXTENDED_STARTS", "extended_shapes"]

EXTENDED_STARTS = (
    "generalised_maxwell",
    "generalised_maxwell_3",
    "fractional",
    "springpot",
    "box_spectrum",
    "saturating_stiffness",
    "preloaded_contact",
    "hertz_contact",
    "play_friction",
    "sliding_friction",
    "displacement_damping",
    "iwan",
    "free_form",
)
_GAP, _SLIP = (0.25, 0.45, 0.7), (0.03, 0.1, 0.25, 0.5)
_POWER = (0.2, 0.4, 0.6, 0.8)
# of loss factors 0.05, 0.15 and 0.5, and the steep ones above
_LOSS_POWER = (0.03, 0.1, 0.3, 0.6)
# logarithms of omega tau of loss factors 0.1, 0.25 and 0.8
_LOSS_TIME = (15.0, 6.0, 2.0)
_KNEE = (0.1, 0.3, 1.0, 3.0)
_PRELOAD = (0.05, 0.2, 0.45, 0.7)
_PLAY = (0.05, 0.2, 0.45)
_CREEP = (0.01, 0.03, 0.1, 0.3)
_GROWTH = (3.0, 30.0)


def extended_shapes(physics: Physics, amplitude: float, band: tuple[float, float], speed: float) -> list[Shape]:
    """As `shapes`, for the laws named in EXTENDED_STARTS: largest displacement `amplitude`, `band` in rad/s, largest
    velocity `speed`."""
    middle = (band[0] * band[1]) ** 0.5
    one = partial(single, physics)
    match physics.law:
        case "generalised_maxwell" | "generalised_maxwell_3":
            taus = [f / middle for f in (0.1, 0.3, 1.0, 3.0, 10.0)]
            n = (len(physics.parameters) - 1) // 2
            return [_maxwell(physics, pick) for pick in combinations(taus, n)]
        case "fractional":
            return [
                Shape(
                    physics,
                    ({"k": 1.0, "c": 0.0, "alpha": power}, {"k": 0.0, "c": middle**-power, "alpha": power}),
                    (("k",), ("c",)),
                )
                for power in _POWER
            ]
        case "springpot":
            return [one({"c": middle**-power, "alpha": power}, "c") for power in _LOSS_POWER]
        case "box_spectrum":
            return [one({"c": 1 / at, "tau": exp(at) / middle}, "c") for at in _LOSS_TIME]
        case "saturating_stiffness":
            return [one({"k": 1.0, "d0": knee * amplitude}, "k") for knee in _KNEE]
        case "preloaded_contact":
            grid = product((1.0, -1.0), _PRELOAD)
            return [one({"k": 1.0, "preload": p * amplitude, "side": side}, "k", "preload") for side, p in grid]
        case "hertz_contact":
            grid = product((1.0, -1.0, 2.0), (0.0, *_GAP))
            return [one({"k": 1.0, "gap": gap * amplitude, "sides": sides}, "k") for sides, gap in grid]
        case "play_friction":
            grid = product(_SLIP, _PLAY)
            return [one({"f": slip * amplitude, "kt": 1.0, "gap": gap * amplitude}, "f", "kt") for slip, gap in grid]
        case "sliding_friction":
            return [one({"f": 1.0, "v0": creep * speed}, "f") for creep in _CREEP]
        case "displacement_damping":
            return [one({"c": 1.0, "beta": growth / amplitude**2}, "c") for growth in _GROWTH]
        case "iwan":
            return [linear_in(physics, {"span": span * amplitude}) for span in (0.5, 1.0)]
        case "free_form":
            return [linear_in(physics, {"d_span": amplitude, "v_span": speed})]
    return []


def _maxwell(physics: Physics, taus: tuple[float, ...]) -> Shape:
    return linear_in(physics, {f"tau{i + 1}": tau for i, tau in enumerate(taus)})
