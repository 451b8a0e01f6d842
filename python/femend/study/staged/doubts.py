"""What a staged study must not call settled: a rival that explains the modes better and yet too little to be named, and
a place of which not all others were tried."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from femend.data import Test
from femend.diagnose.staged import Flow, RunResult, Setup
from femend.diagnose.staged.places import places_tried
from femend.diagnose.staged.select import Rival, Round
from femend.diagnose.staged.settings import StagedSettings
from femend.diagnose.staged.stages import Stage
from femend.numerals import plain
from femend.study.result.predictions import Prediction

__all__ = ["clear_rival", "not_held_out", "places_left", "runs_left", "taken_back", "without_use"]

# ln evidence above the best without a term from which on nothing may be said to be missing no more: odds of twelve to
# one; and by how many times the deviation of a frequency and the form of the model a mode has to be off beside it
CLEARLY, OFF = 2.5, 3.0
# what is left of a run, in units of its noise and the form of the model, from which it is told
LEFT = 3.0
# share by which the error of recordings has to fall with what is named
FALLS = 0.05
# what is tried at nodes
AT_NODES = ("added_mass", "support_stiffness")
# MAC from which on a mode of the model is the identified one
SAME = 0.8


def clear_rival(flow: Flow, settings: StagedSettings) -> str:
    """That a term explains identified modes clearly better than parameters do, where one of them is far off: the term,
    its share and the mode, and what to record; nothing where it is not so."""
    for stage in flow.stages:
        if stage.run is not None or not stage.rounds or not stage.table:
            continue
        best, off = _rival(stage.rounds[-1]), _far_off(stage, settings)
        if best is None or off is None:
            continue
        rival, above = best
        freq, error, times = off
        return (
            f"{rival.label} would explain the modes of {', '.join(stage.recordings)} better than parameters alone (ln "
            f"evidence {plain(above, 2, signed=True)}, {plain(100 * rival.probability, 2)} % of all that was tried), "
            f"which is too little to name it, and the mode at {plain(freq, 3)} Hz is "
            f"{plain(100 * error, 2, signed=True)} % off, {plain(times, 2)} times what its deviation and the form of "
            "the model allow: look there, and "
            "record longer, with more sensors around that place, or a hammer test with its force"
        )
    return ""


def runs_left(flow: Flow, settings: StagedSettings) -> str:
    """That of a run more is left than its noise and the form of the model explain, of the one that is left furthest;
    nothing where none is."""
    runs = [stage for stage in flow.stages if stage.run is not None]
    left = [(stage.unexplained / float(np.hypot(stage.noise, settings.model_run)), stage) for stage in runs]
    times, worst = max(left, key=lambda found: found[0], default=(0.0, None))
    if worst is None or times < LEFT:
        return ""
    return (
        f"{plain(100 * worst.unexplained, 2)} % of {worst.recordings[0]} stays unexplained, {plain(times, 2)} times "
        f"what its noise ({plain(100 * worst.noise, 2)} %) and the form of the model allow: something else shows there "
        "that was not found, or none of what was tried explains it clearly enough; more sensors on the rotor and its "
        "supports, or a run to a higher speed, would tell more"
    )


def _rival(decision: Round) -> tuple[Rival, float] | None:
    """The best rival with a term where it was not taken and is clearly above the best without, and by how much."""
    without = [r.score for r in decision.rivals if r.term is None]
    best = max(decision.rivals, key=lambda r: r.score)
    if (
        decision.taken is not None
        or decision.refused
        or best.term is None
        or not without
        or best.score - max(without) < CLEARLY
    ):
        return None
    return best, best.score - max(without)


def _far_off(stage: Stage, settings: StagedSettings) -> tuple[float, float, float] | None:
    """Frequency (Hz) of the mode that is farthest off of those the model has, its relative error, and in how many
    deviations; None where none is `OFF` of them."""
    found = [
        (freq, model / freq - 1, abs(model - freq) / float(np.hypot(sd, settings.model_freq * freq)))
        for freq, _, model, _, mac, sd in stage.table
        if mac >= SAME
    ]
    worst = max(found, key=lambda row: row[2], default=None)
    return None if worst is None or worst[2] < OFF else worst


def places_left(setup: Setup, flow: Flow) -> str:
    """That a mass or spring was not tried at every node of the model, where one is named and it was not."""
    named = [(t, c) for t, _ in flow.named if t.physics in AT_NODES for c in (t.configurations or setup.configurations)]
    for term, configuration in named:
        own, tried, n = places_tried(setup, configuration, [pair.sensor for pair in setup.pairing])
        if len(tried) < n:
            return (
                f"{term.label or term.name}: it was tried at the {len(own)} nodes with sensors and at {len(tried)} of "
                f"{n} others, spread over the structure; it may be at a node between them"
            )
    return ""


@dataclass(frozen=True)
class _Errors:
    """Mean error of some recordings without and with what is named, and their names."""

    recordings: str
    before: float
    after: float

    @property
    def falls(self) -> bool:
        return self.after <= (1 - FALLS) * self.before

    @property
    def text(self) -> str:
        return (
            f"the error on {self.recordings} does not fall with it by {100 * FALLS:.0f} % ({plain(self.before, 3)} "
            f"without, {plain(self.after, 3)} with it)"
        )


def without_use(test: Test, predictions: Sequence[Prediction], final: Flow) -> str:
    """That what a flow names lowers the error of no recording in its configurations: then it only took up what was
    left. Nothing where it does, where nothing is named, and where identified modes decided, of which no error is told.
    """
    errors = _errors(test, predictions, final)
    if not errors or any(e.falls for e in errors.values()):
        return ""
    said = " and ".join(e.text for e in errors.values())
    return f"{_named(final)} would explain what is fitted better, but {said}, so that it is not named"


def not_held_out(test: Test, predictions: Sequence[Prediction], final: Flow) -> str:
    """That what a flow names lowers the error of fitted recordings alone, not that of those held out; nothing else."""
    errors = _errors(test, predictions, final)
    if "validate" not in errors or errors["validate"].falls:
        return ""
    return (
        f"{_named(final)}: {errors['validate'].text}, though that of fitted recordings does: check how these "
        "recordings began (at rest, or running) and whether the machine was the same"
    )


def _named(flow: Flow) -> str:
    named = [t.label or t.name for t, _ in flow.named]
    named += [f"forces that grow with the speed to the power {plain(r.data.power[0], 3)}" for r in _other_laws(flow)]
    return " and ".join(named)


def _errors(test: Test, predictions: Sequence[Prediction], final: Flow) -> dict[str, _Errors]:
    """By role (fit, validate) the errors of recordings in the configurations in which FRFs or runs named something;
    nothing where modes did, or nothing was named."""
    by_modes = [s for s in final.stages if s.name != "FRFs" and s.run is None]
    if any(d.taken is not None for s in by_modes for d in s.rounds):
        return {}
    where = {s.configuration for s in final.stages if any(d.taken for d in s.rounds) or (s.run and s.run.other_law)}
    of = {r.name: r.configuration for r in test}
    found = {}
    for role in ("fit", "validate"):
        own = [p for p in predictions if p.role == role and of[p.name] in where and p.recorded is not None]
        errors = [(p.error("parameters"), p.error("final")) for p in own]
        known = [(b, a) for b, a in errors if b is not None and a is not None and np.isfinite(b) and np.isfinite(a)]
        if known:
            before, after = (float(np.mean(v)) for v in zip(*known, strict=True))
            found[role] = _Errors(", ".join(p.name for p in own), before, after)
    return found


def _other_laws(flow: Flow) -> list[RunResult]:
    return [result for _, result in flow.runs if result.other_law]


def taken_back(final: Flow, plain: Flow, why: str) -> Flow:
    """The flow without terms, `plain`, with what was tried in `final` and `why` nothing of it is named."""
    tried = {(s.name, s.recordings): s.rounds for s in final.stages}
    stages = []
    for stage in plain.stages:
        rounds = tried.get((stage.name, stage.recordings), ())
        refused = tuple(replace(d, taken=None, refused=d.refused or d.taken is not None) for d in rounds)
        stages.append(replace(stage, rounds=refused))
    stages[-1] = replace(stages[-1], remarks=(*stages[-1].remarks, why))
    return replace(plain, stages=tuple(stages), beside=why)
