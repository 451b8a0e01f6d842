"""`femend update`: the parameters of a study updated on modes and FRFs of its test."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from femend.bench.page import render_page
from femend.bench.reading.compared import Compared
from femend.bench.reading.prepared import Prepared, prepare
from femend.bench.reading.run_compared import ComparedRun
from femend.bench.reading.runs import UPDATE
from femend.bench.reading.small_problem import small_problem
from femend.bench.steps import Steps, write_json
from femend.bench.updating.counted import Counted, counted_modes
from femend.bench.updating.counted_runs import CountedRun, counted_runs, turned_as_found
from femend.bench.updating.drawn import Drawn, draw_posterior_of
from femend.bench.updating.interruption import UpdateInterrupted, search_stopped, what_is_lacking
from femend.bench.updating.problem import study_problem
from femend.bench.updating.run_update_result import runs_result
from femend.bench.updating.starts import Starts, search_from_starts
from femend.bench.updating.strength import Strength, choose_strength
from femend.bench.updating.surface_start import SurfaceStart, start_on_surface
from femend.bench.updating.update_content import update_page, write_tables
from femend.bench.updating.update_result import update_result
from femend.bench.updating.update_run import UpdateRun
from femend.bench.updating.without_mistaken import without_mistaken
from femend.estimate.updating import (
    Iteration,
    Problem,
    UpdatedDeck,
    UpdateResult,
    sensitivities,
    updated_deck,
)
from femend.estimate.updating import update as search
from femend.io import OutputDirectory, refuse_unwritable, refuse_unwritable_file
from femend.model import Model
from femend.progress import Progress, SilentProgress
from femend.study.file.study import AS_MODELLED, Study
from femend.threads import one_blas_thread

__all__ = ["update"]

# searches at most in which forces of a rotor are told anew
ROUNDS = 3
# what the command writes: entries of these names from an earlier run are replaced
OWNED = (
    "updating.json",
    "updating.html",
    "updating.run.json",
    "updating.*.csv",
    "model.updated.*",
    "model.diff",
    "solver.updated.*",
)


@one_blas_thread
def update(
    study: str | Path,
    out: str | Path | None = None,
    progress: Progress | None = None,
    history: str | Path | None = None,
) -> UpdateRun:
    """Updates the parameters of `study` on what its fit recordings measured, as its table [updating] says: modes and
    FRFs, and orders of a rotor's runs.

    Recordings with role validate are compared with the model before and after and have no part in it, and neither have
    sensors that look reversed, exchanged or a factor off, which warnings name. With a folder `out` everything is
    written there: updating.json, updating.html, model.updated.bdf with the changed values where they stood, model.diff,
    tables as CSV and updating.run.json. `history` is a file that keeps every iteration (its folder is made where there
    is none); where it is there, the search goes on from it (the one from the deck, where there are more starts). Raises
    OSError where something cannot be written, the errors of the readers (StudyError, DeckError, FormatError,
    RecordingError, PairingError, ModelError), and UpdatingError for a problem that cannot be posed: no mode with a
    mate, fewer values than unknowns, frequencies in another unit (rad/s), fewer than three sensors that do not look
    mistaken; nothing is written then. Stopped by hand (KeyboardInterrupt) after the search from the deck, while it
    follows other starts or draws, it writes what was found and raises UpdateInterrupted with it; before, nothing is
    written, and the error says what `history` kept.
    """
    _refuse_unwritable(out, history)
    progress = progress or SilentProgress()
    steps = Steps(Path(study), progress)
    prepared = prepare(Path(study), steps, UPDATE, morphs=True, runs=lambda s: "orders" in s.updating.responses)
    with steps.step("weigh what was measured"):
        sound = without_mistaken(prepared, [prepared.compare(m) for m in prepared.measured])
        prepared, before = sound.prepared, sound.compared
        counted = counted_modes(sound)
        runs_before = tuple(prepared.compare_run(m) for m in prepared.runs)
        runs, passed = counted_runs(prepared, runs_before)
        problem = study_problem(prepared, counted, runs)
        told = sensitivities(problem)
    strength = _strength(prepared.study, problem, steps)
    surface, found = _first(prepared.study, problem, steps, history, strength)
    found, runs = _as_found(prepared, counted, runs, found, steps)
    problem = found.problem
    starts, drawn, stopped = _more(prepared.study, problem, found, counted, steps)
    partly = "" if starts is None else starts.lacking
    found = found if starts is None else starts.taken
    with steps.step("compare what was found"):
        model = prepared.models.of(counted[0].configuration if counted else runs[0].measured.configuration)
        after, runs_after = _compared(prepared, found)
        deck = _written(prepared, model, prepared.of_the_deck(found.values, AS_MODELLED))
        result = update_result(sound, counted, told, found, after, deck, strength, surface, starts, drawn)
        result["runs"] = runs_result(runs, found, runs_before, runs_after)
        result["warnings"] += passed
        if stopped:
            result["warnings"].insert(0, f"interrupted by hand: {what_is_lacking(stopped, partly)}")
    run = UpdateRun(
        prepared, counted, problem, told, found, before, after, deck, result, starts, drawn, surface, runs, runs_before,
        runs_after, strength,
    )  # fmt: skip
    if out is not None:
        with steps.step("write"), OutputDirectory(out, owned=OWNED) as folder:
            _write(run, folder, steps)
    progress.done()
    if stopped:
        raise UpdateInterrupted(run, stopped, None if out is None else Path(out), partly)
    return run


def _refuse_unwritable(out: str | Path | None, history: str | Path | None) -> None:
    """Refuses what could not be written at the end, before anything is begun."""
    if out is not None:
        refuse_unwritable(out, owned=OWNED)
    if history is not None:
        refuse_unwritable_file(history)


def _strength(study: Study, problem: Problem, steps: Steps) -> Strength | None:
    """How strongly the priors count, where the study lets the data choose it."""
    if study.updating.regularisation is None:
        return None
    with steps.step("choose the strength of the priors"):
        return choose_strength(problem, study.updating, steps.progress.advance)


def _first(
    study: Study, problem: Problem, steps: Steps, history: str | Path | None, strength: Strength | None
) -> tuple[SurfaceStart | None, UpdateResult]:
    """The first search, from the deck, from where that with the chosen `strength` of the priors ended, or from the
    least point of a response surface where the study asks for one."""
    surface, start = None, None
    if strength is not None:
        problem, start = strength.chosen, strength.p
    if study.updating.response_surface:
        with steps.step("solve the design and fit a response surface"):
            surface = start_on_surface(problem, study.updating)
        start = surface.p if surface.taken else start
    most, stop = study.updating.iterations, _telling(steps.progress)
    if history is not None:
        Path(history).absolute().parent.mkdir(parents=True, exist_ok=True)
    with steps.step("update parameters"):
        try:
            found = search(problem, start, iterations=most, history=history, resume=True, stop=stop)
        except KeyboardInterrupt:
            raise search_stopped(None if history is None else Path(history)) from None
    if start is None:
        return surface, found
    # what stood before is the deck, wherever the search began
    return surface, replace(found, before=problem.evaluate(problem.unknowns.mean))


def _as_found(
    prepared: Prepared,
    counted: Sequence[Counted],
    runs: tuple[CountedRun, ...],
    first: UpdateResult,
    steps: Steps,
) -> tuple[UpdateResult, tuple[CountedRun, ...]]:
    """Searches on where the updated model tells the forces of a rotor otherwise than the deck does: from the end of the
    `first` search, until they stay."""
    found = first
    for _ in range(ROUNDS if runs else 0):
        with steps.step("look again at how forces grow"):
            measured = [r.measured for r in runs]
            again = turned_as_found(
                runs, [prepared.compare_run(m, prepared.of_the_deck(found.values, m.configuration)) for m in measured]
            )
        changed = [
            b for a, b in zip(runs, again, strict=True) if (a.sense, a.power, a.spin) != (b.sense, b.power, b.spin)
        ]
        if not changed:
            break
        runs = again
        with steps.step("update parameters"):
            # with the prior that was chosen, and without modes that the others contradict
            before = found.problem
            problem = replace(
                study_problem(prepared, counted, runs), unknowns=before.unknowns, left_out=before.left_out
            )
            more = search(
                problem, found.p, iterations=prepared.study.updating.iterations, stop=_telling(steps.progress)
            )
        told = tuple(f"{r.name}: forces grow as the speed^{r.power:g}, sense {r.sense}" for r in changed)
        begun = replace(more.history[0], notes=told)
        history = (*found.history, begun, *more.history[1:])
        found = replace(more, before=problem.evaluate(problem.unknowns.mean), history=history)
    return found, runs


def _compared(prepared: Prepared, found: UpdateResult) -> tuple[tuple[Compared, ...], tuple[ComparedRun, ...]]:
    """All that was measured, modes and runs, against what was found, each in its configuration."""

    def there(configuration: str) -> dict[str, float]:
        return prepared.of_the_deck(found.values, configuration)

    return (
        tuple(prepared.compare(m, there(m.configuration)) for m in prepared.measured),
        tuple(prepared.compare_run(m, there(m.configuration)) for m in prepared.runs),
    )


def _written(prepared: Prepared, model: Model, values: Mapping[str, float]) -> UpdatedDeck:
    """The deck of `model` with the `values` found, or the input files of the solver."""
    return updated_deck(model, values) if prepared.solver is None else prepared.solver.written(values)


def _more(
    study: Study, problem: Problem, first: UpdateResult, counted: Sequence[Counted], steps: Steps
) -> tuple[Starts | None, Drawn | None, str]:
    """Searches from other starts, and draws from the posterior, as far as the study asks for them and nobody stops it:
    then the step is told, and what was done before it is kept."""
    settings = study.updating
    sampled = settings.posterior == "sampled"
    starts, drawn, now = None, None, ""
    if settings.starts == 1 and not sampled:
        return None, None, now
    try:
        with steps.step(now := "reduce the models"):
            freq_sd = min((float((c.freq_sd / c.freq).min()) for c in counted if c.freq.size), default=settings.freq_sd)
            small = small_problem(problem, freq_sd, settings.seed)
        if settings.starts > 1:
            with steps.step(now := "search from other starts", settings.starts):
                starts = search_from_starts(problem, first, settings, small, steps.progress.advance)
            if starts.lacking:
                return starts, None, now
        if sampled:
            with steps.step(now := "draw from the posterior"):
                drawn = draw_posterior_of(first if starts is None else starts.taken, settings, small, steps.progress)
    except KeyboardInterrupt:
        return starts, drawn, now
    return starts, drawn, ""


def _telling(progress: Progress) -> Any:
    """Counts the iterations of a search, and stops none."""

    def told(iteration: Iteration) -> bool:
        progress.advance()
        return False

    return told


def _write(run: UpdateRun, folder: Path, steps: Steps) -> None:
    write_json(folder / "updating.json", run.result)
    for name, content in run.updated_files().items():
        (folder / name).write_bytes(content)
    (folder / "model.diff").write_text(run.deck.diff, encoding="utf-8")
    names = ("updating.json", *run.updated_files(), "model.diff", *write_tables(folder, run))
    (folder / "updating.html").write_text(render_page(update_page(run, steps.info.as_dict(), names)), encoding="utf-8")
    steps.info.write(folder / "updating.run.json")
