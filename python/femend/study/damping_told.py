"""What a diagnosis makes of the damping that a deck has itself."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from femend.model import Model
from femend.model.parameter import Parameter
from femend.model.places.place import AXES
from femend.model.reduced.dashpots import still_dashpots
from femend.numerals import listed

__all__ = ["at_dashpots", "damping_told"]

# share of the loss factors that is not alike in all of the structure from which it is told
UNLIKE = 0.05


def damping_told(model: Model, given: Sequence[Parameter]) -> list[str]:
    """Sentences where parameters of the `model` are loss factors, where dashpots are free beyond those of the study's
    parameters `given`, and where loss factors of its deck are not those of the whole: a diagnosis takes all damping but
    that of dashpots as ratios of modes."""
    names = [repr(p.name) for p in model.parameters if p.property == "eta"]
    told = []
    if names:
        are = "is a loss factor" if len(names) == 1 else "are loss factors"
        told.append(
            f"{listed(names, 4)} {are}: `femend diagnose` takes damping, but that of dashpots, as damping ratios of "
            "modes, so that the factor stays 1; `femend update` fits it to FRFs or damping ratios"
        )
    free = [p for p in model.parameters if p.name not in {q.name for q in given}]
    if free:
        sd = f"{100 * free[0].prior_sd:g} %"
        told.append(
            f"dashpots of the deck are free within {sd}, since no [[parameter]] is of them: "
            f"{listed([p.name for p in free], 4)}; give one (property c1 to c6) with the prior_sd that is known"
        )
    if _local_loss(model):
        told.append(
            "the deck has loss factors (GE) that are not those of the whole structure: `femend diagnose` takes them as "
            "damping ratios of modes, and does not see that they couple modes; give springs that damp much a B of PBUSH"
        )
    return told


def at_dashpots(model: Model, findings: Sequence[Mapping[str, Any]]) -> list[str]:
    """A sentence for each of the `findings` of a diagnosis (as in result.json) that stands at a node where the deck of
    the `model` has a dashpot whose strength is held: what is off may be the value that is drawn."""
    at = {node: dof for row in still_dashpots(model) for node, dof in [_dof(model, row)]}
    told = []
    for finding in findings:
        where = finding["location"]
        met = [at[n] for n in where["nodes"] if n in at]
        if met:
            told.append(
                f"the deck has a dashpot at {listed(met, 3)}, where {finding['physics'] or 'something'} is told: a "
                "diagnosis held its value, and one that is drawn too strong looks like another law; give it a "
                "[[parameter]] (property c1 to c6)"
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
