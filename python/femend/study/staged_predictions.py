"""Responses of a staged study's recordings: as the deck stands, updated, and with what was added."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.data import FRF, Channel, Recording, Test
from femend.diagnose.staged import Flow, Setup, StagedData
from femend.diagnose.staged.loads import LEAD, RunResult, fit_run
from femend.diagnose.staged.prepare import run_data
from femend.estimate.frf import ORDER
from femend.estimate.joint import receptance, simulate_run
from femend.model.configured import ConfiguredModel
from femend.model.linear_terms import LinearTerm
from femend.study.predictions import STAGES, Prediction

__all__ = ["predict_staged"]

FloatArray = NDArray[np.float64]
Values = NDArray[Any]


@dataclass(frozen=True, eq=False)
class _Version:
    """A model at one of the stages: its terms, what was settled (None: the deck as it is), the runs' loads by
    configuration."""

    terms: tuple[LinearTerm, ...]
    flow: Flow | None
    runs: dict[str, RunResult]

    def model(self, setup: Setup, configuration: str) -> tuple[ConfiguredModel, FloatArray]:
        unknowns = setup.unknowns(self.terms)
        p: dict[str, float] = {}
        if self.flow is not None:
            found = self.flow.in_configuration(configuration)
            p = dict(zip(found.unknowns.names, found.p.tolist(), strict=True))
        at = np.array([p.get(n, u.mean) for n, u in zip(unknowns.names, unknowns.items, strict=True)])
        return setup.model(configuration, unknowns, self.terms), at


def predict_staged(setup: Setup, test: Test, data: StagedData, final: Flow, plain: Flow) -> list[Prediction]:
    """Predictions of FRFs and runs; ambient recordings have no input to predict from."""
    versions = {"nominal": _nominal(setup, data), "parameters": _of(plain), "final": _of(final)}
    sensors = _sensors(test)
    done = []
    for recording in test:
        if isinstance(recording.data, FRF):
            done.append(_frf(setup, recording, versions, data))
        elif recording.excitation == "rotating" and any(v.runs for v in versions.values()):
            done.append(_run(setup, recording, versions, sensors))
    return done


def _nominal(setup: Setup, data: StagedData) -> _Version:
    """The deck as it is; the unbalance, which no deck holds, is fitted to it."""
    runs = {}
    for configuration, recorded in data.runs.items():
        runs[configuration] = fit_run(setup, configuration, recorded[-1], [], None, structure=False)
    return _Version((), None, runs)


def _of(flow: Flow) -> _Version:
    return _Version(flow.terms, flow, dict(flow.runs))


def _sensors(test: Test) -> tuple[Channel, ...]:
    """Response channels of all fit recordings in time, one per DOF."""
    seen: dict[str, Channel] = {}
    for r in test:
        if r.role == "fit" and r.is_time:
            for c in r.sensors:
                seen.setdefault(str(c.dof), Channel(c.dof, "acceleration", "m/s^2", c.name, c.label))
    return tuple(seen.values())


def _frf(setup: Setup, recording: Recording, versions: dict[str, _Version], data: StagedData) -> Prediction:
    frf = recording.frf
    frf = frf.band(float(frf.freq[frf.freq > 0][0]), np.inf)
    s = 2j * np.pi * frf.freq
    out, into = ([c.dof for c in cs if c.dof is not None] for cs in (frf.outputs, frf.inputs))
    stages: dict[str, Values] = {}
    for stage, version in versions.items():
        model, p = version.model(setup, recording.configuration)
        H = receptance(model, p, s).between(setup.rows(model, out), setup.rows(model, into))
        stages[stage] = H / (s ** ORDER[frf.kind])[:, None, None]
    own = next((f for fs in data.frfs.values() for f in fs if f.name == recording.name), None)
    band = (float(frf.freq[0]), float(frf.freq[-1])) if own is None else (float(own.freq[0]), float(own.freq[-1]))
    return Prediction(recording.name, recording.role, 0.0, frf.outputs, stages, frf.H, frf, band)


def _run(setup: Setup, recording: Recording, versions: dict[str, _Version], sensors: tuple[Channel, ...]) -> Prediction:
    """A run at the recording's own samples, in the state before it that the fitted run showed."""
    stages: dict[str, Values] = {}
    time = recording.time
    dofs = [c.dof for c in sensors if c.dof is not None]
    for stage, version in versions.items():
        result = version.runs.get(recording.configuration) or next(iter(version.runs.values()))
        model = result.model
        if model.name != recording.configuration:
            model = setup.model(recording.configuration, result.posterior.unknowns, version.terms)
        steady, onset = (LEAD, 0.0) if result.onset is None else (0.0, result.onset)
        run = run_data(recording, steady=steady, onset=onset, f_max=0.4 / time.dt)
        run = run.with_power(result.data.power, steady=steady, onset=onset)
        out = setup.rows(model, dofs)
        y = simulate_run(model, result.posterior.p, run.loaded, result.unbalance, out, run.bearings(setup, model))
        stages[stage] = _at_all_samples(y, run.dt, time.dt, time.n_samples)
    recorded = _recorded(recording, sensors)
    return Prediction(recording.name, recording.role, time.dt, sensors, {s: stages[s] for s in STAGES}, recorded)


def _at_all_samples(y: FloatArray, dt: float, wanted: float, n: int) -> FloatArray:
    """Records (n_ch, n) at the step wanted; they were computed at a multiple of it where that was enough."""
    keep = int(round(dt / wanted))
    if keep == 1:
        return y[:, :n]
    from scipy.signal import resample_poly

    return np.asarray(resample_poly(y, keep, 1, axis=1)[:, :n])


def _recorded(recording: Recording, sensors: tuple[Channel, ...]) -> FloatArray | None:
    response = recording.response
    if recording.role == "predict" or response is None:
        return None
    rows = {c.dof: i for i, c in enumerate(response.channels)}
    if any(c.dof not in rows for c in sensors):
        return None
    return np.asarray(response.values[[rows[c.dof] for c in sensors]])
