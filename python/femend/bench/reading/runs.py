"""The operating shapes of a study's rotors: orders of run-ups against the tacho and where they peak, held speeds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femend.bench.reading.held import NOISY, HeldShapes, held_shapes, known_unbalance
from femend.data import ODS, Channel, Geometry, Recording
from femend.data.bands import within_band
from femend.diagnose.staged.prepare import RunData, run_data, tacho_warnings
from femend.diagnose.staged.run_modes import mode_lines, too_short_for_modes
from femend.dof import Dof
from femend.errors import FemendError
from femend.estimate.joint import Run, ods_frf
from femend.io.recordings import read_modes
from femend.numerals import plain
from femend.signal import modal_peaks, peak_frequencies
from femend.study.doubts.sampled import too_slow_for_band
from femend.study.file.channels_sound import with_warnings
from femend.study.file.study import Study, StudyRecording

__all__ = ["UPDATE", "MeasuredRun", "in_order", "measured_runs", "without_runs"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# what a study is read for where its runs may take part
UPDATE = "an update"
# fewer lines than this hold no peak to compare
FEWEST_LINES = 12
# share of the sampling rate up to which the filters before the lines leave an order as it is
USABLE = 0.34
# a line is averaged over this share of the highest speed, as where modes are read off a run
WIDTH = 0.004


@dataclass(frozen=True, eq=False)
class MeasuredRun:
    """The operating shapes of one rotor in one `order`: of a run, or of recordings at speeds that are `held`.

    `shapes` (n_lines, n_dof) complex accelerations per unit course Omega^2 cos(theta), in the model's units, of a shaft
    that turns `order` times while the rotor turns once, at the lines `freq` (n_lines,) in Hz, which are its revolutions
    per second, with the deviation `sd` (n_lines, n_dof) of every value; `dofs` are the sensors, with their signs not
    applied. `held` names the recording of every line where each is one at a held speed, and is empty for a run.
    `peaks` (n_peaks,) are the lines nearest to where a run peaks, in the order of frequency, and `peak_freq` (n_peaks,)
    in Hz between the lines. `nodes` are the bearings and `axis` (0, 1, 2) the shaft's direction; `unbalance` and
    `sense` are what is known of them (`femend.data.Rotating`); each line is the mean over `width` Hz; `warnings` are
    what to mind.
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
    order: float = 1.0
    held: tuple[str, ...] = ()
    unbalance: tuple[tuple[int, complex], ...] = ()
    sense: int = 0
    width: float = 0.0

    def of(self, recording: str) -> bool:
        """Are these shapes, or some of them, those of `recording`?"""
        return recording in (self.held or (self.name,))

    @property
    def noise(self) -> FloatArray:
        """Share of noise in the shape of every line (n_lines,)."""
        return _noise(self.shapes, self.sd)


def _noise(shapes: ComplexArray, sd: FloatArray) -> FloatArray:
    """Share of noise in shapes (n_lines, n_dof) of which every value has the deviation `sd`."""
    return np.asarray(np.linalg.norm(sd, axis=1) / np.linalg.norm(shapes, axis=1))


def measured_runs(study: Study) -> tuple[tuple[MeasuredRun, ...], tuple[str, ...]]:
    """The orders of [correlation] in recordings with role fit or validate, and a sentence for each that cannot be
    compared; recordings at held speeds of one rotor belong together.

    Raises what the reading of a file raises; what a run lacks (a tacho that stands still, strains, too few lines) is
    told, since the other recordings can be compared without it.
    """
    found: list[MeasuredRun] = []
    held: list[HeldShapes] = []
    passed: list[str] = []
    for recording in study.recordings:
        if recording.excitation != "rotating" or recording.role == "predict":
            continue
        if read_modes(recording.file, units=study.units) is not None:
            continue  # a file of modes, which are compared as modes
        try:
            read = with_warnings(recording.read(study.units))
        except FemendError as error:
            error.add_note(f"while reading [[recording]] {recording.name!r} of {study.file}")
            raise
        slow = too_slow_for_band(read, study.correlation.band)
        read = replace(read, warnings=(*slow, *read.warnings))
        for one in _orders_of(recording, read, study):
            passed += [*slow, one] if isinstance(one, str) else []
            held += [one] if isinstance(one, HeldShapes) else []
            found += [one] if isinstance(one, MeasuredRun) else []
    return (*found, *_together(held)), tuple(dict.fromkeys(passed))


def in_order(order: float) -> str:
    """What tells another `order` than 1."""
    return "" if order == 1.0 else f" in order {order:g}"


