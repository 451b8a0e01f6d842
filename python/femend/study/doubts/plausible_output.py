"""Recordings of a force nobody measured against the deck as it stands: what its shapes say of single sensors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from femend.analysis.frf import shapes_at
from femend.correlate.doubts import Doubt, exchange_doubts, misread_doubts, time_doubts, twice_doubts
from femend.correlate.exchanged import Shapes, exchanged, put_right
from femend.correlate.misread import Misread, misread
from femend.correlate.time_axis import time_factor
from femend.data import ModeSet, Recording
from femend.errors import FemendError
from femend.modal.output_only.prepare import motion_rows
from femend.modal.output_only.principal import principal_responses
from femend.model import Pairing
from femend.signal import to_quantity

__all__ = ["NEAR", "output_doubts", "time_axis_doubts"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
# lines up to the highest known mode over this are looked at: a model may be off by so much
NEAR = 1.25


def output_doubts(recording: Recording, modes: ModeSet, pairing: Pairing) -> list[Doubt]:
    """Doubts about the sensors of a time `recording` without its force against the `modes` of the model, whose forces
    are taken to drive every mode alike. Levels of all sensors together tell nothing without a force."""
    response = recording.response
    if response is None:
        return []
    try:
        rows = motion_rows(response)
        same = to_quantity(response, "acceleration", rows=rows)
    except FemendError:
        return []  # no motion, or too short to be differentiated: what takes the recording next says so
    dofs = [d for i in rows if (d := same.channels[i].dof) is not None]
    y, dt = same.values[rows], same.dt
    out = shapes_at(modes, [pairing[d].dof for d in dofs])
    shapes = Shapes(modes.freq, modes.zeta, out, np.ones((1, modes.n_modes)))
    freq, h, noise = _lines(y, dt, modes)
    if told := twice_doubts(h[:, :, None], dofs):
        return told
    if axis := time_doubts(time_factor(h, noise, freq, shapes), dt):
        return axis  # of single sensors nothing is known then
    names = [str(d) for d in dofs]
    pairs = exchanged(h[:, :, None], noise[:, :, None], freq, shapes)
    directions = [pairing[d].dof.component for d in dofs]
    found = _misread(y[put_right(len(dofs), pairs)], dt, modes, shapes, directions)
    if pairs and found:
        # a sensor in other units, or upside down, moves unlike the model wherever it is
        alone = _misread(y, dt, modes, shapes, directions)
        pairs, found = ([], alone) if alone else (pairs, [])
    return [*exchange_doubts(pairs, names), *misread_doubts(found, names)]


def time_axis_doubts(recording: Recording, modes: ModeSet, pairing: Pairing) -> list[Doubt]:
    """Of `output_doubts` the one about the time axis: for recordings, a run's too, whose frequencies are none of the
    model's."""
    return [doubt for doubt in output_doubts(recording, modes, pairing) if doubt.kind == "time axis"]


def _lines(y: FloatArray, dt: float, modes: ModeSet) -> tuple[FloatArray, ComplexArray, FloatArray]:
    """Principal responses on the lines that the modes known reach."""
    freq, h, noise = principal_responses(y, dt)
    below = freq < modes.freq[-1] / NEAR
    return freq[below], h[below], noise[below]


def _misread(y: FloatArray, dt: float, modes: ModeSet, shapes: Shapes, directions: list[int]) -> list[Misread]:
    """Misread sensors among those of one direction: how much a structure is driven across it nobody knows."""
    found = []
    for component in sorted(set(directions)):
        rows = np.flatnonzero(np.array(directions) == component)
        if len(rows) < 3:
            continue
        freq, h, noise = _lines(y[rows], dt, modes)
        own = misread(h, noise, freq, replace(shapes, out=shapes.out[rows]))
        found += [replace(one, sensor=int(rows[one.sensor])) for one in own]
    return found
