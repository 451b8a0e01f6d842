"""What a study's recordings say of modes: identified from FRFs, from responses alone, or read as modes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femend.bench.reading.coarse import longer_pieces, too_coarse
from femend.bench.reading.roved import Part, is_part, joined_part, parts_of_one_test
from femend.correlate import mpc
from femend.data import FRF, Geometry, IdentifiedModes, Recording, Spectra
from femend.data.bands import within_band
from femend.diagnose.staged.prepare import FEWEST_LINES, excited_band, frf_data
from femend.dof import Dof
from femend.errors import FemendError
from femend.estimate.frf import COHERENT
from femend.estimate.prepare import period_of
from femend.io import read_uff
from femend.io.recordings import read_modes
from femend.modal import ModalTest, identify_modes
from femend.modal.identify import no_dof_twice
from femend.modal.output_only import identify_output_only
from femend.modal.output_only.prepare import motion_rows
from femend.numerals import plain
from femend.progress import Progress
from femend.signal import estimate_frf, periodic_frf, to_quantity
from femend.signal.calculus import DERIVATIVES
from femend.signal.suited import blows, suited_frf
from femend.study.doubts.sampled import too_slow_for_band, too_slow_for_modes
from femend.study.file.channels_sound import with_warnings
from femend.study.file.study import Study, StudyRecording

__all__ = ["ALONE", "FRFS", "MeasuredModes", "measured_modes"]

FloatArray = NDArray[np.float64]
Band = tuple[float, float] | None
# name, role and configuration of a recording
About = tuple[str, str, str]
# what is to be told where it is sampled too slowly
TooSlow = Callable[[], tuple[str, ...]]

# damping ratios above this in the middle are those of no structure that is tested for its modes
PLAUSIBLE_ZETA = 0.2
# MPC below which a shape is told as complex, as of modal tests
REAL = 0.8
# how the report says where modes came from
FRFS, ALONE, READ = "identified from FRFs", "identified from responses alone", "read from data sets 55"


@dataclass(frozen=True, eq=False)
class MeasuredModes:
    """The modes of one recording, in the order of frequency.

    `how` says where they are from; `test` is the modal test and `frf` the FRFs in its band, where there are any;
    `shape_sd` (n_dof, n_modes) the deviations of the shapes where they are known; `geometry` the test's nodes.
    `warnings` are what to mind about the recording and its modes.
    """

    name: str
    role: str
    configuration: str
    modes: IdentifiedModes
    how: str
    test: ModalTest | None = None
    frf: FRF | None = None
    shape_sd: FloatArray | None = None
    geometry: Geometry | None = None
    warnings: tuple[str, ...] = ()

    @property
    def dofs(self) -> tuple[Dof, ...]:
        """Every sensor and shaker, once, in the order of appearance."""
        of_frf = () if self.frf is None else (*self.frf.output_dofs, *self.frf.input_dofs)
        return tuple(dict.fromkeys(d for d in (*self.modes.dofs, *of_frf) if d is not None))


def measured_modes(
    study: Study, progress: Progress, lowest: Callable[[], FloatArray] | None = None
) -> tuple[tuple[MeasuredModes, ...], tuple[str, ...]]:
    """The modes of every recording with role fit or validate that shows some, and why others do not.

    `lowest` gives the lowest frequencies of the model (Hz); it is asked where a recording shows no mode, which may be
    sampled too slowly for them.

    Recordings to be predicted hold inputs only and are passed over, and so are a rotor's runs, which have operating
    shapes (`femend.bench.reading.runs`). Raises what the readers and the identification raise.
    """
    every: list[MeasuredModes | Part | str | None] = []
    used = [r for r in study.recordings if r.role != "predict"]
    progress.start("identify modes", len(used))
    for recording in used:
        try:
            every.append(_modes_of(recording, study, lowest))
        except FemendError as error:
            error.add_note(f"while reading [[recording]] {recording.name!r} of {study.file}")
            raise
        progress.advance()
    found = _of_parts(every, study, lowest)
    return tuple(m for m in found if isinstance(m, MeasuredModes)), tuple(m for m in found if isinstance(m, str))


def _of_parts(
    every: list[MeasuredModes | Part | str | None], study: Study, lowest: Callable[[], FloatArray] | None
) -> list[MeasuredModes | str]:
    """`every` recording's modes, those of `Part`s identified: of parts of one test together, else one by one."""
    at = [i for i, one in enumerate(every) if isinstance(one, Part)]
    parts = [one for one in every if isinstance(one, Part)]
    whole: dict[int, Recording] = {at[i]: p.full for i, p in enumerate(parts)}
    for moved, group in parts_of_one_test(parts):
        joined = joined_part([parts[i] for i in group], moved)
        first = at[group[0]]
        if isinstance(joined, str):
            whole[first] = replace(whole[first], warnings=(*whole[first].warnings, joined))
            continue
        whole[first] = joined
        for i in group[1:]:
            del whole[at[i]]
    out: list[MeasuredModes | str] = []
    for i, one in enumerate(every):
        if i in whole:
            out.append(_identified(whole[i], study, lowest))
        elif one is not None and not isinstance(one, Part):
            out.append(one)
    return out


