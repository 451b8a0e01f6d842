"""Sensors and units of a test that look mistaken against the model."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from femend.analysis.model_modes import model_modes
from femend.bench.reading.compared import OFF, Compared
from femend.bench.reading.measured import ALONE
from femend.bench.reading.models import LOWEST
from femend.bench.reading.run_compared import ComparedRun
from femend.correlate.doubts import level_doubts
from femend.correlate.exchanged import CLEAR
from femend.data import FRF
from femend.errors import RecordingError
from femend.estimate.frf import frf_lines_of
from femend.model import Model
from femend.model.free_body import elastic
from femend.study.doubts.plausible_output import time_axis_doubts
from femend.study.doubts.sampled import too_slow_for_modes

if TYPE_CHECKING:
    from femend.bench.reading.prepared import Prepared

__all__ = ["MEND_FIRST", "TIME_FIRST", "at_one_dof", "doubted_levels", "doubted_sensors", "doubted_times"]

# modes whose shapes tell a time axis
KNOWN = 30
TIME_FIRST = "mend the time axis of the recordings that look mistaken first: all frequencies rest on it"
MEND_FIRST = "mend the sensors that look mistaken before anything is updated"


def doubted_sensors(compared: Sequence[Compared]) -> list[str]:
    """Sensors that look reversed or exchanged in the paired modes of each recording, or a factor off in all of them."""
    told: list[str] = []
    for c in compared:
        texts = [*(f.text for f in c.faults), *(s.text for s in c.scaled)]
        told += [f"recording {c.measured.name!r}: {text}" for text in texts]
    return told


def at_one_dof(compared: Sequence[Compared]) -> list[str]:
    """That the shapes of a recording are known at one DOF, where any two are alike."""
    return [
        f"recording {c.measured.name!r}: shapes are compared at one DOF, {c.dofs[0]}, where MAC is 1 of any two modes: "
        "it says nothing, and modes are paired by their frequencies alone; measure at more DOFs, or make sure that "
        "each pair is of one mode"
        for c in compared
        if len(c.dofs) == 1
    ]


def doubted_levels(compared: Sequence[Compared], *, of_all: bool = False) -> list[str]:
    """What the FRFs of a recording are larger or smaller by than the model's, where units explain it: of single
    sensors too, or `of_all` alone."""
    told = []
    for c in compared:
        frf = c.measured.frf
        if frf is not None and c.frf is not None:
            names = [str(channel.dof) for channel in frf.outputs]
            doubts = level_doubts(frf.H, c.frf.H, names, _clear(frf), frf.freq)
            known = {s.name for s in c.scaled}  # told by their shapes
            told += [
                f"recording {c.measured.name!r}: {d.text}"
                for d in doubts
                if not (d.channel and (of_all or d.channel in known))
            ]
    return told


def doubted_times(prepared: Prepared, compared: Sequence[Compared], runs: Sequence[ComparedRun] = ()) -> list[str]:
    """Recordings without their force whose time axis looks mistaken: what is `compared` has modes, or the speeds of
    `runs` lie, where the model has none."""
    names = {c.measured.name: c.measured.configuration for c in compared if c.measured.how == ALONE and _elsewhere(c)}
    for run in runs:
        m = run.measured
        if m.freq[-1] * OFF < _lowest(prepared.models.of(m.configuration)):
            names |= dict.fromkeys(m.held or (m.name,), m.configuration)
    told: list[str] = []
    for recording in prepared.study.recordings:
        if recording.name not in names or prepared.solver is not None:
            continue  # the deck beside a solver may have no modes
        model = prepared.models.of(names[recording.name])
        modes = model_modes(model, n_modes=KNOWN, zeta=prepared.study.damping_ratio)
        read = recording.read(prepared.study.units)
        found = [doubt.text for doubt in time_axis_doubts(read, modes, prepared.placed.pairing)]
        told += [f"recording {recording.name!r}: {text}" for text in found] or too_slow_for_modes(read, modes.freq)
    return told


def _elsewhere(c: Compared) -> bool:
    """Are the modes of a recording paired with none of the model's, or with modes at other frequencies?"""
    rows = c.comparison.table.rows
    return not rows or float(np.median([abs(np.log1p(r.freq_difference)) for r in rows])) > np.log(OFF)


def _lowest(model: Model) -> float:
    """The lowest elastic mode of a model in Hz."""
    return float(min(elastic(model_modes(model, n_modes=LOWEST).freq), default=0.0))


def _clear(frf: FRF) -> NDArray[np.bool_] | None:
    """Values (n_freq, n_out, n_in) that stand clear of their noise; None where lines are too few to tell it."""
    try:
        lines = [frf_lines_of(frf, j) for j in range(len(frf.inputs))]
    except RecordingError:
        return None
    clear = np.zeros(frf.H.shape, dtype=np.bool_)
    clear[frf.freq > 0] = np.stack([np.abs(one.H) > CLEAR * one.noise for one in lines], axis=2)
    return clear
