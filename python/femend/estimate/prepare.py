"""From recordings and a model to records ready for estimation: pairing, units of response, noise, repetition."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from femend.data import Channel, Recording, Test
from femend.data.geometry import stated
from femend.errors import PairingError, RecordingError
from femend.estimate.frf import frf_lines_of
from femend.estimate.lines import FitRecord
from femend.estimate.noise import fewest_samples, noise_of
from femend.estimate.other_units import refuse_other_units
from femend.model import Model, Pairing, pair_sensors
from femend.model.free_body import elastic
from femend.model.sensor_frames import other_frames
from femend.numerals import plain
from femend.signal.calculus import DERIVATIVES
from femend.signal.hammer import blow_force

__all__ = [
    "as_acceleration",
    "check_sampling",
    "fit_records",
    "frf_records",
    "pair_test",
    "period_of",
]

FloatArray = NDArray[np.float64]

# a force record repeats itself where the last period differs from the one before by less than this
REPEATS = 0.05
# fewer samples than this per cycle of the band's end are too few to tell a response from its image (`used_band` ends
# at 2.086 where the force is white)
SAMPLES_PER_CYCLE = 2.05
# what else a rate too low may come from
NOT_ITS_RATE = "; if that is not its rate, mend its time axis: a column that counts milliseconds is called 'time [ms]'"


def pair_test(test: Test, model: Model) -> Pairing:
    """Every sensor and shaker of a test with its DOF of the model; raises PairingError, which names the recording, and
    UnitError for recordings in other units than the model's."""
    refuse_other_units(test, model.units)
    channels: list[Channel] = []
    whose: dict[str, str] = {}
    for recording in test:
        for channel in (*recording.sensors, *recording.inputs):
            channels.append(channel)
            named = f", channel {channel.name!r}" if channel.name else ""
            whose.setdefault(str(channel.dof), f"recording {recording.name!r}{named}")
    places, systems = stated(recording.geometry for recording in test)
    grid = ~model.is_scalar
    try:
        pairing = pair_sensors(channels, model.node_ids[grid], model.xyz[grid], sensor_xyz=places)
    except PairingError as error:
        if error.sensor not in whose:
            raise
        raise PairingError(f"{whose[error.sensor]}: {error}", sensor=error.sensor) from None
    warnings = (*pairing.warnings, *other_frames(pairing, model, systems))
    return replace(pairing, warnings=warnings, mesh=model.mesh_key)