def _modes_of(
    recording: StudyRecording, study: Study, lowest: Callable[[], FloatArray] | None
) -> MeasuredModes | Part | str | None:
    band = study.correlation.band
    read = read_modes(recording.file, units=study.units)
    about = (recording.name, recording.role, recording.configuration)
    if read is not None:
        modes, geometry, notes = read
        modes = _in_band(modes, band)
        told = tuple(
            f"recording {recording.name!r}: {n}"
            for n in (*notes, *_damping_doubts(modes, study), *_complex_shapes(modes))
        )
        if not modes.n_modes:
            return f"recording {recording.name!r} has no mode in the band {_text(band)}"
        return MeasuredModes(*about, modes, READ, frf=_frfs_beside(recording, study), geometry=geometry, warnings=told)
    if recording.excitation == "rotating":
        return None
    full = with_warnings(recording.read(study.units))
    if isinstance(full.data, Spectra):
        return f"recording {recording.name!r} is auto or cross spectra, from which no modes are taken here"
    slow = too_slow_for_band(full, band)
    full = replace(full, warnings=(*slow, *full.warnings))
    if recording.excitation == "measured":
        full = _of_one_quantity(full)
        structure = next((s.name for s in study.updating.structure if recording.name in s.recordings), "")
        if (part := is_part(full, structure)) is not None:
            return part
    return _identified(full, study, lowest)


def _identified(full: Recording, study: Study, lowest: Callable[[], FloatArray] | None) -> MeasuredModes | str:
    """The modes of a recording that was read, or why there are none."""
    band, about = study.correlation.band, (full.name, full.role, full.configuration)
    slow = too_slow_for_band(full, band)

    def too_slow() -> tuple[str, ...]:
        return slow or _too_slow(full, lowest)

    try:
        if full.excitation != "measured":
            return _of_responses(full, about, band, too_slow)
        return _of_frfs(full, about, study, too_slow)
    except FemendError as error:
        for text in too_slow():
            error.add_note(text)
        raise


def _of_one_quantity(full: Recording) -> Recording:
    """A time record whose sensors measure displacements, velocities and accelerations as one of accelerations, so that
    its FRFs are of one kind; others as they are."""
    if not full.is_time or len({full.time.channels[i].quantity for i in full.time.rows(*DERIVATIVES)}) < 2:
        return full
    return replace(full, data=to_quantity(full.time, "acceleration"))


def _damping_doubts(modes: IdentifiedModes, study: Study) -> list[str]:
    """Damping ratios in a file that are those of no structure, or none at all where they are to be met."""
    if not modes.n_modes:
        return []
    middle = float(np.median(modes.zeta))
    if middle > PLAUSIBLE_ZETA:
        return [
            f"the damping ratio of its modes is {plain(middle, 2)} in the middle, as no structure's is: data sets 55 "
            f"hold fractions; in per cent it would be {plain(middle / 100, 2)}: divide them by 100"
        ]
    if not modes.zeta.any() and "damping" in study.updating.responses:
        return [
            'the damping ratios of all its modes are 0, as of a file without them: leave "damping" out of responses'
        ]
    return []


def _complex_shapes(modes: IdentifiedModes) -> list[str]:
    """That shapes of a file are far from real ones, which they are compared with."""
    real = mpc(modes.shapes) if modes.n_modes and np.iscomplexobj(modes.shapes) else np.ones(modes.n_modes)
    odd = np.flatnonzero(real < REAL)
    if not odd.size:
        return []
    which = ", ".join(f"{plain(modes.freq[i])} Hz (MPC {plain(real[i], 2)})" for i in odd)
    noun, verb = ("shapes", "are") if odd.size > 1 else ("shape", "is")
    return [
        f"the {noun} at {which} {verb} complex, and the nearest real one "
        "is compared: local damping, neighbours not separated, channels that are late, or phases lost on the way"
    ]


def _of_responses(full: Recording, about: About, band: Band, too_slow: TooSlow) -> MeasuredModes | str:
    """Modes from responses alone, or why there are none."""
    who = f"recording {full.name!r}"
    no_dof_twice(full.name, [full.time.channels[row] for row in motion_rows(full.time)], "responses")
    alone = identify_output_only(full.time, band)
    if not alone.modes.n_modes:
        return "; ".join((*too_slow(), f"{who}: {'; '.join(alone.advice) or 'no mode was found'}"))
    keep = ~alone.harmonic
    told = tuple(f"{who}: {t}" for t in alone.advice if alone.status != "ok")
    return MeasuredModes(
        *about, alone.modes.select(keep), ALONE, shape_sd=alone.shape_sd[:, keep], geometry=full.geometry,
        warnings=(*full.warnings, *told),
    )  # fmt: skip


