"""What is said of sensors that were not believed as they are: they may be off themselves, one of them may be scaled
wrongly, or it is the model that is off where they are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from femend.data.bands import within_band
from femend.diagnose import Diagnosis
from femend.diagnose.settings import AT_NOISE
from femend.estimate import crossed
from femend.estimate.picked_up import ACROSS_SD, GAIN_SD
from femend.model.places.place import AXES
from femend.numerals import listed, plain
from femend.study.result.predictions import STAGES, Prediction, Values

__all__ = ["loud_sensors", "readings", "sensors_off"]

FloatArray = NDArray[np.float64]

# sensors told of that move across most, or are farthest off
MOST = 3
# a sensor that reads this many of its standard deviations too much or too little is not off by itself, but for one
# alone, the others of which stay within the second number
FAR, FINE = 4.0, 2.0
# sensors that are compared at least for one to be said to stand alone
FEWEST = 3
CALIBRATION, MOUNT = "calibration, of the force too", "transverse sensitivity, a mount a degree off"
# what sensors may be off by
MAY_BE = (
    f"sensors may be off by some {plain(100 * GAIN_SD)} % ({CALIBRATION}) and hold some {plain(100 * ACROSS_SD)} % of "
    f"the motion across them ({MOUNT})"
)
WHY_IT_STAYS = (
    ": what stays is no matter of sensors, but of the model, or of something missing that was not found. Check how "
    "parts are idealised and connected, and the mesh"
)


def sensors_off(diagnosis: Diagnosis, predictions: Sequence[Prediction] = ()) -> list[str]:
    """What is told of sensors whose calibration and share of the motion across them was left free: which of them move
    across most, and which read too much or too little against the final model; that it is the model which is off where
    several do by more than sensors can be, and what stays where the recordings are not explained so. Nothing where they
    are believed."""
    model, problem = diagnosis.reduced.model, diagnosis.problem
    if not any(r.across is not None for r in problem.records):
        return []
    found = crossed(problem.records, problem.band)
    across = {f"node {int(model.node_ids[row // 6])} {AXES[row % 6]}": ratio for row, ratio in found.items()}
    shares = readings(predictions)
    far = {name: share for name, share in shares.items() if abs(share) > FAR * _deviation(name, across)}
    alone = _alone(shares, far, across)
    explained = diagnosis.misfit <= AT_NOISE
    if explained and far and alone is None:
        return [_of_the_model(far)]
    most = sorted(across, key=lambda name: -across[name])[:MOST]
    named = ", ".join(f"{name} ({plain(across[name], 2)} times what goes along it)" for name in most)
    most_across = f". Motion across is largest at {named}" if named else ""
    told = (
        f"the recordings are explained where {MAY_BE}, and not where each is believed as it is: such shares were left "
        "free, and noise floors hold as much"
        if explained
        else f"that {MAY_BE} was allowed for, and noise floors hold as much, but {_stays(diagnosis, predictions)}"
        f"{'' if alone else WHY_IT_STAYS}"
    )
    return [f"{told}{most_across}{_reads(shares, alone)}"]


def _stays(diagnosis: Diagnosis, predictions: Sequence[Prediction]) -> str:
    """What the final model leaves with such shares."""
    times = f"{plain(diagnosis.misfit, 3)} times what noise explains"
    fit = [p for p in predictions if p.role == "fit" and p.recorded is not None]
    if not fit:
        return f"{times} stays all the same"
    left = {p.name: p.error_within(STAGES[-1], diagnosis.problem.band) for p in fit}
    worst = max(left, key=lambda name: left[name])
    return f"{plain(100 * left[worst], 2)} % of {worst} stays all the same, a misfit of {times}"


def loud_sensors(diagnosis: Diagnosis) -> list[str]:
    """What is told of sensors that show what no model and no force explains, while all others are explained."""
    model, told = diagnosis.reduced.model, []
    records = diagnosis.problem.records
    for row in sorted({row for r in records for row, _, _ in r.loud}):
        factor, hum = max((factor, hum) for r in records for loud, factor, hum in r.loud if loud == row)
        how = f", most of it at {plain(hum)} Hz" if np.isfinite(hum) else ""
        told.append(
            f"the sensor at node {int(model.node_ids[row // 6])} {AXES[row % 6]} shows {plain(factor, 2)} times its "
            f"noise beside what the model moves there{how}, which no force at one place explains, while the model "
            "explains all other sensors to their noise: it counted as noise of this one. See whether it is fixed, its "
            "cable and connector, and whether it picks up hum or drifts, or exchange it for another sensor"
        )
    return told


def readings(predictions: Sequence[Prediction]) -> dict[str, float]:
    """By what share sensors, by name ("node 5 -Y"), read more or less than the final model: least squares over all
    samples of the fit recordings in time, and over the lines in the band of FRFs. Those that were left out do not
    count."""
    squares: dict[str, FloatArray] = {}
    for p in predictions:
        if p.role != "fit" or p.recorded is None:
            continue
        for i in p.counted:
            dof = p.channels[i].dof
            if dof is None:
                continue
            model, recorded = (_values(p, y, i) for y in (p.stages[STAGES[-1]], p.recorded))
            sums = np.array([np.vdot(model, recorded).real, np.vdot(model, model).real])
            name = f"node {dof.node} {dof.direction}"
            squares[name] = squares.get(name, np.zeros(2)) + sums
    return {name: float(along / size) - 1.0 for name, (along, size) in squares.items() if size > 0}


def _values(prediction: Prediction, y: Values, i: int) -> Values:
    """What counts of sensor `i`: its samples, or values at the lines in the band for all forces."""
    if prediction.frf is None:
        return np.asarray(y[i])
    return np.asarray(y[within_band(prediction.frf.freq, prediction.band), i])


def _deviation(name: str, across: Mapping[str, float]) -> float:
    """Standard deviation of what a sensor, by name, reads, as a share: of its calibration, and of what it picks up
    `across` it, by name without a sign."""
    node, _, direction = name.rpartition(" ")
    return float(np.hypot(GAIN_SD, ACROSS_SD * across.get(f"{node} {direction.lstrip('+-')}", 0.0)))


def _alone(shares: Mapping[str, float], far: Mapping[str, float], across: Mapping[str, float]) -> str | None:
    """The one sensor that is `far` off while all others read what the model says; None where there is none."""
    if len(far) != 1 or len(shares) < FEWEST:
        return None
    (name,) = far
    fine = all(abs(share) <= FINE * _deviation(other, across) for other, share in shares.items() if other != name)
    return name if fine else None


def _of_the_model(far: Mapping[str, float]) -> str:
    """What is said where sensors read too much or too little by more than they can be off themselves."""
    most = sorted(far, key=lambda name: -abs(far[name]))
    named = listed((f"{name} {_per_cent(far[name])}" for name in most), MOST)
    return (
        f"against the final model {named} are read, which is more than sensors are off by: some "
        f"{plain(100 * GAIN_SD)} % ({CALIBRATION}) and {plain(100 * ACROSS_SD)} % of the motion across them ({MOUNT}) "
        "were left free, and noise floors hold as much. It is rather the model that is off near these nodes: check how "
        "parts are idealised and connected there, and the mesh. Whether a sensor is right shows when it is exchanged "
        "for another one, or calibrated again"
    )


def _reads(shares: Mapping[str, float], alone: str | None) -> str:
    """Which sensors read more or less than the final model by more than calibration is in doubt, the farthest first; of
    one that stands `alone` that its gain may be wrong."""
    off = sorted((name for name in shares if abs(shares[name]) > GAIN_SD), key=lambda name: -abs(shares[name]))
    if alone is None:
        named = ", ".join(f"{name} {_per_cent(shares[name])}" for name in off[:MOST])
        return f". Against the final model they read: {named}" if named else ""
    return (
        f". Against the final model {alone} alone reads {_per_cent(shares[alone])}, more than a calibration is in "
        "doubt by: its gain may be wrong; check the scale of its channel, or exchange it for another sensor"
    )


def _per_cent(share: float) -> str:
    return f"{plain(100 * share, 2, signed=True)} %"