def period_of(u: FloatArray) -> int:
    """Samples of a period of a force record u (n_in, n) that repeats itself at least twice up to its end; 0 for none.

    >>> period_of(np.tile(np.sin(np.arange(50) ** 2), 4)[None])
    50
    """
    n = u.shape[1]
    tail = u[:, n // 2 :] - u[:, n // 2 :].mean(axis=1, keepdims=True)
    m = tail.shape[1]
    spectrum = (np.abs(np.fft.rfft(tail, 2 * m, axis=1)) ** 2).sum(axis=0)
    correlation = np.fft.irfft(spectrum)[:m] / (m - np.arange(m))
    reach = m - m // 8
    if correlation[0] <= 0 or reach < 3:
        return 0
    low = int(np.argmax(correlation < 0.5 * correlation[0]))
    peaks = [
        k
        for k in range(max(low, 2), reach - 1)
        if correlation[k] > 0.9 * correlation[0] and correlation[k - 1] <= correlation[k] >= correlation[k + 1]
    ]
    for k in peaks:
        last, before = u[:, n - k :], u[:, n - 2 * k : n - k]
        if before.shape[1] == k and (last - before).std() < REPEATS * np.sqrt(2) * last.std():
            return k
    return 0


def check_sampling(records: Sequence[FitRecord], band: tuple[float, float], freq: FloatArray) -> None:
    """Raises RecordingError for a record sampled too slowly for the `band` (Hz) or for a model with frequencies `freq`.

    `freq` (r,) are all of the model's natural frequencies that matter, in Hz.
    """
    moving = elastic(freq)
    for r in records:
        if r.frf is not None:
            continue  # lines as they were measured: nothing was sampled here
        rate = 1 / r.dt
        said = f"recording {r.name!r} is sampled at {plain(rate)} Hz"
        if rate < SAMPLES_PER_CYCLE * band[1]:
            raise RecordingError(
                f"{said}, the band of the fit recordings is {plain(band[0])} to {plain(band[1])} Hz: too slow for its "
                f"end; record at {plain(2.5 * band[1])} Hz or more, or leave the recording out{NOT_ITS_RATE}",
                recording=r.name,
            )
        if moving.size and moving.min() > rate / 2:
            raise RecordingError(
                f"{said} and its band is {plain(band[0])} to {plain(band[1])} Hz: too slow for the model, whose lowest "
                f"mode is at {plain(moving.min())} Hz; record at {plain(2.5 * moving.min())} Hz or more, or correct "
                f"the model{NOT_ITS_RATE}",
                recording=r.name,
            )


def fit_records(recordings: Sequence[Recording], model: Model, pairing: Pairing) -> list[FitRecord]:
    """Records with their forces, accelerations at every response channel; every input of an FRF is a record. Of a
    recording whose excitation was not measured the forces are (0, n).

    Velocities and displacements are differentiated in the frequency domain. Raises RecordingError for a record without
    a response the model has, or of a kind that the fit cannot use.
    """
    done: list[FitRecord] = []
    for r in recordings:
        done += [_time_record(r, model, pairing)] if r.is_time else frf_records(r, model, pairing)
    return done


def _time_record(recording: Recording, model: Model, pairing: Pairing) -> FitRecord:
    u, y, dt = _arrays(recording)
    n, least = y.shape[1], fewest_samples(len(u))
    if n < least:
        raise RecordingError(
            f"recording {recording.name!r}: {n} samples, {plain(n * dt, 3)} s, are too few to be fitted, which takes "
            f"{least} at least and should show several periods of the lowest mode: record longer, or leave the "
            "recording out",
            recording=recording.name,
        )
    period = period_of(u if len(u) else y)
    rows = _rows(recording, model, pairing)
    _refuse_unmoved(recording, recording.inputs if len(u) else (), rows[0], model)
    return FitRecord(recording.name, u, y, dt, *rows, noise_of(u, y, period), period)


def frf_records(recording: Recording, model: Model, pairing: Pairing) -> list[FitRecord]:
    """One record for every input of a recording of FRFs, called after it and, with several, the input's DOF."""
    data = recording.frf
    (into, in_signs), (out, out_signs) = (_at(channels, model, pairing) for channels in (data.inputs, data.outputs))
    _refuse_unmoved(recording, data.inputs, into, model)
    done = []
    for j, channel in enumerate(data.inputs):
        lines = frf_lines_of(data, j)
        name = recording.name if len(data.inputs) == 1 else f"{recording.name} / {channel.dof}"
        size = np.abs(lines.H).T
        noise = np.sqrt((lines.noise**2).mean(axis=0))
        u = np.ones((1, size.shape[1]))
        rows = (into[[j]], out, in_signs[[j]], out_signs)
        done.append(FitRecord(name, u, size, 0.0, *rows, noise, frf=lines, recording=recording.name))
    return done


def _refuse_unmoved(recording: Recording, inputs: Sequence[Channel], into: NDArray[np.int64], model: Model) -> None:
    """Raises RecordingError where all the forces of a recording act on rows `into` that the model holds: nothing would
    follow from them."""
    if not len(into) or abs(model.transformation().tocsr()[into]).sum() > 0:
        return
    named = " and ".join(str(c.dof) for c in inputs)
    raise RecordingError(
        f"recording {recording.name!r}: the force {named} acts where the model cannot move, since the deck holds it "
        "there: nothing follows from it; correct its node or direction, or the supports of the deck",
        recording=recording.name,
        channel=inputs[0].text,
    )


def _arrays(recording: Recording) -> tuple[FloatArray, FloatArray, float]:
    data = recording.time
    force, response = recording.force, recording.response
    if response is None or (force is None and recording.excitation == "measured"):
        what = "response" if response is None else "force"
        raise RecordingError(
            f"recording {recording.name!r} has no {what} channel with node and direction; it cannot be used to fit",
            recording=recording.name,
        )
    y = response.values.copy()
    for i, channel in enumerate(response.channels):
        if channel.quantity not in DERIVATIVES:
            raise RecordingError(
                f"recording {recording.name!r}: channel {channel.text} measures {channel.quantity}; the fit takes "
                "accelerations, velocities and displacements: leave the channel out",
                recording=recording.name,
                channel=channel.text,
            )
        y[i] = as_acceleration(y[i], channel.quantity, data.dt)
    u = np.zeros((0, y.shape[1])) if force is None or recording.excitation != "measured" else blow_force(force)
    return u, y, data.dt


def as_acceleration(x: FloatArray, quantity: str, dt: float) -> FloatArray:
    """Samples x (n,) of a `quantity` of `DERIVATIVES` at step `dt` (s) as an acceleration (n,), differentiated in the
    frequency domain."""
    times = DERIVATIVES["acceleration"] - DERIVATIVES[quantity]
    if not times:
        return x
    omega = 2 * np.pi * np.fft.rfftfreq(len(x), dt)
    return np.asarray(np.fft.irfft((1j * omega) ** times * np.fft.rfft(x), n=len(x)))


def _rows(
    recording: Recording, model: Model, pairing: Pairing
) -> tuple[NDArray[np.int64], NDArray[np.int64], FloatArray, FloatArray]:
    force, response = recording.force, recording.response
    assert response is not None
    driven = [] if force is None or recording.excitation != "measured" else force.channels
    (into, in_signs), (out, out_signs) = (_at(channels, model, pairing) for channels in (driven, response.channels))
    return into, out, in_signs, out_signs


def _at(channels: Sequence[Channel], model: Model, pairing: Pairing) -> tuple[NDArray[np.int64], FloatArray]:
    """Rows of the g-set and signs of channels with a DOF."""
    try:
        dofs = [pairing[c.dof].dof for c in channels if c.dof is not None]
    except KeyError as error:
        raise PairingError(f"{error.args[0]}; pair these recordings with this model") from None
    return np.array([model.row(d) for d in dofs], dtype=np.int64), np.array([float(d.sign) for d in dofs])
