"""`femend population`: mean and scatter of the parameters over nominally equal structures that were tested."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from femend.bench.page import render_page
from femend.bench.populations.population_content import population_page, write_population_tables
from femend.bench.populations.population_result import population_result
from femend.bench.populations.population_run import PopulationRun
from femend.bench.populations.population_structure import OneStructure
from femend.bench.reading.links import deck_priors
from femend.bench.reading.prepared import Prepared, prepare
from femend.bench.steps import Steps, write_json
from femend.bench.updating.counted import Counted, counted_modes
from femend.bench.updating.problem import study_problem
from femend.bench.updating.without_mistaken import without_mistaken
from femend.errors import StudyError, UpdatingError
from femend.estimate.updating import Problem, update_population, updated_deck
from femend.io import OutputDirectory, refuse_unwritable
from femend.io.updated_files import updated_files
from femend.progress import Progress, SilentProgress
from femend.study.file.study import Study
from femend.threads import one_blas_thread

__all__ = ["population"]

USE = "a population"
# what the command writes: entries of these names from an earlier run are replaced
OWNED = ("population.json", "population.html", "population.run.json", "population.*.csv", "model.mean.*", "model.diff")


@one_blas_thread
def population(study: str | Path, out: str | Path | None = None, progress: Progress | None = None) -> PopulationRun:
    """Updates the deck of `study` on each of the structures of its table [updating], all together: mean and scatter of
    the parameters from one structure to the next, and each structure inside that population.

    With a folder `out` everything is written there: population.json, population.html, model.mean.bdf with the mean
    values, model.diff, tables as CSV and population.run.json. Raises OSError where something cannot be written, the
    errors of the readers, StudyError for a study without structures or with tables that do not go with them, and
    UpdatingError for a structure of which no mode counts; nothing is written then.
    """
    if out is not None:
        refuse_unwritable(out, owned=OWNED)
    steps = Steps(Path(study), progress or SilentProgress())
    prepared = prepare(Path(study), steps, USE, morphs=True)
    _fits(prepared.study)
    with steps.step("weigh what was measured"):
        sound = without_mistaken(prepared, [prepared.compare(m) for m in prepared.measured])
        prepared, before = sound.prepared, sound.compared
        counted = counted_modes(sound)
        problems = _problems(prepared, counted)
    with steps.step("update all structures"):
        found = update_population([p for _, p in problems], told=steps.progress.advance)
    with steps.step("compare what was found"):
        structures = []
        for (name, _), one in zip(problems, found.results, strict=True):
            of = next(s.recordings for s in prepared.study.updating.structure if s.name == name)
            own = [(m, b) for m, b in zip(prepared.measured, before, strict=True) if m.name in of]
            after = tuple(prepared.compare(m, prepared.of_the_deck(one.values, m.configuration)) for m, _ in own)
            structures.append(OneStructure(name, tuple(b for _, b in own), after, one))
        unknowns = found.results[0].problem.unknowns
        mean = dict(zip(unknowns.names, unknowns.values(found.mean).tolist(), strict=True))
        deck = updated_deck(prepared.model, prepared.of_the_deck(mean))
        result = population_result(sound, found, structures, deck, counted, deck_priors(prepared.study, prepared.model))
    run = PopulationRun(prepared, found, tuple(structures), deck, result)
    if out is not None:
        with steps.step("write"), OutputDirectory(out, owned=OWNED) as folder:
            _write(run, folder, steps)
    steps.progress.done()
    return run


def _fits(study: Study) -> None:
    """Refuses studies without structures, and what does not go with them."""
    u = study.updating
    if not u.structure:
        raise StudyError(
            f"{study.file}: there is no [[updating.structure]]; a population needs three or more, each with its "
            "recordings",
            key="updating.structure",
        )
    others = {
        "solver": study.solver is not None,
        "updating.repeated": u.repeated,
        "updating.field": bool(u.field),
        "updating.regularisation": u.regularisation is not None,
        "updating.responses": "orders" in u.responses,
    }
    for key, given in others.items():
        if given:
            what = "'orders'" if key == "updating.responses" else "it"
            raise StudyError(
                f"{study.file}: {key}: a population is told without {what}; leave {what} out of the study", key=key
            )


def _problems(prepared: Prepared, counted: Sequence[Counted]) -> list[tuple[str, Problem]]:
    """The problem of each structure, by its name; all have the unknowns of all."""
    out = []
    for s in prepared.study.updating.structure:
        own = [c for c in counted if set(c.sources) <= set(s.recordings)]
        if not own:
            raise UpdatingError(
                f"structure {s.name!r}: no mode of its recordings counts, so that nothing is told of it; leave it out, "
                "or find out why (`femend correlate`)"
            )
        out.append((s.name, study_problem(prepared, own)))
    first = out[0][1].unknowns
    for name, problem in out:
        if problem.unknowns.names != first.names:
            raise UpdatingError(
                f"structure {name!r} has other unknowns than {out[0][0]!r}, since [[updating.link]] holds in "
                "configurations that not all were tested in; test all alike, or leave the link out"
            )
    return out


def _write(run: PopulationRun, folder: Path, steps: Steps) -> None:
    write_json(folder / "population.json", run.result)
    files = {
        name.replace("model.updated", "model.mean"): content
        for name, content in updated_files(run.study.model_file, run.deck.files).items()
    }
    for name, content in files.items():
        (folder / name).write_bytes(content.replace(b"model.updated.", b"model.mean."))
    (folder / "model.diff").write_text(run.deck.diff, encoding="utf-8")
    names = ("population.json", *files, "model.diff", *write_population_tables(folder, run))
    page = population_page(run, steps.info.as_dict(), names)
    (folder / "population.html").write_text(render_page(page), encoding="utf-8")
    steps.info.write(folder / "population.run.json")
