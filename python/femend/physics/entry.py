"""What the catalogue holds: a physics with its family, its law and its parameters with units."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from femend.units import UnitSystem

__all__ = ["FAMILIES", "Domain", "Kind", "Parameter", "Physics"]

Domain = Literal["real", "signed", "positive", "fraction", "above_one", "choice"]
Kind = Literal["linear", "nonlinear", "other"]

FAMILIES = ("stiffness", "inertia", "damping", "nonlinear elastic", "hysteretic", "speed", "load")


@dataclass(frozen=True, slots=True)
class Parameter:
    """A parameter of a law.

    `dims` are exponents of force, displacement and time, so that the unit follows for translations and rotations;
    `domain` tells how it is fitted: "positive" by its logarithm, "real" by that of its size (its sign is kept),
    "signed" as it is, "fraction" and "above_one" by maps onto their intervals, "choice" not at all. `shape` marks
    parameters that do not multiply the force; `exponent` names the parameter to whose power time (or else displacement)
    stands in the unit, `typical` is an ordinary size of a parameter of a law of one's own.
    """

    name: str
    dims: tuple[float, float, float]
    domain: Domain = "positive"
    shape: bool = False
    exponent: str = ""
    typical: float = float("nan")

    def unit(self, system: UnitSystem, *, rotational: bool = False) -> str:
        """How the unit is written in a unit system, such as ``N/m``; for a rotation with moments and radians."""
        force, displacement, time = self.dims
        if (force, displacement, time) == (1, -1, 2):
            return system.text("inertia" if rotational else "mass")
        length = system.length_text
        base = [(f"{system.force_text}*{length}" if rotational else system.force_text, force)]
        base += [("s", time), ("rad" if rotational else length, displacement)]
        if self.exponent:
            base = [
                (f"{text}^{self.exponent}" if i == (1 if time else 2) else text, n) for i, (text, n) in enumerate(base)
            ]
        above = "*".join(_power(text, n) for text, n in base if n > 0) or "1"
        below = "*".join(_power(text, -n) for text, n in base if n < 0)
        return f"{above}/{below}" if below else above

    def si_factor(self, system: UnitSystem, *, rotational: bool = False) -> float:
        """SI value of one unit of the parameter in a system (with an `exponent`, of that unit to the power one)."""
        force, displacement, time = self.dims
        factor = system.factor("moment" if rotational else "force") ** force * system.factor("time") ** time
        return float(factor if rotational else factor * system.factor("length") ** displacement)


def _power(text: str, n: float) -> str:
    return text if n == 1 else f"{text}^{n:g}"


@dataclass(frozen=True, slots=True)
class Physics:
    """A name of missing physics.

    `law` is the core's law, None where the physics is no force of a joint of its own motion; `kind` is "linear" (has a
    dynamic stiffness), "nonlinear" (needs a simulation) or "other"; `simpler` are the laws it contains as limits.
    `extended` laws are tried only where they are asked for. The contract has fixed names: an extended law is told by
    `reported`, the name whose physics it is, or (`nearest`) the one of its family that comes nearest; a free-form
    surrogate has none. `scales_together`: the parameters that multiply the force do so only all at once.
    """

    name: str
    family: str
    left_out: str
    law: str | None
    kind: Kind
    parameters: tuple[Parameter, ...] = ()
    simpler: tuple[str, ...] = ()
    companion: bool = False
    extended: bool = False
    contract: str | None = None
    nearest: bool = False
    scales_together: bool = False

    @property
    def reported(self) -> str:
        """Name in result.json: its own, or that of the contract it stands under; "" for a surrogate."""
        return self.name if self.contract is None else self.contract

    @property
    def signed(self) -> bool:
        """Whether a parameter that multiplies the force may be negative."""
        return any(p.domain in ("real", "signed") and not p.shape for p in self.parameters)

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names in the order in which the core takes them."""
        return tuple(p.name for p in self.parameters)

    def values_at(self, x: NDArray[np.float64]) -> dict[str, float]:
        """Values of the parameters, by name, at their logarithms `x` (n_parameters,)."""
        return dict(zip(self.parameter_names, np.exp(x).tolist(), strict=True))
