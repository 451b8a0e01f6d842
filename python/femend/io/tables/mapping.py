"""Columns as time records or FRFs, by the channels a study names.

The axis has no key in the study. It is, in this order: the first column not used as a channel that is called time, t
(or freq, f, frequency, Hz for FRFs); the step the file states itself (dt or fs, the header of a WAV file, wf_increment
of TDMS); the first column not used as a channel that increases evenly. ``time [ms]`` counts in ms, ``omega [rad/s]`` in
rad/s.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from femend.data import FRF, Channel, TimeData
from femend.errors import RecordingError, UnitError
from femend.io.channel_map import ChannelMap, converted
from femend.io.tables.axis import TIME, called_frequency, frequencies, named, time_axis
from femend.io.tables.table import Table
from femend.units import QUANTITIES, ROTATIONAL, parse_unit, quantity_factor, unit_system

__all__ = ["table_data"]

_KIND = {"displacement": "receptance", "velocity": "mobility", "acceleration": "accelerance"}


def table_data(table: Table, channels: Sequence[ChannelMap], name: str, units: str) -> tuple[TimeData | FRF, list[str]]:
    """The mapped columns of `table` as time records or FRFs in the unit system `units`, with notes.

    The data are FRFs where a mapped column is complex, or the axis is called a frequency; the one channel of quantity
    force then says where the force acts (its column, if it has one, divides the others). Raises RecordingError where
    no channel is mapped, a column is missing, no axis is found, or lengths differ; UnitError for a unit that does not
    fit.
    """
    table = table.with_pairs()
    if not channels:
        listed = ", ".join(repr(n) for n in table.names[:12]) + (" …" if len(table.names) > 12 else "")
        raise RecordingError(
            f"recording {name!r}: {table.file} does not say where its columns were measured; map them with "
            f"[[recording.channel]] (source, node, direction, quantity, unit). Its columns are {listed}",
            recording=name,
        )
    sources = [None if c.source is None else c.find(table.names, name) for c in channels]
    used = {s for s in sources if s is not None}
    _refuse_twice(table, channels, sources, name)
    _equal_lengths(table, sorted(used), name)
    complex_columns = [i for i in used if np.iscomplexobj(table.columns[i])]
    if complex_columns or (called_frequency(table, used) and not named(table, used, TIME)):
        return _frf(table, channels, sources, name, units)
    return _time(table, channels, sources, name, units)


def _refuse_twice(table: Table, channels: Sequence[ChannelMap], sources: Sequence[int | None], name: str) -> None:
    """A column is one channel: mapped twice, one of the sensors would show another one's motion."""
    first: dict[int, int] = {}
    for i, source in enumerate(sources):
        if source is None:
            continue
        before = first.setdefault(source, i)
        if before != i:
            both = " and ".join(f"{channels[k].quantity} {channels[k].dof or ''}".strip() for k in (before, i))
            raise RecordingError(
                f"recording {name!r}: column {source} ({table.names[source]!r}) is mapped twice, as {both}; correct "
                "the source of one of them",
                recording=name,
                channel=table.names[source],
            )


def _equal_lengths(table: Table, used: list[int], name: str) -> None:
    lengths = {table.columns[i].size for i in used}
    if len(lengths) > 1:
        shown = ", ".join(f"{table.names[i]!r} {table.columns[i].size}" for i in used[:8])
        raise RecordingError(
            f"recording {name!r}: the columns of {table.file} have unequal lengths ({shown}); cut them to one length",
            recording=name,
        )


def _time(
    table: Table, channels: Sequence[ChannelMap], sources: list[int | None], name: str, units: str
) -> tuple[TimeData, list[str]]:
    notes = list(table.notes)
    labels, rows = [], []
    for channel, source in zip(channels, sources):
        if source is None:
            raise RecordingError(
                f"recording {name!r}: the {channel.quantity} channel has no source; give its column", recording=name
            )
        label, values = converted(channel, table.columns[source], table.names[source], units)
        labels.append(label)
        rows.append(values)
    t0, dt = time_axis(table, {s for s in sources if s is not None}, rows[0].size, name, notes)
    return TimeData(name, dt, np.array(rows), tuple(labels), t0), notes


