"""The curves of the report: frequency responses, time traces, and the force the model lacks over its own motion."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from femend import _core
from femend.data import Channel
from femend.data.bands import within_band
from femend.diagnose.fitting.candidates import Candidate
from femend.diagnose.locating.recovered import Recovered, recover
from femend.diagnose.naming.ranked import Ranked
from femend.estimate import FitRecord
from femend.report.content import FrfOverlay, RestoringForce, TimeOverlay
from femend.study.result.predictions import STAGES, Prediction
from femend.units import UnitSystem, unit_system

if TYPE_CHECKING:
    from femend.diagnose import Diagnosis
    from femend.study.result.study_run import StudyRun

__all__ = ["accepted", "frf_estimate", "frf_overlays", "restoring_force", "time_overlays"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# sensors that are drawn: of the frequency responses, of a fit recording in time, of every other recording in time
FRF_SENSORS, FIT_TRACES, OTHER_TRACES = 6, 3, 1
# lines averaged by H1 where a record does not repeat itself, and how many are drawn at most
AVERAGED, DRAWN = 5, 900
# lines of a record up to which its force is recovered anew on all of them for the picture
RECOVERED = 6000
# a line whose force has less than this share of the power of the strongest of so many neighbours to either side carries
# noise alone; a multisine leaves such lines out on purpose
EXCITED, NEIGHBOURS = 1e-2, 12


def frf_estimate(u: FloatArray, y: FloatArray, dt: float, period: int = 0) -> tuple[FloatArray, ComplexArray]:
    """Frequencies (K,) in Hz and H (K, n_out) from a force u (n,) to responses y (n_out, n).

    A record that repeats itself gives the ratio of its last period's spectra, others H1 with cross and power spectra
    averaged over neighbouring lines (Bendat and Piersol, Random Data, 4th ed., eq. 6.37). Measured and predicted
    responses that go through the same estimate have the same leakage. Lines without force are left out.
    """
    if period:
        u, y = u[-period:], y[:, -period:]
    U, Y = np.fft.rfft(u), np.fft.rfft(y, axis=1)
    freq = np.fft.rfftfreq(len(u), dt)
    power, cross = np.abs(U) ** 2, Y * U.conj()
    if not period:
        width = max(AVERAGED, -(-len(freq) // (4 * DRAWN)))
        kernel = np.ones(width) / width
        power = np.convolve(power, kernel, "same")
        cross = np.array([np.convolve(row, kernel, "same") for row in cross])
    power[0] = 0.0
    around = np.lib.stride_tricks.sliding_window_view(np.pad(power, NEIGHBOURS, "edge"), 2 * NEIGHBOURS + 1).max(axis=1)
    excited = power > np.maximum(EXCITED * around, EXCITED**3 * power.max())
    return freq[excited], (cross[:, excited] / power[excited]).T


def highest(records: list[FitRecord]) -> FitRecord:
    """The record of the highest level."""
    return max(records, key=lambda r: r.level)


def frf_overlays(run: StudyRun) -> tuple[FrfOverlay, ...]:
    """Of the highest fit recording, the sensors explained worst by updating alone; from its strongest force."""
    timed = [r for r in run.records if r.frf is None and r.driven]
    if not timed:
        return ()
    record = highest(timed)
    prediction = next((p for p in run.predictions if p.name == record.name), None)
    if prediction is None or prediction.recorded is None:
        return ()
    u = record.u[int(np.argmax(record.u.std(axis=1)))]
    freq, measured = frf_estimate(u, prediction.recorded, record.dt, record.period)
    inside = np.flatnonzero(within_band(freq, run.diagnosis.problem.band))
    inside = inside[:: max(1, -(-len(inside) // DRAWN))]
    if len(inside) < 2:
        return ()
    stages = {s: frf_estimate(u, prediction.stages[s], record.dt, record.period)[1] for s in _drawn_stages(run)}
    system = unit_system(run.model.units)
    return tuple(
        FrfOverlay(
            freq[inside],
            measured[inside, i],
            label=_label(prediction.channels[i]),
            recording=record.name,
            unit=f"({prediction.channels[i].unit})/{system.text('force')}",
            **{s: H[inside, i] for s, H in stages.items()},
        )
        for i in _worst(prediction, prediction.recorded)[:FRF_SENSORS]
    )


def _label(channel: Channel) -> str:
    return f"{channel.name} {channel.dof}" if channel.name else str(channel.dof)


def _drawn_stages(run: StudyRun) -> tuple[str, ...]:
    """The final model is drawn apart from the updated one where something was added to it."""
    return STAGES if run.diagnosis.best is not None or run.diagnosis.by_load else STAGES[:2]


def _worst(prediction: Prediction, recorded: FloatArray | None) -> list[int]:
    """Sensors by falling error of the updated parameters, or by response where nothing is known."""
    updated = prediction.stages["parameters"]
    left = updated if recorded is None else updated - recorded
    power = (np.nan_to_num(left) ** 2).sum(axis=1)
    # sensors of several quantities are compared by what theirs show
    size = (np.nan_to_num(updated if recorded is None else recorded) ** 2).sum(axis=1)
    kinds = [c.quantity for c in prediction.channels]
    if len(set(kinds)) > 1:
        power = power / np.array([size[[k == kind for k in kinds]].mean() for kind in kinds])
    return [int(i) for i in np.argsort(-power, kind="stable")]


def time_overlays(run: StudyRun) -> tuple[TimeOverlay, ...]:
    """The highest fit recording, then `validate` with the recording and `predict` with curves alone."""
    timed = [r for r in run.records if r.frf is None]
    first = highest(timed).name if timed else ""
    order = [p for p in run.predictions if p.name == first and p.frf is None]
    order += [p for p in run.predictions if p.role != "fit" and p.frf is None]
    found = []
    for prediction in order:
        recorded = None if prediction.role == "predict" else prediction.recorded
        count = FIT_TRACES if prediction.role == "fit" else OTHER_TRACES
        for i in _worst(prediction, recorded)[:count]:
            curves = {s: prediction.stages[s][i] for s in _drawn_stages(run)}
            found.append(
                TimeOverlay(
                    np.asarray(prediction.dt * np.arange(prediction.stages["nominal"].shape[1]), dtype=np.float64),
                    None if recorded is None else recorded[i],
                    label=_label(prediction.channels[i]),
                    recording=prediction.name,
                    role=prediction.role,
                    unit=prediction.channels[i].unit,
                    **curves,
                )
            )
    return tuple(found)


def accepted(diagnosis: Diagnosis) -> Ranked | None:
    """The ranked candidate behind the verdict's law or place; None where nothing was located."""
    if diagnosis.place is None:
        return None
    if diagnosis.rival is not None:
        return diagnosis.rival.ranked
    ranked = diagnosis.ranked if diagnosis.further is None else diagnosis.further.laws[0]
    here = [r for r in ranked if r.located is diagnosis.place]
    if diagnosis.best is None:
        return here[0] if here else None
    joint = diagnosis.best.joint
    return next((r for r in here if r.candidate.joint is joint), here[0] if here else None)


