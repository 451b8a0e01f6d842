"""When a law beyond the contract's names has collapsed to a simpler one."""

from __future__ import annotations

from collections.abc import Mapping
from math import log

from femend.physics.entry import Physics

__all__ = ["IWAN_GRID", "simpler_extended"]

# yield displacements of the Iwan surrogate as shares of its span, as in the core
IWAN_GRID = (0.03125, 0.0625, 0.125, 0.25, 0.5, 1.0)
# omega tau above which a Maxwell branch is a spring to a few per cent; shares below which a part does not matter
_ELASTIC, _NOTHING = 8.0, 1e-3
# rates closer than this cannot be told apart; distance from 0 and 1 at which a power is a spring or a dashpot
_SAME_RATE, _END = 1.15, 0.03
# omega tau below which rates are so fast that they make a dashpot
_VISCOUS = 0.15
# times the highest speed there is from which friction does nothing but creep
_CREEPS = 3.0
# relative change of slope over the motion below which a law is linear in noisy records
_LINEAR = 0.02


def simpler_extended(
    physics: Physics, values: Mapping[str, float], *, amplitude: float, band: tuple[float, float]
) -> tuple[str, dict[str, float]] | None:
    """As `simpler`, for the laws beyond the contract's names: (law, parameters) at `amplitude` and `band`, or None."""
    p = values
    match physics.law:
        case "generalised_maxwell" | "generalised_maxwell_3":
            return _maxwell(p, band)
        case "fractional":
            return _fractional(p, band)
        case "springpot":
            return _fractional({"k": 0.0, **p}, band)
        case "box_spectrum":
            return _box_spectrum(p, band)
        case "saturating_stiffness" if amplitude < _LINEAR * p["d0"]:
            return "support_stiffness", {"k": p["k"]}
        case "preloaded_contact" if p["preload"] >= p["k"] * amplitude:
            return "support_stiffness", {"k": p["k"]}
        case "preloaded_contact" if p["preload"] < _NOTHING * p["k"] * amplitude:
            sides = ("k_plus", "k_minus") if p["side"] == 1 else ("k_minus", "k_plus")
            return "bilinear_stiffness", {sides[0]: p["k"], sides[1]: 0.0}
        case "play_friction" if p["gap"] < _NOTHING * amplitude:
            return "coulomb_friction", {"f": p["f"], "kt": p["kt"]}
        case "play_friction" if p["f"] > p["kt"] * max(amplitude - p["gap"], 0.0):
            return "clearance", {"k": p["kt"], "gap": p["gap"], "sides": 2.0}
        case "sliding_friction" if p["v0"] > _CREEPS * amplitude * band[1]:
            return "viscous_damper", {"c": p["f"] / p["v0"]}
        case "displacement_damping" if p["beta"] * amplitude**2 < _LINEAR:
            return "viscous_damper", {"c": p["c"]}
        case "iwan":
            return _iwan(p, amplitude)
    return None


def _maxwell(p: Mapping[str, float], band: tuple[float, float]) -> tuple[str, dict[str, float]] | None:
    """Branches of no stiffness go, frozen ones join the spring, two of one rate become one."""
    n = sum(name.startswith("tau") for name in p)
    k0, branches = p["k0"], sorted((p[f"tau{i}"], p[f"k{i}"]) for i in range(1, n + 1))
    total = abs(k0) + sum(k for _, k in branches)
    kept: list[tuple[float, float]] = []
    for tau, k in branches:
        if k < _NOTHING * total:
            continue
        if band[0] * tau > _ELASTIC:
            k0 += k
        elif kept and tau < _SAME_RATE * kept[-1][0]:
            kept[-1] = (kept[-1][0], kept[-1][1] + k)
        else:
            kept.append((tau, k))
    if len(kept) == n:
        return None
    if not kept:
        return "support_stiffness", {"k": k0}
    if len(kept) == 1:
        return "viscoelastic", {"k0": k0, "k1": kept[0][1], "tau": kept[0][0]}
    (tau1, k1), (tau2, k2) = kept
    return "generalised_maxwell", {"k0": k0, "k1": k1, "tau1": tau1, "k2": k2, "tau2": tau2}


def _fractional(p: Mapping[str, float], band: tuple[float, float]) -> tuple[str, dict[str, float]] | None:
    middle = (band[0] * band[1]) ** 0.5
    size = p["c"] * middle ** p["alpha"]
    if size < _NOTHING * abs(p["k"]) or p["alpha"] < _END:
        return "support_stiffness", {"k": p["k"] + (size if p["alpha"] < _END else 0.0)}
    if p["alpha"] > 1 - _END and abs(p["k"]) < 0.15 * size:
        return "viscous_damper", {"c": size / middle}
    return None


def _box_spectrum(p: Mapping[str, float], band: tuple[float, float]) -> tuple[str, dict[str, float]] | None:
    middle = (band[0] * band[1]) ** 0.5
    if band[1] * p["tau"] < _VISCOUS:
        return "viscous_damper", {"c": p["c"] * p["tau"]}
    at = log(max(middle * p["tau"], 1.0))
    return ("support_stiffness", {"k": p["c"] * at}) if at > 1 / _END else None


def _iwan(p: Mapping[str, float], amplitude: float) -> tuple[str, dict[str, float]] | None:
    stiffness = [p[f"k{i}"] for i in range(1, 7)]
    total = sum(stiffness)
    moving = sum(k for k, share in zip(stiffness, IWAN_GRID, strict=True) if share * p["span"] < amplitude)
    if moving < _NOTHING * total:
        return "support_stiffness", {"k": total}
    largest = max(range(6), key=stiffness.__getitem__)
    if stiffness[largest] > (1 - _LINEAR) * total:
        kt = stiffness[largest]
        return "coulomb_friction", {"f": kt * IWAN_GRID[largest] * p["span"], "kt": kt}
    return None
