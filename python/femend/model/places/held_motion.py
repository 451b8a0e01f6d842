"""A motion that the deck holds: of one DOF, or of a region of held nodes as a rigid whole."""

from __future__ import annotations

from typing import NamedTuple

__all__ = ["HeldMotion", "held_dof"]


class HeldMotion(NamedTuple):
    """Held DOFs that move together where they are let go of.

    Attributes:
        component: 0 to 5, X to RZ: the axis that the motion is a translation along or a rotation about.
        rows: rows of the g-set.
        values: how far each moves in a unit of the motion.
    """

    component: int
    rows: tuple[int, ...]
    values: tuple[float, ...]


def held_dof(row: int) -> HeldMotion:
    """The motion of one held DOF, `row` of the g-set.

    >>> held_dof(8)
    HeldMotion(component=2, rows=(8,), values=(1.0,))
    """
    return HeldMotion(int(row) % 6, (int(row),), (1.0,))
