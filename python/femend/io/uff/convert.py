"""Functions of a universal file as recordings' data: units applied, channels labelled, axes checked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from femend.data import FRF, Channel, Spectra, TimeData
from femend.dof import Dof
from femend.errors import RecordingError, UnitError
from femend.io.uff.header58 import Axis
from femend.io.uff.reader import UniversalFile
from femend.io.uff.set58 import Function58
from femend.units import QUANTITIES, ROTATIONAL, SYSTEMS, UnitSystem, parse_unit, quantity_of

__all__ = ["frf_blocks", "spectra_blocks", "time_data"]

# Specific data types of the format. 0 and 1 say nothing: the unit decides.
_QUANTITY = {2: "pressure", 3: "strain", 8: "displacement", 9: "force", 11: "velocity", 12: "acceleration"}
_QUANTITY |= {13: "force", 15: "pressure", 19: "tacho", 21: "pressure"}
_KIND = {"displacement": "receptance", "velocity": "mobility", "acceleration": "accelerance"}
_SPECTRA = {2: "autospectrum", 3: "cross-spectrum", 6: "coherence", 9: "psd", 10: "esd", 12: "spectrum"}


@dataclass(slots=True)
class _Context:
    file: UniversalFile
    name: str
    system: UnitSystem
    notes: list[str] = field(default_factory=list)

    def say(self, note: str) -> None:
        if note not in self.notes:
            self.notes.append(note)


def _blank(text: str) -> bool:
    return text.strip().upper() in ("", "NONE", "UNKNOWN", "-")


def _label(function: Function58) -> str:
    return next((line.strip() for line in function.header.ids if not _blank(line)), "")


def _side(function: Function58, side: str) -> tuple[Dof | None, str]:
    """DOF and name of the response or reference side."""
    h = function.header
    node, direction, name = (
        (h.rsp_node, h.rsp_dir, h.rsp_name) if side == "rsp" else (h.ref_node, h.ref_dir, h.ref_name)
    )
    return Dof.from_uff(node, direction), "" if _blank(name) else name


def _quantity(axis: Axis, dof: Dof | None, *texts: str) -> str:
    """What an axis measures: by its data type, else by its unit; a scalar called tacho or speed is a tacho."""
    if dof is None and any(t.lower().startswith(("tacho", "rpm", "speed")) for t in texts):
        return "tacho"
    if axis.type in _QUANTITY:
        return _QUANTITY[axis.type]
    return "unknown" if _blank(axis.unit) else quantity_of(axis.unit) or "unknown"


def _own(context: _Context, quantity: str, dof: Dof | None) -> tuple[str, str]:
    """Name of the quantity with rotations told apart, and how its unit is written in the wanted system."""
    rotational = dof is not None and dof.is_rotation
    name = ROTATIONAL.get(quantity, quantity) if rotational else quantity
    return name, context.system.text(quantity, rotational=rotational)


def _factor(context: _Context, function: Function58, axis: Axis, quantity: str, dof: Dof | None) -> float:
    """Factor from the axis' unit to the wanted system: by its unit label, else by data set 164, else SI is assumed."""
    name, text = _own(context, quantity, dof)
    own = context.system.factor(name)
    units = context.file.units_at(function.record)
    if _blank(axis.unit):
        if units is not None:
            context.say(f"units of data set 164 ({units.name or units.code}) applied to channels without a unit label")
            return units.to_si(QUANTITIES[name]) / own
        context.say(f"{quantity} channels without a unit label are taken as {SYSTEMS['SI'].text(quantity)}")
        return 1.0 / own
    where = f"recording {context.name!r}: data set {function.record} ({_label(function)})"
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


def _channel(context: _Context, function: Function58, side: str, axis: Axis) -> tuple[Channel, float]:
    dof, name = _side(function, side)
    label = _label(function)
    quantity = _quantity(axis, dof, name, label)
    if quantity in ("tacho", "unknown", "voltage"):
        return Channel(dof, quantity, "" if _blank(axis.unit) else axis.unit, name, label), 1.0
    _, text = _own(context, quantity, dof)
    return Channel(dof, quantity, text, name, label), _factor(context, function, axis, quantity, dof)


def even_step(x: NDArray[np.float64], name: str) -> float:
    """Step of the evenly spaced axis `x`; raises RecordingError naming the worst step otherwise."""
    steps = np.diff(x)
    step = float((x[-1] - x[0]) / max(len(x) - 1, 1))
    if len(x) > 1 and (step <= 0 or np.abs(steps - step).max() > 1e-3 * step):
        worst = int(np.argmax(np.abs(steps - step)))
        raise RecordingError(
            f"recording {name!r}: the time axis is not even: step {worst} is {steps[worst]:.6g} s, the mean {step:.6g} "
            "s; resample the recording to an even step",
            recording=name,
        )
    return step


