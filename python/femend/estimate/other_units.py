"""Recordings whose values are held in other units than the model has: nothing converts them after reading."""

from __future__ import annotations

from math import isclose

from femend.data import Channel, Recording, Spectra, Test
from femend.errors import UnitError
from femend.units import QUANTITIES, ROTATIONAL, SYSTEMS, Unit, UnitSystem, parse_unit, unit_system

__all__ = ["refuse_other_units"]


def refuse_other_units(test: Test, units: str) -> None:
    """Raises UnitError for the first recording of `test` with a response or a force that is not held in the unit system
    `units` of the model. Channels without a unit that can be read are taken as being in it; spectra keep the units of
    their file, and are not compared with a model as they are."""
    own = unit_system(units)
    for recording in test:
        if isinstance(recording.data, Spectra):
            continue
        for channel in (*recording.sensors, *recording.inputs):
            held = _held(channel)
            if held is not None and not _in(held, channel, own):
                raise _error(recording, channel, held, own)


def _held(channel: Channel) -> Unit | None:
    """The unit that a channel's values are held in; None where none is given or it does not measure the quantity."""
    if channel.quantity not in QUANTITIES or not channel.unit.strip():
        return None
    try:
        unit = parse_unit(channel.unit)
    except UnitError:
        return None
    return unit if unit.dims == QUANTITIES[_quantity(channel)] else None


def _quantity(channel: Channel) -> str:
    turning = channel.dof is not None and channel.dof.is_rotation
    return ROTATIONAL.get(channel.quantity, channel.quantity) if turning else channel.quantity


def _in(held: Unit, channel: Channel, system: UnitSystem) -> bool:
    return isclose(held.factor, system.factor(_quantity(channel)), rel_tol=1e-6)


def _error(recording: Recording, channel: Channel, held: Unit, own: UnitSystem) -> UnitError:
    """What is said of the recording: its units, the model's, and how the two are made one."""
    channels = [(c, u) for c in (*recording.sensors, *recording.inputs) if (u := _held(c)) is not None]
    theirs = [name for name, system in SYSTEMS.items() if all(_in(u, c, system) for c, u in channels)]
    turning = channel.dof is not None and channel.dof.is_rotation
    at = f"recording {recording.name!r} has {channel.text} in {held.text}" + (f" (units {theirs[0]})" if theirs else "")
    other = f", or the model with units={theirs[0]!r} if that is what its deck is in" if theirs else ""
    return UnitError(
        f"{at}, the model is in {own.text(channel.quantity, rotational=turning)} (units {own.name}), and nothing is "
        f"converted after reading: read the recordings with read_recordings(..., units={own.name!r}){other}"
    )
