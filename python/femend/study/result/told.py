"""Laws as they are told: with the parameters that the contract has for their name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from femend.diagnose import Diagnosis
from femend.diagnose.fitting.candidates import Candidate
from femend.diagnose.locating.equivalent import middle
from femend.model.places.place import AXES
from femend.physics import Parameter, physics, with_companion
from femend.physics.causal import CAUSAL, structural, structural_jacobian

__all__ = ["told"]

FloatArray = NDArray[np.float64]


def told(diagnosis: Diagnosis, best: Candidate) -> tuple[Sequence[Parameter], dict[str, float], FloatArray | None]:
    """Parameters a law is told by, their values, and how these change with the law's own over their logarithms (n, m);
    None for the last where they are the law's own.

    A springpot and a box of rates are told as structural damping in the middle of the band, what a model loses at a
    support by the spring on which it stands, the spring under a clamp as k1 to k6 by the component it acts in.
    """
    assert best.physics is not None
    values = with_companion(best.physics, best.values, best.k) if best.nonlinear else dict(best.values)
    if best.physics.law in CAUSAL:
        omega = middle(diagnosis.problem)
        return physics("structural_damping").parameters, structural(values, omega), structural_jacobian(values, omega)
    if best.physics.law == "released_support" and best.joint is not None:
        place = best.joint.place
        factor = 1.0 if place.parameter is None else float(np.exp(best.p[place.parameter]))
        S = factor * place.support
        whole = S**2 / values["g"]
        return physics("compliant_support").parameters, {"k": max(whole - S, 0.0)}, np.array([[-whole]])
    clamp = best.joint.place if best.joint is not None and best.joint.place.kind == "clamp" else None
    if best.name == "compliant_support" and clamp is not None and clamp.direction in AXES:
        (k,) = best.physics.parameters
        name = f"k{AXES.index(clamp.direction) + 1}"
        return (replace(k, name=name),), {name: values[k.name]}, None
    return best.physics.parameters, values, None
