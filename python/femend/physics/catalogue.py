"""Every name of missing physics: its family, its parameters and the local law that stands for it in the core."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from femend.errors import LawParameterError
from femend.units import UnitSystem

__all__ = ["CATALOGUE", "FAMILIES", "Domain", "Parameter", "Physics", "catalogue", "physics"]

Domain = Literal["real", "positive", "fraction", "above_one", "choice"]
Kind = Literal["linear", "nonlinear", "other"]

FAMILIES = ("stiffness", "inertia", "damping", "nonlinear elastic", "hysteretic", "speed", "load")


@dataclass(frozen=True, slots=True)
class Parameter:
    """A parameter of a law.

    `dims` are exponents of force, displacement and time, so that the unit follows for translations and rotations;
    `domain` tells how it is fitted: "positive" by its logarithm, "real" as it is (its sign is kept where it starts with
    one), "fraction" and "above_one" by maps onto their intervals, "choice" not at all. `shape` marks parameters that do
    not multiply the force.
    """

    name: str
    dims: tuple[int, int, int]
    domain: Domain = "positive"
    shape: bool = False

    def unit(self, system: UnitSystem, *, rotational: bool = False) -> str:
        """How the unit is written in a unit system, such as ``N/m``; for a rotation with moments and radians."""
        force, displacement, time = self.dims
        if (force, displacement, time) == (1, -1, 2):
            return system.text("inertia" if rotational else "mass")
        length = system.length_text
        base = [(f"{system.force_text}*{length}" if rotational else system.force_text, force)]
        base += [("s", time), ("rad" if rotational else length, displacement)]
        above = "*".join(_power(text, n) for text, n in base if n > 0) or "1"
        below = "*".join(_power(text, -n) for text, n in base if n < 0)
        text = f"{above}/{below}" if below else above
        return f"1/{'rad' if rotational else length}^n" if self.name in ("beta", "gamma") else text

    def si_factor(self, system: UnitSystem, *, rotational: bool = False) -> float:
        """SI value of one unit of the parameter in a system (of `beta` and `gamma`: to be raised to the power n)."""
        force, displacement, time = self.dims
        factor = system.factor("moment" if rotational else "force") ** force * system.factor("time") ** time
        return float(factor if rotational else factor * system.factor("length") ** displacement)


def _power(text: str, n: int) -> str:
    return text if n == 1 else f"{text}^{n}"


@dataclass(frozen=True, slots=True)
class Physics:
    """A name of missing physics.

    `law` is the core's law, None where the physics is no force of a joint of its own motion; `kind` is "linear" (has a
    dynamic stiffness), "nonlinear" (needs a simulation) or "other"; `simpler` are the laws it contains as limits.
    """

    name: str
    family: str
    left_out: str
    law: str | None
    kind: Kind
    parameters: tuple[Parameter, ...] = ()
    simpler: tuple[str, ...] = ()
    companion: bool = False

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names in the order in which the core takes them."""
        return tuple(p.name for p in self.parameters)


K, C, M = (1, -1, 0), (1, -1, 1), (1, -1, 2)
_ONE = (0, 0, 0)


def _p(name: str, dims: tuple[int, int, int], domain: Domain = "positive", *, shape: bool = False) -> Parameter:
    return Parameter(name, dims, domain, shape)


