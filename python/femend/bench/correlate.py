"""`femend correlate`: a study's deck against its test, as the deck stands."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from femend.analysis.model_modes import model_modes
from femend.analysis.tam import TamTable
from femend.bench.compared import Compared, compare_recording
from femend.bench.correlation_content import correlation_page, write_tables
from femend.bench.correlation_result import correlation_result
from femend.bench.measured import MeasuredModes, measured_modes
from femend.bench.models import LOWEST, Models
from femend.bench.orthogonal import orthogonality_of
from femend.bench.page import render_page
from femend.bench.placed import Placed, placed_sensors
from femend.bench.run_compared import ComparedRun, compare_run
from femend.bench.run_content import write_run_table
from femend.bench.runs import MeasuredRun, in_order, measured_runs, without_runs
from femend.bench.steps import Steps, write_json
from femend.diagnose.staged.shaft import axis_doubt
from femend.errors import RecordingError
from femend.io import OutputDirectory, refuse_unwritable
from femend.model import Model
from femend.progress import Progress, SilentProgress
from femend.study.added_masses import added_mass_doubts
from femend.study.load import load_study
from femend.study.sound import deck_warnings
from femend.study.study import Study
from femend.threads import one_blas_thread

__all__ = ["CorrelationRun", "Prepared", "correlate", "prepare"]

# lines of a run from which on its shapes tell the shaft's axis
FEWEST_LINES = 8
# what the command writes: entries of these names from an earlier run are replaced
OWNED = ("correlation.json", "correlation.html", "correlation.run.json", "correlation.*.csv")


@dataclass(frozen=True, eq=False)
class Prepared:
    """A study read for correlation or updating: the models of its configurations, the measured modes of its fit and
    validate recordings, its sensors placed on the first model, and what is to be told; `runs` are the operating shapes
    of its rotor's runs where they were asked for."""

    study: Study
    models: Models
    measured: tuple[MeasuredModes, ...]
    placed: Placed
    warnings: tuple[str, ...]
    runs: tuple[MeasuredRun, ...] = ()

    @property
    def model(self) -> Model:
        """The model of the first recording."""
        first: MeasuredModes | MeasuredRun = self.measured[0] if self.measured else self.runs[0]
        return self.models.of(first.configuration)

    def compare(self, measured: MeasuredModes, factors: Mapping[str, float] | None = None) -> Compared:
        """The `measured` modes of a recording against the model in its configuration, at `factors` of its
        parameters and amplitudes of its morphs by name."""
        return compare_recording(
            measured,
            self.models.of(measured.configuration),
            self.placed.places,
            zeta=self.study.damping_ratio,
            mac_min=self.study.correlation.mac_min,
            factors=factors,
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
        )


@dataclass(frozen=True, eq=False, repr=False)
class CorrelationRun:
    """A finished correlation: what was `prepared`, each recording `compared`, the orthogonality of its shapes
    over reduced masses (`tams`, None where there is none), the rotor's `runs` compared, and the `result` as it is
    written."""

    prepared: Prepared
    compared: tuple[Compared, ...]
    tams: tuple[TamTable | None, ...]
    result: dict[str, Any]
    runs: tuple[ComparedRun, ...] = ()

    @property
    def study(self) -> Study:
        """The study."""
        return self.prepared.study

    def __getitem__(self, recording: str) -> Compared:
        """The comparison of a recording by name; raises KeyError where it has none."""
        for one in self.compared:
            if one.measured.name == recording:
                return one
        raise KeyError(f"no recording {recording!r}; there are {', '.join(c.measured.name for c in self.compared)}")

    def run(self, recording: str, order: float = 1.0) -> ComparedRun:
        """The comparison of a rotor's run in an `order`, or of the held speeds that a recording is one of, by the
        recording's name; raises KeyError where there is none."""
        for one in self.runs:
            if one.measured.of(recording) and one.measured.order == order:
                return one
        there = ", ".join(f"{r.measured.name}{in_order(r.measured.order)}" for r in self.runs)
        raise KeyError(f"no run {recording!r}{in_order(order)}; there are {there or 'none'}")

    def __repr__(self) -> str:
        from femend.bench.words import correlation_text

        return correlation_text(self.result)


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

    `use` is what all this is for ("an update"), as messages say it; the models have the study's `morphs`, and
    operating shapes are taken from rotor's `runs`, where the study asks for that."""
    with steps.step("read the study and the deck"):
        study = load_study(study_path, use=use)
        models = Models(study, morphs)
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
        placed = placed_sensors(every, first, align=study.correlation.align)
    told = [
        *deck_warnings(study, first.deck),
        *added_mass_doubts(study, first),
        *placed.warnings,
        *passed,
        *(w for m in every for w in m.warnings),
    ]
    return Prepared(study, models, measured, placed, tuple(dict.fromkeys(told)), turned)


@one_blas_thread
def correlate(study: str | Path, out: str | Path | None = None, progress: Progress | None = None) -> CorrelationRun:
    """Compares the modes, FRFs and operating shapes of every fit and validate recording of `study` with its deck as it
    stands.

    With a folder `out` everything is written there: correlation.json, correlation.html, tables as CSV and
    correlation.run.json. Raises the errors of the readers (StudyError, DeckError, FormatError, RecordingError,
    PairingError, ModelError); nothing is written then.
    """
    if out is not None:
        refuse_unwritable(out, owned=OWNED)
    steps = Steps(Path(study), progress or SilentProgress())
    prepared = prepare(Path(study), steps, "a correlation", runs=lambda study: True)
    with steps.step("compare"):
        compared = tuple(prepared.compare(m) for m in prepared.measured)
        tams = tuple(orthogonality_of(c, prepared.models.of(c.measured.configuration)) for c in compared)
        runs = tuple(prepared.compare_run(m) for m in prepared.runs)
        result = correlation_result(prepared, compared, tams, runs)
        result["warnings"] += [*_positions(prepared.study), *_axes(prepared, runs)]
    run = CorrelationRun(prepared, compared, tams, result, runs)
    if out is not None:
        with steps.step("write"), OutputDirectory(out, owned=OWNED) as folder:
            _write(run, folder, steps)
    steps.progress.done()
    return run


def _axes(prepared: Prepared, runs: Sequence[ComparedRun]) -> list[str]:
    """Runs whose shaft turns about another axis than the study says, as their operating shapes have it."""
    found = []
    for run in runs:
        if run.response is None or run.measured.freq.size < FEWEST_LINES:
            continue

        def likeness(axis: int, run: ComparedRun = run) -> float:
            same = axis == run.measured.axis
            other = run if same else prepared.compare_run(replace(run.measured, axis=axis))
            return 0.0 if other.response is None else float(np.nanmean(other.response.csac))

        found.append(axis_doubt(run.measured.name, run.measured.axis, likeness))
    return [text for text in found if text]


def _positions(study: Study) -> list[str]:
    """That the deck is compared where its nodes stand, though an update may move some."""
    names = ", ".join(m.name for m in study.updating.morph)
    said = (
        f"the deck is compared as it stands, the amplitudes of [[updating.morph]] ({names}) being 0 in it; "
        "`femend update` changes them"
    )
    return [said] if names else []


def _write(run: CorrelationRun, folder: Path, steps: Steps) -> None:
    write_json(folder / "correlation.json", run.result)
    names = [*write_tables(folder, run.compared), *write_run_table(folder, run.result["runs"])]
    info = steps.info.as_dict()
    page = correlation_page(run, info, ("correlation.json", *names))
    (folder / "correlation.html").write_text(render_page(page), encoding="utf-8")
    steps.info.write(folder / "correlation.run.json")
