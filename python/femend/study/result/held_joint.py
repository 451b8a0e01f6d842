"""The spring that holds a joint beside the law that was found there.

A nonlinear law is fitted beside a free linear spring. At most places that makes up for what the model's stiffness is
off by; at a joint, which the model has rigid and the law opens, it is what connects the two sides, and a law such as
k3 d³ alone would be no connection at small motion.
"""

from __future__ import annotations

from femend.diagnose import Diagnosis
from femend.numerals import plain
from femend.physics import physics, with_companion
from femend.units import unit_system

__all__ = ["held_joint"]


def held_joint(diagnosis: Diagnosis) -> str:
    """What has to be said of the linear spring beside a nonlinear law at an opened joint; nothing where the law's own
    parameters tell it."""
    best = diagnosis.best
    if best is None or best.physics is None or best.joint is None or not best.nonlinear or best.k <= 0:
        return ""
    place = best.joint.place
    if place.release is None or with_companion(best.physics, best.values, best.k) != dict(best.values):
        return ""
    (stiffness,) = physics("support_stiffness").parameters
    unit = stiffness.unit(unit_system(diagnosis.reduced.model.units), rotational=place.direction.startswith("R"))
    return (
        f"the joint, which the model has rigid, is held by a linear spring of {plain(best.k, 3)} {unit} beside the "
        "law: it is in the final model and its predictions, and belongs into a model that is made with the law"
    )