def restoring_force(run: StudyRun) -> RestoringForce | None:
    """What the opened place did on the highest recording it was recovered from, and the law along that motion."""
    diagnosis = run.diagnosis
    ranked = accepted(diagnosis)
    if ranked is None or ranked.recovered is None:
        return None
    recovered = ranked.recovered
    i = int(np.argmax([r.level for r in recovered.records]))
    if recovered.records[i].frf is not None:
        return None  # an FRF is not a motion
    whole = _on_all_lines(diagnosis, recovered.records[i].name)
    recovered, i = (recovered, i) if whole is None else (whole, 0)
    k = int(np.argmax(recovered.f[i].std(axis=1)))
    d, v, f = recovered.d[i][k], recovered.v[i][k], recovered.f[i][k]
    if not (np.isfinite(d).all() and np.isfinite(f).all()):
        return None
    best = diagnosis.best
    law = None if best is None else law_along(best, recovered, i, k)
    if law is None or not np.isfinite(law).all():
        law = None
    system = unit_system(run.model.units)
    turning = ranked.located is not None and ranked.located.place.direction.startswith("R")
    return RestoringForce(
        d, v, f,
        law_d=None if law is None else d,
        law_v=None if law is None else v,
        law_f=law,
        recording=recovered.records[i].name,
        **_units(system, turning),
    )  # fmt: skip


def _on_all_lines(diagnosis: Diagnosis, name: str) -> Recovered | None:
    """What the place of one nonlinear law did in the record `name`, read off on all its lines beside the final model.

    Laws are compared on some of the lines, whose time histories are smeared; a stop shows its gap on all of them.
    """
    best = diagnosis.best
    if best is None or best.joint is None or not best.nonlinear or diagnosis.further is not None:
        return None
    record = next((r for r in diagnosis.problem.records if r.name == name), None)
    if record is None or diagnosis.problem.load is not None:
        return None
    low, high = diagnosis.problem.band
    if (high - low) * record.n * record.dt > RECOVERED:
        return None
    return recover(diagnosis.problem.on([record]), best.joint, best.p)


def _units(system: UnitSystem, turning: bool) -> dict[str, str]:
    return {
        "d_unit": system.text("displacement", rotational=turning),
        "v_unit": system.text("velocity", rotational=turning),
        "f_unit": system.text("force", rotational=turning),
    }


def law_along(candidate: Candidate, recovered: Recovered, i: int, k: int) -> FloatArray | None:
    """Force (n,) of a candidate's law and its linear companion along the recovered motion of record i, coordinate k.

    The recovered force holds the lines of the fit alone, and so does what is returned. None without a law.
    """
    if candidate.physics is None:
        return None
    law = candidate.physics.law or candidate.physics.name
    laws = [(law, dict(candidate.values))]
    if candidate.coordinates is not None:
        laws = candidate.coordinates.composite(candidate.values)
    record, index = recovered.records[i], recovered.index[i]
    n = record.n
    F = np.zeros(n // 2 + 1, dtype=complex)
    if candidate.nonlinear:
        d, v, a = (x[i][k] for x in (recovered.d, recovered.v, recovered.a))
        force = candidate.k * d + candidate.c * v
        force = force + sum(_core.law_force(name, values, d, v, a, record.dt) for name, values in laws)
        F[index] = np.fft.rfft(force)[index]
    else:
        s = np.asarray(2j * np.pi * np.fft.rfftfreq(n, record.dt)[index], dtype=np.complex128)
        kappa, _ = _core.law_dynamic_stiffness(law, dict(candidate.values), s)
        F[index] = kappa * np.fft.rfft(recovered.d[i][k])[index]
    return np.asarray(np.fft.irfft(F, n))
