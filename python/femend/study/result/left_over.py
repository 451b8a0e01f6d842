"""What has to be said where a fitted recording is left far from its noise, with nothing told and beside laws."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.locating.locate import Located
from femend.estimate import FitRecord
from femend.estimate.power import PASSED
from femend.estimate.stretches import following
from femend.model.known_mesh import Unresolved
from femend.numerals import plain
from femend.report.noise import BEYOND_NOISE, farthest_from_noise, noise_without
from femend.study.result.predictions import Prediction

__all__ = ["left_beside", "left_beside_sine", "left_over", "shares_outside"]

FloatArray = NDArray[np.float64]

# share of the motion above the band that follows the force from which the force is not what lacks there
FOLLOWS = 0.5
TOO_FEW = "there are too few samples to a cycle"
TOO_COARSE = "the deck's mesh is too coarse"
# error beside laws, in units of the noise, from which it is told
BESIDE_LAWS = 3.0


def shares_outside(
    prediction: Prediction | None, band: tuple[float, float], stage: str = "parameters"
) -> tuple[float, float]:
    """Shares (0 to 1) of what a `stage` of the model leaves of a recording's samples that lie below and above a `band`
    (Hz); 0 of FRFs, whose errors count in the band alone, of what holds no responses, and of nothing."""
    if prediction is None or prediction.recorded is None or prediction.frf is not None:
        return 0.0, 0.0
    freq, power = _left_power(prediction, stage)
    below, above = (float(power[:, outside].sum()) for outside in (freq < band[0], freq > band[1]))
    return (below / power.sum(), above / power.sum()) if power.sum() > 0 else (0.0, 0.0)


def _left_power(prediction: Prediction, stage: str = "parameters") -> tuple[FloatArray, FloatArray]:
    """Frequencies (K,) in Hz, and the power (n, K) that a `stage` of the model leaves of the n sensors that count."""
    assert prediction.recorded is not None
    left = prediction.stages[stage][prediction.counted] - prediction.recorded[prediction.counted]
    power = np.abs(np.fft.rfft(left - left.mean(axis=1, keepdims=True), axis=1)) ** 2
    return np.asarray(np.fft.rfftfreq(left.shape[1], prediction.dt), dtype=np.float64), np.asarray(power)


def _mostly(prediction: Prediction, f_low: float) -> str:
    """The sensor that shows most of what is left below a frequency (Hz); nothing where none does."""
    freq, power = _left_power(prediction)
    own = power[:, freq < f_low].sum(axis=1)
    dof = prediction.channels[prediction.counted[int(np.argmax(own))]].dof
    return "" if dof is None or own.max() < 0.5 * own.sum() else f", most of it at node {dof.node} {dof.direction}"


def left_over(
    verdict: str,
    fit: Sequence[Mapping[str, Any]],
    predictions: Sequence[Prediction] = (),
    band: tuple[float, float] = (0.0, np.inf),
    records: Sequence[FitRecord] = (),
    missed: Unresolved | None = None,
) -> str:
    """What has to be said beside silence where the updated model leaves clearly more than noise. Outside the fitted
    `band` (Hz) models are not compared: what is left there of the `predictions` is told as such, and whether what the
    mesh `missed`, the force or the sampling is the reason, as the `records` show it."""
    if verdict not in ("consistent", "parameters-only"):
        return ""
    times, worst = farthest_from_noise(fit, "parameters")
    if worst is None or times < BEYOND_NOISE:
        return ""
    name = worst["recording"]
    own = _named(name, predictions)
    below, above = shares_outside(own, band)
    left = f"the updated model leaves {plain(times, 2)} times the noise of {name}"
    if not noise_without(times, below + above):
        return (
            f"{left}, which no law at one place explains clearly enough to be told; the mesh or the idealisation may "
            "leave that much: refine the mesh and see whether it shrinks, or record more sensors"
        )
    if own is not None and below > above:
        return (
            f"{left}; {plain(100 * below, 3)} % of its square lies below {plain(band[0], 3)} Hz, where the force "
            f"excites too little for models to be compared{_mostly(own, band[0])}: above that it is noise. Sensors "
            "that drift or show a trend leave such; see to their zero, or record with a high-pass filter"
        )
    if _ends_band(missed, band):
        return (
            f"{left}; {plain(100 * above, 3)} % of its square lies above {plain(band[1], 3)} Hz, where {TOO_COARSE} "
            f"for models to be compared: below that it is noise. If those frequencies matter, {missed.what_to_do}"
        )
    if own is not None and _sampled_too_slowly(own, band[1], records):
        return (
            f"{left}; {plain(100 * above, 3)} % of its square lies above {plain(band[1], 3)} Hz, near half the "
            f"sampling rate of {plain(1 / own.dt, 4)} Hz, where the recorder's anti-alias filter acts and {TOO_FEW} "
            f"for models to be compared: below that it is noise. If those frequencies matter, {_faster(own)}"
        )
    return (
        f"{left}; {plain(100 * above, 3)} % of its square lies above {plain(band[1], 3)} Hz, where the force excites "
        "too little for models to be compared: below that it is noise. If those frequencies matter, record with a "
        "force that reaches them"
    )


def left_beside(
    verdict: str,
    fit: Sequence[Mapping[str, Any]],
    predictions: Sequence[Prediction] = (),
    band: tuple[float, float] = (0.0, np.inf),
    records: Sequence[FitRecord] = (),
    missed: Unresolved | None = None,
) -> str:
    """What has to be said beside laws that leave much of a recording: what chose them may not show all that is
    there. What is left of the `predictions` outside the fitted `band` (Hz), where nothing is compared, is told as
    such, and whether what the mesh `missed`, the force or the sampling is the reason, as the `records` show it."""
    times, worst = farthest_from_noise(fit, "final")
    if verdict != "missing-physics" or worst is None or times < BESIDE_LAWS:
        return ""
    left = (
        f"with what is told the model still leaves {plain(100 * worst['final'], 2)} % of {worst['recording']}, "
        f"{plain(times, 2)} times its noise"
    )
    own = _named(worst["recording"], predictions)
    below, above = shares_outside(own, band, "final")
    if noise_without(times, below + above):
        why, what = "the force excites too little", "record with a force that reaches further"
        if above > below and _ends_band(missed, band):
            why, what = TOO_COARSE, missed.what_to_do
        elif own is not None and above > below and _sampled_too_slowly(own, band[1], records):
            why, what = TOO_FEW, _faster(own)
        return (
            f"{left}; {plain(100 * (below + above), 3)} % of its square lies outside {plain(band[0], 3)} to "
            f"{plain(band[1], 3)} Hz, where {why} for models to be compared: inside it is noise. Predictions are that "
            f"far off outside; if it matters, {what}"
        )
    if own is not None and own.frf is not None:
        return (
            f"{left}: something else that was not found shows there, or what the mesh and the idealisation leave, "
            "which shows above noise as small as that: refine the mesh and see whether it shrinks. Predictions of such "
            "recordings are that far off"
        )
    return (
        f"{left}: something else that was not found shows there, or motion that depends on its past too much to be "
        "followed; predictions of such recordings are that far off"
    )


def _ends_band(missed: Unresolved | None, band: tuple[float, float]) -> TypeGuard[Unresolved]:
    """Whether a band (Hz) ends where the mesh follows no longer."""
    return missed is not None and missed.limit > 0 and bool(np.isclose(missed.limit, band[1]))


def _sampled_too_slowly(prediction: Prediction, end: float, records: Sequence[FitRecord]) -> bool:
    """Whether it is the sampling that keeps models from being compared above a band's `end` (Hz): near half the rate
    recorders filter, and what is recorded there follows the force, as far as the `records` hold it."""
    if end * prediction.dt <= PASSED:
        return False
    record = next((r for r in records if r.name == prediction.name and r.frf is None and r.driven), None)
    if record is None:
        return True
    above = np.fft.rfftfreq(record.n, record.dt) > end
    share = following(*(np.fft.rfft(x, axis=1)[:, above] for x in (record.u, record.y)))
    return not share < FOLLOWS


def _faster(prediction: Prediction) -> str:
    """What to do about too slow a sampling."""
    return f"sample at more than {plain(1 / prediction.dt, 4)} Hz"


def _named(recording: str, predictions: Sequence[Prediction]) -> Prediction | None:
    """The prediction of a recording; None where there is none."""
    return next((p for p in predictions if p.name == recording), None)


def left_beside_sine(
    finding: Mapping[str, Any], fit: Sequence[Mapping[str, Any]], located: Sequence[Located] = (), noise: float = 0.0
) -> str:
    """What has to be said beside a harmonic force that nobody recorded, an entry of findings, where it leaves much of a
    recording: one force along one axis of a node comes near others that it is not, and has another place and size;
    unless a force of any course there, of the places `located`, explains the recordings to a score of `noise`."""
    frequency = finding["parameters"].get("frequency", {}).get("value")
    times, worst = farthest_from_noise(fit, "final")
    if finding["physics"] != "unmeasured_force" or frequency is None or worst is None or times < BESIDE_LAWS:
        return ""
    where = finding["location"]
    leaves = f"leaves {plain(100 * worst['final'], 2)} % of {worst['recording']}, {plain(times, 2)} times its noise"
    at = f"at node {where['nodes'][0]} along {where['direction']}"
    there = [f for f in located if (list(f.place.nodes), f.place.direction) == (where["nodes"], where["direction"])]
    if any(one.fit.score <= noise for one in there):
        return (
            f"something acts at {plain(frequency, 3)} Hz {at}, where a force of any course explains the recordings to "
            f"the noise; one of the same amplitude from their beginning on {leaves}: its amplitude or frequency "
            "changes, or it began at another time. Stop what runs at that frequency and record again, or record its "
            "force"
        )
    return (
        f"something acts at {plain(frequency, 3)} Hz, but a single force {at} {leaves}: it acts along two axes at "
        "once, as an unbalance does that turns, at several nodes, or its amplitude changes. Node and amplitude are "
        "those of the one force that comes nearest, not where to look: look for what runs at that frequency, stop it "
        "and record again, or record its force"
    )
