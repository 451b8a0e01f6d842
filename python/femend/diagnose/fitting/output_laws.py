"""A named law taken on to the fit in the measured quantity, and a further law beside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from femend import _core
from femend.diagnose.fitting.candidates import Candidate
from femend.diagnose.fitting.output_fit import Modes, OutputFit, TimeRecord, fit_output, residual_of, simulated
from femend.diagnose.settings import Settings
from femend.errors import RecordingError
from femend.estimate import Problem
from femend.physics import Physics, shapes

__all__ = ["modes_of", "with_further_law"]

FloatArray = NDArray[np.float64]

# size of the force, as a share of the recorded one, by which a further law is tried, and laws that are then fitted
PROBE, FOLLOWED = 1e-3, 2


def modes_of(problem: Problem, candidate: Candidate) -> Modes:
    """Modal model of a candidate's fit at the sensors and forces of the problem's first record.

    The spring and dashpot beside its law are in the modes, the dashpot by what it adds to each mode's own damping.
    Raises RecordingError for a candidate without a coordinate (a member's factor, a load).
    """
    if candidate.joint is None:
        raise RecordingError(f"{candidate.name} has no coordinate that could carry a law")
    record, reduced = problem.records[0], candidate.joint.reduced
    omega, zeta, Q = problem.modes(reduced, candidate.p)
    w = candidate.joint.w @ Q
    beyond = candidate.k if candidate.joint.held is None else (candidate.k - candidate.joint.held)[:, None]
    values, turn = eigh(np.diag(omega**2) + w.T @ (beyond * w))
    new = np.sqrt(np.maximum(values, 0.0))
    damping = np.diag(turn.T @ (np.diag(2 * zeta * omega) + candidate.c * w.T @ w) @ turn)
    rows = (
        reduced.rows(*at) @ Q @ turn for at in ((record.in_rows, record.in_signs), (record.out_rows, record.out_signs))
    )
    phi_in, phi_out = rows
    return Modes(new, damping / (2 * np.maximum(new, 1e-300)), phi_in, phi_out, w @ turn)


def with_further_law(
    fit: OutputFit,
    entries: Sequence[Physics],
    records: Sequence[TimeRecord],
    choosing: Sequence[TimeRecord],
    *,
    skip: int = 0,
    settings: Settings | None = None,
) -> OutputFit | None:
    """The fit with one more law of `entries` beside the first coordinate's, or None where none is worth it.

    Every shape of every law is tried by the change that a little of it makes to the responses of `records`; the laws
    that would take most away are fitted with everything else, and the one that leaves least on `choosing`, which no fit
    has seen, is taken if what is left falls by `Settings.gain_nonlinear` (ln).
    """
    settings = settings or Settings()
    best, least = None, fit.share(choosing, skip) * float(np.exp(-settings.gain_nonlinear))
    known = {physics.law for physics, _ in fit.laws[0]}
    promising = _screened(fit, [entry for entry in entries if entry.law not in known], records, skip)
    for physics, values in promising[:FOLLOWED]:
        laws = ((*fit.laws[0], (physics, values)), *fit.laws[1:])
        new = _again(fit, laws, records, skip)
        left = np.inf if new is None else new.share(choosing, skip)
        if left < least:
            best, least = new, left
    return best


def _again(
    fit: OutputFit,
    laws: tuple[tuple[tuple[Physics, Mapping[str, float]], ...], ...],
    records: Sequence[TimeRecord],
    skip: int,
) -> OutputFit | None:
    """A fit with other laws that starts where `fit` is; None where it cannot be simulated."""
    shifted = [replace(record, u=record.u + fit.zero[:, None]) for record in records]
    zero = bool(fit.zero.any())
    try:
        new = fit_output(fit.modes, laws, shifted, quantity=fit.quantity, zero=zero, skip=skip)
    except RecordingError:
        return None
    return replace(new, zero=new.zero + fit.zero)


def _screened(
    fit: OutputFit, entries: Sequence[Physics], records: Sequence[TimeRecord], skip: int
) -> list[tuple[Physics, dict[str, float]]]:
    """(law, start) for each entry, those first of which a little would take most of the residual away."""
    done = simulated([fit], records)[0]
    e = residual_of(done, records, skip)
    first = done[0]
    d, v = first[1][0], first[2][0]
    dt, size = records[0].dt, float(np.mean([record.u.std() for record in records]))
    band = (float(fit.modes.omega.min()) / 3, float(fit.modes.omega.max()) * 3)
    found = []
    for entry in entries:
        best: tuple[float, dict[str, float]] | None = None
        for shape in shapes(entry, amplitude=float(np.abs(d).max()), band=band, speed=float(np.abs(v).max())):
            little = []
            for i, term in enumerate(shape.terms):
                force = _core.law_force(entry.law or entry.name, dict(term), d, v, np.gradient(v, dt), dt)
                one = np.zeros(len(shape.terms))
                one[i] = PROBE * size / max(float(force.std()), 1e-300)
                little.append(one)
            changed = [_plus(fit, entry, shape.values(one.tolist())) for one in little]
            J = np.stack([residual_of(h, records, skip) - e for h in simulated(changed, records)], axis=1)
            if not np.isfinite(J).all():
                continue
            x = np.linalg.lstsq(J, -e, rcond=None)[0]
            if not entry.signed:
                x = np.maximum(x, 1e-3)
            left = float(((e + J @ x) ** 2).sum())
            if best is None or left < best[0]:
                best = left, shape.values((x @ np.array(little)).tolist())
        found += [] if best is None else [(best[0], entry, best[1])]
    return [(entry, values) for _, entry, values in sorted(found, key=lambda item: item[0])]


def _plus(fit: OutputFit, physics: Physics, values: Mapping[str, float]) -> OutputFit:
    return replace(fit, laws=((*fit.laws[0], (physics, values)), *fit.laws[1:]))
