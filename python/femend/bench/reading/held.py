"""The operating shape of a recording at a held speed: one order, averaged over whole revolutions against the tacho."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.data import Geometry, Recording
from femend.diagnose.staged.prepare import RunData
from femend.dof import Dof
from femend.numerals import plain
from femend.study.file.study import Study, StudyRecording

__all__ = ["NOISY", "HeldShapes", "held_shapes", "known_unbalance"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# revolutions of a stretch, in which whole, half and quarter orders are told apart, and the fewest of such stretches
# whose scatter says how far the mean is off
REVOLUTIONS, FEWEST = 4, 5
# a shape of which noise is a larger share is none to be compared
NOISY = 0.5
# how many times longer a recording may have to be for that to be advice
LONGEST = 20.0


@dataclass(frozen=True, eq=False)
class HeldShapes:
    """One recording at a held speed: `shape` (n_dof,) complex accelerations per unit course of the `order`, its line
    `freq` in Hz, and the deviation `sd` (n_dof,) of every value; the rest as of `MeasuredRun`.

    What has the same `rotor` is one rotor at several speeds, whose forces belong together.
    """

    name: str
    role: str
    configuration: str
    freq: float
    shape: ComplexArray
    sd: FloatArray
    dofs: tuple[Dof, ...]
    nodes: tuple[int, ...]
    axis: int
    order: float
    rotor: tuple[object, ...]
    geometry: Geometry | None = None
    warnings: tuple[str, ...] = ()
    unbalance: tuple[tuple[int, complex], ...] = ()
    sense: int = 0


def known_unbalance(recording: Recording, order: float) -> tuple[tuple[tuple[int, complex], ...], int]:
    """The unbalance and the sense of rotation that are known of a recording; nothing of another order than 1, whose
    forces are others."""
    rotating = recording.rotating
    return ((), 0) if rotating is None or order != 1.0 else (rotating.unbalance, rotating.sense)


def held_shapes(data: RunData, told: StudyRecording, recording: Recording, study: Study) -> HeldShapes | str | None:
    """The operating shape of a recording whose speed is held, a sentence where it cannot be compared, and None where
    the speed is not held.

    It is held where it stays within the half-power width of a mode of the study's damping ratio, twice that ratio, so
    that the mean over the recording is the shape at one speed. Amplitudes are those of least squares in stretches of
    four revolutions; the scatter over the stretches gives the deviation of their mean.
    """
    low, high = float(data.rev_per_s.min()), float(data.rev_per_s.max())
    mean = float(data.rev_per_s.mean())
    if high - low > 2 * study.damping_ratio * mean:
        return None
    who, speed = f"recording {told.name!r}", mean / data.order
    band = study.correlation.band or (0.0, np.inf)
    if not band[0] <= mean <= band[1]:
        return (
            f"{who} is not compared in order {data.order:g}: its speed is held at {plain(speed)} rev/s, {plain(mean)} "
            f"Hz, outside the band {band[0]:g} to {band[1]:g} Hz of [correlation]"
        )
    if mean > 0.45 * recording.time.rate:
        return (
            f"{who} is not compared in order {data.order:g}: {plain(mean)} Hz is too near to half its sampling rate, "
            f"{plain(0.5 * recording.time.rate)} Hz"
        )
    amplitudes = _stretches(data)
    if len(amplitudes) < FEWEST:
        return (
            f"{who} is not compared: at {plain(speed)} rev/s it holds {REVOLUTIONS * len(amplitudes)} whole "
            f"revolutions clear of its ends, fewer than {REVOLUTIONS * FEWEST}; record longer"
        )
    course = (2 * np.pi * mean) ** 2
    spread = amplitudes.std(axis=0, ddof=1) / np.sqrt(len(amplitudes))
    noise = float(np.linalg.norm(spread)) / max(float(np.linalg.norm(amplitudes.mean(axis=0))), 1e-300)
    if noise > NOISY:
        return _drowned(who, data, len(amplitudes), noise)
    rotating = recording.rotating
    assert rotating is not None
    # angle 0 is at the first pulse: with several pulses to a revolution it is another tooth in every recording
    alone = told.name if rotating.pulses_per_revolution != 1 else ""
    known = known_unbalance(recording, data.order)
    rotor = (
        told.role,
        told.configuration,
        data.nodes,
        data.axis,
        data.sensors,
        data.order,
        rotating.tacho,
        alone,
        known,
    )
    return HeldShapes(
        told.name, told.role, told.configuration, mean, amplitudes.mean(axis=0) / course,
        np.maximum(spread / course, 1e-300), data.sensors, data.nodes, data.axis, data.order, rotor,
        recording.geometry, (), *known,
    )  # fmt: skip


def _drowned(who: str, data: RunData, stretches: int, noise: float) -> str:
    """That `noise` is too large a share of what the mean over `stretches` shows, and what would help."""
    order = "" if data.order == 1.0 else f" in order {data.order:g}"
    speed = float(data.rev_per_s.mean()) / data.order
    told = (
        f"{who} is not compared{order}: at {plain(speed)} rev/s {plain(100 * noise, 3)} % of its shape is noise, over "
        f"{REVOLUTIONS * stretches} revolutions"
    )
    times = (noise / NOISY) ** 2  # a mean over n stretches is off by 1/sqrt(n)
    if times > LONGEST:
        return f"{told}; it shows next to nothing of this order: leave the recording out, or run nearer to a resonance"
    return f"{told}; record {plain(np.ceil(times), 2)} times as long, or run nearer to a resonance"


def _stretches(data: RunData) -> ComplexArray:
    """Amplitudes (n_stretches, n_dof) of the order in stretches of whole revolutions, where filters have no ends."""
    t = np.arange(data.y.shape[1], dtype=np.float64) * data.dt
    clear = np.flatnonzero((data.slips == 1.0) & (t >= data.speed.start) & (t <= data.speed.stop))
    if not clear.size:
        return np.zeros((0, len(data.y)), dtype=np.complex128)
    angle = data.speed.at(t[clear])[1]
    turn = 2 * np.pi * REVOLUTIONS * data.order
    number = np.floor((angle - angle[0]) / turn).astype(np.int64)
    found = []
    for k in range(int(number[-1])):  # the last one is cut off
        inside = clear[number == k]
        theta = angle[number == k]
        basis = np.column_stack([np.cos(theta), -np.sin(theta), np.ones_like(theta)])
        x = np.linalg.lstsq(basis, data.y[:, inside].T, rcond=None)[0]
        found.append(x[0] + 1j * x[1])
    return np.array(found, dtype=np.complex128).reshape(len(found), len(data.y))
