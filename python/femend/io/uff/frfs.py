"""FRFs of a universal file as grids of outputs and inputs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from femend.data import FRF, Channel
from femend.dof import Dof
from femend.errors import RecordingError, UnitError
from femend.io.uff.abscissa import AxisKey, axis_key, frequencies
from femend.io.uff.header58 import Axis
from femend.io.uff.labels import QUANTITY_OF_TYPE, Context, factor_of, is_blank, label_of, own_unit, side_of
from femend.io.uff.reader import UniversalFile
from femend.io.uff.set58 import Function58
from femend.units import QUANTITIES, ROTATIONAL, SYSTEMS, parse_unit

__all__ = ["frf_blocks"]

_KIND = {"displacement": "receptance", "velocity": "mobility", "acceleration": "accelerance"}


def _frf_pair(context: Context, function: Function58) -> tuple[Channel, Channel, float, str]:
    """Output, input, factor to the wanted system and kind of one FRF."""
    h = function.header
    (out, out_name), (ref, ref_name) = side_of(function, "rsp"), side_of(function, "ref")
    where = f"recording {context.name!r}: data set {function.record} ({label_of(function)})"
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
    out_name_q, out_unit = own_unit(context, quantity, out)
    ref_name_q, ref_unit = own_unit(context, "force", ref)
    factor = _ratio_factor(context, h.ordinate, out_name_q, ref_name_q)
    if factor is None:
        over = factor_of(context, function, h.denominator, "force", ref)
        factor = factor_of(context, function, h.ordinate, quantity, out) / over
    output = Channel(out, quantity, out_unit, out_name, label_of(function))
    return output, Channel(ref, "force", ref_unit, ref_name), factor, _KIND[quantity]


def _frf_quantity(axis: Axis, dof: Dof) -> str | None:
    known = QUANTITY_OF_TYPE.get(axis.type)
    if known in _KIND:
        return known
    if known is not None or is_blank(axis.unit):
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


def _ratio_factor(context: Context, axis: Axis, output: str, reference: str) -> float | None:
    """Factor of an ordinate label that is already a ratio, such as m/s^2/N; None where it is not."""
    if is_blank(axis.unit):
        return None
    try:
        unit = parse_unit(axis.unit)
    except UnitError:
        return None
    if unit.dims != tuple(a - b for a, b in zip(QUANTITIES[output], QUANTITIES[reference])):
        return None
    return unit.factor * context.system.factor(reference) / context.system.factor(output)


def frf_blocks(
    file: UniversalFile, functions: Sequence[Function58], name: str, units: str
) -> tuple[list[FRF], list[str]]:
    """FRFs (function type 4) as full grids of outputs and inputs in the unit system `units`, with notes.

    FRFs that form no full grid come back as several: one per kind, frequency axis and set of outputs that inputs
    share. Coherences (type 6) among `functions` are attached where every FRF of a grid has one. Raises RecordingError
    for an FRF without DOFs, one that stands twice, and NaN; UnitError for unit labels that cannot be read.
    """
    context = Context(file, name, SYSTEMS[units])
    coherence = {
        (side_of(f, "rsp")[0], side_of(f, "ref")[0], axis_key(context, f)): f.y.real
        for f in functions
        if f.header.func_type == 6
    }
    columns: dict[tuple[object, ...], dict[Dof, dict[Dof, tuple[Function58, float]]]] = {}
    labels: dict[tuple[str, Dof], Channel] = {}
    for function in (f for f in functions if f.header.func_type == 4):
        output, ref, factor, kind = _frf_pair(context, function)
        assert output.dof is not None
        assert ref.dof is not None
        if not np.iscomplexobj(function.y):
            context.say(
                f"data set {function.record} ({label_of(function)}) holds an FRF without imaginary part; it is taken "
                "as it stands: if it is the magnitude alone, export real and imaginary part"
            )
        labels.setdefault((kind, output.dof), output)
        labels.setdefault(("input", ref.dof), ref)
        column = columns.setdefault((kind, axis_key(context, function)), {}).setdefault(ref.dof, {})
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
    context: Context,
    kind: str,
    by_input: dict[Dof, dict[Dof, tuple[Function58, float]]],
    refs: list[Dof],
    labels: dict[tuple[str, Dof], Channel],
    coherence: Mapping[tuple[Dof | None, Dof | None, AxisKey], NDArray[np.float64]],
) -> FRF:
    outs = list(by_input[refs[0]])
    first = by_input[refs[0]][outs[0]][0]
    freq, lines = frequencies(context, first), axis_key(context, first)
    H = np.empty((freq.size, len(outs), len(refs)), dtype=np.complex128)
    gamma = np.empty(H.shape)
    complete = True
    for j, ref in enumerate(refs):
        for i, out in enumerate(outs):
            function, factor = by_input[ref][out]
            H[:, i, j] = function.y * factor
            pair = coherence.get((out, ref, lines))
            if pair is None:
                complete = False
            else:
                gamma[:, i, j] = pair
    outputs = tuple(labels[(kind, out)] for out in outs)
    inputs = tuple(labels[("input", ref)] for ref in refs)
    unit = f"{outputs[0].unit}/{inputs[0].unit}"
    return FRF(context.name, freq, H, outputs, inputs, kind, unit, gamma if complete else None)
