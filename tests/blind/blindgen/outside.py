"""Laws that the package's catalogue does not have: each with its class in words and the families that say as much."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from . import laws
from .effects import Effect, Place, Scene, local, somewhere


def outside(law: str) -> Callable[[Scene], Effect]:
    """Draw of a law that the package's catalogue does not have; `extra` says of which class it is."""

    def draw(sc: Scene) -> Effect:
        p = somewhere(sc)
        code, span, par = OUTSIDE[law].shape(sc.rng, p)

        def values(x: float) -> dict[str, Any]:
            return {f"p{i}": float(q) for i, q in enumerate(par(x))}

        e = local("outside", p, span, code, par, values, over=16)
        e.extra = {"law": law, "class": OUTSIDE[law].kind, "families": OUTSIDE[law].families}
        return e

    return draw


Shape = tuple[int, tuple[float, float], Callable[[float], list[float]]]


@dataclass(frozen=True)
class Outside:
    """A law without a name: its class in words, the families of the catalogue that say as much, its shape."""

    kind: str
    families: tuple[str, ...]
    shape: Callable[[np.random.Generator, Place], Shape]


def tanh_loop(rng: np.random.Generator, p: Place) -> Shape:
    """k d0 tanh(d / d0) beside a smooth slider that yields at a third of that or less."""
    d0, limit, ratio = rng.uniform(0.4, 1.0) * p.d, rng.uniform(0.1, 0.3) * p.d, rng.uniform(0.5, 1.5)
    return laws.TANH_LOOP, (0.02, 15.0), lambda x: [x * p.k, d0, ratio * x * p.k, limit]


def odd_damping(rng: np.random.Generator, p: Place) -> Shape:
    """c (|d| / d0)^p v with p = 1 or 3."""
    power, c = float(rng.choice([1.0, 3.0])), p.k * p.d / p.v
    return laws.ODD_DAMPING, (2e-3, 10.0), lambda x: [x * c, p.d, power, 0.01 * p.d]


def quintic(rng: np.random.Generator, p: Place) -> Shape:
    """-k3 d^3 + k5 d^5: softens, and hardens beyond two to three times the RMS motion."""
    turn = rng.uniform(1.6, 2.4) * p.d
    return laws.QUINTIC, (2e-3, 2.0), lambda x: [x * p.k / p.d**2, x * p.k / p.d**2 / turn**2]


def power_damping(rng: np.random.Generator, p: Place) -> Shape:
    """c v |v|^0.5 that grows with displacement too."""
    d0, c = rng.uniform(0.3, 1.0) * p.d, p.k * p.d / p.v**1.5
    return laws.POWER_DAMPING, (1e-3, 10.0), lambda x: [x * c, 1e-3 * p.v, d0]


def exponential(rng: np.random.Generator, p: Place) -> Shape:
    """k d0 (exp(d / d0) - 1)."""
    d0 = rng.uniform(0.8, 1.6) * p.d * float(rng.choice([-1.0, 1.0]))
    return laws.EXPONENTIAL, (5e-3, 10.0), lambda x: [x * p.k, d0]


def wedge(_rng: np.random.Generator, p: Place) -> Shape:
    """Friction under a normal force that grows with displacement: k |d| sign v."""
    return laws.WEDGE, (5e-3, 3.0), lambda x: [x * p.k, 0.02 * p.v, 0.01 * p.d]


OUTSIDE: dict[str, Outside] = {
    "tanh_loop": Outside("saturating, hysteretic", ("hysteretic", "nonlinear elastic"), tanh_loop),
    "odd_damping": Outside("dissipative growing with displacement", ("damping",), odd_damping),
    "quintic": Outside("softening, then hardening", ("nonlinear elastic",), quintic),
    "power_damping": Outside("dissipative growing with level", ("damping",), power_damping),
    "exponential": Outside("asymmetric, hardening on one side", ("nonlinear elastic",), exponential),
    "wedge": Outside("hysteretic, friction growing with displacement", ("hysteretic", "damping"), wedge),
}
