"""Forces at places taken as known: two free forces read off together, and records with one of them as an input."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.fitting.candidates import Candidate
from femend.diagnose.fitting.nonlinear import simulate_candidate
from femend.diagnose.locating.dressed import with_attached
from femend.diagnose.locating.joint import enlarged
from femend.diagnose.locating.receptances import answers, on_lines
from femend.diagnose.locating.split import Split
from femend.estimate import Fit, FitRecord, ForcesBeside, Lines, Problem
from femend.model import Place, ReducedModel

__all__ = [
    "Known",
    "ReadOff",
    "forces_beside",
    "forces_of_laws",
    "free_forces",
    "known_from",
    "last_force",
    "read_off",
    "rows_of",
    "shown_forces",
]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# rounds in which the power of free forces is estimated, and the lines over which it is smoothed
ROUNDS, SMOOTH = 6, 31


@dataclass(frozen=True, eq=False)
class Known:
    """Forces (n_w, n) on the structure at `places`, for every record by its name and place.

    The spring or the mass that does most of what a force does is part of the model (`attached`, stiffness and mass for
    every place), and the force is what is left: one that undoes a resonance of the model without it had to be exact.
    """

    places: tuple[Place, ...]
    forces: Mapping[str, tuple[FloatArray, ...]]
    attached: tuple[tuple[float, float], ...] = ()

    def on(self, record: FitRecord) -> FitRecord:
        """The record with the forces among its inputs, a row for every DOF they act at."""
        rows, u = [record.in_rows], [record.u]
        for place, force in zip(self.places, self.forces[record.name], strict=True):
            for j, (g, values) in enumerate(zip(place.g_rows, place.g_values, strict=True)):
                rows.append(np.asarray(g, dtype=np.int64))
                u.append(np.asarray(values)[:, None] * force[j][None, : record.n])
        in_rows = np.concatenate(rows)
        signs = np.concatenate([record.in_signs, np.ones(len(in_rows) - len(record.in_rows))])
        return replace(record, in_rows=in_rows, in_signs=signs, u=np.ascontiguousarray(np.vstack(u)))

    def split(self, split: Split) -> Split:
        """The records of a split with the forces among their inputs."""
        return split.changed(self.on)

    def basis(self, reduced: ReducedModel, f_max: float, g_rows: Sequence[int]) -> tuple[ReducedModel, list[int]]:
        """The model in a basis that holds the response to the forces, and to those of springs and masses that are part
        of it, with the rows they need."""
        rows = rows_of((*self.places, *(place for place in reduced.members if place.inside)), g_rows)
        own_model = enlarged((), reduced, f_max, rows)
        for place, (k, m) in zip(self.places, self.attached, strict=True):
            own_model = with_attached(place, k, m, own_model)
        return own_model, rows


def rows_of(places: Sequence[Place], g_rows: Sequence[int]) -> list[int]:
    """Rows of the g-set that hold `g_rows` and those at which `places` act."""
    return sorted({*g_rows, *(int(g) for place in places for rows in place.g_rows for g in rows)})


@dataclass(frozen=True, eq=False)
class ReadOff:
    """Forces `F` on the structure at the coordinates of a fit, how well they are seen, `weight`, and those of `least`
    squares with the motion `D` under them, each (K, n_w), on a record's lines."""

    line: Lines
    D: ComplexArray
    F: ComplexArray
    weight: FloatArray
    least: ComplexArray


def read_off(problem: Problem, fit: Fit) -> list[ReadOff]:
    """What the coordinates of a fit with free forces did on the lines of every record.

    A least-squares force is noise on lines where the sensors hardly see it, or cannot tell it from the other. So every
    force has a prior of a power that is smooth over the lines, and that power is estimated from the forces themselves
    (empirical Bayes by expectation maximisation; Dempster, Laird and Rubin 1977).
    """
    problem = problem.thinned(None)
    reduced, w = fit.hypothesis.reduced, fit.hypothesis.w
    lines, system = problem.lines(reduced), problem.system(reduced)
    fitted = problem.fitted_lines(fit.hypothesis, fit.p, fit.x)
    omega, zeta, Q, own = system.modal(fit.p)
    found = []
    for line, (y, D, F) in zip(lines, fitted, strict=True):
        s, g, out = on_lines(line, reduced, omega, zeta, Q)
        H = s[:, None, None] ** 2 * answers(out, g, w @ Q, s, own)
        found.append(ReadOff(line, D, *shown_forces(line, y, H, F), F))
    return found


