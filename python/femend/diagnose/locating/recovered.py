"""What a place's coordinate did: displacement and force recovered from the recordings without any law."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.locating.equivalent import equivalent_linear
from femend.diagnose.locating.free_force import FreeForce
from femend.diagnose.locating.joint import Joint
from femend.diagnose.locating.receptances import answers, on_lines
from femend.estimate import Fit, FitRecord, Lines, Problem
from femend.model import ReducedModel

__all__ = ["Recovered", "in_time", "recover", "to_time", "without_ends"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# times the power expected from its neighbours from which a line stands out
STANDS_OUT = 9.0
# samples at each end of a record that ring
ENDS = 24


@dataclass(frozen=True, eq=False)
class Recovered:
    """Coordinates and forces against the motion (K, n_w) on the lines of every record, at `freq` (K,) Hz, and in time
    (n_w, n); `free` is the bare free force, where it is needed."""

    fit: Fit
    equivalent: Fit
    D: list[ComplexArray]
    F: list[ComplexArray]
    d: list[FloatArray]
    v: list[FloatArray]
    a: list[FloatArray]
    f: list[FloatArray]
    weight: list[FloatArray]
    records: list[FitRecord]
    index: list[NDArray[np.int64]]
    freq: list[FloatArray]
    free: list[FreeForce] = field(default_factory=list)

    @property
    def s(self) -> list[ComplexArray]:
        """i omega (K,) of the lines of every record."""
        return [np.asarray(2j * np.pi * f, dtype=np.complex128) for f in self.freq]


def recover(
    problem: Problem,
    joint: Joint,
    start: FloatArray,
    *,
    by_record: bool = False,
    sharp: bool = False,
    densely: bool = False,
) -> Recovered | None:
    """Reads off what the coordinate of an opened joint did.

    `start` are unknowns of the model; None where the opened model falls apart there. An equivalent spring and dashpot,
    the same in all records or one in each (`by_record`, for what depends on the level), give force, displacement and
    free decays; what the sensors still see beyond them goes to the force as far as they see the joint at all (Wiener
    form). A bare least-squares force would be noise where the joint is hardly seen, and could trade any free decay
    against itself near a resonance. With `sharp`, lines that stand out of their neighbours are not held to them: a
    force from outside may be harmonic. With `densely` the place is read on every line of the band, however few of them
    the problem is fitted on: lines left out leave a history that no record had, and laws that follow it sample by
    sample are led astray.
    """
    (fit,) = problem.fit([joint.hypothesis(None)], [(start, np.zeros(0))], iterations=8)
    if fit is None:
        return None
    seen = _seen(problem, joint, fit)
    free = [one.free for one in seen]
    equal = equivalent_linear(problem, joint, fit.p, free)
    if equal is None:
        return None
    out = Recovered(fit, equal, [], [], [], [], [], [], [], problem.records, [], [], free)
    if densely:
        problem = problem.thinned(None)
        seen = _seen(problem, joint, fit)
    out.index.extend(one.line.index for one in seen)
    out.freq.extend(one.line.freq for one in seen)
    for i, one in enumerate(seen):
        y, D, F_eq, misfit = _nearest_element(problem, joint, i, fit.p, equal, one.free if by_record else None)
        left = (one.line.Y - y) * one.line.weight
        # where the equivalent element explains little, the force is not known to be like its own
        more_than = misfit / max(float(fit.misfit[i]), 1e-12) if by_record else equal.score / max(fit.score, 1e-12)
        spread = _smooth(np.abs(F_eq) ** 2) * max(1.0, more_than)
        shown = np.einsum("ksw,ks->kw", one.weighted.conj(), left)
        gram = one.free.gram
        F = F_eq + _wiener(gram, shown, _standing_out(gram, shown, spread) if sharp else spread)
        out.D.append(D + np.einsum("kvw,kw->kv", one.free.C, F - F_eq))
        out.F.append(-F)
        out.weight.append(np.real(np.einsum("kww->kw", gram)))
        to_time(out, one.line, one.free.s)
    return out


@dataclass(frozen=True, eq=False)
class _Seen:
    """A record's lines, what forces of one at the joint do there to the weighted responses (K, n_out, n_w) beside what
    an unrecorded force could do as well, and what the free force does."""

    line: Lines
    weighted: ComplexArray
    free: FreeForce


def _seen(problem: Problem, joint: Joint, fit: Fit) -> list[_Seen]:
    """What the sensors see of the joint on every record, at the `fit` of a free force there."""
    omega, zeta, Q, own = problem.system(joint.reduced).modal(fit.p)
    w, n_w, out = joint.w @ Q, len(joint.w), list[_Seen]()
    fitted = problem.fitted_lines(fit.hypothesis, fit.p, fit.x)
    for line, (_, D, F) in zip(problem.lines(joint.reduced), fitted, strict=True):
        s, g, rows = on_lines(line, joint.reduced, omega, zeta, Q)
        moved = s[:, None, None] ** 2 * answers(rows, g, w, s, own) * line.weight[:, :, None]
        weighted = _beside_load(problem, line, joint.reduced, (s, g, rows), (Q, own), moved)
        C = answers(w, g, w, s, own) + np.diag(joint.compliance)
        if joint.held is not None:
            # a force of one moves the springs that hold the joint, whose force acts on the model too
            passed_on = np.linalg.inv(np.eye(n_w) - joint.held[:, None] * C)
            weighted, C = weighted @ passed_on, C @ passed_on
        gram = np.einsum("ksv,ksw->kvw", weighted.conj(), weighted)
        out.append(_Seen(line, weighted, FreeForce(s, D[:, :n_w], F[:, :n_w], C, gram)))
    return out


def _beside_load(
    problem: Problem,
    line: Lines,
    reduced: ReducedModel,
    modal: tuple[ComplexArray, ComplexArray, FloatArray],
    basis: tuple[FloatArray, FloatArray],
    weighted: ComplexArray,
) -> ComplexArray:
    """Weighted answers (K, n_out, n_w) without what an unrecorded force could do as well; `modal` as of `on_lines`,
    `basis` the modes and the dashpots over them."""
    if problem.load is None:
        return weighted
    (s, g, rows), (Q, own) = modal, basis
    load = problem.load.w(reduced.V, reduced.V_a) @ Q
    H = s[:, None, None] ** 2 * answers(rows, g, load, s, own) * line.weight[:, :, None]
    B = np.linalg.qr(H)[0]
    return np.asarray(weighted - B @ (B.conj().transpose(0, 2, 1) @ weighted))


def _wiener(gram: ComplexArray, shown: ComplexArray, spread: FloatArray) -> ComplexArray:
    """Forces (K, n_w) that the sensors show (K, n_w) with the information `gram` (K, n_w, n_w), of prior power `spread`
    (K, n_w)."""
    ridge = gram + np.eye(gram.shape[1])[None] / spread[:, None, :]
    return np.asarray(np.linalg.solve(ridge, shown[:, :, None])[:, :, 0])


def _standing_out(gram: ComplexArray, shown: ComplexArray, spread: FloatArray) -> FloatArray:
    """The prior power `spread` (K, n_w), raised to that of a bare least-squares force on lines where this explains far
    more than noise and a force of the prior's power would."""
    tiny = 1e-9 * np.maximum(np.real(np.einsum("kww->k", gram)), 1e-300) / gram.shape[1]
    bare = _wiener(gram, shown, 1 / tiny[:, None])
    explained = np.real(np.einsum("kw,kw->k", shown.conj(), bare))
    expected = gram.shape[1] + np.real(np.einsum("kww,kw->k", gram, spread))
    far = explained > STANDS_OUT * expected
    return np.where(far[:, None], np.maximum(np.abs(bare) ** 2, spread), spread)


