"""The steps of a diagnosis one by one, for scripts and notebooks; `femend.diagnose_study` does them all from a file,
as `correlate_study`, `update_study` and `pretest_study` do the classic chain.

Each step takes what the one before gave and returns an object that shows itself as a short table.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from numbers import Real
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.bench import CorrelationRun, PopulationRun, PretestRun, UpdateRun
from femend.bench import correlate as correlate_bench
from femend.bench import population as population_bench
from femend.bench import pretest as pretest_bench
from femend.bench import update as update_bench
from femend.cli.summary import summary
from femend.data import FRF, Test
from femend.diagnose import Diagnosis, Settings
from femend.diagnose.diagnosis import explain
from femend.diagnose.locating.locate import Located
from femend.diagnose.locating.locate import locate as locate_places
from femend.diagnose.updating.update import UpdatedModel, update_model
from femend.errors import ArgumentError, ModelError, PairingError, RecordingError, UpdatingError
from femend.estimate import Fit, FitRecord, Hypothesis, Problem, fit_records, pair_test
from femend.estimate.other_units import refuse_other_units
from femend.io.atomic import write_atomic
from femend.model import Model, Pairing, Parameter, Place, ReducedModel, find_places
from femend.model import read_model as read_deck
from femend.physics import Physics, selected
from femend.report.numbers import ratio
from femend.report.page import render
from femend.report.runinfo import RunInfo
from femend.report.text_table import table
from femend.study import Study
from femend.study.result.predictions import STAGES, Prediction, predict_all
from femend.study.result.result import result_of
from femend.study.result.study_run import StudyRun
from femend.study.run import diagnose
from femend.study.shown.content import report_content
from femend.study.staged.study_run import StagedRun

__all__ = [
    "Check",
    "Named",
    "Places",
    "Updated",
    "correlate_study",
    "diagnose_study",
    "locate",
    "name",
    "pair",
    "pretest_study",
    "read_model",
    "update",
    "update_study",
    "validate",
    "write_report",
]

FloatArray = NDArray[np.float64]
# places shown in a table
SHOWN = 8


@dataclass(frozen=True, eq=False, repr=False)
class Updated:
    """A model with its parameters updated within their priors, and all that the next steps need.

    `test` and `pairing` as given, `records` the fit records, `found` what the update gave.
    """

    model: Model
    test: Test
    pairing: Pairing
    records: list[FitRecord]
    found: UpdatedModel

    @property
    def reduced(self) -> ReducedModel:
        """The model in its Ritz basis."""
        return self.found.reduced

    @property
    def problem(self) -> Problem:
        """The records with their band."""
        return self.found.problem

    @property
    def fit(self) -> Fit:
        """The minimum."""
        return self.found.null

    @property
    def nominal(self) -> tuple[Hypothesis, FloatArray]:
        """The deck as it is, and its unknowns."""
        return self.found.nominal

    @cached_property
    def misfit(self) -> tuple[float, float]:
        """Mean weighted square left by the deck as it is and by the updated model; noise alone leaves about 1."""
        hypothesis, p = self.nominal
        (before,) = self.problem.fit([hypothesis], [(p, np.zeros(0))], iterations=0)
        return (float("inf") if before is None else before.score), self.fit.score

    @property
    def factors(self) -> dict[str, float]:
        """Factors on the deck's values by parameter name."""
        return {p.name: float(np.exp(v)) for p, v in zip(self.model.parameters, self.fit.p)}

    def __repr__(self) -> str:
        rows = [
            [p.name, f"{self.factors[p.name]:.4f}", f"{np.log(self.factors[p.name]) / p.prior_sd:+.1f}"]
            for p in self.model.parameters
        ]
        before, after = self.misfit
        text = table(["parameter", "factor", "prior sd"], rows, "lrr")
        return f"{text}\nmisfit {ratio(before)} -> {ratio(after)}"


@dataclass(frozen=True, eq=False, repr=False)
class Places:
    """Places ranked by what a free force there explains; `found[0]` explains most, `every` are all that were tried."""

    found: tuple[Located, ...]
    settings: Settings
    every: tuple[Place, ...] = ()

    def __iter__(self) -> Iterator[Located]:
        return iter(self.found)

    def __len__(self) -> int:
        return len(self.found)

    def __getitem__(self, index: int) -> Located:
        return self.found[index]

    @property
    def ambiguous(self) -> tuple[Located, ...]:
        """The places that the records do not tell apart from the first one, with it."""
        return tuple(f for f in self.found if f.cost - self.found[0].cost < self.settings.margin)

    def __repr__(self) -> str:
        rows = [[f.place.text, ratio(f.fit.score), f"{f.cost - self.found[0].cost:.1f}"] for f in self.found[:SHOWN]]
        return table(["place", "misfit", "cost above first"], rows, "lrr")