def _frf(
    table: Table, channels: Sequence[ChannelMap], sources: list[int | None], name: str, units: str
) -> tuple[FRF, list[str]]:
    notes = list(table.notes)
    used = {s for s in sources if s is not None}
    forces = [i for i, c in enumerate(channels) if c.quantity == "force"]
    outs = [i for i, c in enumerate(channels) if c.quantity in _KIND]
    if len(forces) != 1 or not outs or len(outs) + 1 != len(channels):
        raise RecordingError(
            f'recording {name!r}: a table of FRFs needs one channel with quantity = "force" (where the force acts; '
            f"without source if the columns are ratios) and displacements, velocities or accelerations beside it; "
            f"there are {len(forces)} forces and {len(outs)} responses among {len(channels)} channels",
            recording=name,
        )
    kinds = sorted({_KIND[channels[i].quantity] for i in outs})
    if len(kinds) > 1:
        raise RecordingError(
            f"recording {name!r}: one recording holds FRFs of one kind, not {' and '.join(kinds)}; make it two",
            recording=name,
        )
    force, force_source = channels[forces[0]], sources[forces[0]]
    input_label, divisor = _input(table, force, force_source, name, units)
    first = sources[outs[0]]
    if first is None:
        raise RecordingError(
            f"recording {name!r}: a response of the FRF has no source; give its column", recording=name
        )
    freq = frequencies(table, used, table.columns[first].size, name, notes)
    H = np.empty((freq.size, len(outs), 1), dtype=np.complex128)
    labels = []
    for k, i in enumerate(outs):
        source = sources[i]
        assert source is not None
        column = table.columns[source]
        if not np.iscomplexobj(column):
            raise RecordingError(
                f"recording {name!r}: column {table.names[source]!r} of an FRF is real; give real and imaginary part "
                'as one complex column, or as columns x_re and x_im with source = "x"',
                recording=name,
                channel=table.names[source],
            )
        label, factor = _output(channels[i], force, table.names[source], units, ratio=divisor is None)
        labels.append(label)
        H[:, k, 0] = column * factor if divisor is None else column * factor / divisor
    unit = f"{labels[0].unit}/{input_label.unit}"
    return FRF(name, freq, H, tuple(labels), (input_label,), kinds[0], unit), notes


def _input(
    table: Table, force: ChannelMap, source: int | None, name: str, units: str
) -> tuple[Channel, NDArray[np.complex128] | None]:
    """The input's label and, where the force has a column, its spectrum in the unit system."""
    if force.dof is None:
        raise RecordingError(f"recording {name!r}: the force of an FRF needs node and direction", recording=name)
    system, rotational = unit_system(units), force.dof.is_rotation
    text = system.text("force", rotational=rotational)
    if source is None:
        return Channel(force.dof, "force", text), None
    own = system.factor("moment" if rotational else "force")
    factor = quantity_factor("force", force.unit, rotational=rotational) * force.scale / own
    spectrum = np.asarray(table.columns[source], dtype=np.complex128) * factor
    if not spectrum.all():
        line = int(np.flatnonzero(spectrum == 0)[0])
        raise RecordingError(
            f"recording {name!r}: the force spectrum is 0 in line {line}; leave lines without force out",
            recording=name,
            channel=table.names[source],
        )
    return Channel(force.dof, "force", text, table.names[source]), spectrum


def _output(channel: ChannelMap, force: ChannelMap, name: str, units: str, *, ratio: bool) -> tuple[Channel, float]:
    """The output's label and the factor of its column; a ratio may carry the unit m/s^2/N or m/s^2 (per N)."""
    assert force.dof is not None
    if channel.dof is None:
        raise RecordingError(f"channel {channel.source!r}: the response of an FRF needs node and direction")
    system, rotational = unit_system(units), channel.dof.is_rotation
    quantity = ROTATIONAL[channel.quantity] if rotational else channel.quantity
    over = "moment" if force.dof.is_rotation else "force"
    text = system.text(channel.quantity, rotational=rotational)
    own = system.factor(quantity)
    parsed = parse_unit(channel.unit)
    if parsed.dims == QUANTITIES[quantity]:
        factor = parsed.factor / own
        if ratio:
            factor *= system.factor(over) / quantity_factor("force", force.unit, rotational=force.dof.is_rotation)
    elif ratio and parsed.dims == tuple(a - b for a, b in zip(QUANTITIES[quantity], QUANTITIES[over])):
        factor = parsed.factor * system.factor(over) / own
    else:
        raise UnitError(
            f"channel {channel.source!r}: unit {channel.unit!r} does not measure {quantity} or {quantity}/{over}"
        )
    return Channel(channel.dof, channel.quantity, text, name), factor * channel.scale
