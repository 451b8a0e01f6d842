"""What a diagnosis makes of the damping that a deck has itself."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from femend.model import Model
from femend.model.dashpots import dashpot_dofs
from femend.model.parameter import is_of_damping
from femend.model.place import AXES
from femend.numerals import listed

__all__ = ["at_dashpots", "damping_told"]

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


def at_dashpots(model: Model, findings: Sequence[Mapping[str, Any]]) -> list[str]:
    """A sentence for each of the `findings` of a diagnosis (as in result.json) that stands at a node where the deck of
    the `model` has a dashpot: what is off may be the value that is drawn."""
    at = {node: dof for row in dashpot_dofs(model) for node, dof in [_dof(model, row)]}
    told = []
    for finding in findings:
        where = finding["location"]
        met = [at[n] for n in where["nodes"] if n in at]
        if met:
            told.append(
                f"the deck has a dashpot at {listed(met, 3)}, where {finding['physics'] or 'something'} is told: a "
                "diagnosis keeps its value, and one that is drawn too strong looks like another law; look at it first, "
                "and try half and twice as much"
            )
    return told


def _dof(model: Model, row: int) -> tuple[int, str]:
    """Node, and node and direction as text, of a row of the g-set."""
    node = int(model.node_ids[row // 6])
    return node, f"{node} {AXES[row % 6]}"


def _local_loss(model: Model) -> bool:
    """Whether structural damping of the deck is anything but one loss factor of all its stiffness."""
    _, _, k, _, _, h = model.fe.assemble()
    if not np.any(h):
        return False
    eta = float(h @ k) / float(k @ k)
    return bool(np.linalg.norm(h - eta * k) > UNLIKE * np.linalg.norm(h))