@dataclass(frozen=True, eq=False, repr=False)
class Named:
    """The outcome: `start` the updated model it began with, `diagnosis` with ranked laws and the final model."""

    start: Updated
    diagnosis: Diagnosis

    @property
    def verdict(self) -> str:
        """Verdict in the words of result.json: "missing-physics", "parameters-only", ..."""
        return self.diagnosis.verdict

    @cached_property
    def result(self) -> dict[str, Any]:
        """The content of result.json, without predictions."""
        return result_of(self.diagnosis, [], self.start.records)

    def __repr__(self) -> str:
        ranked = zip(self.diagnosis.ranked[:SHOWN], self.diagnosis.probabilities)
        rows = [
            [r.candidate.name, "" if r.located is None else r.located.place.text, ratio(r.candidate.chosen), f"{p:.2f}"]
            for r, p in ranked
        ]
        return summary(self.result) + "\n\n" + table(["law", "place", "unseen misfit", "probability"], rows, "llrr")


@dataclass(frozen=True, eq=False, repr=False)
class Check:
    """Predicted responses of recordings, at the stages "nominal", "parameters" and "final"."""

    predictions: tuple[Prediction, ...]

    def __getitem__(self, recording: str) -> Prediction:
        for prediction in self.predictions:
            if prediction.name == recording:
                return prediction
        raise KeyError(f"no recording {recording!r} was predicted; there are {[p.name for p in self.predictions]}")

    def nrmse(self, recording: str, stage: str = "final") -> float:
        """Error of the prediction of `recording` at `stage`, as a share of what was recorded; NaN where nothing was."""
        prediction = self[recording]
        if prediction.recorded is None:
            return float("nan")
        return prediction.error(stage)

    def __repr__(self) -> str:
        rows = [[p.name, *(ratio(self.nrmse(p.name, stage)) for stage in STAGES)] for p in self.predictions]
        return table(["recording", *STAGES], rows, "lrrr")


# what an argument of a step is and where it comes from
_FROM: dict[type, str] = {
    Test: "recordings as `femend.read_recordings` gives them, or `femend.data.Test((recording,))`",
    Model: "a model as `femend.read_model` gives it",
    Pairing: "what `femend.pair(test, model)` gives",
    Updated: "what `femend.update(model, test, pairs)` gives",
    Places: "what `femend.locate(start)` gives",
    Named: "what `femend.name(start, where)` gives",
    Check: "what `femend.validate(what, test)` gives",
    Settings: "thresholds as `femend.Settings(...)`",
}


def _given(step: str, **arguments: tuple[object, type]) -> None:
    """Raises ArgumentError where a step was given a value of another kind than it takes, each by what it is taken
    as."""
    for name, (value, kind) in arguments.items():
        if not isinstance(value, kind):
            raise ArgumentError.given(f"`femend.{step}` takes {_FROM[kind]}, as its {name}", value)


def read_model(
    path: str | os.PathLike[str],
    *,
    units: str = "SI",
    parameters: str | Parameter | Sequence[str | Parameter] = (),
    prior_sd: float = 0.10,
    spc: int | None = None,
) -> Model:
    """Reads the bulk-data deck at `path`, in the unit system `units`, with the `parameters` that may be updated.

    A parameter is a `Parameter` or a text: "E:1" is E of material 1, "rho:1,2" the density of two materials together,
    "I1:12" a property of card 12, "m:7" the mass element 7; `prior_sd` is the relative standard deviation of those
    given as text. `spc` selects a constraint set other than the deck's own. Raises DeckError for a deck that cannot be
    read, UnitError for `units` that are none, and ModelError for a model that cannot be used, a parameter that means
    nothing, a `prior_sd` that is not above 0, and two parameters of one name or on the same values.
    """
    given = [parameters] if isinstance(parameters, (str, Parameter)) else parameters
    found = [p if isinstance(p, Parameter) else _parameter(p, prior_sd) for p in given]
    return read_deck(Path(path), units=units, parameters=found, spc=spc)


def _parameter(text: str, prior_sd: float) -> Parameter:
    if not isinstance(text, str):
        takes = "`femend.read_model` takes parameters as texts like 'E:1', or as `femend.Parameter(...)`"
        raise ArgumentError.given(takes, text)
    what, _, ids = text.partition(":")
    try:
        numbers = tuple(int(i) for i in ids.split(","))
    except ValueError:
        raise ModelError(f"parameter {text!r} is not of the form property:id, as in 'E:1' or 'rho:1,2'") from None
    target = "material" if what in ("E", "G", "nu", "rho") else "mass" if what == "m" else "property_id"
    return Parameter(text, what, target, numbers, prior_sd)


