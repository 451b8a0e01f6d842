"""What a ``[[recording.channel]]`` table of a study says about one column of a file."""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.data import Channel
from femend.dof import Dof, parse_direction
from femend.errors import RecordingError, UnitError
from femend.units import ROTATIONAL, parse_unit, quantity_factor, unit_system

__all__ = ["CHANNEL_QUANTITIES", "ChannelMap", "converted"]

CHANNEL_QUANTITIES = ("displacement", "velocity", "acceleration", "force", "strain", "tacho")


@dataclass(frozen=True, slots=True)
class ChannelMap:
    """One column of a file as a channel: value = column * scale * (factor of `unit`).

    `source` is the column's number from 0 or its name (None only for the force of an FRF table, which has no column);
    `node` and `direction` are None for a tacho. Raises RecordingError for an unknown quantity or direction.
    """

    source: int | str | None
    node: int | None
    direction: str | None
    quantity: str
    unit: str
    scale: float = 1.0

    def __post_init__(self) -> None:
        if self.quantity not in CHANNEL_QUANTITIES:
            raise RecordingError(
                f"channel {self.source!r}: quantity {self.quantity!r} is none of {', '.join(CHANNEL_QUANTITIES)}"
            )
        if self.direction is not None:
            try:
                parse_direction(self.direction)
            except ValueError as error:
                raise RecordingError(f"channel {self.source!r}: {error}") from None

    @property
    def dof(self) -> Dof | None:
        """The DOF, or None where node or direction is not given."""
        if self.node is None or self.direction is None:
            return None
        return Dof(self.node, *parse_direction(self.direction))

    def find(self, names: Sequence[str], recording: str) -> int:
        """Column of the source among `names`; raises RecordingError that names `recording` and lists them."""
        if isinstance(self.source, int):
            if 0 <= self.source < len(names):
                return self.source
            problem = f"column {self.source} is asked for but there are {len(names)}, counted from 0"
        else:
            exact = [i for i, n in enumerate(names) if n == self.source]
            loose = exact or [i for i, n in enumerate(names) if n.strip().lower() == str(self.source).strip().lower()]
            if len(loose) == 1:
                return loose[0]
            close = difflib.get_close_matches(str(self.source), list(names), n=1, cutoff=0.5)
            hint = f"; did you mean {close[0]!r}?" if close and not loose else ""
            problem = f"{len(loose) or 'no'} column{'s are' if loose else ' is'} named {self.source!r}{hint}"
        listed = ", ".join(repr(n) for n in names[:12]) + (" …" if len(names) > 12 else "")
        raise RecordingError(
            f"recording {recording!r}: {problem}; the columns are {listed}",
            recording=recording,
            channel=str(self.source),
        )


def converted(
    channel: ChannelMap, values: NDArray[np.float64], name: str, units: str
) -> tuple[Channel, NDArray[np.float64]]:
    """The channel of a map and its values in the unit system `units`; raises UnitError where the unit does not fit."""
    system, dof = unit_system(units), channel.dof
    rotational = dof is not None and dof.is_rotation
    if channel.quantity == "tacho":
        return Channel(dof, "tacho", channel.unit, name), values * channel.scale
    try:
        if channel.quantity == "strain":
            factor = parse_unit(channel.unit).factor
        else:
            factor = quantity_factor(channel.quantity, channel.unit, rotational=rotational)
    except UnitError as error:
        raise UnitError(f"channel {name!r}: {error}") from None
    own = system.factor(ROTATIONAL.get(channel.quantity, channel.quantity) if rotational else channel.quantity)
    text = system.text(channel.quantity, rotational=rotational)
    return Channel(dof, channel.quantity, text, name), values * (channel.scale * factor / own)
