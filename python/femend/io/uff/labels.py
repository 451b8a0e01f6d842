"""What the header of a function says about its channel: DOF, quantity, unit, and the factor to the wanted units."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from femend.data import Channel
from femend.dof import Dof
from femend.errors import RecordingError, UnitError
from femend.io.uff.header58 import Axis
from femend.io.uff.reader import UniversalFile
from femend.io.uff.set58 import Function58
from femend.units import QUANTITIES, ROTATIONAL, SYSTEMS, UnitSystem, parse_unit, quantity_of

__all__ = [
    "QUANTITIES_OF_MOTION",
    "QUANTITY_OF_TYPE",
    "Context",
    "channel_of",
    "factor_of",
    "is_blank",
    "label_of",
    "name_of",
    "own_unit",
    "quantity_of_axis",
    "side_of",
]

# Specific data types of the format. 0 and 1 say nothing: the unit decides.
QUANTITIES_OF_MOTION = ("displacement", "velocity", "acceleration", "force")
QUANTITY_OF_TYPE = {2: "pressure", 3: "strain", 8: "displacement", 9: "force", 11: "velocity", 12: "acceleration"}
QUANTITY_OF_TYPE |= {13: "force", 15: "pressure", 19: "tacho", 21: "pressure"}

# highest code of a direction
DIRECTIONS = 6


@dataclass(slots=True)
class Context:
    """The file and the recording that are being converted, the wanted unit system, and what had to be assumed."""

    file: UniversalFile
    name: str
    system: UnitSystem
    notes: list[str] = field(default_factory=list)

    def say(self, note: str) -> None:
        """Adds `note` once."""
        if note not in self.notes:
            self.notes.append(note)


def is_blank(text: str) -> bool:
    """True for a field that says nothing."""
    return text.strip().upper() in ("", "NONE", "UNKNOWN", "-")


def label_of(function: Function58) -> str:
    """The first id line that says something."""
    return next((line.strip() for line in function.header.ids if not is_blank(line)), "")


def name_of(function: Function58) -> str:
    """Name of the response side, empty where it says nothing."""
    return "" if is_blank(function.header.rsp_name) else function.header.rsp_name


def side_of(function: Function58, side: str) -> tuple[Dof | None, str]:
    """DOF and name of the response or reference side; raises RecordingError for a negative node, and for a direction
    that the format does not know."""
    h = function.header
    node, direction, name = (
        (h.rsp_node, h.rsp_dir, h.rsp_name) if side == "rsp" else (h.ref_node, h.ref_dir, h.ref_name)
    )
    if node < 0:
        raise RecordingError(
            f"data set {function.record} ({label_of(function)}): its {'response' if side == 'rsp' else 'reference'} is "
            f"at node {node}, and nodes count from 1; mend record 6 or export the function again"
        )
    if abs(direction) > DIRECTIONS:
        raise RecordingError(
            f"data set {function.record} ({label_of(function)}): its {'response' if side == 'rsp' else 'reference'} at "
            f"node {node} has the direction {direction}, and directions are 1 to 3 along and 4 to 6 about X, Y and Z, "
            "negative against the axis, or 0 of what has none; mend record 6 or export the function again"
        )
    return Dof.from_uff(node, direction), "" if is_blank(name) else name


def quantity_of_axis(axis: Axis, dof: Dof | None, *texts: str) -> str:
    """What an axis measures: by its data type, else by its unit; a scalar called tacho or speed is a tacho."""
    if dof is None and any(t.lower().startswith(("tacho", "rpm", "speed")) for t in texts):
        return "tacho"
    if axis.type in QUANTITY_OF_TYPE:
        return QUANTITY_OF_TYPE[axis.type]
    return "unknown" if is_blank(axis.unit) else quantity_of(axis.unit) or "unknown"


def own_unit(context: Context, quantity: str, dof: Dof | None) -> tuple[str, str]:
    """Name of the quantity with rotations told apart, and how its unit is written in the wanted system."""
    rotational = dof is not None and dof.is_rotation
    name = ROTATIONAL.get(quantity, quantity) if rotational else quantity
    return name, context.system.text(quantity, rotational=rotational)


def factor_of(context: Context, function: Function58, axis: Axis, quantity: str, dof: Dof | None) -> float:
    """Factor from the axis' unit to the wanted system: by its unit label, else by data set 164, else SI is assumed.

    Raises UnitError for a label that cannot be read or does not measure `quantity`.
    """
    name, text = own_unit(context, quantity, dof)
    own = context.system.factor(name)
    units = context.file.units_at(function.record)
    if is_blank(axis.unit):
        if units is not None:
            context.say(f"units of data set 164 ({units.name or units.code}) applied to channels without a unit label")
            return units.to_si(QUANTITIES[name]) / own
        context.say(f"{quantity} channels without a unit label are taken as {SYSTEMS['SI'].text(quantity)}")
        return 1.0 / own
    where = f"recording {context.name!r}: data set {function.record} ({label_of(function)})"
    advice = f"state it with [[recording.channel]] or mend the label; femend works in {text}"
    try:
        unit = parse_unit(axis.unit)
    except UnitError as error:
        raise UnitError(f"{where}: {error}; {advice}") from None
    if unit.dims != QUANTITIES[name]:
        raise UnitError(f"{where}: unit {axis.unit!r} does not measure {name}; {advice}")
    if units is not None and not np.isclose(units.to_si(QUANTITIES[name]), unit.factor, rtol=1e-6):
        context.say(
            f"unit label {axis.unit!r} and data set 164 ({units.name or units.code}) disagree; the label counts"
        )
    return unit.factor / own


def channel_of(context: Context, function: Function58, side: str, axis: Axis) -> tuple[Channel, float]:
    """Label of one `side` (rsp or ref) measured on `axis`, and the factor of its values to the wanted system."""
    dof, name = side_of(function, side)
    label = label_of(function)
    quantity = quantity_of_axis(axis, dof, name, label)
    if quantity in ("tacho", "unknown", "voltage"):
        return Channel(dof, quantity, "" if is_blank(axis.unit) else axis.unit, name, label), 1.0
    _, text = own_unit(context, quantity, dof)
    try:
        return Channel(dof, quantity, text, name, label), factor_of(context, function, axis, quantity, dof)
    except UnitError:
        if quantity in QUANTITIES_OF_MOTION:
            raise
    context.say(f"{quantity} channels keep their unit {axis.unit!r}, which is unknown")
    return Channel(dof, quantity, axis.unit, name, label), 1.0
