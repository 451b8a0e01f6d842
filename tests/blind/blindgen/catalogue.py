"""All effects of the catalogue by their names."""

from __future__ import annotations

from collections.abc import Callable

from .areas import bedding, weak_patch
from .effects import (
    Effect,
    Scene,
    added_mass,
    base_motion,
    bilinear_stiffness,
    bouc_wen,
    clearance,
    compliant_support,
    coulomb_friction,
    cubic_stiffness,
    joint_stiffness,
    load_misplaced,
    quadratic_damping,
    structural_damping,
    support_stiffness,
    tuned_absorber,
    unmeasured_force,
    viscoelastic,
    viscous_damper,
)

__all__ = ["CATALOGUE"]

CATALOGUE: dict[str, Callable[[Scene], Effect]] = {
    f.__name__: f
    for f in (
        support_stiffness,
        viscous_damper,
        viscoelastic,
        structural_damping,
        tuned_absorber,
        quadratic_damping,
        cubic_stiffness,
        clearance,
        bilinear_stiffness,
        coulomb_friction,
        bouc_wen,
        added_mass,
        joint_stiffness,
        weak_patch,
        bedding,
        compliant_support,
        base_motion,
        unmeasured_force,
        load_misplaced,
    )
}
