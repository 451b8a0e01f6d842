"""Nested laws: one that does what a simpler law does over the lines where the joint moves takes the simpler name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from femend import _core
from femend.diagnose.fitting.candidates import SPRINGS, Candidate
from femend.diagnose.locating.recovered import Recovered
from femend.diagnose.settings import Settings
from femend.physics import FitCoordinates, physics, simpler

__all__ = ["SHARP", "collapsed", "nearest_size", "without_gap"]

# exponent n from which the knee of a Bouc-Wen loop is as sharp as that of friction with a spring before it
SHARP = 8.0
# share of the largest motion below which the yield displacement of a loop cannot be seen: its knee, some three of them
# long, is then within a tenth of the motion, and the loop a rectangle whatever the knee
NARROW = 0.03


def collapsed(candidate: Candidate, recovered: Recovered | None, settings: Settings) -> Candidate:
    """The linear law as the simplest one whose force at the joint is the same but for `settings.same_law`, a Bouc-Wen
    loop with a knee too sharp or too short to be seen as friction, a stop without a gap as a stiffness of two sides;
    another nonlinear law or a place without recovered motion stays as it is."""
    amplitude = 0.0 if recovered is None else max(float(np.abs(d).max(initial=0.0)) for d in recovered.d)
    if candidate.name == "bouc_wen" and (candidate.values["n"] > SHARP or _yield(candidate) < NARROW * amplitude):
        return _friction(candidate)
    if candidate.name == "clearance" and recovered is not None:
        return _bilinear(candidate, amplitude)
    if candidate.physics is None or candidate.joint is None or candidate.nonlinear or recovered is None:
        return candidate
    kind = candidate.joint.place.kind
    law = candidate.physics.law or candidate.physics.name
    for name, reported in (
        ("support_stiffness", SPRINGS.get(kind, "support_stiffness")),
        ("viscous_damper", "viscous_damper"),
        ("added_mass", "added_mass"),
    ):
        if name == law:
            return candidate
        value = _same_force(recovered, law, dict(candidate.values), name, settings)
        if value is not None and (name != "added_mass" or kind == "ground"):
            entry = physics(name)
            own = {entry.parameter_names[0]: value}
            return replace(candidate, physics=entry, name=reported, values=own, x=np.log([value]), n_law=1)
    return candidate


def _yield(candidate: Candidate) -> float:
    """Yield displacement of a Bouc-Wen loop, (beta + gamma)^(-1/n)."""
    law = candidate.values
    return float((law["beta"] + law["gamma"]) ** (-1.0 / law["n"]))


def _friction(candidate: Candidate) -> Candidate:
    """A Bouc-Wen loop as friction behind a spring beside the companion: it slips at the yield force
    (1 - alpha) k (beta + gamma)^(-1/n), and what is left after yield is a spring of its own."""
    law = candidate.values
    moving = (1.0 - law["alpha"]) * law["k"]
    slip = moving * _yield(candidate)
    k = candidate.k + law["alpha"] * law["k"]
    return _as(candidate, "coulomb_friction", {"f": slip, "kt": moving}, k)


def _bilinear(candidate: Candidate, amplitude: float) -> Candidate:
    """A stop on one side as a bilinear stiffness where its gap is nothing beside the `amplitude` of the motion."""
    found = simpler(physics("clearance"), candidate.values, amplitude=amplitude, band=(1.0, 1.0))
    if found is None or found[0] != "bilinear_stiffness":
        return candidate
    return _as(candidate, *found, candidate.k)


def without_gap(candidate: Candidate) -> Candidate | None:
    """A stop on one side with its gap closed, which is a bilinear stiffness; None for other laws."""
    if candidate.name != "clearance":
        return None
    closed = _bilinear(candidate, np.inf)
    return None if closed is candidate else closed


def _as(candidate: Candidate, name: str, values: Mapping[str, float], k: float) -> Candidate:
    """A nonlinear law told as another one that does the same, beside a companion of stiffness `k`."""
    entry = physics(name)
    coordinates = FitCoordinates(entry, values)
    companion = [k / candidate.extra["k_scale"], candidate.c / candidate.extra["c_scale"]]
    return replace(
        candidate,
        physics=entry,
        name=entry.name,
        values=dict(coordinates.values),
        x=np.concatenate([coordinates.start(), companion]),
        n_law=len(coordinates.free) + 2,
        k=k,
        covariance=None,
        coordinates=coordinates,
    )


def nearest_size(recovered: Recovered, law: str, values: dict[str, float], simple: str) -> tuple[float, float]:
    """Size of the `simple` law whose force is most like that of a `law` over all lines, and the share of that one's
    power that it leaves."""
    top = bottom = power = 0.0
    unit = {physics(simple).parameter_names[0]: 1.0}
    for s, D, weight in zip(recovered.s, recovered.D, recovered.weight, strict=True):
        kappa = _core.law_dynamic_stiffness(law, values, s)[0][:, None]
        shape = _core.law_dynamic_stiffness(simple, unit, s)[0][:, None]
        seen = weight * np.abs(D) ** 2
        top += float((seen * np.real(shape.conj() * kappa)).sum())
        bottom += float((seen * np.abs(shape) ** 2).sum())
        power += float((seen * np.abs(kappa) ** 2).sum())
    if bottom * power == 0.0:
        return 0.0, 1.0  # nothing moves there
    return top / bottom, 1.0 - top**2 / (bottom * power)


def _same_force(
    recovered: Recovered, law: str, values: dict[str, float], simple: str, settings: Settings
) -> float | None:
    """Size of the simple law whose force is most like the law's over all lines; None where it differs too much."""
    value, left = nearest_size(recovered, law, values, simple)
    return value if value > 0 and left < settings.same_law**2 else None
