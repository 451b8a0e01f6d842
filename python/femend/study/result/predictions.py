"""Predicted responses of every recording at the three stages."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.data import FRF, Channel, Recording, Test, TimeData
from femend.data.bands import within_band
from femend.diagnose import Diagnosis
from femend.diagnose.deciding.spread import Spread, as_good, spread
from femend.diagnose.deciding.stages import STAGES, stages
from femend.estimate import FitRecord
from femend.estimate.frf import ORDER
from femend.estimate.prepare import frf_records
from femend.io import functions_of, write_uff
from femend.model import Model, Pairing
from femend.numerals import plain
from femend.signal.calculus import DERIVATIVES
from femend.signal.hammer import blow_force
from femend.study.result.left_out import in_band, predicted_by_others
from femend.units import unit_system

__all__ = ["STAGES", "Prediction", "motion_error", "nrmse", "predict_all", "rows_of", "write_predictions"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
# samples of a response, or the values of an FRF
Values = NDArray[Any]


@dataclass(frozen=True, eq=False)
class Prediction:
    """One recording's responses at each stage; `recorded` where they were recorded.

    Time records: (n_out, n) at step `dt`, each row in the quantity and unit of its channel. FRFs: (n_freq, n_out, n_in)
    of the recording's own kind at the recording's lines above 0 Hz, which `frf` holds, and `dt` 0; their errors count
    in the `band` (Hz) of the diagnosis. Sensors at positions `left_out` were left out of the fit, and do not count in
    errors. `spread` is how far the final one is told, of recordings that were not fitted to laws that are nonlinear.
    """

    name: str
    role: str
    dt: float
    channels: tuple[Channel, ...]
    stages: dict[str, Values]
    recorded: Values | None
    frf: FRF | None = None
    band: tuple[float, float] = (0.0, np.inf)
    left_out: frozenset[int] = frozenset()
    spread: Spread | None = None

    def as_data(self, stage: str) -> TimeData | FRF:
        """The responses of a stage as time data, or as FRFs."""
        if self.frf is not None:
            return replace(self.frf, H=self.stages[stage], coherence=None)
        return TimeData(self.name, self.dt, self.stages[stage], self.channels)

    @property
    def outside(self) -> str:
        """What is said of FRFs that have no line in the band, so that they have no errors; "" elsewhere."""
        if self.frf is None or within_band(self.frf.freq, self.band).any():
            return ""
        first, last, low, high = (plain(f, 3) for f in (self.frf.freq[0], self.frf.freq[-1], *self.band))
        return (
            f"no errors are told of recording {self.name!r}: its FRFs ({first} to {last} Hz) have no line in the band "
            f"that was compared ({low} to {high} Hz), in which alone errors of FRFs count; fit recordings that reach "
            "it, or leave it out"
        )

    @property
    def counted(self) -> list[int]:
        """Positions of the sensors that count in errors."""
        return [i for i in range(len(self.channels)) if i not in self.left_out]

    def error(self, stage: str) -> float:
        """NRMSE of a stage; nan where what counts was still, or lies outside the band. Raises ValueError where nothing
        was recorded."""
        if self.recorded is None:
            raise ValueError(f"recording {self.name!r} holds no responses to compare with")
        counted = self.counted
        if self.frf is None:
            channels = [self.channels[i] for i in counted]
            return motion_error(channels, self.stages[stage][counted], self.recorded[counted])
        inside = within_band(self.frf.freq, self.band)
        return nrmse(self.stages[stage][inside][:, counted], self.recorded[inside][:, counted])

    def error_within(self, stage: str, band: tuple[float, float]) -> float:
        """NRMSE of a stage of what lies in a `band` (Hz); that of `error` for FRFs, whose errors count in the band of
        the diagnosis alone, and nan where nothing was recorded in it. Raises ValueError like `error`."""
        if self.frf is not None or self.recorded is None:
            return self.error(stage)
        counted = self.counted
        channels, n = [self.channels[i] for i in counted], self.recorded.shape[1]
        outside = ~within_band(np.fft.rfftfreq(n, self.dt), band)
        inside = []
        for values in (self.stages[stage][counted], self.recorded[counted]):
            lines = np.fft.rfft(values, axis=1)
            lines[:, outside] = 0.0
            inside.append(np.fft.irfft(lines, n, axis=1))
        return motion_error(channels, *inside) if np.any(inside[1]) else float("nan")


def nrmse(predicted: Values, recorded: Values) -> float:
    """Root of the summed squared error of `predicted` over that of the summed squares of `recorded`, of one shape; nan
    where nothing was recorded.

    >>> nrmse(np.zeros((1, 4)), np.ones((1, 4))), nrmse(np.ones((1, 4)), np.zeros((1, 4)))
    (1.0, nan)
    """
    size = float((np.abs(recorded) ** 2).sum())
    return float(np.sqrt((np.abs(predicted - recorded) ** 2).sum() / size)) if size > 0 else float("nan")


def motion_error(channels: Sequence[Channel], predicted: FloatArray, recorded: FloatArray) -> float:
    """NRMSE of `predicted` (n_out, n) over what `channels` `recorded`.

    Sensors of several quantities count by their number, each quantity with an NRMSE of its own: squares of metres and
    of metres per second have no sum. Displacements are compared without their means, since the zero of such a sensor is
    its own.
    """
    squares = 0.0
    for quantity in dict.fromkeys(c.quantity for c in channels):
        rows = [i for i, c in enumerate(channels) if c.quantity == quantity]
        left, whole = predicted[rows] - recorded[rows], recorded[rows]
        if DERIVATIVES.get(quantity) == 0:
            left, whole = (x - x.mean(axis=1, keepdims=True) for x in (left, whole))
        squares += len(rows) * nrmse(left + whole, whole) ** 2
    return float(np.sqrt(squares / len(channels)))


def predict_all(
    diagnosis: Diagnosis,
    test: Test,
    model: Model,
    pairing: Pairing,
    records: list[FitRecord],
    whole: Recording | None = None,
) -> list[Prediction]:
    """Responses of every sensor of the fit recordings to the forces of every recording with measured force, in the
    quantity that the recording's own sensors measure, else in that of the fit; of fit recordings of a force nobody
    recorded accelerations of every sensor from the others, in the band. `whole` is the first fit recording
    with the sensors that were left out, where there are some: what holds inputs only is predicted at these as well."""
    first = next(r for r in test if r.role == "fit")
    channels, every = (tuple(c for c in r.sensors if c.quantity in DERIVATIVES) for r in (first, whole or first))
    models = as_good(diagnosis) if any(recording.role != "fit" for recording in test) else None
    done = []
    for recording in test:
        if isinstance(recording.data, FRF):
            done.append(_predict_frf(diagnosis, recording, model, pairing, records))
            continue
        own = next((r for r in records if r.name == recording.name), None)
        if own is not None and not own.driven:
            others, recorded = predicted_by_others(diagnosis, own), in_band(diagnosis, own)
            # of sensors that were left out nothing is left here
            rows, kept = _outputs(channels, model, pairing)["out_rows"].tolist(), set(own.out_rows.tolist())
            shown = _as_accelerations([c for c, row in zip(channels, rows, strict=True) if row in kept], model.units)
            done.append(Prediction(recording.name, recording.role, own.dt, shown, others, recorded))
            continue
        if not recording.is_time or recording.force is None or recording.excitation != "measured":
            continue
        rows = rows_of(recording, channels) if own is None else list(range(len(recording.sensors)))
        sensors, measured = every, None
        if rows is not None and recording.response is not None:
            sensors, measured = tuple(recording.sensors[i] for i in rows), recording.response.values[rows]
        if own is None:
            own = _inputs_only(recording, model, pairing, replace(records[0], **_outputs(sensors, model, pairing)))
        moved, left_out = _moved(diagnosis, own, sensors), _left_out(diagnosis, own)
        apart = None if models is None or recording.role == "fit" else spread(models, diagnosis, own)
        done.append(
            Prediction(
                recording.name, recording.role, own.dt, sensors, moved, measured, left_out=left_out, spread=apart
            )
        )
    return done


def _left_out(diagnosis: Diagnosis, record: FitRecord) -> frozenset[int]:
    """Positions among the sensors of `record` of those that were left out of the fit; none where that leaves none."""
    rows = {row for r in diagnosis.problem.records for row, _, _ in r.crossed}
    found = frozenset(i for i, row in enumerate(record.out_rows.tolist()) if row in rows)
    return found if len(found) < len(record.out_rows) else frozenset()


def _moved(diagnosis: Diagnosis, record: FitRecord, channels: Sequence[Channel]) -> dict[str, Values]:
    """What `channels`, which are the outputs of `record`, show at every stage (n_out, n), each in its own quantity."""
    orders = [DERIVATIVES[c.quantity] for c in channels]
    found = {order: stages(diagnosis, record, order) for order in sorted(set(orders))}
    return {stage: np.array([found[order][stage][i] for i, order in enumerate(orders)]) for stage in STAGES}


def _as_accelerations(channels: Sequence[Channel], units: str) -> tuple[Channel, ...]:
    """The places of `channels` with accelerations in the unit system `units`."""
    system = unit_system(units)
    return tuple(
        replace(c, quantity="acceleration", unit=system.text("acceleration", rotational=c.dof.is_rotation))
        for c in channels
        if c.dof is not None
    )


def _outputs(channels: tuple[Channel, ...], model: Model, pairing: Pairing) -> dict[str, Any]:
    """Rows and signs of response channels, as a record has them."""
    dofs = [pairing[c.dof].dof for c in channels if c.dof is not None]
    return {"out_rows": np.array([model.row(d) for d in dofs]), "out_signs": np.array([float(d.sign) for d in dofs])}


def _inputs_only(recording: Recording, model: Model, pairing: Pairing, first: FitRecord) -> FitRecord:
    """A record with its forces alone: the responses of a held-out recording are never handed to the diagnosis."""
    force = recording.force
    assert force is not None
    dofs = [pairing[c.dof].dof for c in force.channels if c.dof is not None]
    return replace(
        first,
        name=recording.name,
        u=blow_force(force),
        y=np.zeros((len(first.out_rows), force.n_samples)),
        dt=force.dt,
        in_rows=np.array([model.row(d) for d in dofs]),
        in_signs=np.array([float(d.sign) for d in dofs]),
        period=0,
        frf=None,
        recording="",
    )


def _predict_frf(
    diagnosis: Diagnosis, recording: Recording, model: Model, pairing: Pairing, records: list[FitRecord]
) -> Prediction:
    """The FRFs of a recording, input by input, in the recording's own kind."""
    data = recording.frf
    data = data.band(float(data.freq[data.freq > 0][0]), np.inf)
    own = [r for r in records if r.source == recording.name] or frf_records(recording, model, pairing)
    columns = [stages(diagnosis, r) for r in own]
    to_kind = 1 / ((2j * np.pi * data.freq) ** ORDER[data.kind])[:, None, None]
    by_stage = {stage: np.stack([c[stage] for c in columns], axis=2) * to_kind for stage in STAGES}
    band = diagnosis.problem.band
    left_out = _left_out(diagnosis, own[0])
    return Prediction(recording.name, recording.role, 0.0, data.outputs, by_stage, data.H, data, band, left_out)


def rows_of(recording: Recording, channels: Sequence[Channel]) -> list[int] | None:
    """Which sensors of `recording` stand for `channels`; None where one of these has none.

    Of several sensors at one place it is the one of the same quantity, else the one nearest to an acceleration.
    """
    found = []
    for c in channels:
        there = [i for i, s in enumerate(recording.sensors) if s.dof == c.dof and s.quantity in DERIVATIVES]
        if not there:
            return None
        found.append(
            max(there, key=lambda i: (recording.sensors[i].quantity == c.quantity, _order(recording.sensors[i])))
        )
    return found


def _order(channel: Channel) -> int:
    return DERIVATIVES[channel.quantity]


def write_predictions(folder: Path, predictions: Iterable[Prediction]) -> None:
    """Writes predictions/<stage>/<recording>.uff of every recording that was not fitted into `folder`; every stage has
    its folder where there are predictions at all."""
    for prediction in predictions:
        for stage in STAGES:
            where = folder / "predictions" / stage
            where.mkdir(parents=True, exist_ok=True)
            if prediction.role != "fit":
                data = prediction.as_data(stage)
                assert isinstance(data, FRF) or data.values.size
                write_uff(where / f"{prediction.name}.uff", functions_of(data))
