"""A base that moves as the drive: the supports let go of along one axis, as one, and a mass far above the structure's.

A force on that mass is the motion of the base (the large mass method: Léger, Idé and Paultre, Multiple-support seismic
analysis of large structures, Comput. Struct. 36 (1990) 1153-1158), and the modes are those of the structure on its
fixed base, with their damping against it. Forces on the structure that stand for a moved support leave out what its
damping and the mass beside the support do: twice the damping ratio at a resonance.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femend.diagnose.locating.dressed import with_attached
from femend.model import Model, Place, ReducedModel
from femend.model.places.held_motion import HeldMotion
from femend.model.places.place import AXES

__all__ = ["as_moving_base", "on_moving_base"]

# mass on the base in that of the structure, and its frequency on a soft spring in the lowest of the structure: free
# decays of a mode of 0 Hz have no frequency, and one that is lower is lost in the roundings of the highest
MASS, SOFT = 1e5, 1e-2


def as_moving_base(model: Model, base: Place) -> Place | None:
    """The place of a force that moves the nodes which the deck holds in all directions, as one, along the axis of a
    `base` motion of absolute responses; None of one of responses against the base, and where something else than SPC
    sets holds one of the nodes, or their frames are turned against the axes."""
    if base.to != "moved":
        return None
    c = AXES.index(base.direction)
    moving, free = ({int(row) for row in m.g_rows()} for m in (model, model.unsupported))
    held = free - moving
    nodes = [i for i in range(len(model.node_ids)) if held.issuperset(range(6 * i, 6 * i + 3))]
    if not set(base.nodes).issubset(model.node_ids[nodes].tolist()):
        return None
    if not all(np.array_equal(model.frames[i], np.eye(3)) for i in nodes):
        return None
    rows = tuple(6 * i + c for i in nodes)
    motion = HeldMotion(c, rows, (1.0,) * len(rows))
    mean = np.full(len(rows), 1 / len(rows))
    return replace(base, g_rows=(np.array(rows),), g_values=(mean,), independent=False, motions=(motion,))


def on_moving_base(drive: Place, reduced: ReducedModel) -> ReducedModel:
    """The model on a base that a force at the place `drive` (`as_moving_base`) moves: it has one mode more, the lowest.

    Raises ModelError where the supports cannot be let go of.
    """
    mass = MASS * reduced.model.total_mass
    soft = mass * (2 * np.pi * SOFT * float(reduced.freq[0])) ** 2
    return with_attached(drive, soft, mass, reduced)
