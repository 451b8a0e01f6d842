"""A force that acts far off the axis it was recorded along, as a finding.

A stinger or a blow a few degrees off is put right and told as a warning; beyond that the force that was recorded acts
in another direction than was said.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from femend.diagnose import Diagnosis
from femend.diagnose.naming.calibration import CALIBRATION
from femend.diagnose.recordings.tilted import AXES, ForceTilt
from femend.dof import Dof
from femend.estimate import FitRecord

__all__ = ["turned_force"]

# angle in degrees from which no stinger and no blow is meant for the axis
TURNED = 10.0


def turned_force(diagnosis: Diagnosis, records: Sequence[FitRecord]) -> dict[str, Any] | None:
    """The finding of a force that acts in another direction than in the `records` as they were made; None where it is
    no more than a little off.

    Its direction is a unit vector over the axes of its node.
    """
    off = diagnosis.off
    if not isinstance(off, ForceTilt) or off.angle < TURNED:
        return None
    node, own = int(diagnosis.reduced.model.node_ids[off.row // 6]), off.row % 6
    sense = float(next(r.in_signs[0] for r in records if r.driven))
    shares = np.zeros(3)
    shares[own] = 1.0
    for row, share in off.others:
        shares[row % 6] = share
    shares *= np.sign(sense) / np.linalg.norm(shares)
    vector = " ".join(f"{s:+.2f} {axis}" for s, axis in zip(shares, AXES, strict=True) if abs(s) >= 0.005)
    return {
        "physics": "load_misplaced",
        "probability": CALIBRATION.surest,
        "location": {
            "nodes": [node], "to": "", "direction": AXES[int(np.argmax(np.abs(shares)))], "also_possible": [],
        },
        "parameters": {
            "node": {"value": node, "sd": None, "unit": ""},
            "direction": {"value": vector, "sd": None, "unit": ""},
        },
        "alternatives": [],
        "configurations": ["as modelled"],
        "recorded": [{"node": node, "direction": Dof(node, own + 1, int(np.sign(sense))).direction}],
    }  # fmt: skip