def _nearest_element(
    problem: Problem, joint: Joint, i: int, p: FloatArray, equal: Fit, free: FreeForce | None
) -> tuple[ComplexArray, ComplexArray, ComplexArray, float]:
    """Responses, motion and force of a spring and dashpot at the joint on record i, and the misfit they leave: those of
    all records (`equal`), or, where the record's `free` force is given, those that explain the record by itself where
    they do better. What depends on the level is another element in each record: friction that sticks in one slips in
    the next."""
    line = problem.lines(joint.reduced)[i]
    several = free is not None and len(problem.records) > 1
    own = (
        equivalent_linear(problem.on([problem.records[i]]), joint, p, [free]) if several and free is not None else None
    )
    tried = []
    for one in (equal, own):
        if one is not None:
            ((y, D, F),) = problem.fitted_lines(one.hypothesis, p, one.x, [line])
            left = float(np.mean(np.abs((line.Y - y) * line.weight) ** 2))
            n_w = len(one.hypothesis.w)
            tried.append((y, D[:, :n_w], F[:, :n_w], left))
    return min(tried, key=lambda element: element[3])


def to_time(out: Recovered, line: Lines, s: ComplexArray) -> None:
    """Adds the histories of what `out` got last, on the lines `s` (K,) of a record."""
    D, F = out.D[-1], out.F[-1]
    if line.record.frf is not None:  # an FRF is not a motion; only linear laws, which need none, are tried on it
        for to in (out.d, out.v, out.a, out.f):
            to.append(np.zeros((D.shape[1], 0)))
        return
    for to, X in ((out.d, D), (out.v, s[:, None] * D), (out.a, s[:, None] ** 2 * D), (out.f, F)):
        to.append(in_time(X, line.index, line.record.n))


def in_time(X: ComplexArray, index: NDArray[np.int64], n: int) -> FloatArray:
    """History (n_w, n) of what has the transform `X` (K, n_w) on the lines of numbers `index` and nothing on others."""
    full = np.zeros((n // 2 + 1, X.shape[1]), dtype=complex)
    full[index] = X
    return np.asarray(np.fft.irfft(full, n=n, axis=0).T)


def without_ends(history: FloatArray, index: NDArray[np.int64]) -> tuple[FloatArray, ComplexArray]:
    """A `history` (n_w, n) that is let go to nothing over the ends of its record, and its lines of numbers `index`
    (K, n_w); a record of a few samples stays as it is.

    Free decays beside a force that is free on every line are told badly, and what is too much of them jumps where a
    record begins again at its end: a history of few lines rings there, by far beyond all that the place did. What is
    linear in the histories holds without the ends too, and so does what follows them sample by sample.
    """
    n = history.shape[1]
    if n >= 4 * ENDS:
        window = np.ones(n)
        window[:ENDS] = 0.5 - 0.5 * np.cos(np.pi * np.arange(ENDS) / ENDS)
        window[-ENDS:] = window[ENDS - 1 :: -1]
        history = history * window
    return history, np.asarray(np.fft.rfft(history, axis=1)[:, index].T)


def _smooth(power: FloatArray, width: int = 31) -> FloatArray:
    """Running mean over lines, never zero."""
    kernel = np.ones(width) / width
    padded = np.pad(power, ((width // 2, width // 2), (0, 0)), "reflect" if len(power) > width else "edge")
    mean = np.array([np.convolve(column, kernel, "valid") for column in padded.T]).T
    return np.asarray(np.maximum(mean, 1e-12 * max(float(mean.max()), 1e-300)))