def _of_frfs(full: Recording, about: About, study: Study, too_slow: TooSlow) -> MeasuredModes | str:
    """Modes from FRFs, measured or estimated, or why there are none."""
    who, band = f"recording {full.name!r}", study.correlation.band
    frf, notes = (full.data, ()) if isinstance(full.data, FRF) else suited_frf(full.time)
    if band is None:
        own = frf_data(full)
        band = (float(own.freq[0]), float(own.freq[-1]))
    test = identify_modes(frf, band, geometry=full.geometry)
    if not isinstance(full.data, FRF):
        frf, test = _finer(full, frf, test, band, study.damping_ratio)
    if not test.modes.n_modes:
        slow = too_slow()
        # what FRFs that are folded back say of sensors is not true
        of_sensors = {check.message for check in test.checks} if slow else set()
        return "; ".join((*slow, f"{who}: {'; '.join(t for t in test.advice if t not in of_sensors)}"))
    shown, beyond = _excited(full.name, frf, test.measured)
    beyond = beyond if study.correlation.band is not None else ()
    told = tuple(f"{who}: {t}" for t in (*notes, *(test.advice if test.status != "ok" else ())))
    if not isinstance(full.data, FRF):
        told += tuple(f"{who}: {t}" for t in too_coarse(test.modes, full.time, frf))
    return MeasuredModes(
        *about, test.modes, FRFS, test, shown, test.shape_sd, full.geometry, (*full.warnings, *told, *beyond)
    )


def _too_slow(recording: Recording, lowest: Callable[[], FloatArray] | None) -> tuple[str, ...]:
    try:
        return () if lowest is None else too_slow_for_modes(recording, lowest())
    except FemendError:
        return ()  # whoever solves the model next says what is wrong with it


def _finer(full: Recording, frf: FRF, test: ModalTest, band: tuple[float, float], zeta: float) -> tuple[FRF, ModalTest]:
    """FRFs and their modes from longer pieces of a record, or from the periods of its force, where lines of pieces of
    an eighth are too far apart for the modes of `test` and these show as many; else what is given."""
    step = None if blows(full.time).size else longer_pieces(test.modes, full.time, frf, zeta)
    if step is None:
        return frf, test
    try:
        period = period_of(full.time.values[full.time.rows("force")])
        finer = periodic_frf(full.time, period).frf if period else estimate_frf(full.time, resolution=step).frf
        again = identify_modes(finer, band, geometry=full.geometry)
    except FemendError:
        return frf, test  # one period alone, or forces that are not independent in so few pieces
    return (finer, again) if again.modes.n_modes >= test.modes.n_modes else (frf, test)


def _excited(name: str, frf: FRF, used: FRF) -> tuple[FRF, tuple[str, ...]]:
    """The FRFs `used`, cut to where the forces explain the responses, and that a band asked for goes beyond it."""
    excited, low, high = excited_band(frf), float(used.freq[0]), float(used.freq[-1])
    step = float(np.diff(used.freq).max(initial=0.0))
    if excited is None or (low >= excited[0] - step and high <= excited[1] + step):
        return used, ()
    inside = within_band(used.freq, excited)
    if inside.sum() < FEWEST_LINES:
        return used, ()
    said = (
        f"recording {name!r}: the force excited {plain(excited[0])} to {plain(excited[1])} Hz (outside, the coherence "
        f"of most responses is below {COHERENT:g}), and [correlation] band is {plain(low)} to {plain(high)} Hz: FRFs "
        "are compared and drawn where it did, modes outside are doubtful; narrow the band, or excite all of it"
    )
    return used.band(*excited), (said,)


def _frfs_beside(recording: StudyRecording, study: Study) -> FRF | None:
    """FRFs that stand in one file with modes, in the band."""
    if not any(f.header.func_type == 4 for f in read_uff(recording.file).functions):
        return None
    data = recording.read(study.units).data
    if not isinstance(data, FRF):
        return None
    low, high = study.correlation.band or (0.0, np.inf)
    return data.band(max(low, float(data.freq[data.freq > 0][0])), high)


def _in_band(modes: IdentifiedModes, band: Band) -> IdentifiedModes:
    return modes if band is None else modes.select(within_band(modes.freq, band))


def _text(band: Band) -> str:
    return "of all frequencies" if band is None else f"{band[0]:g} to {band[1]:g} Hz"