def pair(test: Test, model: Model) -> Pairing:
    """Pairs every sensor and shaker of `test` with its DOF of `model`, by node id or by the nearest node.

    Raises UnitError for recordings that were read in other units than the model, PairingError for a sensor that is far
    from every node, and ArgumentError for what is no test or no model.
    """
    _given("pair", test=(test, Test), model=(model, Model))
    return pair_test(test, model)


def update(model: Model, test: Test, pairs: Pairing, *, damping: float = 0.01) -> Updated:
    """Updates the parameters of `model` within their priors, with a damping ratio (prior median `damping`) a mode.

    The fit recordings of `test` are used, with their sensors placed by `pairs`. Raises RecordingError where `test` has
    no recording with role "fit", one lacks a measured force, or the model has no solution at the deck's values,
    UnitError for recordings in other units than the model's, PairingError for `pairs` with another model, UpdatingError
    for a `damping` that is not between 0 and 1, and ArgumentError for arguments of another kind, as when they are
    exchanged.
    """
    _given("update", model=(model, Model), test=(test, Test), pairs=(pairs, Pairing))
    if not (isinstance(damping, Real) and 0 < damping < 1):
        shown = f"{damping:g}" if isinstance(damping, Real) else repr(damping)
        raise UpdatingError(f"`femend.update`: damping: {shown} is not between 0 and 1 (1 % is 0.01)")
    fit = [r for r in test if r.role == "fit"]
    if not fit:
        raise RecordingError('no recording has role = "fit"; at least one is needed to estimate anything')
    unmeasured = next((r.name for r in fit if r.excitation != "measured"), None)
    if unmeasured is not None:
        raise RecordingError(
            f"recording {unmeasured!r} has no measured excitation; give it another role or leave it out",
            recording=unmeasured,
        )
    refuse_other_units(test, model.units)
    if pairs.mesh not in ("", model.mesh_key):
        raise PairingError(
            "the pairing was made with another model, whose nodes or units are not those of this one: pair the "
            "recordings with it, `femend.pair(test, model)`"
        )
    records = fit_records(fit, model, pairs)
    found = update_model(model, records, damping)
    return Updated(model, test, pairs, records, found)


def locate(start: Updated, settings: Settings | None = None) -> Places:
    """Ranks every joint, support, member end, member and pair of joints by what a free force there would explain.

    All unknowns of the updated model `start` stay free meanwhile; `settings` holds the thresholds. Raises ArgumentError
    for arguments of another kind.
    """
    _given("locate", start=(start, Updated), settings=(Settings() if settings is None else settings, Settings))
    every = find_places(start.reduced.model)
    found = locate_places(start.problem, start.reduced, every, start.fit)
    return Places(tuple(found), settings or Settings(), tuple(every))


def name(start: Updated, where: Places, laws: Sequence[str | Physics] | None = None) -> Named:
    """Fits the catalogue's laws at the best places of `where` and judges them on data the fit has not seen.

    The verdict says whether one of them is missing in the updated model `start`. `laws` (names or entries of
    `femend.physics`, those of one's own too) are tried in place of the default ones, beside a plain spring; each costs
    seconds. Raises LawParameterError for a name that is no law, and ArgumentError for arguments of another kind.
    """
    _given("name", start=(start, Updated), where=(where, Places))
    with selected(laws):
        return Named(start, explain(start.found, where.found, where.every, where.settings))


def validate(what: Named, test: Test) -> Check:
    """Predicts the responses of the recordings in `test`, which took no part in `what`, from their measured forces.

    Raises RecordingError for a recording that was used to fit, or that has no measured force, UnitError for recordings
    in other units than the model's, and ArgumentError for arguments of another kind.
    """
    _given("validate", what=(what, Named), test=(test, Test))
    start = what.start
    used = {r.source for r in start.records}
    for recording in test:
        if recording.name in used:
            raise RecordingError(
                f"recording {recording.name!r} was used to fit; validate with recordings that were not",
                recording=recording.name,
            )
        forces = isinstance(recording.data, FRF) or (recording.is_time and recording.force is not None)
        if not forces or recording.excitation != "measured":
            raise RecordingError(
                f"recording {recording.name!r} has neither time records of a measured force nor "
                "FRFs; it cannot be predicted",
                recording=recording.name,
            )
    held = tuple(replace(r, role="validate") if r.role == "fit" else r for r in test)
    every = Test((*start.test.role("fit"), *held))
    found = predict_all(what.diagnosis, every, start.model, pair_test(every, start.model), start.records)
    return Check(tuple(p for p in found if p.name not in used))


