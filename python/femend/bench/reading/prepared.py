"""A study read for correlation or updating."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from femend.analysis.model_modes import model_modes
from femend.bench.reading.compared import Compared, compare_recording
from femend.bench.reading.links import values_in
from femend.bench.reading.measured import ALONE, FRFS, MeasuredModes, measured_modes
from femend.bench.reading.models import LOWEST, Models
from femend.bench.reading.placed import Placed, placed_sensors
from femend.bench.reading.placed_by_shapes import shapes_suit
from femend.bench.reading.run_compared import ComparedRun, compare_run
from femend.bench.reading.runs import MeasuredRun, measured_runs, without_runs
from femend.bench.reading.same_twice import same_twice
from femend.bench.reading.solver import Solver, solver_of
from femend.bench.reading.turned import turned_in
from femend.bench.steps import Steps
from femend.errors import RecordingError
from femend.model import Model
from femend.study.doubts.added_masses import added_mass_doubts
from femend.study.doubts.gathered import gathered
from femend.study.doubts.overlapping import overlaps
from femend.study.doubts.sound import deck_warnings
from femend.study.doubts.unused_configurations import unused_configurations
from femend.study.file.load import load_study
from femend.study.file.study import AS_MODELLED, Study

__all__ = ["Prepared", "prepare"]


@dataclass(frozen=True, eq=False)
class Prepared:
    """A study read for correlation or updating: the models of its configurations, the measured modes of its fit and
    validate recordings, its sensors placed on the first model, and what is to be told; `runs` are the operating shapes
    of its rotor's runs where they were asked for. With a `solver` of the user's own its modes are compared in place of
    the models'."""

    study: Study
    models: Models
    measured: tuple[MeasuredModes, ...]
    placed: Placed
    warnings: tuple[str, ...]
    runs: tuple[MeasuredRun, ...] = ()
    solver: Solver | None = None

    @property
    def model(self) -> Model:
        """The model of the first recording."""
        first: MeasuredModes | MeasuredRun = self.measured[0] if self.measured else self.runs[0]
        return self.models.of(first.configuration)

    def drawn_model(self, configuration: str) -> Model | None:
        """The deck's model in the `configuration` of this name; None beside a solver, whose model it is not."""
        return self.models.of(configuration) if self.solver is None else None

    def of_the_deck(self, found: Mapping[str, float], configuration: str = AS_MODELLED) -> dict[str, float]:
        """What was `found` by name, as parameters and morphs of the deck have it in the `configuration` of this name,
        or values of the solver; what damping is unknown beside them is none of theirs."""
        return dict(found) if self.solver is not None else values_in(self.study, self.model, found, configuration)

    def compare(self, measured: MeasuredModes, factors: Mapping[str, float] | None = None) -> Compared:
        """The `measured` modes of a recording against the model in its configuration, at `factors` of its
        parameters and amplitudes of its morphs, or values of the solver, by name."""
        zeta, f_max = self.study.damping_ratio, float(measured.modes.freq.max())
        return compare_recording(
            measured,
            self.models.of(measured.configuration),
            self.placed.places,
            zeta=zeta,
            mac_min=self.study.correlation.mac_min,
            factors=None if self.solver is not None else factors,
            modes=None if self.solver is None else self.solver.modes(factors, zeta, f_max),
        )

    def compare_run(self, measured: MeasuredRun, factors: Mapping[str, float] | None = None) -> ComparedRun:
        """The operating shapes of a `measured` run against the model in its configuration, at `factors` as of
        `compare`."""
        return compare_run(
            measured,
            self.models.of(measured.configuration),
            self.placed.places,
            zeta=self.study.damping_ratio,
            mac_min=self.study.correlation.mac_min,
            factors=factors,
            parts=turned_in(self.models.rotors, measured),
        )


def prepare(
    study_path: Path,
    steps: Steps,
    use: str,
    *,
    morphs: bool = False,
    runs: Callable[[Study], bool] = lambda study: False,
) -> Prepared:
    """Reads a study with its deck and recordings, identifies modes and places the sensors; raises what these raise, and
    RecordingError where no recording to fit can be compared.

    `use` is what all this is for ("an update"), as messages say it; the models have the study's `morphs` (and
    fields), and operating shapes are taken from rotor's `runs`, where the study asks for that."""
    with steps.step("read the study and the deck"):
        study = load_study(study_path, use=use)
        models = Models(study, morphs, fields=morphs)
        used = [r.configuration for r in study.recordings if r.role != "predict"]
        first = next(iter(models.all(used).values()))
    with steps.info.step("identify modes"):  # which tells its progress recording by recording
        measured, passed = measured_modes(study, steps.progress, lambda: model_modes(first, n_modes=LOWEST).freq)
    turned: tuple[MeasuredRun, ...] = ()
    if runs(study) and any(r.excitation == "rotating" for r in study.recordings):
        with steps.step("take operating shapes from runs"):
            turned, lost = measured_runs(study)
    else:
        lost = () if runs(study) else without_runs(study, use)
    passed = (*passed, *lost)
    every: tuple[MeasuredModes | MeasuredRun, ...] = (*measured, *turned)
    if not any(m.role == "fit" for m in every):
        why = "; ".join(passed) or "there is none with role fit"
        raise RecordingError(f"no recording to fit shows a mode: {why}; widen [correlation] band, or record longer")
    with steps.step("place sensors"):
        # beside a solver of the user's own the deck is but a list of places
        suits = shapes_suit(models, study.correlation.mac_min) if study.solver is None else None
        placed = placed_sensors(every, first, align=study.correlation.align, suits=suits)
        models.see(placed.points)
    sensors = [d for m in measured for d in m.modes.dofs]
    solver = solver_of(study, placed.places, first, sensors, updating=morphs)
    told = [
        *deck_warnings(study, first.deck),
        *unused_configurations(study),
        *added_mass_doubts(study, first),
        *placed.warnings,
        *passed,
        *(twice := same_twice(measured)),
        *_overlapping(study, measured, twice),
        *gathered((m.name, w) for m in every for w in m.warnings),
    ]
    return Prepared(study, models, measured, placed, tuple(dict.fromkeys(told)), turned, solver)


def _overlapping(study: Study, measured: Sequence[MeasuredModes], twice: Sequence[str]) -> list[str]:
    """Recordings that hold the same stretch of time, where none are told as one test listed twice."""
    names = {m.name for m in measured if m.how in (FRFS, ALONE)}
    if twice or len(names) < 2:
        return []
    return overlaps([r.read(study.units) for r in study.recordings if r.name in names])