def last_force(problem: Problem, fit: Fit) -> list[FloatArray]:
    """History (n,) of the last of the free forces of `fit` in every record of `problem`."""
    read = read_off(problem, fit)
    return [_in_time(one.line, one.F[:, -1:], one.D[:, -1:], 0.0, 0.0)[0] for one in read]


def forces_beside(problem: Problem, fit: Fit) -> ForcesBeside | None:
    """The free forces of `fit` in every record of `problem`, as the recordings show them, for what they move; None
    where it has none."""
    if not len(fit.hypothesis.w):
        return None
    made: dict[str, FloatArray | ComplexArray] = {}
    for one in read_off(problem, fit):
        record = one.line.record
        made[record.name] = _in_time(one.line, one.F, one.D, 0.0, 0.0) if record.frf is None else _on_all(one)
    return ForcesBeside(fit.hypothesis.w, made)


def _on_all(one: ReadOff) -> ComplexArray:
    """Forces (n_w, n) on all lines of an FRF, none outside the band."""
    full = np.zeros((one.line.record.n, one.F.shape[1]), dtype=np.complex128)
    full[one.line.index] = one.F
    return np.asarray(full.T)


def free_forces(problem: Problem, fit: Fit, places: Sequence[Place]) -> Known:
    """Forces at `places` as the recordings show them, the model being that of `fit`, whose hypothesis has a free force
    at each of them in their order."""
    read = read_off(problem, fit)
    lines, motions, parts = [r.line for r in read], [r.D for r in read], [r.F for r in read]
    weights = [r.weight for r in read]
    forces: dict[str, tuple[FloatArray, ...]] = {}
    ends = np.cumsum([0, *(p.n_w for p in places)])
    spans = [slice(a, b) for a, b in itertools.pairwise(ends)]
    attached = tuple(
        _follower(lines, [D[:, i] for D in motions], [F[:, i] for F in parts], [w[:, i] for w in weights])
        for i in spans
    )
    for line, D, F in zip(lines, motions, parts, strict=True):
        forces[line.record.name] = tuple(
            _in_time(line, F[:, i], D[:, i], *follower) for i, follower in zip(spans, attached, strict=True)
        )
    return Known(tuple(places), forces, attached)


def _follower(
    lines: Sequence[Lines], D: Sequence[ComplexArray], F: Sequence[ComplexArray], weights: Sequence[FloatArray]
) -> tuple[float, float]:
    """The spring or the mass, whichever does more, whose force on the structure is most like F (K, n_w) under the
    motion D (K, n_w)."""
    tops, bottoms = np.zeros(2), np.zeros(2)
    for line, d, f, w in zip(lines, D, F, weights, strict=True):
        s = line.s
        for i, shape in enumerate((-d, -((s**2)[:, None]) * d)):
            tops[i] += float((w * np.real(shape.conj() * f)).sum())
            bottoms[i] += float((w * np.abs(shape) ** 2).sum())
    gains = np.where(tops > 0, tops**2 / np.maximum(bottoms, 1e-300), 0.0)
    best = int(np.argmax(gains))
    value = float(tops[best] / bottoms[best]) if gains[best] > 0 else 0.0
    return (value, 0.0) if best == 0 else (0.0, value)