def _orders_of(told: StudyRecording, recording: Recording, study: Study) -> list[MeasuredRun | HeldShapes | str]:
    """The operating shapes of a recording in every order of the study, or why there are none."""
    who, orders = f"recording {told.name!r}", study.correlation.orders
    if not recording.is_time:
        return [f"{who} is not compared: it is a rotor's run and holds no time records, from which orders are taken"]
    if not recording.sensors:
        return [f"{who} is not compared: it holds no response with a node and a direction"]
    try:
        # filtered alike, so that the courses of all of them stand on the same lines
        top = run_data(recording, order=max(orders))
        every = [top if order == top.order else run_data(recording, order=order, f_max=top.f_max) for order in orders]
        straight = [i for i, d in enumerate(top.sensors) if not d.is_rotation]
        if not straight:
            return [
                f"{who} is not compared: all its sensors turn, and rotations are not compared with the model's modes"
            ]
        # a sum over metres and radians depends on the unit of length, so that rotations stay out here as with modes
        every = [replace(d, y=d.y[straight], sensors=tuple(d.sensors[i] for i in straight)) for d in every]
        doubts = tacho_warnings(recording, top.speed, top.order)
        warnings = (*recording.warnings, *doubts)
        found: list[MeasuredRun | HeldShapes | str] = []
        for data in every:
            held = held_shapes(data, told, recording, study)
            if held is None:
                beside = [d.run for d in every if d is not data]
                found.append(_run_of(told, recording, data, beside, study.correlation.band, warnings))
            else:
                found.append(held if isinstance(held, str) else replace(held, warnings=warnings))
        if any(isinstance(one, str) for one in found):
            found += doubts  # what is doubtful about the tacho may be why
    except FemendError as error:
        return [f"{who} is not compared: {error}"]
    return found


def _run_of(
    told: StudyRecording,
    recording: Recording,
    data: RunData,
    beside: Sequence[Run],
    band: tuple[float, float] | None,
    warnings: tuple[str, ...],
) -> MeasuredRun | str:
    who = f"recording {told.name!r}"
    short = too_short_for_modes(data)
    if short:
        return f"{who} is not compared: {short.removeprefix(f'{who}: ')}"
    lines, step = mode_lines(data)
    low, high = band or (0.0, np.inf)
    sampled = USABLE * recording.time.rate
    freq = lines[within_band(lines, (low, min(high, sampled)))]
    if freq.size < FEWEST_LINES:
        limits = f"the sampling up to {plain(sampled)} Hz"
        if band:
            limits = f"the band {low:g} to {high:g} Hz of [correlation]"
        return (
            f"{who} is not compared{in_order(data.order)}: its {'speeds go' if data.order == 1.0 else 'order goes'} "
            f"through {plain(lines[0])} to {plain(lines[-1])} Hz, of which {limits} holds {freq.size} lines, fewer "
            f"than {FEWEST_LINES}"
        )
    width = max(2.5 * step, WIDTH * float(data.rev_per_s.max()))
    shapes = ods_frf(data.run, data.y, freq, width, beside=beside)
    peaks, at, remarks = _peaks(data, freq, shapes.Y, shapes.sd)
    if lines[-1] > sampled:
        remarks.append(
            f"order {data.order:g} is compared up to {plain(freq[-1])} Hz, beyond which it is sampled too coarsely"
        )
    warnings = (*warnings, *(f"{who}: {r}" for r in remarks))
    return MeasuredRun(
        told.name, told.role, told.configuration, freq, shapes.Y, shapes.sd, data.sensors, peaks, at, data.nodes,
        data.axis, recording.geometry, warnings, data.order, (), *known_unbalance(recording, data.order), width,
    )  # fmt: skip


def _together(held: list[HeldShapes]) -> list[MeasuredRun]:
    """Recordings at held speeds with the same `HeldShapes.rotor`, in the order of their speeds."""
    rotors: dict[object, list[HeldShapes]] = {}
    for one in held:
        rotors.setdefault(one.rotor, []).append(one)
    found = []
    for some in rotors.values():
        some.sort(key=lambda h: h.freq)
        first = some[0]
        nothing = np.zeros(0, dtype=np.int64)
        found.append(
            MeasuredRun(
                ", ".join(h.name for h in some), first.role, first.configuration, np.array([h.freq for h in some]),
                np.array([h.shape for h in some]), np.array([h.sd for h in some]), first.dofs, nothing, np.zeros(0),
                first.nodes, first.axis, first.geometry, tuple(w for h in some for w in h.warnings), first.order,
                tuple(h.name for h in some), first.unbalance, first.sense,
            )
        )  # fmt: skip
    return found


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
    told = _lost_peaks(at[lost], noise[lost])
    if lost.all():
        told.append(
            f"its operating shapes have no peak from {plain(freq[0])} to {plain(freq[-1])} Hz that stands out of the "
            "noise"
        )
    return lines[~lost], at[~lost], told


def _lost_peaks(at: FloatArray, noise: FloatArray) -> list[str]:
    """What is said of peaks at `at` (n,) Hz that are not compared for the share of `noise` (n,) in their shapes."""
    if not at.size:
        return []
    low, high = (round(100 * float(share)) for share in (noise.min(), noise.max()))
    shares = f"{low}" if low == high else f"{low} to {high}"
    if at.size == 1:
        return [f"the peak at {plain(at[0])} Hz is not compared, {shares} % of its shape is noise"]
    return [
        f"{at.size} peaks from {plain(at[0])} to {plain(at[-1])} Hz are not compared, {shares} % of their shapes are "
        "noise"
    ]


def without_runs(study: Study, use: str) -> tuple[str, ...]:
    """That the runs of `study` have no part in what it is read for, `use` ("an update"), a sentence for each."""
    take = "; 'orders' in [updating] responses takes them" if use == UPDATE else ""
    return tuple(
        f"recording {r.name!r} is a rotor's run and has no part in {use}; `femend correlate` compares its operating "
        f"shapes{take}"
        for r in study.recordings
        if r.excitation == "rotating" and r.role != "predict"
    )
