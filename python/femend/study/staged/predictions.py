"""Responses of a staged study's recordings: as the deck stands, updated, and with what was added."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.data import FRF, Channel, Recording, Test
from femend.diagnose.staged import Flow, Setup, StagedData
from femend.diagnose.staged.loads import LEAD, RunResult, fit_run
from femend.diagnose.staged.prepare import run_data
from femend.estimate.frf import ORDER
from femend.estimate.joint import receptance, simulate_run
from femend.model.terms.configured import ConfiguredModel
from femend.model.terms.linear_terms import LinearTerm
from femend.signal.calculus import DERIVATIVES
from femend.study.result.predictions import STAGES, Prediction, rows_of

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
    """Response channels of all fit recordings in time that measure a motion, one per DOF."""
    seen: dict[str, Channel] = {}
    for r in test:
        if r.role == "fit" and r.is_time:
            for c in r.sensors:
                if c.quantity in DERIVATIVES:
                    seen.setdefault(str(c.dof), c)
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
    """A run at the recording's own samples, in the state before it that the fitted run showed; each sensor in the
    quantity that it measures, in the recording where it is there."""
    stages: dict[str, Values] = {}
    time = recording.time
    rows = None if recording.role == "predict" else rows_of(recording, sensors)
    recorded = None
    if rows is not None and recording.response is not None:
        sensors, recorded = tuple(recording.sensors[i] for i in rows), recording.response.values[rows]
    orders = [DERIVATIVES[c.quantity] for c in sensors]
    dofs = [c.dof for c in sensors if c.dof is not None]
    for stage, version in versions.items():
        result = version.runs.get(recording.configuration) or next(iter(version.runs.values()))
        model = result.model
        if model.name != recording.configuration:
            model = setup.model(recording.configuration, result.posterior.unknowns, version.terms)
        steady, onset = (LEAD, 0.0) if result.onset is None else (0.0, result.onset)
        # the unbalance acts where the fitted run showed it, which may be another node than was told
        run = run_data(recording, steady=steady, onset=onset, f_max=0.4 / time.dt)
        run = replace(run, nodes=result.data.nodes)
        run = run.with_power(result.data.power, steady=steady, onset=onset)
        out = setup.rows(model, dofs)
        at = model, result.posterior.p, run.loaded, result.unbalance, out, run.bearings(setup, model)
        by_order = {order: simulate_run(*at, order) for order in sorted(set(orders))}
        y = np.array([by_order[order][i] for i, order in enumerate(orders)])
        stages[stage] = _at_all_samples(y, run.dt, time.dt, time.n_samples)
    return Prediction(recording.name, recording.role, time.dt, sensors, {s: stages[s] for s in STAGES}, recorded)


def _at_all_samples(y: FloatArray, dt: float, wanted: float, n: int) -> FloatArray:
    """Records (n_ch, n) at the step wanted; they were computed at a multiple of it where that was enough."""
    keep = int(round(dt / wanted))
    if keep == 1:
        return y[:, :n]
    from scipy.signal import resample_poly

    return np.asarray(resample_poly(y, keep, 1, axis=1)[:, :n])
