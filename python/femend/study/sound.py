"""What is wrong with the channels of a study's recordings: refused where nothing is left of them, else told."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femend.data import FRF, Recording
from femend.data.recording import RESPONSES
from femend.errors import RecordingError, SignalError
from femend.signal import check_signals

__all__ = ["with_warnings"]


def with_warnings(recording: Recording) -> Recording:
    """`recording` with what `check_signals` finds on its channels as `warnings`, each with channel and time.

    A response that stands still would be taken for a node of every shape: SignalError. So would an FRF that is zero on
    all lines: RecordingError. Weak channels and clipped or held stretches are warnings.
    """
    if isinstance(recording.data, FRF):
        _no_empty_frf(recording, recording.data)
        return recording
    if not recording.is_time:
        return recording
    data = recording.time
    told = []
    for fault in check_signals(data):
        if fault.kind == "dead" and data.channels[fault.row].quantity in RESPONSES:
            raise SignalError(
                f"{fault.text}: leave the dead channel out of the recording",
                recording=recording.name,
                channel=fault.channel,
                time=fault.start,
            )
        told.append(fault.text)
    return replace(recording, warnings=(*recording.warnings, *told))


def _no_empty_frf(recording: Recording, frf: FRF) -> None:
    empty = np.argwhere(~frf.H.any(axis=0))
    if empty.size:
        i, j = (int(v) for v in empty[0])
        dead = f"{frf.outputs[i].dof} / {frf.inputs[j].dof}"
        raise RecordingError(
            f"recording {recording.name!r}: the FRF {dead} is 0 on all {len(frf.freq)} lines"
            f"{f', and so are {len(empty) - 1} others' if len(empty) > 1 else ''}; a sensor or a blow is missing: "
            "leave its response or force out",
            recording=recording.name,
            channel=dead,
        )
