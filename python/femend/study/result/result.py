"""result.json: the diagnosis as the contract words it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.diagnose import Diagnosis
from femend.diagnose.deciding.by_priors import rests_on_priors
from femend.diagnose.deciding.deck_alone import deck_alone
from femend.diagnose.deciding.deck_with_law import deck_with_law, strain_of_modes
from femend.diagnose.deciding.power import untold
from femend.diagnose.fitting.candidates import standard_deviations
from femend.estimate import FitRecord, noise_floor
from femend.estimate.cross_axis import STILL
from femend.estimate.noise import noise_of
from femend.model import MeshError
from femend.model.places.place import AXES, Place
from femend.numerals import plain
from femend.report.headline import INTERRUPTED, tells_in_band
from femend.report.noise import BEYOND_NOISE, times_noise
from femend.study.result.findings import ALSO, findings, rounded
from femend.study.result.held_joint import held_joint
from femend.study.result.left_over import left_beside, left_beside_sine, left_over, shares_outside
from femend.study.result.predictions import STAGES, Prediction, motion_error
from femend.study.result.sensors_off import loud_sensors, sensors_off
from femend.study.result.turned_force import turned_force

__all__ = ["result_of"]

FloatArray = NDArray[np.float64]

FORMAT = "femend-diagnosis/1"
SIMULATED = (
    "the recordings follow the deck's own mesh, its errors included, to the noise and better than a refined one: no "
    "structure does, so they look simulated with this deck, which was taken as it is; for recordings of a structure "
    "linear shells and solids are refined first"
)
# error of a frequency by the deck's mesh, relative, from which it is told
MESH_OFF = 0.05
# times as much as a sensor records the model has to move there for it to be dead, loose or in another unit
DEAF = 10.0
# what estimates of the model's factors are off by beside what noise explains, relative; set as `OFF_LAW` of findings
OFF_MODEL = 0.015


def result_of(
    diagnosis: Diagnosis, predictions: list[Prediction], records: list[FitRecord], warnings: Sequence[str] = ()
) -> dict[str, Any]:
    """The content of result.json.

    To `warnings`, those of the recordings' channels, it adds where the force acts that nobody recorded, by how much it
    was recorded late, which lines the mesh cannot represent, how far the deck that is written is off by itself, which
    sensors were left out and what others may be off by, on what laws were chosen if there was but one recording, which
    predictions hang on little, which FRFs have no line that counts, what the recorder did not filter, and what the
    excitation cannot tell.
    """
    by_priors = rests_on_priors(diagnosis)
    warnings = [
        *warnings,
        *_drive(diagnosis),
        *_recorded_off(diagnosis),
        *_mesh(diagnosis),
        *_left_out(diagnosis),
        *loud_sensors(diagnosis),
        *filter(None, [by_priors]),
        *_deck_alone(diagnosis),
        *sensors_off(diagnosis, predictions),
        *filter(None, [diagnosis.split.told(diagnosis.sigma)]),
        *filter(None, [p.spread.text(p.name) for p in predictions if p.spread is not None]),
        *filter(None, [p.outside for p in predictions]),
        *diagnosis.problem.recorder.warnings,
    ]
    warnings += untold(records)
    # those of the fit know what their sensors may hold of the motion across them, and have those alone that count
    known = {r.name: r for r in diagnosis.problem.records if r.across is not None or r.crossed or r.loud}
    floors = [known.get(r.name, r) for r in records]
    fit = [_fit(p, floors, diagnosis.problem.band) for p in predictions if p.recorded is not None]
    if diagnosis.verdict in ("consistent", "parameters-only"):
        _note_outside(fit, predictions, diagnosis.problem.band)
    fit = _told_in_band(fit, predictions, diagnosis.problem.band)
    found, verdict = findings(diagnosis), diagnosis.verdict
    if by_priors:
        found = [{**one, "rests_on": "priors"} for one in found]
    turned = turned_force(diagnosis, records)
    if turned is not None:
        found = [*found, turned]
        verdict = "missing-physics" if verdict in ("consistent", "parameters-only") else verdict
    seen = predictions, diagnosis.problem.band, records, diagnosis.reduced.model.unresolved
    sines = "".join(left_beside_sine(one, fit, diagnosis.located, diagnosis.settings.consistent) for one in found)
    beside = sines if diagnosis.by_load else left_beside(diagnosis.verdict, fit, *seen)
    advice = diagnosis.advice or left_over(diagnosis.verdict, fit, *seen) or beside
    return {
        "format": FORMAT,
        "verdict": verdict,
        "findings": found,
        "parameters": _parameters(diagnosis),
        "fit": fit,
        "status": _status(diagnosis),
        "advice": "; ".join(filter(None, [held_joint(diagnosis), advice])),
        "warnings": list(warnings),
    }


def _deck_alone(diagnosis: Diagnosis) -> list[str]:
    """How far the updated deck, with what was found, is off without what modes and members have of their own."""
    alone, beside = deck_alone(diagnosis), deck_with_law(diagnosis)
    told = [alone.text] if alone is not None and alone.told else []
    return told if beside is None else [*told, beside.text]


def _recorded_off(diagnosis: Diagnosis) -> list[str]:
    """What all recordings are off by."""
    off, records = diagnosis.off, diagnosis.problem.records
    if off is None:
        return []
    return [off.text([r.name for r in records], diagnosis.reduced.model.node_ids.tolist(), records[0].dt)]


def _mesh(diagnosis: Diagnosis) -> list[str]:
    """What is said of the deck's mesh: how far it is off, lines whose waves it does not follow, and that recordings
    follow its errors."""
    model = diagnosis.reduced.model
    off = _mesh_off(model.mesh_error)
    missed = [] if model.unresolved is None else [model.unresolved.text]
    return [*off, *missed, SIMULATED] if model.simulated else [*off, *missed]


def _mesh_off(error: MeshError | None) -> list[str]:
    """That a mesh that stood aside for a refined one is off by more than a few per cent."""
    if error is None or not np.nanmax(np.abs(error.error)) > MESH_OFF:
        return []
    worst = error.worst
    size = f"{plain(100 * error.error[worst], 2, signed=True)} %"
    return [
        f"the deck's mesh puts frequencies up to {size} off (mode {worst + 1}: {plain(error.freq[worst])} Hz, "
        f"{plain(error.converged[worst])} Hz refined), which no parameter should make up for; a refined mesh was used "
        "for all but the errors as given: refine the deck before it is used elsewhere"
    ]


def _left_out(diagnosis: Diagnosis) -> list[str]:
    """Which sensors were left out: those that record next to nothing of what the model moves along them, that stand
    still, and that may have recorded what moves across them."""
    model, told = diagnosis.reduced.model, []
    found = {row: (ratio, little) for r in diagnosis.problem.records for row, ratio, little in r.crossed}

    def named(rows: Sequence[int]) -> str:
        return ", ".join(f"node {int(model.node_ids[row // 6])} {AXES[row % 6]}" for row in sorted(rows))

    deaf = {row: little for row, (_, little) in found.items() if little > DEAF}
    if deaf:
        told.append(
            f"the sensors at {named(list(deaf))} record hardly anything of what the model moves there "
            f"({plain(max(deaf.values()), 2)} times as much, at the most): they were left out of the fit and of its "
            "errors. See whether they are connected, fixed and switched on, and their units and directions"
        )
    still = [row for row, (ratio, _) in found.items() if np.isinf(ratio) and row not in deaf]
    if still:
        told.append(
            f"the sensors at {named(still)} stand still, dead or in a plane that nothing drives: they were left out of "
            f"the fit and of its errors, since they show less than {plain(STILL)} of what the liveliest one does. If "
            "they should move, see whether they are connected, and switched on"
        )
    crossed_alone = {row: ratio for row, (ratio, _) in found.items() if row not in deaf and row not in still}
    if crossed_alone:
        told.append(
            f"the structure moves up to {plain(max(crossed_alone.values()), 2)} times as much across the sensors at "
            f"{named(list(crossed_alone))} as along them, so that one that is mounted a degree off, or picks up 1 % of "
            "what moves across it, records that: they were left out of the fit and of its errors"
        )
    return told


def _drive(diagnosis: Diagnosis) -> list[str]:
    """Where the force acts that nobody recorded, and what the errors are of."""
    driven = diagnosis.driven
    if driven is None:
        return []
    base, where = driven.place.kind == "base", _acting(driven.place)
    others = ", ".join(p.text.replace(" to ground", "") for p in driven.alike[:ALSO])
    told = f" (or {others}, as far as the responses tell)" if others else ""
    hidden = (
        "what drives all supports alike counts as part of it, and no law is tried that has to be simulated, unless the "
        "base's acceleration is recorded"
        if base
        else "whatever is missing at that place itself counts as part of it and does not show, unless the force is "
        "recorded"
    )
    return [
        f"no force was recorded: {where}{told} explains the responses best; {hidden}; errors on the fitted recordings "
        "are those of every sensor predicted from the others"
    ]


def _acting(place: Place) -> str:
    """A place where a force may act that nobody recorded, in words."""
    if place.kind == "base":
        return f"a motion of the base along {place.direction}"
    return f"one that acts at {place.text.replace(' to ground', '')}"


def _status(diagnosis: Diagnosis) -> str:
    """How the run ended."""
    if diagnosis.interrupted:
        return INTERRUPTED
    return "converged" if _converged(diagnosis) else "stalled"


def _converged(diagnosis: Diagnosis) -> bool:
    """Whether the fit of the final model came to its minimum."""
    if diagnosis.best is not None:
        return diagnosis.best.converged
    if diagnosis.load is not None and diagnosis.by_load:
        return diagnosis.load.fit.converged
    return diagnosis.null.converged


def _fit(prediction: Prediction, records: list[FitRecord], band: tuple[float, float]) -> dict[str, Any]:
    own = [r for r in records if r.source == prediction.name]
    floors = [noise_floor(r, band) for r in own]
    if len(own) == 1 and prediction.frf is None and any(c.quantity != "acceleration" for c in prediction.channels):
        floors = [_floor_as_recorded(prediction, own[0], floors[0])]
    noise = float(np.sqrt(np.mean(np.square(floors)))) if floors else None
    row: dict[str, Any] = {"recording": prediction.name, "role": prediction.role, "noise_floor": rounded(noise)}
    row.update({stage: rounded(prediction.error(stage)) for stage in STAGES})
    return row


def _told_in_band(
    fit: Sequence[dict[str, Any]], predictions: Sequence[Prediction], band: tuple[float, float]
) -> list[dict[str, Any]]:
    """The rows `fit`, with the errors in the band (Hz) beside where they say something else than those over all
    frequencies. Those of FRFs are errors in the band."""
    own = {p.name: p for p in predictions if p.frf is None}
    ends = [rounded(f) for f in band]
    rows = []
    for row in fit:
        prediction = own.get(row["recording"])
        inside = {} if prediction is None else {s: rounded(prediction.error_within(s, band)) for s in STAGES}
        rows.append({**row, "in_band": {"band": ends, **inside}} if inside else row)
    return rows if tells_in_band({"fit": rows}) else list(fit)


def _note_outside(fit: Sequence[dict[str, Any]], predictions: Sequence[Prediction], band: tuple[float, float]) -> None:
    """Adds to rows that the updated model leaves beyond noise how much of that lies outside the band (Hz)."""
    own = {p.name: p for p in predictions}
    for row in fit:
        if (times_noise(row, "parameters") or 0.0) >= BEYOND_NOISE:
            row["outside_band"] = rounded(sum(shares_outside(own[row["recording"]], band)))


def _floor_as_recorded(prediction: Prediction, record: FitRecord, floor: float) -> float:
    """NRMSE that noise leaves of what was recorded, for sensors that measure no acceleration; what sensors may be off
    by is added as in the `floor` of the accelerations that follow."""
    recorded = prediction.recorded
    assert recorded is not None
    recorded, channels = recorded[prediction.counted], [prediction.channels[i] for i in prediction.counted]
    noise = noise_of(record.u, recorded, record.period)
    apart = np.sqrt(max(floor**2 - noise_floor(replace(record, across=None), (0.0, np.inf)) ** 2, 0.0))
    # as an error of what was recorded: that of a prediction which is off by the noise in every sample
    return float(np.hypot(motion_error(channels, recorded + _swing(noise, recorded), recorded), apart))


def _swing(size: FloatArray, like: FloatArray) -> FloatArray:
    """Records (n_out, n) as `like` whose standard deviations are `size` (n_out,)."""
    signs = np.where(np.arange(like.shape[1]) % 2, -1.0, 1.0)
    return np.asarray(size[:, None] * signs)


def _parameters(diagnosis: Diagnosis) -> dict[str, Any]:
    names = [p.name for p in diagnosis.reduced.model.parameters]
    p = diagnosis.null.p if diagnosis.best is None else diagnosis.best.p
    if diagnosis.read is not None:
        p = diagnosis.read.p
    if diagnosis.load is not None and diagnosis.by_load:
        p = diagnosis.load.fit.p
    sd = _model_sd(diagnosis)
    return {
        name: {"factor": rounded(float(np.exp(p[i]))), "sd": rounded(float(np.exp(p[i]) * sd[i]))}
        for i, name in enumerate(names)
    }


def _model_sd(diagnosis: Diagnosis) -> np.ndarray:
    """Standard deviations of the model's unknowns beside what was added, inflated by what is left above the noise, and
    of its parameters (n,) by what its modes were strained by, up to their priors; those of the updated model where
    nothing was added."""
    best, null = diagnosis.best, diagnosis.null if diagnosis.read is None else diagnosis.read.fit
    if diagnosis.read is not None and diagnosis.read.held is not None:
        best = diagnosis.read.held
    if best is not None and best.p_sd is not None:
        own = best.p_sd * np.sqrt(max(1.0, best.fitted))
    else:
        own = standard_deviations(np.linalg.pinv(null.hessian), left=null.score)
    parameters = diagnosis.reduced.model.parameters
    sd = np.hypot(own, OFF_MODEL)[: len(parameters)]
    prior = np.array([p.prior_sd for p in parameters])
    return np.asarray(np.maximum(sd, np.minimum(sd * strain_of_modes(diagnosis), prior)))
