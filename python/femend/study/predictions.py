"""Predicted responses of every recording at the three stages."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femend.data import Channel, Recording, Test, TimeData
from femend.diagnose import Diagnosis
from femend.diagnose.loads import moved_record
from femend.diagnose.predict import predict_candidate, predict_model
from femend.estimate import FitRecord
from femend.model import Model, Pairing

__all__ = ["STAGES", "Prediction", "nrmse", "predict_all"]

FloatArray = NDArray[np.float64]
STAGES = ("nominal", "parameters", "final")


@dataclass(frozen=True, eq=False)
class Prediction:
    """One recording's responses (n_out, n) at each stage; `recorded` where they were recorded."""

    name: str
    role: str
    dt: float
    channels: tuple[Channel, ...]
    stages: dict[str, FloatArray]
    recorded: FloatArray | None

    def as_data(self, stage: str) -> TimeData:
        """The responses of a stage as time data."""
        return TimeData(self.name, self.dt, self.stages[stage], self.channels)


def nrmse(predicted: FloatArray, recorded: FloatArray) -> float:
    """Root of the summed squared error of `predicted` over that of the summed squares of `recorded`, both (n_out, n).

    >>> nrmse(np.zeros((1, 4)), np.ones((1, 4)))
    1.0
    """
    return float(np.sqrt(((predicted - recorded) ** 2).sum() / (recorded**2).sum()))


def predict_all(
    diagnosis: Diagnosis, test: Test, model: Model, pairing: Pairing, records: list[FitRecord]
) -> list[Prediction]:
    """Responses of every sensor of the fit recordings to the forces of every recording with measured force."""
    fit = [r for r in test if r.role == "fit" and r.is_time and r.response is not None]
    sensors = fit[0].response
    assert sensors is not None
    channels = tuple(Channel(c.dof, "acceleration", "m/s^2", c.name, c.label) for c in sensors.channels)
    done = []
    for recording in test:
        if not recording.is_time or recording.force is None or recording.excitation != "measured":
            continue
        own = next((r for r in records if r.name == recording.name), None)
        if own is None:
            own = _inputs_only(recording, model, pairing, records[0])
        recorded = own.y if recording.role == "fit" else _recorded(recording, channels)
        done.append(Prediction(recording.name, recording.role, own.dt, channels, _stages(diagnosis, own), recorded))
    return done


def _inputs_only(recording: Recording, model: Model, pairing: Pairing, first: FitRecord) -> FitRecord:
    """A record with its forces alone: the responses of a held-out recording are never handed to the diagnosis."""
    force = recording.force
    assert force is not None
    dofs = [pairing[c.dof].dof for c in force.channels if c.dof is not None]
    return replace(
        first,
        name=recording.name,
        u=force.values.copy(),
        y=np.zeros((len(first.out_rows), force.n_samples)),
        dt=force.dt,
        in_rows=np.array([model.row(d) for d in dofs]),
        in_signs=np.array([float(d.sign) for d in dofs]),
        period=0,
    )


def _recorded(recording: Recording, channels: tuple[Channel, ...]) -> FloatArray | None:
    response = recording.response
    if response is None:
        return None
    rows = {(c.dof, c.quantity): i for i, c in enumerate(response.channels)}
    wanted = [rows.get((c.dof, "acceleration")) for c in channels]
    if any(w is None for w in wanted):
        return None
    return np.asarray(response.values[[w for w in wanted if w is not None]])


def _stages(diagnosis: Diagnosis, record: FitRecord) -> dict[str, FloatArray]:
    problem, null = diagnosis.problem, diagnosis.null
    nothing = np.zeros(0)
    nominal = predict_model(problem, null.hypothesis, diagnosis.nominal, nothing, record)
    updated = predict_model(problem, null.hypothesis, null.p, nothing, record)
    final = updated
    if diagnosis.best is not None:
        fallback = diagnosis.place.fit.hypothesis if diagnosis.place is not None else null.hypothesis
        final = predict_candidate(problem, diagnosis.best, fallback, record)
        if not np.isfinite(final).all():
            final = updated
    elif diagnosis.load is not None and diagnosis.verdict == "missing-physics":
        load = diagnosis.load
        final = predict_model(load.problem, load.fit.hypothesis, load.fit.p, nothing, moved_record(record, load))
    return {"nominal": nominal, "parameters": updated, "final": final}
