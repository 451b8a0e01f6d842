"""The two ends of FRFs: DOFs of their channels, unit forces there, units."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from femend.data.channel import Channel
from femend.dof import Dof
from femend.errors import ArgumentError, PairingError

__all__ = ["PER_FORCE", "dofs_of", "unit_forces"]

PER_FORCE = {"receptance": "m/N", "mobility": "m/s/N", "accelerance": "m/s^2/N"}
"""SI unit of each kind of FRF."""


def dofs_of(channels: Sequence[Channel]) -> list[Dof]:
    """The DOF of every channel; raises ValueError for one that has none, ArgumentError for what is no channel."""
    for channel in channels:
        if not isinstance(channel, Channel):
            takes = 'ends of FRFs are channels, as Channel(Dof(12, 3), "acceleration", "m/s^2") of `femend`'
            raise ArgumentError.given(takes, channel)
        if channel.dof is None:
            raise ValueError(f"channel {channel.text} has no DOF; FRFs are between DOFs")
    return [c.dof for c in channels if c.dof is not None]


def unit_forces(rows: Sequence[Dof], wanted: Sequence[Dof], whose: str, advice: str) -> NDArray[np.float64]:
    """Unit forces (n_rows, n_wanted) at signed DOFs, as columns over `rows`.

    Raises PairingError for DOFs that are not among them, which says what has no such DOF (`whose`) and what to do.
    """
    row = {(dof.node, dof.component): (i, dof.sign) for i, dof in enumerate(rows)}
    missing = [str(d) for d in wanted if (d.node, d.component) not in row]
    if missing:
        raise PairingError(f"{whose} no DOF {', '.join(missing[:8])}; {advice}")
    out = np.zeros((len(rows), len(wanted)))
    for j, d in enumerate(wanted):
        i, sign = row[d.node, d.component]
        out[i, j] = sign * d.sign
    return out
