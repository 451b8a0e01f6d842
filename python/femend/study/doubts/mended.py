"""Recordings as they would be without the mistakes that are doubted in them, and without sensors."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from femend.data import FRF, Channel, Recording, Test, TimeData
from femend.data.recording import RESPONSES
from femend.study.doubts.plausible import Doubted

__all__ = ["mended", "sensors_of", "without"]

FloatArray = NDArray[np.float64]


def mended(test: Test, doubted: Sequence[Doubted]) -> Test:
    """The recordings of a test with the mistakes of `doubted` taken out of those that raise the doubt, and of those
    that were not fitted where all fitted ones raise it (but for a time axis, which a file has of its own)."""
    fitted = {r.name for r in test if r.role == "fit"}
    done = []
    for recording in test:
        for one in doubted:
            alike = recording.name not in fitted and fitted <= set(one.recordings) and one.doubt.kind != "time axis"
            if recording.name in one.recordings or alike:
                recording = _mended(recording, one)
        done.append(recording)
    return Test(tuple(done))


def without(test: Test, sensors: Collection[str]) -> Test:
    """The recordings of a test without the responses of `sensors`, by their DOF as text."""
    return Test(tuple(_without(r, sensors) for r in test)) if sensors else test


def sensors_of(recordings: Iterable[Recording]) -> list[str]:
    """The sensors of all recordings, each once, by their DOF as text."""
    return list(dict.fromkeys(str(c.dof) for r in recordings for c in r.sensors))


def _mended(recording: Recording, one: Doubted) -> Recording:
    """A recording without one mistake."""
    doubt, data = one.doubt, recording.data
    if doubt.kind == "time axis":
        return recording if doubt.factor is None else replace(recording, data=_rated(recording.time, doubt.factor))
    if isinstance(data, TimeData):
        rows = _by_name(data.channels, ("force",) if doubt.kind == "force sign" else RESPONSES)
        values = np.array(data.values)
        _mend(values, rows, one)
        return replace(recording, data=data.with_values(values))
    if not isinstance(data, FRF):
        return recording
    H = np.array(data.H)
    if doubt.kind == "force sign":
        _mend(np.moveaxis(H, 2, 0), _by_name(data.inputs), one)
    else:
        _mend(np.moveaxis(H, 1, 0), _by_name(data.outputs), one)
    return replace(recording, data=replace(data, H=H))


def _rated(data: TimeData, factor: float) -> TimeData:
    """Time records of which the step was `factor` times what it should be."""
    return replace(data, dt=data.dt / factor, t0=data.t0 / factor)


def _mend(values: NDArray, rows: dict[str, int], one: Doubted) -> None:
    """Takes a mistake out of `values` (n_channels, ...) in place, of which `rows` are by name."""
    doubt = one.doubt
    if doubt.order and all(name in rows for name in doubt.order):
        shows = [rows[name] for name in doubt.order]
        values[[*shows[1:], shows[0]]] = values[shows]
    elif doubt.factor is not None:
        concerned = [rows[doubt.channel]] if doubt.channel in rows else [] if doubt.channel else list(rows.values())
        values[concerned] /= doubt.factor


def _by_name(channels: Sequence[Channel], quantities: Collection[str] = ()) -> dict[str, int]:
    """Rows of channels that have a DOF by its text, of all quantities where none are given."""
    return {
        str(c.dof): i
        for i, c in enumerate(channels)
        if c.dof is not None and (not quantities or c.quantity in quantities)
    }


def _without(recording: Recording, sensors: Collection[str]) -> Recording:
    data = recording.data
    if isinstance(data, FRF):
        kept = [i for i, c in enumerate(data.outputs) if str(c.dof) not in sensors]
        return recording if len(kept) == len(data.outputs) else replace(recording, data=data.select(outputs=kept))
    if not isinstance(data, TimeData):
        return recording
    gone = {i for name, i in _by_name(data.channels, RESPONSES).items() if name in sensors}
    rows = [i for i in range(len(data.channels)) if i not in gone]
    return replace(recording, data=data.select(rows)) if gone else recording
