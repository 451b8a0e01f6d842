"""Which effect stands in which case: shuffled blocks, so that any prefix of a set is nearly balanced."""

from __future__ import annotations

import numpy as np

from .outside import OUTSIDE

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
# what FRFs, which average over levels, are of
LINEAR = [*EFFECTS[: EFFECTS.index("quadratic_damping")], "compliant_support"]
KINDS = ("one", "linear", "outside", "two")
LONE = {
    "plate": ("joint_stiffness",),
    "twin plates": ("joint_stiffness",),
    "solid": ("joint_stiffness", "compliant_support"),
}


def shown(seed: int, index: int, kind: str) -> list[str]:
    """The sixteen effects of a block. kind: "one" (catalogue), "linear" (of it), "outside" (laws it does not have) or
    "two" at once."""
    rng = np.random.default_rng([seed, 76, index])
    if kind == "linear":
        return 2 * LINEAR
    if kind == "outside":
        names = list(OUTSIDE)
        return ["outside:" + names[(16 * index + k) % len(names)] for k in range(16)]
    if kind == "two":
        pairs = [rng.permutation(EFFECTS)[:2] for _ in range(16)]
        return ["two:" + "+".join(sorted(map(str, p))) for p in pairs]
    return EFFECTS + [RARE[(seed + 2 * index + k) % 3] for k in range(2)]


def block(seed: int, index: int, controls: float = 1 / 3, kind: str = "one") -> list[str]:
    """Labels of one block, shuffled: sixteen effects and as many controls ("none:<sort>") as make up their share, or
    sixteen controls for a share of 1.
    """
    rng = np.random.default_rng([seed, 77, index])
    n = 16 if controls >= 1 else round(16 * controls / (1 - controls))
    labels = ["none:" + CONTROLS[(index * n + k) % 3] for k in range(n)]
    labels += [] if controls >= 1 else shown(seed, index, kind)
    return [labels[k] for k in rng.permutation(len(labels))]


def label(seed: int, case: int, controls: float = 1 / 3, kind: str = "one") -> str:
    """Label of case number `case` (from 0)."""
    size = len(block(seed, 0, controls, kind))
    return block(seed, case // size, controls, kind)[case % size]


def suited(label: str, family: str, unmeasured: bool = False) -> str:
    """Plates and solids have no members, and solids no single clamp: those slots go to `support_stiffness`. Where no
    force is recorded it cannot be misplaced, nor told from another one: those slots go to `base_motion`."""
    if unmeasured and label in ("load_misplaced", "unmeasured_force"):
        return "base_motion"
    without = LONE.get(family, ())
    if not label.startswith("two:"):
        return "support_stiffness" if label in without else label
    names = ["support_stiffness" if n in without else n for n in label.removeprefix("two:").split("+")]
    if names[0] == names[1]:
        names[1] = "added_mass"
    return "two:" + "+".join(sorted(names))


def family(seed: int, case: int, families: list[str]) -> str:
    """Structure families in turns, from a start that the seed gives."""
    return families[(seed + case) % len(families)]