def printed_step(dx: float) -> float:
    """The step meant by a header's digits (six or more): 1/rate where exactly one integer rate prints as these.

    A header writes 1/1024 s as 9.76562e-04; over a minute the rounding would be 30 microseconds. Rates that are no
    integer stay as printed.
    """
    if not (np.isfinite(dx) and dx > 0):
        return dx
    digits = max(len(f"{dx:.16g}".split("e")[0].replace(".", "").lstrip("0")), 6)
    half = 0.5 * 10.0 ** (np.floor(np.log10(dx)) - digits + 1)
    rate = round(1.0 / dx)
    unique = 1.0 / (dx - half) - 1.0 / (dx + half) < 1.0
    if rate >= 1 and unique and abs(1.0 / rate - dx) <= half * (1 + 1e-6):
        return 1.0 / rate
    return dx


def _step(function: Function58, name: str) -> tuple[float, float]:
    """Start and step of a time function in s."""
    h = function.header
    if h.even:
        return h.x0, printed_step(h.dx)
    return float(function.x[0]) if function.x.size else 0.0, even_step(function.x, name)


def time_data(
    file: UniversalFile, functions: Sequence[Function58], name: str, units: str
) -> tuple[TimeData, list[str]]:
    """Time functions as one TimeData in the unit system `units`, with notes on what was assumed.

    Raises RecordingError for unequal lengths or steps (naming the data sets), complex time records and everything
    TimeData refuses; UnitError for a unit label that cannot be read.
    """
    context = _Context(file, name, SYSTEMS[units])
    first = functions[0]
    t0, dt = _step(first, name)
    channels, rows = [], []
    for function in functions:
        channel, factor = _channel(context, function, "rsp", function.header.ordinate)
        here = f"data set {function.record} ({_label(function) or channel.text})"
        if function.y.size != first.y.size:
            raise RecordingError(
                f"recording {name!r}: {here} has {function.y.size} samples, data set {first.record} "
                f"({_label(first)}) has {first.y.size}; cut the records to equal length",
                recording=name,
                channel=channel.text,
            )
        start, step = _step(function, name)
        if abs(step - dt) > 1e-6 * abs(dt) or abs(start - t0) > 1e-3 * abs(dt):
            raise RecordingError(
                f"recording {name!r}: {here} starts at {start:g} s with step {step:g} s, data set {first.record} at "
                f"{t0:g} s with {dt:g} s; resample the records to one time axis",
                recording=name,
                channel=channel.text,
            )
        if np.iscomplexobj(function.y) and np.any(function.y.imag):
            raise RecordingError(f"recording {name!r}: {here} is a complex time record; export it as real")
        channels.append(channel)
        rows.append(function.y.real * factor)
    if first.header.even and dt != first.header.dx:
        context.say(f"time step {first.header.dx:g} s taken as 1/{round(1 / dt)} s")
    return TimeData(name, dt, np.array(rows), tuple(channels), t0), context.notes


def _frf_pair(context: _Context, function: Function58) -> tuple[Channel, Channel, float, str]:
    """Output, input, factor to the wanted system and kind of one FRF."""
    h = function.header
    (out, out_name), (ref, ref_name) = _side(function, "rsp"), _side(function, "ref")
    where = f"recording {context.name!r}: data set {function.record} ({_label(function)})"
    if out is None or ref is None:
        side = "response" if out is None else "reference"
        raise RecordingError(
            f"{where}: the {side} of the FRF has no direction (node and direction code -6..6 of record 6); export the "
            "FRFs with their DOFs",
            recording=context.name,
        )
    quantity = _frf_quantity(h.ordinate, out)
    if quantity is None or h.denominator.type not in (0, 1, 13):
        raise RecordingError(
            f"{where}: an FRF of ordinate type {h.ordinate.type} [{h.ordinate.unit}] over denominator type "
            f"{h.denominator.type} [{h.denominator.unit}] is no receptance, mobility or accelerance; leave it out",
            recording=context.name,
        )
    out_name_q, out_unit = _own(context, quantity, out)
    ref_name_q, ref_unit = _own(context, "force", ref)
    factor = _ratio_factor(context, h.ordinate, out_name_q, ref_name_q)
    if factor is None:
        over = _factor(context, function, h.denominator, "force", ref)
        factor = _factor(context, function, h.ordinate, quantity, out) / over
    output = Channel(out, quantity, out_unit, out_name, _label(function))
    return output, Channel(ref, "force", ref_unit, ref_name), factor, _KIND[quantity]


def _frf_quantity(axis: Axis, dof: Dof) -> str | None:
    known = _QUANTITY.get(axis.type)
    if known in _KIND:
        return known
    if known is not None or _blank(axis.unit):
        return None
    try:
        dims = parse_unit(axis.unit).dims
    except UnitError:
        return None
    for quantity in _KIND:
        name = ROTATIONAL[quantity] if dof.is_rotation else quantity
        for over in ("force", "moment"):
            ratio = tuple(a - b for a, b in zip(QUANTITIES[name], QUANTITIES[over]))
            if dims in (QUANTITIES[name], ratio):
                return quantity
    return None


