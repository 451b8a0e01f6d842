"""Running a study: from study.toml to the folder the contract describes."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

from femend.data import Recording, Spectra, Test
from femend.diagnose import Diagnosis, diagnose_records, diagnose_responses
from femend.diagnose.deciding.interrupted import undecided
from femend.diagnose.deciding.so_far import SoFar
from femend.diagnose.driven.unrecorded import LEAST_SENSORS
from femend.diagnose.settings import Settings
from femend.diagnose.updating.update import UpdatedModel
from femend.errors import FemendError, RecordingError, StudyError, TimeLimitError
from femend.estimate import FitRecord, fit_records, pair_test
from femend.io import OutputDirectory, refuse_unwritable
from femend.io.deck import patch_deck
from femend.io.updated_files import updated_files
from femend.model import Model, Pairing, read_model
from femend.physics import Physics, selected
from femend.progress import Progress, SilentProgress, say
from femend.report.page import render
from femend.report.runinfo import RunInfo
from femend.study.damping_told import at_dashpots, damping_told
from femend.study.doubts.corrections import BEYOND, Corrections, corrections_of, left_out_unseen
from femend.study.doubts.explained import answered
from femend.study.doubts.plausible import Doubted, doubts_found
from femend.study.doubts.priors import bounds_told, far_told
from femend.study.doubts.sound import deck_doubts, warnings_of
from femend.study.file.cut_blows import left_out, none_whole, of_whole_blows, without_cut_blows
from femend.study.file.load import load_study
from femend.study.file.study import Study
from femend.study.free_dashpots import with_free_dashpots
from femend.study.result.deck_told import deck_told
from femend.study.result.interruption import StudyInterrupted, nothing_settled
from femend.study.result.patch import cards_told, deck_cards, deck_changes, on_new_supports
from femend.study.result.predictions import predict_all, write_predictions
from femend.study.result.result import result_of
from femend.study.result.study_run import StudyRun
from femend.study.shown.content import report_content
from femend.study.staged.run import diagnose_staged, is_staged
from femend.study.staged.study_run import StagedRun
from femend.study.steps import Steps
from femend.study.time_limit import TimeLimit

__all__ = ["diagnose"]


# doubts about a test or a deck as a whole, beside which nothing else can be told
OF_ALL = ("level", "frequencies", "time axis", "unrelated", "parameter")
# why recordings of a force nobody recorded are taken as ambient vibration
ONLY_MODES = "only the modes that they show were compared, which passes over most of what may be missing"
TOO_FEW = f"no force was recorded, and not {LEAST_SENSORS} responses in time: {ONLY_MODES}; record more responses"
NO_ONE_FORCE = (
    "no force was recorded, and no one force along an axis of a node explains the responses, nor does a motion of the "
    f'base: {ONLY_MODES}; check the sensors, or say excitation = "ambient" where many forces act'
)


def diagnose(
    study_path: str | Path,
    out: str | Path | None = None,
    progress: Progress | None = None,
    seed: int = 0,
    laws: Sequence[str | Physics] | str | None = None,
    time_limit: float | None = None,
) -> StudyRun | StagedRun:
    """Runs a study from its file and, where `out` is given, writes everything the contract asks for to that folder.

    `laws` are tried in place of the default ones, as `femend.physics.selected` takes them; run.json lists them. Raises
    LawParameterError for one that does not exist and StudyError for a study in stages, which has laws of its own.
    Raises the errors of the readers (StudyError, DeckError, FormatError, RecordingError, PairingError, ModelError);
    nothing is written then. Stopped by hand (KeyboardInterrupt) after the update, a study without stages writes what is
    settled and raises StudyInterrupted with it; before, and stopped again while it writes, nothing is written.

    With a `time_limit` in seconds it is stopped when they are over, and what is settled by then is written and
    returned, which takes some seconds more; run.json says the limit. Raises TimeLimitError where the parameters were
    not updated by then, and StudyError for a study in stages, which settles nothing on its way; one of responses alone
    that turns out to need stages goes through them to their end and warns.
    """
    limit = TimeLimit(time_limit)
    with selected(laws) as tried:
        settings: dict[str, Any] = {} if laws is None else {"laws": [law.name for law in tried]}
        settings |= {} if time_limit is None else {"time_limit": time_limit}
        info = RunInfo(seed=seed, study=str(Path(study_path).name), settings=settings)
        return _diagnose(Path(study_path), out, progress or SilentProgress(), info, limit)


def _diagnose(
    study_path: Path, out: str | Path | None, progress: Progress, info: RunInfo, limit: TimeLimit
) -> StudyRun | StagedRun:
    """Reads the study and runs it, in stages where it needs them."""
    steps = Steps(info, progress)
    folder = None if out is None else Path(out)
    if folder is not None:
        refuse_unwritable(folder)
    with steps.step("read the study"):
        study = load_study(study_path)
    unrecorded = _unrecorded(study)
    if is_staged(study) and not unrecorded:
        if unkept := _not_kept(info):
            raise StudyError(f"{'; '.join(unkept.values())}; leave out {' and '.join(unkept)}")
        return diagnose_staged(study, steps, info, progress, folder)
    with _before_update(limit, steps), steps.step("read the deck and the recordings"):
        model = read_model(study.model_file, units=study.units, parameters=study.parameters, spc=_spc(study))
        model = with_free_dashpots(model)
        test = study.read_recordings()
        pairing = pair_test(test, model)
        _usable(test, unrecorded)
        doubts = doubts_found(model, without_cut_blows(test), pairing, study.damping_ratio)
        warnings = [
            *pairing.warnings,
            *warnings_of(study, model.deck, test),
            *damping_told(model, study.parameters),
            *doubts.texts,
            *left_out(_fitted(test)),
            *none_whole(_fitted(test)),
        ]
    for text in (*warnings, *bounds_told(study.parameters)):
        say(progress, text)
    right = Corrections(test)
    if doubts.of_recordings:
        with _before_update(limit, steps), steps.step("try corrections"):
            given = (test, doubts.of_recordings)
            right = (
                left_out_unseen(*given) if unrecorded else corrections_of(model, pairing, study.damping_ratio, *given)
            )
    used = of_whole_blows(_usable(right.test, unrecorded))
    records = [] if unrecorded and not _enough(right.test) else fit_records(used, model, pairing)
    task = _Task(
        study, model, test, pairing, records, info, steps, folder, right, limit, warnings, doubts.of_recordings
    )
    try:
        # a time axis that is mistaken without a force is for the modes to tell
        run = task.run(unrecorded) if records and not (unrecorded and right.whole) else None
    except KeyboardInterrupt:
        if limit.reached:
            return task.out_of_time()
        raise task.stopped() from None
    except FemendError as error:
        for text in warnings:  # what was doubtful from the start may be why
            error.add_note(text)
        raise
    if run is not None:
        return run
    # what is left of the recordings are modes
    why = [] if right.whole else [NO_ONE_FORCE if records else TOO_FEW]
    return diagnose_staged(study, steps, info, progress, folder, [*why, *_not_kept(info).values()])


def _not_kept(info: RunInfo) -> dict[str, str]:
    """What was asked for that a study in stages does not keep, with what is said of it: a time limit, and laws that its
    stages do not try."""
    told = {}
    if "time_limit" in info.settings:
        told["the limit"] = (
            f"a time limit was set ({info.settings['time_limit']:g} s), but this study goes through its stages, of "
            "which nothing is settled before the last one"
        )
    if "laws" in info.settings:
        told["the choice of laws"] = (
            f"laws were chosen ({', '.join(info.settings['laws'])}), but this study goes through its stages, which try "
            "supports, springs, joints and masses alone"
        )
    return told


@dataclass(eq=False)
class _Task:
    """A study that was read, while it is diagnosed: `test` as recorded, `right` what is used of it; `doubted` is what
    is doubtful of the recordings, among the `warnings`, and `so_far` what is settled."""

    study: Study
    model: Model
    test: Test
    pairing: Pairing
    records: list[FitRecord]
    info: RunInfo
    steps: Steps
    out: Path | None
    right: Corrections
    limit: TimeLimit
    warnings: list[str] = field(default_factory=list)
    doubted: Sequence[Doubted] = ()
    so_far: SoFar = field(default_factory=SoFar)

    def run(self, unrecorded: bool) -> StudyRun | None:
        """From the records to what is written; None where no single force explains responses alone. Nothing is looked
        for in recordings that have to be corrected as a whole."""
        if self.right.whole:
            settled = undecided(SoFar(start=self.right.start), "")
            assert settled is not None
            return self.finished(replace(settled, interrupted=False, advice=""))
        diagnose_them = diagnose_responses if unrecorded else partial(diagnose_records, contradicts=self._contradicts)
        with self.limit, self.steps.step("diagnose"), self.steps.parts("diagnose") as told:
            found = diagnose_them(self.model, self.records, self.study.damping_ratio, told, so_far=self.so_far)
        return None if found is None else self.finished(found)

    def finished(self, diagnosis: Diagnosis) -> StudyRun:
        """Predictions and result of a diagnosis, written to the folder where there is one."""
        # with the noise that was told from them
        records = self.records if diagnosis.driven is None else diagnosis.driven.start.problem.records
        with self.steps.step("predict"):
            first = next(r for r in self.test if r.role == "fit")
            used = self.right.test
            predictions = predict_all(diagnosis, used, self.model, self.pairing, records, first)
            result = result_of(diagnosis, predictions, records, self.warnings)
            factors = {name: entry["factor"] for name, entry in result["parameters"].items()}
            result["warnings"] += bounds_told(self.study.parameters, factors)
            # what recordings that are off as a whole make of a parameter is told with what they are off by
            result["warnings"] += [] if self.right.whole else far_told(self.study.parameters, factors)
            result["warnings"] += at_dashpots(self.model, result["findings"])
            answered_in = self._answered(result, self._unexplained(diagnosis))
            result = self.right.told_in(self._doubted_first(answered_in))
        run = StudyRun(self.study, self.model, used, self.pairing, records, diagnosis, predictions, result)
        if self.out is not None:
            _write(run, self.out, self.info)
        return run

    def _answered(self, result: dict[str, Any], unexplained: Collection[str] = ()) -> dict[str, Any]:
        """The result without warnings of what it answers, which is nothing of sensors that it leaves `unexplained`."""
        if self.right.whole:
            return result
        gone = {one.text for one in answered(self.doubted, result, {*self.right.left_out, *unexplained})}
        for text in filter(gone.__contains__, result["warnings"]):
            # it was said when the run began
            self.steps.tell(f"no longer in doubt, since the model explains what was recorded as it is: {text}")
        return {**result, "warnings": [text for text in result["warnings"] if text not in gone]}

    def _unexplained(self, diagnosis: Diagnosis) -> set[str]:
        """Sensors, by name, that a `diagnosis` left out of its fit, or what they show beyond the model to noise."""
        records = diagnosis.problem.records
        rows = {row for r in records for row in (*(x[0] for x in r.crossed), *(x[0] for x in r.loud))}
        dofs = (
            {c.dof for r in self.right.test if r.role == "fit" for c in r.sensors if c.dof is not None} if rows else ()
        )
        return {str(dof) for dof in dofs if self.model.row(self.pairing[dof].dof) in rows}

    def _doubted_first(self, result: dict[str, Any]) -> dict[str, Any]:
        """The result with what is doubtful of the test or the deck as a whole at the head of its advice, where nothing
        was named: a search for missing physics does not make up for other units, another time step or no supports. A
        level that what is missing may make as well comes first in nothing, as it does in the search. Nor does what is
        doubtful beside a law that was read at a place whose force explains the recordings."""
        read = any(finding.get("as_read") for finding in result.get("findings", ()))
        if read or result["verdict"] not in ("located-not-named", "undetermined"):
            return result
        told = [text for text in self._contradictions(sure=True) if text in result["warnings"]]
        if not told:
            return result
        first = "settle this first, since no place and no law can be told beside it: " + "; ".join(told)
        return {**result, "advice": "; ".join(filter(None, [first, result["advice"]]))}

    def _contradicts(self, start: UpdatedModel) -> bool:
        """Whether the deck or the test as a whole is doubtful. Where the updated model strains its priors and is far
        from the recordings all the same, digits of parameters are doubted that were not before."""
        if not self._contradictions() and _strained(start):
            found = doubts_found(self.model, self.test, self.pairing, self.study.damping_ratio, digits=True)
            more = [one for one in found.of_recordings if one.doubt.kind == "parameter"]
            self.doubted = [*self.doubted, *more]
            self.warnings += [one.text for one in more]
        return bool(self._contradictions(sure=True))

    def _contradictions(self, *, sure: bool = False) -> list[str]:
        """What is doubtful of the deck or of the test as a whole; where it has to be `sure`, no level that a stiff
        spring or a heavy mass at the shaker may scale as much."""
        whole = [one for one in self.doubted if one.doubt.kind in OF_ALL]
        told = [one.text for one in whole if not (sure and one.doubt.kind == "level" and _of_structures(one))]
        return [*deck_doubts(self.study, self.model.deck), *none_whole(_fitted(self.test)), *told]

    def settled(self, why: str = "the run was interrupted") -> StudyRun | None:
        """What is settled when it is stopped for the reason `why`, written; None where nothing is."""
        diagnosis = undecided(self.so_far, self.steps.now, why=why)
        return None if diagnosis is None else self.finished(diagnosis)

    def stopped(self) -> KeyboardInterrupt:
        """What is raised when the user stops it, after what is settled was written."""
        step = self.steps.now
        run = self.settled()
        return nothing_settled(step) if run is None else StudyInterrupted(run, step, self.out)

    def out_of_time(self) -> StudyRun:
        """What is settled when the time is over, written; TimeLimitError where nothing is."""
        step = self.steps.now
        run = self.settled(self.limit.told)
        if run is None:
            raise _too_short(self.limit, step)
        return run


@contextmanager
def _before_update(limit: TimeLimit, steps: Steps) -> Iterator[None]:
    """For steps within a limit in which nothing is settled yet. Raises TimeLimitError where the time ends in them."""
    try:
        with limit:
            yield
    except KeyboardInterrupt:
        if limit.reached:
            raise _too_short(limit, steps.now) from None
        raise


def _too_short(limit: TimeLimit, step: str) -> TimeLimitError:
    """The time was over in a `step` before anything was settled."""
    assert limit.seconds is not None
    return TimeLimitError(
        f'{limit.told} in the step "{step}", before the parameters were updated; no result was written: give it more '
        "time",
        seconds=limit.seconds, step=step,
    )  # fmt: skip


def _of_structures(one: Doubted) -> bool:
    """Whether a level is off by no more than what is missing in a model may do."""
    factor = one.doubt.factor
    return factor is not None and max(factor, 1 / factor) <= BEYOND


def _strained(start: UpdatedModel) -> bool:
    """Whether an updated model bends its priors, and is far from the recordings all the same."""
    settings = Settings()
    return start.null.score > settings.far and settings.strains(start.null.prior)


def _unrecorded(study: Study) -> bool:
    """Were all fit recordings, of one configuration, driven by a force nobody recorded?"""
    fit = [r for r in study.recordings if r.role == "fit"]
    return bool(fit) and all(r.excitation == "unknown" for r in fit) and len({r.configuration for r in fit}) == 1


def _enough(test: Test) -> bool:
    """Have all fit recordings as many responses in time as a diagnosis without a force needs?"""
    fit = [r for r in test if r.role == "fit"]
    return all(r.is_time and r.response is not None and len(r.response.channels) >= LEAST_SENSORS for r in fit)


def _fitted(test: Test) -> list[Recording]:
    return [r for r in test if r.role == "fit"]


def _usable(test: Test, unrecorded: bool = False) -> list[Recording]:
    """Fit recordings the estimation can take, those of a force nobody recorded where that is looked for; others are an
    error that says what to do."""
    fit = _fitted(test)
    if not fit:
        raise StudyError('no recording has role = "fit"; at least one is needed to estimate anything', key="recording")
    taken = "unknown" if unrecorded else "measured"
    wrong = [r for r in fit if r.excitation != taken or isinstance(r.data, Spectra)]
    if wrong:
        r = wrong[0]
        what = f'excitation = "{r.excitation}"' if r.excitation != "measured" else "auto or cross spectra"
        raise RecordingError(
            f"recording {r.name!r} has {what}; this version fits time records with measured force and frequency "
            "response functions: give it another role or leave it out",
            recording=r.name,
        )
    return fit


def _spc(study: Study) -> int | None:
    """The SPC set of the fit recordings' configuration where they share one; None for the deck's own."""
    used = {r.configuration for r in study.recordings if r.role == "fit"}
    return study.configuration(used.pop()).spc if len(used) == 1 else None


def _write(run: StudyRun, out: Path, info: RunInfo) -> None:
    patched = _patched(run)
    factors = {name: entry["factor"] for name, entry in run.result["parameters"].items()}
    told = [*deck_told(run.model, factors, patched), *cards_told(run.model, run.result)]
    run.result["warnings"] = [*run.result["warnings"], *told]
    with OutputDirectory(out) as folder:
        (folder / "result.json").write_text(json.dumps(run.result, indent=2) + "\n", encoding="utf-8")
        write_predictions(folder, run.predictions)
        for name, text in updated_files(Path(run.model.deck.path), patched).items():
            (folder / name).write_bytes(text)
        info.write(folder / "run.json")
        content = report_content(run, info.as_dict())
        (folder / "report.html").write_text(render(content), encoding="utf-8")


def _patched(run: StudyRun) -> dict[Path, bytes]:
    """The main file of the deck and the others that change, with the parameters' values and the terms found."""
    changes = deck_changes(run.model, run.result["parameters"])
    patched = patch_deck(run.model.deck, changes, deck_cards(run.model, run.result))
    main = Path(run.model.deck.path)
    text = patched[main] if main in patched else main.read_bytes()
    patched[main] = on_new_supports(text, run.model, run.result)
    return patched
