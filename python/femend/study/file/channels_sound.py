"""What is doubtful about a recording's channels: refused where nothing is left of them, else told."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femend.data import FRF, Recording, Remark
from femend.data.recording import RESPONSES
from femend.errors import RecordingError, SignalError
from femend.numerals import plain
from femend.signal import check_signals
from femend.signal.exponential import exponential_window_of, window_taken_off
from femend.signal.mains import mains_hum
from femend.signal.suited import blows
from femend.study.file.cut_blows import cut_blows
from femend.study.file.tacho_sound import tacho_told

__all__ = ["with_warnings"]

# mean of an acceleration or a force from which it is told, in its rms about that mean
OFFSET = 0.3
# share of a channel's rms from which a line of the mains is told
HUM = 0.02
# per cent of a record that are its beginning
BEGINNING = 1


def with_warnings(recording: Recording) -> Recording:
    """`recording` without an exponential window that was put on it, and with what `check_signals` finds on its channels
    as `warnings`, each with channel and time.

    A response that stands still would be taken for a node of every shape: SignalError. So would an FRF that is zero on
    all lines: RecordingError. Weak channels and clipped or held stretches are warnings.
    """
    if isinstance(recording.data, FRF):
        _no_empty_frf(recording, recording.data)
        return recording
    if not recording.is_time:
        return recording
    data = recording.time
    told: list[str] = cut_blows(recording)
    forces = data.rows("force") if told else ()
    for fault in check_signals(data):
        if fault.kind == "dead" and data.channels[fault.row].quantity in RESPONSES:
            raise SignalError(
                f"{fault.text}: leave the dead channel out of the recording",
                recording=recording.name,
                channel=fault.channel,
                time=fault.start,
            )
        if fault.kind != "clipped" or fault.row not in forces:
            told.append(fault.text)
    recording, window_told = _without_window(recording)
    told += [*window_told, *_offsets(recording), *_preloads(recording), *_hum(recording), *tacho_told(recording)]
    return replace(recording, warnings=(*recording.warnings, *told))


def _without_window(recording: Recording) -> tuple[Recording, list[str]]:
    """The recording as it was before an exponential window was put on it, and what is said of that."""
    data = recording.time
    window = exponential_window_of(data) if recording.excitation == "measured" else None
    if window is None:
        return recording, []
    end, forced = 100 * float(window.values(data)[-1]), bool(set(window.rows) & set(data.rows("force")))
    off = "the sensors and the force" if forced else "the sensors, not off the force, whose noise does not fall"
    said = (
        f"recording {recording.name!r}: an exponential window is on it, since the noise of all its sensors falls with "
        f"exp(-{plain(window.decay, 3)} t), to {plain(end, 2)} % of what it is at the beginning. It is damping, of "
        f"{plain(10 * window.decay / (2 * np.pi), 2)} % of the critical one at 10 Hz, that the structure does not "
        f"have: it was taken off {off}, from the {'blow' if window.begin else 'first sample'} on. Export time records "
        "without a window"
    )
    return replace(recording, data=window_taken_off(data, window)), [said]


def _offsets(recording: Recording) -> list[str]:
    """Accelerations that do not swing about zero: what is shaken comes back, so that a mean is the sensor's."""
    data = recording.time
    told: list[str] = []
    for row in data.rows("acceleration"):
        channel, y = data.channels[row], data.values[row]
        mean, swing = float(y.mean()), float(y.std())
        if abs(mean) <= OFFSET * swing:
            continue
        share = abs(mean) / float(np.hypot(mean, swing))
        said = (
            f"has a mean of {plain(mean)} {channel.unit} and "
            f"swings about it by {plain(swing)} {channel.unit} rms: no model predicts an offset, so it alone is an "
            f"error of {plain(share, 2)} in this channel; take it off before (a sensor that shows gravity is off by 1 "
            "g)"
        )
        told.append(Remark(recording.name, said, channel.text, f"offset in {channel.unit}"))
    return told


def _preloads(recording: Recording) -> list[str]:
    """Forces with a mean from their beginning on, as a preload or a sensor's offset is; one that sets in is none. A
    hammer's offset is taken off (`signal/hammer.py`)."""
    data = recording.time
    told: list[str] = []
    if blows(data).size:
        return []
    for row in data.rows("force"):
        channel, x = data.channels[row], data.values[row]
        mean, swing = float(x.mean()), float(x.std())
        if abs(mean) <= OFFSET * swing or abs(float(x[: BEGINNING * x.size // 100 + 1].mean())) < 0.5 * abs(mean):
            continue
        said = (
            f"has a mean of {plain(mean)} {channel.unit} from its "
            f"beginning on and swings about it by {plain(swing)} {channel.unit} rms: it would set the model in motion, "
            "and a structure that rests under it does not move; take it off before"
        )
        told.append(Remark(recording.name, said, channel.text, f"preload in {channel.unit}"))
    return told


def _hum(recording: Recording) -> list[str]:
    """Lines of the mains in responses whose force is measured and does not hold them."""
    data = recording.time
    told: list[str] = []
    if recording.excitation != "measured":
        return []
    for hum in mains_hum(data):
        if hum.share < HUM:
            continue
        channel = data.channels[hum.row]
        said = (
            f"holds a line of {plain(hum.freq, 4)} Hz with "
            f"{plain(hum.level)} {channel.unit} rms, {plain(100 * hum.share, 2)} % of all it shows, which the force "
            "does not hold: hum of the mains (a ground loop, an unshielded cable), or a machine nearby. A model would "
            "have to make a force of it: mend the wiring, or filter the line off before"
        )
        told.append(Remark(recording.name, said, channel.text, f"hum in {channel.unit}"))
    return told


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