def _in_time(line: Lines, F: ComplexArray, D: ComplexArray, k: float, m: float) -> FloatArray:
    """History (n_w, n) of what is left of a force beside a spring and a mass."""
    s = line.s
    full = np.zeros((line.record.n // 2 + 1, F.shape[1]), dtype=complex)
    full[line.index] = F + (k + m * s**2)[:, None] * D
    return np.asarray(np.fft.irfft(full, n=line.record.n, axis=0).T)


def shown_forces(line: Lines, y: ComplexArray, H: ComplexArray, F: ComplexArray) -> tuple[ComplexArray, FloatArray]:
    """Forces (K, n_w) as the sensors show them on a record's lines, and how well, (K, n_w): from least-squares ones `F`
    (K, n_w) with which they were to read `y` (K, n_out), forces of one answering with `H` (K, n_out, n_w)."""
    answer = (line.Y - y + np.einsum("ksw,kw->ks", H, F)) * line.weight
    H = H * line.weight[:, :, None]
    return _shrunk(H, answer, F), np.asarray((np.abs(H) ** 2).sum(axis=1))


def _shrunk(H: ComplexArray, answer: ComplexArray, F: ComplexArray) -> ComplexArray:
    """Forces (K, n_w) behind weighted answers (K, n_out) of the sensors, from least-squares ones `F`."""
    gram = np.einsum("ksv,ksw->kvw", H.conj(), H)
    seen = np.einsum("ksw,ks->kw", H.conj(), answer)[:, :, None]
    power = _smooth(np.abs(F) ** 2)
    for _ in range(ROUNDS):
        covariance = np.linalg.inv(gram + np.einsum("kw,wv->kwv", 1 / power, np.eye(F.shape[1])))
        F = np.asarray((covariance @ seen)[:, :, 0])
        power = _smooth(np.abs(F) ** 2 + np.real(np.einsum("kww->kw", covariance)))
    return F


def _smooth(power: FloatArray) -> FloatArray:
    """Running mean (K, n_w) over lines, never zero."""
    width = min(SMOOTH, len(power))
    kernel = np.ones(width)
    count = np.convolve(np.ones(len(power)), kernel, "same")
    mean = np.array([np.convolve(column, kernel, "same") / count for column in power.T]).T
    return np.asarray(np.maximum(mean, 1e-12 * max(float(mean.max()), 1e-300)))


def forces_of_laws(problem: Problem, candidate: Candidate) -> Known | None:
    """Forces that a fitted law exerts on the structure in the recordings of `problem`; None for a member's factor,
    which is part of the model, and where the law cannot be followed.

    In a cut the rigid connection of the deck stays: what the law leaves of it is a force as large as the opening.
    """
    joint = candidate.joint
    if joint is None or candidate.physics is None:
        return None
    problem = problem.thinned(None)
    lines = problem.lines(joint.reduced)
    motions, parts = [], []
    if candidate.nonlinear:
        for line in lines:
            history = simulate_candidate(problem, candidate, line.record)
            if not (np.isfinite(history.f).all() and np.isfinite(history.d).all()):
                return None
            alone = history.f - candidate.k * history.d - candidate.c * history.v
            both = (np.fft.rfft(x, line.record.n, axis=1)[:, line.index].T for x in (history.d, -alone))
            d, f = both
            motions.append(d)
            parts.append(f)
    else:
        hypothesis = joint.hypothesis(
            (candidate.physics.law or candidate.physics.name,), candidate.x, np.full(len(candidate.x), 1.0)
        )
        for _, d, f in problem.fitted_lines(hypothesis, candidate.p, candidate.x, lines):
            motions.append(d[:, : joint.place.n_w])
            parts.append(f[:, : joint.place.n_w])
    return known_from(lines, joint.place, motions, parts)


def known_from(
    lines: Sequence[Lines], place: Place, motions: Sequence[ComplexArray], parts: Sequence[ComplexArray]
) -> Known:
    """What a law at a place exerts on the structure, `parts` (K, n_w), under the `motions` (K, n_w) there, on the lines
    of every record."""
    if place.release is not None:
        opened = {line.record.name: (_in_time(line, d, d, 0.0, 0.0),) for line, d in zip(lines, motions, strict=True)}
        return Known((place,), opened, ((0.0, 0.0),))
    follower = _follower(lines, motions, parts, [np.ones(d.shape) for d in motions])
    left = {
        line.record.name: (_in_time(line, f, d, *follower),) for line, d, f in zip(lines, motions, parts, strict=True)
    }
    return Known((place,), left, (follower,))
