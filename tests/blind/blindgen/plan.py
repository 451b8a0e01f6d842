"""Which effect stands in which case: shuffled blocks of twenty, so that any prefix of a set is nearly balanced."""

from __future__ import annotations

import numpy as np

CONTROLS = ["exact", "parameters", "model_form"]
EFFECTS = [
    "support_stiffness",
    "joint_stiffness",
    "added_mass",
    "tuned_absorber",
    "viscous_damper",
    "viscoelastic",
    "structural_damping",
    "quadratic_damping",
    "cubic_stiffness",
    "clearance",
    "bilinear_stiffness",
    "coulomb_friction",
    "bouc_wen",
    "compliant_support",
]
RARE = ["base_motion", "load_misplaced", "unmeasured_force"]
BLOCK = 20


def block(seed: int, index: int) -> list[str]:
    """Labels of one block: 5 controls ("none:<kind>"), 14 effects and one rare one, shuffled."""
    rng = np.random.default_rng([seed, 77, index])
    labels = ["none:" + CONTROLS[(index * 5 + k) % 3] for k in range(5)] + EFFECTS + [RARE[(seed + index) % 3]]
    return [labels[k] for k in rng.permutation(len(labels))]


def label(seed: int, case: int) -> str:
    """Label of case number `case` (from 0)."""
    return block(seed, case // BLOCK)[case % BLOCK]


def suited(label: str, family: str) -> str:
    """A plate has no members: its slot of `joint_stiffness` goes to `support_stiffness`."""
    return "support_stiffness" if family == "plate" and label == "joint_stiffness" else label


def family(seed: int, case: int, families: list[str]) -> str:
    """Structure family, drawn with the weights 0.4 : 0.3 : 0.3 (equal for other lists)."""
    rng = np.random.default_rng([seed, 78, case])
    p = np.array([0.4, 0.3, 0.3]) if len(families) == 3 else np.ones(len(families)) / len(families)
    return families[int(rng.choice(len(families), p=p))]
