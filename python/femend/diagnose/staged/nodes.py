"""Nodes of a structure by where they are: those that elements hold, and those on the line of a shaft."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from femend.diagnose.staged.setup import Setup

__all__ = ["on_the_line", "with_elements"]

# what lies this far off the shaft's line, as a share of the structure's size, is not on it
OFF_AXIS = 1e-3


def with_elements(setup: Setup) -> set[int]:
    """Ids of the nodes that elements hold."""
    return {int(n) for _, _, _, nodes in setup.free.deck.elements() for n in nodes}


def on_the_line(setup: Setup, nodes: Iterable[int], bearing: int, axis: int) -> list[int]:
    """Those of the `nodes` that lie on the line through a `bearing` along `axis` (0, 1, 2), in their order."""
    free = setup.free
    xyz = free.xyz_of
    off = OFF_AXIS * float(np.ptp(free.xyz, axis=0).max())
    return [n for n in nodes if n in xyz and np.linalg.norm(np.delete(xyz[n] - xyz[bearing], axis)) <= off]
