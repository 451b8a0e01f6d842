"""Responses from rest to given forces: of the model with its parameters, and of a candidate with its law."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend import _core
from femend.diagnose.fitting.candidates import Candidate
from femend.diagnose.fitting.nonlinear import candidate_motion
from femend.diagnose.locating.receptances import answers, receptances
from femend.estimate import FitRecord, Hypothesis, Problem
from femend.model import ReducedModel
from femend.physics import physics

__all__ = ["predict_candidate", "predict_frf", "predict_linear", "predict_model", "transfer"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# the record is continued by so many times its length, and the decay window leaves exp(-WRAP) of what runs round the end
PADDING, WRAP = 2, 12.0


def transfer(
    problem: Problem,
    hypothesis: Hypothesis,
    p: FloatArray,
    x: FloatArray,
    s: ComplexArray,
    out: FloatArray,
    into: FloatArray,
    order: int = 2,
) -> ComplexArray:
    """Accelerances (K, n_out, n_in) at lines s with linear laws closed, at unknowns `p` and ln law parameters `x`;
    `out`, `into` are rows of the basis. Of another `order` than 2 it is that derivative of the displacement."""
    omega, zeta, Q, own = problem.system(hypothesis.reduced).modal(p)
    g = receptances(omega, zeta, s)
    phi_out, phi_in = out @ Q, into @ Q
    H = answers(phi_out, g, phi_in, s, own)
    if hypothesis.laws and len(hypothesis.w):
        w = hypothesis.w @ Q
        held = np.zeros(len(w)) if hypothesis.held is None else hypothesis.held
        kappa = (_kappa(hypothesis.laws, x, s)[:, None] - held)[:, :, None]
        c = answers(w, g, w, s, own)
        c = c + np.diag(hypothesis.compliance if hypothesis.compliance is not None else np.zeros(len(w)))
        B = np.linalg.inv(np.eye(len(w)) + kappa * c)
        from_w, to_w = answers(phi_out, g, w, s, own), answers(w, g, phi_in, s, own)
        H = H - from_w @ B @ (kappa * to_w)
    return np.asarray(s[:, None, None] ** order * H)


def _kappa(laws: tuple[str, ...], x: FloatArray, s: ComplexArray) -> ComplexArray:
    total = np.zeros(len(s), dtype=complex)
    first = 0
    for law in laws:
        names = physics(law).parameter_names
        values = np.exp(x[first : first + len(names)])
        total += _core.law_dynamic_stiffness(law, dict(zip(names, values.tolist())), s)[0]
        first += len(names)
    return total


def predict_model(
    problem: Problem, hypothesis: Hypothesis, p: FloatArray, x: FloatArray, record: FitRecord, order: int = 2
) -> FloatArray:
    """Accelerations (n_out, n) from rest at unknowns `p` and ln law parameters `x`, by the exponential window method
    (Kausel and Roesset 1992); of another `order` than 2 that derivative of the displacements."""
    reduced: ReducedModel = hypothesis.reduced
    n = record.n
    length = PADDING * n
    sigma = WRAP / (length * record.dt)
    t = record.dt * np.arange(n)
    U = np.fft.rfft(record.u * np.exp(-sigma * t), length, axis=1)
    s = np.asarray(sigma + 2j * np.pi * np.fft.rfftfreq(length, record.dt), dtype=np.complex128)
    out = reduced.rows(record.out_rows, record.out_signs)
    into = reduced.rows(record.in_rows, record.in_signs)
    H = transfer(problem, hypothesis, p, x, s, out, into, order)
    y = np.fft.irfft(np.einsum("koi,ik->ok", H, U), length, axis=1)[:, :n]
    return np.asarray(y * np.exp(sigma * t))


def predict_frf(
    problem: Problem, hypothesis: Hypothesis, p: FloatArray, x: FloatArray, record: FitRecord
) -> ComplexArray:
    """Accelerances (K, n_out) of a model at unknowns `p` and ln law parameters `x` on the lines of an FRF column.

    Raises ValueError for a record of time samples.
    """
    if record.frf is None:
        raise ValueError(f"record {record.name!r} holds time samples, not an FRF")
    reduced: ReducedModel = hypothesis.reduced
    out = reduced.rows(record.out_rows, record.out_signs)
    into = reduced.rows(record.in_rows, record.in_signs)
    return transfer(problem, hypothesis, p, x, np.asarray(2j * np.pi * record.frf.freq), out, into)[:, :, 0]


def predict_linear(
    problem: Problem, hypothesis: Hypothesis, p: FloatArray, x: FloatArray, record: FitRecord, order: int = 2
) -> FloatArray | ComplexArray:
    """Accelerations (n_out, n), or another derivative by its `order`, of a model at unknowns `p` and ln law parameters
    `x` for a time record, as `predict_model`, or accelerances (K, n_out) for one of an FRF, as `predict_frf`."""
    if record.frf is not None:
        return predict_frf(problem, hypothesis, p, x, record)
    return predict_model(problem, hypothesis, p, x, record, order)


def predict_candidate(
    problem: Problem, candidate: Candidate, fallback: Hypothesis, record: FitRecord, order: int = 2
) -> FloatArray | ComplexArray:
    """Accelerations (n_out, n) of a candidate, or another derivative by its `order`, or accelerances (K, n_out) for a
    record of an FRF (NaN for a nonlinear law); `fallback` is the model for a candidate without a joint."""
    if candidate.joint is None:
        return predict_linear(problem, fallback, candidate.p, candidate.x, record, order)
    if candidate.nonlinear and record.frf is not None:
        return np.full(record.frf.H.shape, np.nan, dtype=complex)
    if candidate.nonlinear:
        y: Any = candidate_motion(problem, candidate, record, order)
        return np.asarray(y)
    assert candidate.physics is not None
    hypothesis = candidate.joint.hypothesis((candidate.physics.law or candidate.physics.name,))
    return predict_linear(problem, hypothesis, candidate.p, candidate.x, record, order)