_ALL = (
    Physics("support_stiffness", "stiffness", "an elastic support or spring where the model has none",
            "support_stiffness", "linear", (_p("k", K, "real"),)),
    Physics("compliant_support", "stiffness", "a support modelled as fixed is elastic",
            "support_stiffness", "linear", (_p("k", K),)),
    Physics("joint_stiffness", "stiffness", "a connection modelled as rigid is flexible, or a member is weaker",
            "support_stiffness", "linear", (_p("k", K, "real"),)),
    Physics("spring_bending", "stiffness", "a spring modelled by translations alone also carries moments",
            "support_stiffness", "linear", (_p("k", K),)),
    Physics("added_mass", "inertia", "a mass that is not in the model", "added_mass", "linear", (_p("m", M, "real"),)),
    Physics("tuned_absorber", "inertia", "an attached oscillator", "tuned_absorber", "linear",
            (_p("m", M), _p("k", K), _p("c", C)), ("added_mass",)),
    Physics("viscous_damper", "damping", "a local dashpot", "viscous_damper", "linear", (_p("c", C),)),
    Physics("structural_damping", "damping", "local hysteretic loss", "structural_damping", "linear",
            (_p("k", K, "real"), _p("eta", _ONE, shape=True)), ("support_stiffness",)),
    Physics("viscoelastic", "damping", "stiffness that relaxes (Zener)", "viscoelastic", "linear",
            (_p("k0", K, "real"), _p("k1", K), _p("tau", (0, 0, 1), shape=True)),
            ("viscous_damper", "support_stiffness")),
    Physics("quadratic_damping", "damping", "a force as v*abs(v)", "quadratic_damping", "nonlinear",
            (_p("c", (1, -2, 2)),), companion=True),
    Physics("cubic_stiffness", "nonlinear elastic", "a force as x^3, either sign", "cubic_stiffness", "nonlinear",
            (_p("k3", (1, -3, 0), "real"),), companion=True),
    Physics("quadratic_stiffness", "nonlinear elastic", "a force as x^2", "quadratic_stiffness", "nonlinear",
            (_p("k2", (1, -2, 0), "real"),), companion=True),
    Physics("clearance", "nonlinear elastic", "contact after a gap, one- or two-sided", "clearance", "nonlinear",
            (_p("k", K), _p("gap", (0, 1, 0), shape=True), _p("sides", _ONE, "choice", shape=True)),
            ("bilinear_stiffness", "support_stiffness"), companion=True),
    Physics("bilinear_stiffness", "nonlinear elastic", "different stiffness in tension and compression, no gap",
            "bilinear_stiffness", "nonlinear", (_p("k_plus", K, "real"), _p("k_minus", K, "real")),
            ("support_stiffness",)),
    Physics("coulomb_friction", "hysteretic", "dry friction, elastic until slip (Jenkins)", "coulomb_friction",
            "nonlinear", (_p("f", (1, 0, 0)), _p("kt", K)), ("support_stiffness",), companion=True),
    Physics("bouc_wen", "hysteretic", "smooth hysteresis", "bouc_wen", "nonlinear",
            (_p("k", K), _p("alpha", _ONE, "fraction", shape=True), _p("n", _ONE, "above_one", shape=True),
             _p("beta", (0, -1, 0), shape=True), _p("gamma", (0, -1, 0), "real", shape=True)),
            ("support_stiffness",), companion=True),
    Physics("gyroscopic", "speed", "gyroscopic coupling of a rotor", None, "other", (_p("Ip", (1, 1, 2)),)),
    Physics("speed_stiffness", "speed", "stiffness that changes with speed", None, "other", (_p("k", K, "real"),)),
    Physics("unmeasured_force", "load", "a force nobody recorded", None, "other"),
    Physics("base_motion", "load", "the ground moves", None, "other"),
    Physics("load_misplaced", "load", "the recorded force acts elsewhere or in another direction", None, "other"),
    Physics("unbalance_law", "load", "the assumed rotating load is wrong", None, "other"),
)  # fmt: skip

CATALOGUE: dict[str, Physics] = {entry.name: entry for entry in _ALL}


def physics(name: str) -> Physics:
    """The entry of that name; raises LawParameterError with the nearest name.

    >>> physics("clearance").family
    'nonlinear elastic'
    """
    try:
        return CATALOGUE[name]
    except KeyError:
        near = difflib.get_close_matches(name, CATALOGUE, n=1, cutoff=0.0)
        hint = f"; the nearest is {near[0]!r}" if near else ""
        raise LawParameterError(f"no physics is called {name!r}{hint}", law=name) from None


def catalogue(*, kind: Kind | None = None, families: Iterable[str] | None = None) -> tuple[Physics, ...]:
    """All entries that are a local law, optionally of one kind or some families only.

    Raises LawParameterError for a family that does not exist.

    >>> [entry.name for entry in catalogue(kind="nonlinear", families=["hysteretic"])]
    ['coulomb_friction', 'bouc_wen']
    """
    wanted = set(FAMILIES if families is None else families)
    if not wanted <= set(FAMILIES):
        unknown = ", ".join(sorted(wanted - set(FAMILIES)))
        raise LawParameterError(f"no family is called {unknown}; families are {', '.join(FAMILIES)}")
    return tuple(
        entry
        for entry in _ALL
        if entry.law is not None and entry.family in wanted and (kind is None or entry.kind == kind)
    )
