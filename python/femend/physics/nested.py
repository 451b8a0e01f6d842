"""Laws inside laws: when a fitted law is only a simpler one, and how a linear companion is told."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from femend.physics.entry import Physics
from femend.physics.nested_extended import simpler_extended

__all__ = ["companion_jacobian", "simpler", "with_companion"]

# below and above these omega tau a Zener solid is a dashpot and a spring to a few per cent
_VISCOUS, _ELASTIC = 0.15, 8.0
# a member whose two sides differ by less than this cannot be told from a spring in noisy records
_EQUAL = 0.1


def simpler(
    physics: Physics, values: Mapping[str, float], *, amplitude: float, band: tuple[float, float]
) -> tuple[str, dict[str, float]] | None:
    """The simpler law a fitted one has collapsed to, with its parameters, or None where it is itself.

    `amplitude` is the largest displacement of the coordinate, `band` the circular frequencies (rad/s) of the fit.

    >>> from femend.physics import physics
    >>> zener = {"k0": 0.0, "k1": 2e5, "tau": 1e-4}
    >>> simpler(physics("viscoelastic"), zener, amplitude=1e-3, band=(50, 400))
    ('viscous_damper', {'c': 20.0})
    """
    low, high = band
    p = values
    match physics.law:
        case "viscoelastic":
            # the whole band has to lie on one side of the relaxation
            if high * p["tau"] < _VISCOUS and abs(p["k0"]) < _VISCOUS * high * p["tau"] * p["k1"]:
                return "viscous_damper", {"c": p["k1"] * p["tau"]}
            if low * p["tau"] > _ELASTIC or p["k1"] < 1e-3 * abs(p["k0"]):
                k1 = p["k1"] if low * p["tau"] > _ELASTIC else 0.0
                return "support_stiffness", {"k": p["k0"] + k1}
        case "tuned_absorber":
            tuned = (p["k"] / p["m"]) ** 0.5
            if tuned > 3 * high:
                return "added_mass", {"m": p["m"]}
            if tuned < low / 3:
                return "support_stiffness", {"k": p["k"]}
        case "structural_damping" if p["eta"] < 1e-3:
            return "support_stiffness", {"k": p["k"]}
        case "clearance" if p["gap"] < 1e-3 * amplitude:
            if p["sides"] == 2:
                return "support_stiffness", {"k": p["k"]}
            sides = ("k_plus", "k_minus") if p["sides"] == 1 else ("k_minus", "k_plus")
            return "bilinear_stiffness", {sides[0]: p["k"], sides[1]: 0.0}
        case "bilinear_stiffness" if abs(p["k_plus"] - p["k_minus"]) < _EQUAL * abs(p["k_plus"] + p["k_minus"]) / 2:
            return "support_stiffness", {"k": (p["k_plus"] + p["k_minus"]) / 2}
        case "coulomb_friction" if p["f"] > p["kt"] * amplitude:
            return "support_stiffness", {"k": p["kt"]}
        case "bouc_wen" if (p["beta"] + p["gamma"]) * (2 * amplitude) ** p["n"] < 1e-2:
            return "support_stiffness", {"k": p["k"]}
        case _ if physics.extended:
            return simpler_extended(physics, values, amplitude=amplitude, band=band)
    return None


def with_companion(physics: Physics, values: Mapping[str, float], k: float) -> dict[str, float]:
    """A law's parameters with the linear stiffness `k` of its companion told as part of it, where the law has room.

    Bouc-Wen fitted with alpha = 0 beside a spring k is Bouc-Wen with total stiffness and alpha = share of the spring;
    a bilinear stiffness takes k on both sides, a Zener solid on k0. Others come back as they are, and so does Bouc-Wen
    beside a negative k, which no alpha in [0, 1] can tell.

    >>> from femend.physics import physics
    >>> law = {"k": 3e4, "alpha": 0.0, "n": 1.5, "beta": 1e4, "gamma": 5e3}
    >>> with_companion(physics("bouc_wen"), law, 1e4)["alpha"]
    0.25
    """
    out = {name: float(value) for name, value in values.items()}
    if physics.law == "bouc_wen" and k > 0:
        linear = out["alpha"] * out["k"] + k
        out["k"] += k
        out["alpha"] = linear / out["k"]
    elif physics.law == "bilinear_stiffness":
        out["k_plus"] += k
        out["k_minus"] += k
    elif physics.law == "viscoelastic":
        out["k0"] += k
    return out


def companion_jacobian(physics: Physics, values: Mapping[str, float], k: float) -> NDArray[np.float64]:
    """What `with_companion` gives changes with the law's own `values` and the companion's `k`, (n, n + 1) in the order
    of the law's parameters, `k` last."""
    names = physics.parameter_names
    J = np.eye(len(names), len(names) + 1)
    if physics.law == "bouc_wen" and k > 0:
        told = with_companion(physics, values, k)
        of_k, of_alpha = names.index("k"), names.index("alpha")
        J[of_k, -1] = 1.0
        J[of_alpha, of_alpha] = values["k"] / told["k"]
        J[of_alpha, of_k] = (values["alpha"] - told["alpha"]) / told["k"]
        J[of_alpha, -1] = (1.0 - told["alpha"]) / told["k"]
    elif physics.law == "bilinear_stiffness":
        J[[names.index("k_plus"), names.index("k_minus")], -1] = 1.0
    elif physics.law == "viscoelastic":
        J[names.index("k0"), -1] = 1.0
    return J
