"""The operating shapes of a study's run-ups and run-downs: order 1 against its tacho, and where it peaks."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femend.data import ODS, Channel, Geometry, Recording
from femend.diagnose.staged.prepare import RunData, run_data, tacho_warnings
from femend.diagnose.staged.run_modes import mode_lines, too_short_for_modes
from femend.dof import Dof
from femend.errors import FemendError
from femend.estimate.joint import ods_frf
from femend.io.recordings import read_modes
from femend.signal import modal_peaks, peak_frequencies
from femend.study.sound import with_warnings
from femend.study.study import Study, StudyRecording

__all__ = ["MeasuredRun", "measured_runs", "without_runs"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# a peak at which noise is a larger share of the shape is none to be compared
NOISY = 0.5
# fewer lines than this hold no peak to compare
FEWEST_LINES = 12
# a line is averaged over this share of the highest speed, as where modes are read off a run
WIDTH = 0.004


@dataclass(frozen=True, eq=False)
class MeasuredRun:
    """The operating shapes of one rotor's run.

    `shapes` (n_lines, n_dof) complex accelerations per unit course Omega^2 cos(theta) of order 1, in the model's units,
    at the lines `freq` (n_lines,) in Hz, which are revolutions per second, with the deviation `sd` (n_lines, n_dof) of
    every value; `dofs` are the sensors, with their signs not applied. `peaks` (n_peaks,) are the lines nearest to where
    they peak, in the order of frequency, and `peak_freq` (n_peaks,) in Hz between the lines. `nodes` are the bearings
    and `axis` (0, 1, 2) the shaft's direction; `warnings` are what to mind.
    """

    name: str
    role: str
    configuration: str
    freq: FloatArray
    shapes: ComplexArray
    sd: FloatArray
    dofs: tuple[Dof, ...]
    peaks: NDArray[np.int64]
    peak_freq: FloatArray
    nodes: tuple[int, ...]
    axis: int
    geometry: Geometry | None = None
    warnings: tuple[str, ...] = ()

    @property
    def noise(self) -> FloatArray:
        """Share of noise in the shape of every line (n_lines,)."""
        return _noise(self.shapes, self.sd)


def _noise(shapes: ComplexArray, sd: FloatArray) -> FloatArray:
    """Share of noise in shapes (n_lines, n_dof) of which every value has the deviation `sd`."""
    return np.asarray(np.linalg.norm(sd, axis=1) / np.linalg.norm(shapes, axis=1))


def measured_runs(study: Study) -> tuple[tuple[MeasuredRun, ...], tuple[str, ...]]:
    """The runs of recordings with role fit or validate, and a sentence for each that cannot be compared.

    Raises what the reading of a file raises; what a run lacks (a tacho that stands still, strains, too few lines) is
    told, since the other recordings can be compared without it.
    """
    found: list[MeasuredRun] = []
    passed: list[str] = []
    for recording in study.recordings:
        if recording.excitation != "rotating" or recording.role == "predict":
            continue
        if read_modes(recording.file, units=study.units) is not None:
            continue  # a file of modes, which are compared as modes
        try:
            read = recording.read(study.units)
        except FemendError as error:
            error.add_note(f"while reading [[recording]] {recording.name!r} of {study.file}")
            raise
        try:
            one = _run_of(recording, with_warnings(read), study.correlation.band)
        except FemendError as error:
            passed.append(f"recording {recording.name!r} is not compared: {error}")
            continue
        passed += [one] if isinstance(one, str) else []
        found += [one] if isinstance(one, MeasuredRun) else []
    return tuple(found), tuple(passed)


def _run_of(told: StudyRecording, recording: Recording, band: tuple[float, float] | None) -> MeasuredRun | str:
    who = f"recording {told.name!r}"
    if not recording.is_time:
        return f"{who} is not compared: it is a rotor's run and holds no time records, from which orders are taken"
    if not recording.sensors:
        return f"{who} is not compared: it holds no response with a node and a direction"
    data = run_data(recording)
    straight = [i for i, d in enumerate(data.sensors) if not d.is_rotation]
    if not straight:
        return f"{who} is not compared: all its sensors turn, and rotations are not compared with the model's modes"
    # a sum over metres and radians depends on the unit of length, so that rotations stay out here as with modes
    data = replace(data, y=data.y[straight], sensors=tuple(data.sensors[i] for i in straight))
    short = too_short_for_modes(data)
    if short:
        return f"{who} is not compared: {short.removeprefix(f'{who}: ')}"
    lines, step = mode_lines(data)
    low, high = band or (0.0, np.inf)
    freq = lines[(lines >= low) & (lines <= high)]
    if freq.size < FEWEST_LINES:
        return (
            f"{who} is not compared: its speeds go through {lines[0]:.4g} to {lines[-1]:.4g} Hz, of which the band "
            f"{low:g} to {high:g} Hz of [correlation] holds {freq.size} lines, fewer than {FEWEST_LINES}"
        )
    shapes = ods_frf(data.run, data.y, freq, max(2.5 * step, WIDTH * float(data.rev_per_s.max())))
    peaks, at, remarks = _peaks(data, freq, shapes.Y, shapes.sd)
    warnings = (*recording.warnings, *tacho_warnings(recording, data.speed), *(f"{who}: {r}" for r in remarks))
    return MeasuredRun(
        told.name, told.role, told.configuration, freq, shapes.Y, shapes.sd, data.sensors, peaks, at, data.nodes,
        data.axis, recording.geometry, warnings,
    )  # fmt: skip


def _peaks(
    data: RunData, freq: FloatArray, Y: ComplexArray, sd: FloatArray
) -> tuple[NDArray[np.int64], FloatArray, list[str]]:
    """Lines and frequencies at which the shapes per unit of the course peak, and what is to be said of peaks that are
    noise.

    What the forces of an unbalance gain with the speed is taken off, so that a peak is one of the structure.
    """
    channels = tuple(Channel(d, "acceleration", "m/s^2") for d in data.sensors)
    total = modal_peaks(ODS(data.name, freq, Y.T, channels, "order", order=1.0, speed=freq))
    at = peak_frequencies(freq, total)
    lines = np.array([int(np.argmin(np.abs(freq - f))) for f in at], dtype=np.int64)
    noise = _noise(Y, sd)[lines]
    lost = noise > NOISY
    told = [
        f"the peak at {f:.4g} Hz is not compared, {100 * share:.0f} % of its shape is noise"
        for f, share in zip(at[lost], noise[lost], strict=True)
    ]
    if lost.all():
        told.append(
            f"its operating shapes have no peak from {freq[0]:.4g} to {freq[-1]:.4g} Hz that stands out of the noise"
        )
    return lines[~lost], at[~lost], told


def without_runs(study: Study, use: str) -> tuple[str, ...]:
    """That the runs of `study` have no part in what it is read for, `use` ("an update"), a sentence for each."""
    return tuple(
        f"recording {r.name!r} is a rotor's run and has no part in {use}; `femend correlate` compares its operating "
        "shapes"
        for r in study.recordings
        if r.excitation == "rotating" and r.role != "predict"
    )