def write_report(what: Named, check: Check, path: str | os.PathLike[str], title: str = "") -> Path:
    """Writes the page of `what` and `check` to `path` and returns it; `title` defaults to the deck's file name. Raises
    ArgumentError for arguments of another kind."""
    _given("write_report", what=(what, Named), check=(check, Check))
    start, out = what.start, Path(path)
    fitted = predict_all(what.diagnosis, start.test.role("fit"), start.model, start.pairing, start.records)
    predictions = [*fitted, *check.predictions]
    result = result_of(what.diagnosis, predictions, start.records, start.pairing.warnings)
    deck = Path(start.model.deck.path)
    study = Study(deck, title or deck.stem, deck, start.model.units, start.problem.zeta, (), (), ())
    run = StudyRun(study, start.model, start.test, start.pairing, start.records, what.diagnosis, predictions, result)
    page = render(report_content(run, RunInfo(study=study.title).as_dict()))
    write_atomic(out, page)
    return out


def diagnose_study(
    study: str | os.PathLike[str],
    out: str | os.PathLike[str] | None = None,
    *,
    seed: int = 0,
    laws: Sequence[str | Physics] | str | None = None,
    time_limit: float | None = None,
) -> StudyRun | StagedRun:
    """Runs the study file `study` from end to end; with a folder `out` everything is written there.

    `seed` is written down with the run. `laws` (names or entries of `femend.physics`, those of one's own too) are tried
    in place of the default ones; "default" and "all" stand for many, and each costs seconds. Raises LawParameterError
    for a law that does not exist, and StudyError, DeckError, FormatError, RecordingError, PairingError and ModelError
    as the readers do; nothing is written then. Stopped by hand after the update, a study without stages writes what is
    settled and raises `femend.study.StudyInterrupted` (a KeyboardInterrupt) with it.

    With a `time_limit` (s) it stops when that is over and returns what is settled, with the status "interrupted":
    "located-not-named" with the likeliest law so far, or "undetermined". Raises TimeLimitError where the parameters
    were not updated by then, and StudyError for a study in stages or in another thread than the main one.
    """
    folder = None if out is None else Path(out)
    return diagnose(Path(study), folder, seed=seed, laws=laws, time_limit=time_limit)


def correlate_study(study: str | os.PathLike[str], out: str | os.PathLike[str] | None = None) -> CorrelationRun:
    """Compares the deck of the study file `study`, as it stands, with its test; with a folder `out` everything is
    written there.

    Modes are identified or read, sensors placed, modes and FRFs compared; the result shows itself as a table. Raises
    StudyError, DeckError, FormatError, RecordingError, PairingError and ModelError as the readers do; nothing is
    written then.
    """
    return correlate_bench(Path(study), None if out is None else Path(out))


def update_study(
    study: str | os.PathLike[str],
    out: str | os.PathLike[str] | None = None,
    *,
    history: str | os.PathLike[str] | None = None,
) -> UpdateRun:
    """Updates the parameters of the study file `study` on its measured modes, and FRFs where its table [updating] asks
    for them; with a folder `out` everything is written there, the changed deck too.

    `history` is a file that keeps every iteration, from which a run that was stopped goes on. Raises what
    `correlate_study` raises, and UpdatingError for a problem that cannot be posed and a history of another one. Stopped
    by hand after the search, while it follows other starts or draws, it writes what was found and raises
    `femend.bench.UpdateInterrupted` (a KeyboardInterrupt) with it.
    """
    return update_bench(
        Path(study), None if out is None else Path(out), history=None if history is None else Path(history)
    )


def population_study(study: str | os.PathLike[str], out: str | os.PathLike[str] | None = None) -> PopulationRun:
    """Mean and scatter of the parameters of the study file `study` over the nominally equal structures of its tables
    [[updating.structure]]; with a folder `out` everything is written there, the deck with the mean values too.

    Raises what `correlate_study` raises, StudyError for a study without structures, and UpdatingError for a structure
    of which nothing is told.
    """
    return population_bench(Path(study), None if out is None else Path(out))


def pretest_study(study: str | os.PathLike[str], out: str | os.PathLike[str] | None = None) -> PretestRun:
    """Plans a test on the model of the study file `study`, as its table [pretest] says; recordings are not needed. With
    a folder `out` everything is written there.

    Raises StudyError, DeckError and ModelError as the readers do, and PretestError for a test that cannot be planned.
    """
    return pretest_bench(Path(study), None if out is None else Path(out))
