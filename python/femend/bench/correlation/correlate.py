"""`femend correlate`: a study's deck against its test, as the deck stands."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from femend.bench.correlation.correlation_content import correlation_page, write_tables
from femend.bench.correlation.correlation_result import correlation_result
from femend.bench.correlation.correlation_run import CorrelationRun
from femend.bench.correlation.orthogonal import orthogonality_of
from femend.bench.correlation.run_content import write_run_table
from femend.bench.correlation.where_wrong import where_wrong
from femend.bench.correlation.where_wrong_content import write_where_tables
from femend.bench.page import render_page
from femend.bench.reading.prepared import Prepared, prepare
from femend.bench.reading.run_compared import ComparedRun
from femend.bench.steps import Steps, write_json
from femend.diagnose.staged.shaft import axis_doubt
from femend.io import OutputDirectory, refuse_unwritable
from femend.progress import Progress, SilentProgress
from femend.study.file.study import Study
from femend.threads import one_blas_thread

__all__ = ["correlate"]

# lines of a run from which on its shapes tell the shaft's axis
FEWEST_LINES = 8
# what the command writes: entries of these names from an earlier run are replaced
OWNED = ("correlation.json", "correlation.html", "correlation.run.json", "correlation.*.csv")


@one_blas_thread
def correlate(study: str | Path, out: str | Path | None = None, progress: Progress | None = None) -> CorrelationRun:
    """Compares the modes, FRFs and operating shapes of every fit and validate recording of `study` with its deck as it
    stands, or modes with those of the solver that it names.

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
        models = [prepared.drawn_model(c.measured.configuration) for c in compared]
        tams = tuple(None if m is None else orthogonality_of(c, m) for c, m in zip(compared, models, strict=True))
        wrong = tuple(
            None if m is None else where_wrong(c, m, prepared.study) for c, m in zip(compared, models, strict=True)
        )
        runs = tuple(prepared.compare_run(m) for m in prepared.runs)
        result = correlation_result(prepared, compared, tams, wrong, runs)
        if prepared.solver is not None:
            result["warnings"] += prepared.solver.warnings
        result["warnings"] += [*_positions(prepared.study), *_axes(prepared, runs)]
    run = CorrelationRun(prepared, compared, tams, result, runs, wrong)
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
    names = [
        *write_tables(folder, run.compared),
        *write_where_tables(folder, run),
        *write_run_table(folder, run.result["runs"]),
    ]
    info = steps.info.as_dict()
    page = correlation_page(run, info, ("correlation.json", *names))
    (folder / "correlation.html").write_text(render_page(page), encoding="utf-8")
    steps.info.write(folder / "correlation.run.json")
