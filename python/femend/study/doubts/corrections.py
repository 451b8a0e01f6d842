"""Mistakes that are doubted in recordings, tried: would the correction make the model explain them?

A mistake with one sensor is judged by the model updated on all the others, which the sensor had no say in; one with all
responses or with a force by the model updated with and without the correction. A sensor whose mistake is confirmed is
left out; of recordings that are confirmed to be mistaken as a whole nothing can be said until they are corrected.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.correlate.doubts import suggested
from femend.correlate.mistaken_units import mistaken_as
from femend.data import Recording, Test
from femend.data.bands import within_band
from femend.diagnose.fitting.predict import predict_frf, predict_model
from femend.diagnose.updating.update import UpdatedModel, update_model
from femend.errors import FemendError
from femend.estimate import FitRecord, fit_records
from femend.model import Model, Pairing
from femend.numerals import plain
from femend.study.doubts.mended import mended, sensors_of, without
from femend.study.doubts.plausible import Doubted

__all__ = ["Correction", "Corrections", "corrections_of", "left_out_unseen"]

FloatArray = NDArray[np.float64]

# mistakes that concern all of a recording
WHOLE = ("level", "force sign", "time axis")
# error, as it is or weighted by noise, to which a correction has to bring what it concerns, of that as recorded
CURED, CURED_SENSOR = 0.7, 0.8
# error of corrected recordings, or of a corrected sensor, up to which the model explains them; of a sensor also so many
# times the others' median one, but no more than what one shows that has little to do with the model
EXPLAINED, LIKE_OTHERS, NOTHING = 0.5, 1.25, 0.85
# prior cost of the corrected recordings' update from which it may not be more than that of those recorded
STRAINED = 1000.0
# a factor on all responses, or its inverse, that nothing missing in a model has
BEYOND = 100.0
# how near a factor has to come to that of units
NEAR_UNITS = 1.2
# how many times what a silent sensor shows the model updated on the others has to move there
UNHEARD = 3.0
# mistakes that nothing done to a recording mends, and how many times the others' median error a sensor that stands
# elsewhere has
LOST, APART = ("silent", "elsewhere"), 2.0
# sensors that have to stay at least, and their share of all
FEWEST, SHARE = 2, 0.5


@dataclass(frozen=True, slots=True)
class Correction:
    """A mistake that was confirmed: relative error of what it concerns `before` and `after` the correction (None where
    the shapes of the model alone tell it)."""

    doubted: Doubted
    before: float | None = None
    after: float | None = None

    @property
    def sensors(self) -> tuple[str, ...]:
        """The sensors it concerns; none where it concerns all."""
        doubt = self.doubted.doubt
        return () if doubt.kind in WHOLE else doubt.order or (doubt.channel,)

    @property
    def text(self) -> str:
        """What to correct, and what that does."""
        doubt = self.doubted.doubt
        factor = doubt.factor or 1.0
        if doubt.kind == "time axis":
            off = f"{plain(max(factor, 1 / factor), 3)} times too {'long' if factor >= 1 else 'short'}"
            what = f"the time step of {' and '.join(self.doubted.recordings)} is about {off}"
        elif doubt.kind == "level":
            what = f"the responses, or the force, are off by a factor {plain(factor)}"
        elif doubt.order:
            circle = " in a circle, each with the next" if len(doubt.order) > 2 else ""
            what = f"the sensors {', '.join(doubt.order[:-1])} and {doubt.order[-1]} are exchanged{circle}"
        elif doubt.kind == "silent":
            what = f"the sensor {doubt.channel} shows nothing of what the forces do"
        elif doubt.kind == "elsewhere":
            what = f"the sensor {doubt.channel} moves as the model does elsewhere"
        elif doubt.kind == "sensor level":
            what = f"the sensor {doubt.channel} shows {plain(factor)} times what it should"
        else:
            what = f"the {doubt.kind.removesuffix(' sign')} {doubt.channel} is reversed"
        if self.before is None or self.after is None:
            return what
        before, after = plain(self.before, 2), plain(self.after, 2)
        return f"{what} (error against the updated model {before} as recorded, {after} corrected)"

    def as_dict(self, left_out: bool) -> dict[str, Any]:
        """The entry of result.json."""
        doubt = self.doubted.doubt
        return {
            "mistake": doubt.kind, "channels": list(doubt.order or filter(None, [doubt.channel])),
            "recordings": list(self.doubted.recordings), "factor": doubt.factor,
            "error": self.before, "corrected": self.after, "left_out": left_out,
        }  # fmt: skip


@dataclass(frozen=True, eq=False)
class Corrections:
    """Mistakes that are confirmed: `whole` those that have to be corrected before anything can be said, `single` those
    of sensors that are left out. `test` is what is used, without these sensors and with `whole` corrected; `start` the
    model updated on it where there is something in `whole`."""

    test: Test
    single: tuple[Correction, ...] = ()
    whole: tuple[Correction, ...] = ()
    start: UpdatedModel | None = None

    @property
    def left_out(self) -> tuple[str, ...]:
        """The sensors that are left out."""
        return tuple(dict.fromkeys(name for one in self.single for name in one.sensors))

    @property
    def advice(self) -> str:
        """What to do; empty where nothing is mistaken."""
        said = []
        if self.whole:
            said.append(
                f"first correct the recordings: {'; '.join(one.text for one in self.whole)}. Nothing was looked for in "
                "them as they are; parameters and errors told here are those of the corrected ones"
            )
        if self.single:
            alone = len(self.left_out) == 1
            said.append(
                f"{', '.join(self.left_out)} {'was' if alone else 'were'} left out: "
                f"{'; '.join(one.text for one in self.single)}; correct {'it' if alone else 'them'} and run again"
            )
        return ". ".join(said)

    def told_in(self, result: dict[str, Any]) -> dict[str, Any]:
        """The content of result.json with what was corrected and left out, and what to do about it first; itself where
        that is nothing."""
        rows = [*(one.as_dict(False) for one in self.whole), *(one.as_dict(True) for one in self.single)]
        if not rows:
            return result
        if self.whole:
            result = {**result, "verdict": "undetermined", "findings": []}
        return {**result, "advice": ". ".join(filter(None, [self.advice, result["advice"]])), "corrections": rows}


def corrections_of(model: Model, pairing: Pairing, zeta: float, test: Test, found: Sequence[Doubted]) -> Corrections:
    """Which of the doubts `found` in recordings with their force are confirmed by the `model`, whose modes have the
    damping ratio `zeta`."""
    cured = [one for one in found if one.doubt.factor is not None or one.doubt.order or one.doubt.kind in LOST]
    if not cured:
        return Corrections(test)
    axis = [one for one in cured if one.doubt.kind == "time axis"]
    if axis:
        return _at_the_right_rate(model, pairing, zeta, test, axis)
    whole = [one for one in cured if one.doubt.kind in WHOLE]
    if all(one.doubt.kind == "force sign" for one in whole):
        whole = []  # a force the other way round is a load that the diagnosis names
    single = [one for one in cured if one.doubt.kind not in WHOLE]
    if not _enough(test, _names(single)):
        whole, single = [one for one in cured if one.doubt.kind not in LOST], []
    trial = _Trial(model, pairing, zeta, without(test, _names(single)))
    try:
        told = _whole(trial, whole)
        right = mended(test, [one.doubted for one in told])
        alone = _single(trial, right, single) if single else ()
        used = without(right, _names([one.doubted for one in alone]))
        start = trial.updated(used) if told and len(alone) < len(single) else trial.start
    except FemendError:
        return Corrections(test)  # what takes the recordings next says what is wrong with them
    return Corrections(used, alone, told, start)


def left_out_unseen(test: Test, found: Sequence[Doubted]) -> Corrections:
    """The same for recordings without a force, or of several configurations: the shapes of the model are all that
    tells, and what was told by them is left out where enough sensors stay. A mistaken time axis comes first."""
    axis = [one for one in found if one.doubt.kind == "time axis"]
    if axis:
        return Corrections(mended(test, axis), whole=tuple(map(Correction, axis)))
    single = [one for one in found if (one.doubt.factor is not None or one.doubt.order) and one.doubt.kind not in WHOLE]
    names = _names(single)
    if not names or not _enough(test, names):
        return Corrections(test)
    return Corrections(without(test, names), tuple(map(Correction, single)))


def _at_the_right_rate(model: Model, pairing: Pairing, zeta: float, test: Test, axis: Sequence[Doubted]) -> Corrections:
    """Recordings at the rate that shapes tell; at the mistaken one there is nothing to update a model on."""
    right = mended(test, axis)
    try:
        start = _Trial(model, pairing, zeta, right).updated(right)
    except FemendError:
        return Corrections(test)  # what takes the recordings next says what is wrong with them
    return Corrections(right, whole=tuple(map(Correction, axis)), start=start)


def _names(single: Sequence[Doubted]) -> list[str]:
    """The sensors of doubts."""
    return [name for one in single for name in (one.doubt.order or (one.doubt.channel,))]


def _enough(test: Test, names: Sequence[str]) -> bool:
    """Do enough sensors of the fit recordings stay without `names`?"""
    every = sensors_of(_fitted(test))
    stay = len(set(every) - set(names))
    return stay >= max(FEWEST, SHARE * len(every))


class _Trial:
    """The model updated on recordings as they are, and on corrected ones; `start` is the last update."""

    def __init__(self, model: Model, pairing: Pairing, zeta: float, test: Test) -> None:
        self.model, self.pairing, self.zeta, self.test = model, pairing, zeta, test
        self.start: UpdatedModel | None = None

    def updated(self, test: Test) -> UpdatedModel:
        """The model updated on a test."""
        self.start = update_model(self.model, fit_records(_fitted(test), self.model, self.pairing), self.zeta)
        return self.start

    def left(self, test: Test) -> FloatArray:
        """Relative error (2,) that the model updated on a test leaves there, and that weighted by noise."""
        start = self.updated(test)
        return np.array([_relative(self.squares(test).values()), np.sqrt(start.null.score)])

    def squares(self, test: Test) -> dict[str, FloatArray]:
        """By sensor (3,) what `_squares` gives of the model updated last. Every record counts as much, however strongly
        it was driven."""
        assert self.start is not None
        total: dict[str, FloatArray] = {}
        for recording in _fitted(test):
            for record in fit_records([recording], self.model, self.pairing):
                own = _squares(self.start, record)
                for channel, squares in zip(recording.sensors, own.T / own[1].sum(), strict=True):
                    total[str(channel.dof)] = total.get(str(channel.dof), np.zeros(3)) + squares
        return total


def _fitted(test: Test) -> list[Recording]:
    return [r for r in test if r.role == "fit"]


def _whole(trial: _Trial, doubted: Sequence[Doubted]) -> tuple[Correction, ...]:
    """Mistakes with all of the recordings, where all of them together are confirmed."""
    if not doubted:
        return ()
    before = trial.left(trial.test)
    as_recorded = trial.start
    assert as_recorded is not None
    right = mended(trial.test, doubted)
    after = trial.left(right)
    # the updated model knows better which factor it is
    factor = _factor(trial.squares(right).values())
    better = [_times(one, factor) if one.doubt.kind == "level" else one for one in doubted]
    if better != list(doubted):
        after, doubted = trial.left(mended(trial.test, better)), better
    beyond = any(max(f, 1 / f) > BEYOND for f in (abs(one.doubt.factor or 1.0) for one in doubted))
    cured = (after < before).all() if beyond else (after < CURED * before).any()
    # a right correction lets the model's unknowns be what they are thought to be
    assert trial.start is not None
    strain = trial.start.null.prior
    relieved = strain < as_recorded.null.prior or strain < STRAINED
    # a stiff spring or a heavy mass at the shaker scales all responses too, but leaves other resonances
    units = all(_of_units(one) for one in doubted)
    if not (cured and relieved and units) or after[0] > (NOTHING if beyond else EXPLAINED):
        trial.start = as_recorded
        return ()
    return tuple(Correction(one, float(before[0]), float(after[0])) for one in doubted)


def _single(trial: _Trial, test: Test, doubted: Sequence[Doubted]) -> tuple[Correction, ...]:
    """The mistakes with sensors of a `test` that the model confirms, updated on the other sensors."""
    if trial.start is None:
        trial.updated(trial.test)
    before, concerned = trial.squares(test), set(_names(doubted))
    typical = float(np.median([_relative([s]) for name, s in before.items() if name not in concerned]))
    limit = min(NOTHING, max(EXPLAINED, LIKE_OTHERS * typical))
    # a model that hardly explains the other sensors has less to say about one
    enough = CURED if typical > EXPLAINED else CURED_SENSOR
    told = []
    for one in doubted:
        names = _names([one])
        if one.doubt.kind == "silent":
            if _unheard(before[one.doubt.channel]):
                told.append(Correction(one))
            continue
        if one.doubt.kind == "elsewhere":
            # the model updated on the others explains them, and not this one
            if _relative([before[one.doubt.channel]]) > APART * typical and typical < EXPLAINED:
                told.append(Correction(one))
            continue
        after = trial.squares(mended(test, [one]))
        if one.doubt.kind == "sensor level":
            one = _times(one, _factor([after[name] for name in names]))
            after = trial.squares(mended(test, [one]))
        errors = _relative([before[name] for name in names]), _relative([after[name] for name in names])
        if _of_units(one) and errors[1] <= min(limit, enough * errors[0]):
            told.append(Correction(one, *errors))
    return tuple(told)


def _unheard(squares: FloatArray) -> bool:
    """Whether the model moves far more than what a sensor shows, by its squares (3,)."""
    error, recorded, both = squares
    return bool(error - recorded + 2 * both > UNHEARD**2 * recorded)


def _of_units(one: Doubted) -> bool:
    """Whether a level is off as units are that were mistaken for each other, if it is a level: what is missing in a
    model may scale a response, or all of them, by any factor."""
    factor = one.doubt.factor
    if factor is None or one.doubt.kind not in ("level", "sensor level"):
        return True
    return mistaken_as(abs(factor), NEAR_UNITS) is not None


def _factor(squares: Iterable[FloatArray]) -> float:
    """What is recorded, in least squares, per what is computed; 1 where that is not above 0."""
    error, recorded, both = np.sum(list(squares), axis=0)
    computed = error - recorded + 2 * both
    return float(both / computed) if min(both, computed) > 0 else 1.0


def _times(one: Doubted, factor: float) -> Doubted:
    """A doubt of which `factor` was left by its correction."""
    own = one.doubt.factor
    better = None if own is None else suggested(own * factor) if own > 0 else own
    return replace(one, doubt=replace(one.doubt, factor=better or own))


def _relative(squares: Iterable[FloatArray]) -> float:
    error, recorded, _ = np.sum(list(squares), axis=0)
    return float(np.sqrt(error / recorded))


def _squares(start: UpdatedModel, record: FitRecord) -> FloatArray:
    """Of every sensor of a record (3, n_out): squares of the errors of an updated model and of what was recorded, and
    the product of what was computed and recorded."""
    at = (start.problem, start.null.hypothesis, start.null.p, np.zeros(0), record)
    if record.frf is None:
        return _sums(predict_model(*at), record.y)
    inside = within_band(record.frf.freq, start.problem.band)
    return _sums(predict_frf(*at)[inside].T, record.frf.H[inside].T)


def _sums(computed: NDArray[Any], recorded: NDArray[Any]) -> FloatArray:
    pairs = ((computed - recorded,) * 2, (recorded,) * 2, (computed, recorded))
    return np.array([np.real(a.conj() * b).sum(axis=1) for a, b in pairs])
