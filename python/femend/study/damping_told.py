"""What a diagnosis makes of the damping that a deck has itself."""

from __future__ import annotations

import numpy as np

from femend.model import Model
from femend.model.parameter import is_of_damping
from femend.numerals import listed

__all__ = ["damping_told"]

# share of the loss factors that is not alike in all of the structure from which it is told
UNLIKE = 0.05


def damping_told(model: Model) -> list[str]:
    """Sentences where parameters of the `model` are of damping alone, and where loss factors of its deck are not those
    of the whole: a diagnosis keeps dashpots as they are drawn, and takes the rest of damping as ratios of modes."""
    names = [repr(p.name) for p in model.parameters if is_of_damping(p)]
    told = []
    if names:
        are = "is a parameter" if len(names) == 1 else "are parameters"
        told.append(
            f"{listed(names, 4)} {are} of damping alone: `femend diagnose` takes the deck's dashpots as they are drawn "
            "and everything else as damping ratios of modes, so that the factor stays 1; `femend update` fits it to "
            "FRFs or damping ratios"
        )
    if _local_loss(model):
        told.append(
            "the deck has loss factors (GE) that are not those of the whole structure: `femend diagnose` takes them as "
            "damping ratios of modes, and does not see that they couple modes; give springs that damp much a B of PBUSH"
        )
    return told


def _local_loss(model: Model) -> bool:
    """Whether structural damping of the deck is anything but one loss factor of all its stiffness."""
    _, _, k, _, _, h = model.fe.assemble()
    if not np.any(h):
        return False
    eta = float(h @ k) / float(k @ k)
    return bool(np.linalg.norm(h - eta * k) > UNLIKE * np.linalg.norm(h))
