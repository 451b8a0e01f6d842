"""Data as functions of data set 58, ready to be written."""

from __future__ import annotations

import numpy as np

from femend.data import FRF, Channel, TimeData
from femend.data._arrays import frozen
from femend.io.uff.header58 import Axis, Header58
from femend.io.uff.set58 import Function58

__all__ = ["functions_of"]

_TYPE = {"displacement": 8, "velocity": 11, "acceleration": 12, "force": 13, "strain": 3, "pressure": 15}


def _ends(channel: Channel | None) -> tuple[str, int, int]:
    """Name, node and direction of one side of record 6."""
    if channel is None:
        return "NONE", 0, 0
    if channel.dof is None:
        return channel.name or "NONE", 0, 0
    return channel.name or "NONE", channel.dof.node, channel.dof.uff_direction


def _axis(channel: Channel, unit: str | None = None) -> Axis:
    return Axis(_TYPE.get(channel.quantity, 0), (0, 0, 0), "NONE", unit or channel.unit or "NONE")


def functions_of(data: TimeData | FRF, *, single: bool = False) -> list[Function58]:
    """Each channel of time records, or each pair of an FRF, as a function of data set 58.

    Rows keep their order; FRFs come input by input. `single` writes four bytes per number instead of eight.
    """
    if isinstance(data, TimeData):
        return _of_time(data, single)
    return _of_frf(data, single)


def _header(
    label: str,
    name: str,
    func_type: int,
    ends: tuple[str, int, int, str, int, int],
    form: tuple[int, int, float, float],
    axes: tuple[Axis, Axis, Axis],
) -> Header58:
    ids = (label or "NONE", name or "NONE", "NONE", "NONE", "NONE")
    kind, n_points, x0, dx = form
    return Header58(ids, func_type, 0, 0, *ends, kind, n_points, True, x0, dx, 0.0, *axes, Axis())


def _of_time(data: TimeData, single: bool) -> list[Function58]:
    functions: list[Function58] = []
    t = frozen(data.t)
    for row, channel in zip(data.values, data.channels):
        header = _header(
            channel.label or channel.text,
            data.name,
            1,
            (*_ends(channel), *_ends(None)),
            (2 if single else 4, data.n_samples, data.t0, data.dt),
            (Axis(17, unit="s"), _axis(channel), Axis()),
        )
        functions.append(Function58(header, t, row, len(functions) + 1))
    return functions


def _of_frf(data: FRF, single: bool) -> list[Function58]:
    functions: list[Function58] = []
    n = data.n_freq
    step = float((data.freq[-1] - data.freq[0]) / (n - 1)) if n > 1 else 0.0
    even = n < 2 or bool(np.abs(np.diff(data.freq) - step).max() <= 1e-9 * step)
    for j, ref in enumerate(data.inputs):
        for i, out in enumerate(data.outputs):
            header = _header(
                out.label or f"{data.kind} {out.dof} / {ref.dof}",
                data.name,
                4,
                (*_ends(out), *_ends(ref)),
                (5 if single else 6, n, float(data.freq[0]), step if even else 0.0),
                (Axis(18, unit="Hz"), _axis(out, f"{out.unit}/{ref.unit}"), _axis(ref)),
            )
            functions.append(Function58(header, data.freq, data.H[:, i, j], len(functions) + 1))
    return functions