def _ratio_factor(context: _Context, axis: Axis, output: str, reference: str) -> float | None:
    """Factor of an ordinate label that is already a ratio, such as m/s^2/N; None where it is not."""
    if _blank(axis.unit):
        return None
    try:
        unit = parse_unit(axis.unit)
    except UnitError:
        return None
    if unit.dims != tuple(a - b for a, b in zip(QUANTITIES[output], QUANTITIES[reference])):
        return None
    return unit.factor * context.system.factor(reference) / context.system.factor(output)


def _axis_key(function: Function58) -> tuple[int, float, float]:
    x = function.x
    return x.size, float(x[0]) if x.size else 0.0, float(x[-1]) if x.size else 0.0


def frf_blocks(
    file: UniversalFile, functions: Sequence[Function58], name: str, units: str
) -> tuple[list[FRF], list[str]]:
    """FRFs (function type 4) as full grids of outputs and inputs in the unit system `units`, with notes.

    FRFs that form no full grid come back as several: one per kind, frequency axis and set of outputs that inputs
    share. Coherences (type 6) among `functions` are attached where every FRF of a grid has one. Raises RecordingError
    for an FRF without DOFs, one that stands twice, and NaN; UnitError for unit labels that cannot be read.
    """
    context = _Context(file, name, SYSTEMS[units])
    coherence = {(_side(f, "rsp")[0], _side(f, "ref")[0]): f.y.real for f in functions if f.header.func_type == 6}
    columns: dict[tuple[object, ...], dict[Dof, dict[Dof, tuple[Function58, float]]]] = {}
    labels: dict[tuple[str, Dof], Channel] = {}
    for function in (f for f in functions if f.header.func_type == 4):
        output, ref, factor, kind = _frf_pair(context, function)
        assert output.dof is not None
        assert ref.dof is not None
        labels.setdefault((kind, output.dof), output)
        labels.setdefault(("input", ref.dof), ref)
        column = columns.setdefault((kind, *_axis_key(function)), {}).setdefault(ref.dof, {})
        if output.dof in column:
            raise RecordingError(
                f"recording {name!r}: the FRF {output.dof} / {ref.dof} stands twice, in data sets "
                f"{column[output.dof][0].record} and {function.record}; leave one out",
                recording=name,
            )
        column[output.dof] = (function, factor)
    blocks = []
    for key, by_input in columns.items():
        shared: dict[frozenset[Dof], list[Dof]] = {}
        for ref_dof, column in by_input.items():
            shared.setdefault(frozenset(column), []).append(ref_dof)
        for refs in shared.values():
            blocks.append(_grid(context, str(key[0]), by_input, refs, labels, coherence))
    return blocks, context.notes


def _grid(
    context: _Context,
    kind: str,
    by_input: dict[Dof, dict[Dof, tuple[Function58, float]]],
    refs: list[Dof],
    labels: dict[tuple[str, Dof], Channel],
    coherence: dict[tuple[Dof | None, Dof | None], NDArray[np.float64]],
) -> FRF:
    outs = list(by_input[refs[0]])
    freq = by_input[refs[0]][outs[0]][0].x
    H = np.empty((freq.size, len(outs), len(refs)), dtype=np.complex128)
    gamma = np.empty(H.shape)
    complete = True
    for j, ref in enumerate(refs):
        for i, out in enumerate(outs):
            function, factor = by_input[ref][out]
            H[:, i, j] = function.y * factor
            pair = coherence.get((out, ref))
            if pair is None or pair.size != freq.size:
                complete = False
            else:
                gamma[:, i, j] = pair
    outputs = tuple(labels[(kind, out)] for out in outs)
    inputs = tuple(labels[("input", ref)] for ref in refs)
    unit = f"{outputs[0].unit}/{inputs[0].unit}"
    return FRF(context.name, freq, H, outputs, inputs, kind, unit, gamma if complete else None)


def spectra_blocks(functions: Sequence[Function58], name: str) -> list[Spectra]:
    """Spectra (types 2, 3, 6, 9, 10, 12), one Spectra per kind and frequency axis, in the units of the file."""
    groups: dict[tuple[object, ...], list[Function58]] = {}
    for function in functions:
        kind = _SPECTRA.get(function.header.func_type)
        if kind is not None:
            groups.setdefault((kind, *_axis_key(function)), []).append(function)
    blocks = []
    for key, members in groups.items():
        channels, references = [], []
        for f in members:
            (dof, text), (ref, ref_text) = _side(f, "rsp"), _side(f, "ref")
            axis = f.header.ordinate
            channels.append(Channel(dof, _quantity(axis, dof, text), axis.unit, text, _label(f)))
            references.append(None if ref is None else Channel(ref, "unknown", f.header.denominator.unit, ref_text))
        values = np.array([f.y for f in members])
        blocks.append(Spectra(name, members[0].x, values, tuple(channels), str(key[0]), tuple(references)))
    return blocks
