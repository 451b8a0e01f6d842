"""What a place's coordinate did: displacement and force recovered from the recordings without any law."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.dressed import dressed
from femend.diagnose.receptances import on_lines
from femend.errors import ModelError
from femend.estimate import Fit, FitRecord, Hypothesis, Lines, Problem
from femend.model import Place, ReducedModel, reduce_model
from femend.model.reduction import LARGE, extend_model

__all__ = [
    "FEW_LINES",
    "Joint",
    "Recovered",
    "enlarged",
    "equivalent_linear",
    "in_time",
    "middle",
    "open_joint",
    "open_joints",
    "recover",
    "stiffness_scale",
    "to_time",
]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# lines a record on which the equivalent spring and dashpot of a place are fitted
FEW_LINES = 120
# times the power expected from its neighbours from which a line stands out
STANDS_OUT = 9.0


@dataclass(frozen=True, eq=False)
class Joint:
    """A place opened for a law: the reduced model without the rigid connection (of a cut), `w` (n_w, r) the coordinates
    d = w q, and the compliance (n_w,) in series with them."""

    place: Place
    reduced: ReducedModel
    w: FloatArray
    compliance: FloatArray

    def hypothesis(
        self, laws: tuple[str, ...] | None, mean: FloatArray | None = None, sd: FloatArray | None = None
    ) -> Hypothesis:
        """The joint with linear laws (`mean`, `sd`: prior of the logarithms of their parameters), or with a free
        force."""
        return Hypothesis(self.reduced, self.w, laws, self.compliance, mean, sd)


def open_joint(place: Place, reduced: ReducedModel, f_max: float, g_rows: list[int]) -> Joint:
    """Opens a place in a basis that holds its own static response; `f_max` in Hz, `g_rows` as for `reduce_model`."""
    return open_joints([place], reduced, f_max, g_rows)


def open_joints(places: Sequence[Place], reduced: ReducedModel, f_max: float, g_rows: list[int]) -> Joint:
    """Opens several places at once: their coordinates after each other, named by the first of them.

    Cuts must not be of one element: its ends would couple.
    """
    own = enlarged(places, reduced, f_max, g_rows)
    rows, compliances = [np.zeros((0, own.r))], [np.zeros(0)]
    for place in places:
        B = place.w(own.V, own.V_a)
        if place.release is None:
            rows.append(B)
            compliances.append(np.zeros(place.n_w))
            continue
        # Cuts of one member end do not couple (axes of the section), so that S is diagonal and so is the compliance.
        inverse = 1 / np.diag(place.release)
        taken = B.T @ (inverse[:, None] * B)
        own = own.minus(taken, place.parameter)
        own = own if own.form is None else own.form.cut(own, place.elements[0], taken)
        rows.append(inverse[:, None] * B)
        compliances.append(inverse)
    return Joint(places[0], own, np.vstack(rows), np.concatenate(compliances))


def enlarged(places: Sequence[Place], reduced: ReducedModel, f_max: float, g_rows: list[int]) -> ReducedModel:
    """The model in a basis that holds the static response to forces at `places` too."""
    model = reduced.model
    T = model.transformation()
    loads = [np.zeros((model.fe.n_a, 0))]
    for place in places:
        pattern = np.zeros((model.fe.n_a if place.independent else model.fe.n_g, place.n_w))
        for j, (rows, values) in enumerate(zip(place.g_rows, place.g_values, strict=True)):
            pattern[rows, j] = values
        loads.append(pattern if place.independent else np.asarray(T.T @ pattern))
    if model.fe.n_a >= LARGE and not (reduced.extra or reduced.attached):
        return dressed(extend_model(reduced.bare(), np.hstack(loads)), reduced)
    return dressed(reduce_model(model, f_max, g_rows, np.hstack(loads)), reduced)


@dataclass(frozen=True, eq=False)
class Recovered:
    """Coordinates and forces against the motion (K, n_w) on the lines of every record, at `freq` (K,) Hz, and in time
    (n_w, n)."""

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

    @property
    def s(self) -> list[ComplexArray]:
        """i omega (K,) of the lines of every record."""
        return [np.asarray(2j * np.pi * f, dtype=np.complex128) for f in self.freq]


def recover(
    problem: Problem, joint: Joint, start: FloatArray, *, by_record: bool = False, sharp: bool = False
) -> Recovered | None:
    """Reads off what the coordinate of an opened joint did.

    `start` are unknowns of the model; None where the opened model falls apart there. An equivalent spring and dashpot,
    the same in all records or one in each (`by_record`, for what depends on the level), give force, displacement and
    free decays; what the sensors still see beyond them goes to the force as far as they see the joint at all (Wiener
    form). A bare least-squares force would be noise where the joint is hardly seen, and could trade any free decay
    against itself near a resonance. With `sharp`, lines that stand out of their neighbours are not held to them: a
    force from outside may be harmonic.
    """
    (fit,) = problem.fit([joint.hypothesis(None)], [(start, np.zeros(0))], iterations=8)
    if fit is None:
        return None
    lines = problem.lines(joint.reduced)
    system = problem.system(joint.reduced)
    equal = equivalent_linear(problem, joint, fit.p)
    if equal is None:
        return None
    omega, zeta, Q = system.modal(fit.p)
    out = Recovered(fit, equal, [], [], [], [], [], [], [], problem.records, [], [])
    out.index.extend(line.index for line in lines)
    out.freq.extend(line.freq for line in lines)
    for i, line in enumerate(lines):
        y, D, F_eq, misfit = _nearest_element(problem, joint, i, fit.p, equal, by_record)
        s, g, rows = on_lines(line, joint.reduced, omega, zeta, Q)
        w = joint.w @ Q
        seen = np.einsum("kr,sr,wr->ksw", g * s[:, None] ** 2, rows, w, optimize=True)
        weighted = _beside_load(problem, line, joint.reduced, (s, g, rows), Q, seen * line.weight[:, :, None])
        left = (line.Y - y) * line.weight
        gram = np.einsum("ksv,ksw->kvw", weighted.conj(), weighted)
        # where the equivalent element explains little, the force is not known to be like its own
        more_than = misfit / max(float(fit.misfit[i]), 1e-12) if by_record else equal.score / max(fit.score, 1e-12)
        spread = _smooth(np.abs(F_eq) ** 2) * max(1.0, more_than)
        shown = np.einsum("ksw,ks->kw", weighted.conj(), left)
        F = F_eq + _wiener(gram, shown, _standing_out(gram, shown, spread) if sharp else spread)
        weight = np.real(np.einsum("kww->kw", gram))
        c = np.einsum("kr,vr,wr->kvw", g, w, w, optimize=True)
        D = D - F_eq * joint.compliance + np.einsum("kvw,kw->kv", c, F - F_eq)
        out.D.append(D + F * joint.compliance)
        out.F.append(-F)
        out.weight.append(weight)
        to_time(out, line, s)
    return out


def _beside_load(
    problem: Problem,
    line: Lines,
    reduced: ReducedModel,
    modal: tuple[ComplexArray, ComplexArray, FloatArray],
    Q: FloatArray,
    weighted: ComplexArray,
) -> ComplexArray:
    """Weighted answers (K, n_out, n_w) without what an unrecorded force could do as well; `modal` as of `on_lines`."""
    if problem.load is None:
        return weighted
    s, g, rows = modal
    load = problem.load.w(reduced.V, reduced.V_a) @ Q
    H = np.einsum("kr,sr,wr->ksw", g * s[:, None] ** 2, rows, load, optimize=True) * line.weight[:, :, None]
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
    problem: Problem, joint: Joint, i: int, p: FloatArray, equal: Fit, by_record: bool
) -> tuple[ComplexArray, ComplexArray, ComplexArray, float]:
    """Responses, motion and force of a spring and dashpot at the joint on record i, and the misfit they leave: those of
    all records (`equal`), or `by_record` those that explain the record by itself where they do better. What depends on
    the level is another element in each record: friction that sticks in one slips in the next."""
    line = problem.lines(joint.reduced)[i]
    several = by_record and len(problem.records) > 1
    own = equivalent_linear(problem.on([problem.records[i]]), joint, p) if several else None
    found = []
    for one in (equal, own):
        if one is not None:
            ((y, D, F),) = problem.fitted_lines(one.hypothesis, p, one.x, [line])
            left = float(np.mean(np.abs((line.Y - y) * line.weight) ** 2))
            n_w = len(one.hypothesis.w)
            found.append((y, D[:, :n_w], F[:, :n_w], left))
    return min(found, key=lambda element: element[3])


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


def _smooth(power: FloatArray, width: int = 31) -> FloatArray:
    """Running mean over lines, never zero."""
    kernel = np.ones(width) / width
    padded = np.pad(power, ((width // 2, width // 2), (0, 0)), "reflect" if len(power) > width else "edge")
    mean = np.array([np.convolve(column, kernel, "valid") for column in padded.T]).T
    return np.asarray(np.maximum(mean, 1e-12 * max(float(mean.max()), 1e-300)))


def stiffness_scale(problem: Problem, joint: Joint) -> tuple[float, float]:
    """Stiffness (deck units) that a term at the joint has to have to matter, and a circular frequency of the band."""
    if joint.place.support:
        return joint.place.support, middle(problem)
    if joint.place.release is not None:
        return float(np.mean(np.diag(joint.place.release))), middle(problem)
    system = problem.system(joint.reduced)
    try:
        omega, _, Q = system.modal(problem.prior(joint.reduced)[0])
    except ModelError:
        return np.inf, middle(problem)  # what was added before leaves no mass at the prior means
    w = joint.w @ Q
    low = 2 * np.pi * problem.band[0]
    compliance = (w**2 / np.maximum(omega**2, low**2)).sum(axis=1)
    mean = float(np.mean(compliance))
    # what does not move is stiffer than anything
    return 1 / mean if mean > 0 else np.inf, middle(problem)


def middle(problem: Problem) -> float:
    """Geometric middle of the band, rad/s."""
    return float(2 * np.pi * np.sqrt(problem.band[0] * problem.band[1]))


def equivalent_linear(problem: Problem, joint: Joint, p: FloatArray) -> Fit | None:
    """The spring or mass with a dashpot that explains the records best, from a few sizes and unknowns `p` (n_p,) of the
    model; None where nothing moves."""
    scale, omega = stiffness_scale(problem, joint)
    if not np.isfinite(scale):
        return None
    sizes = (0.02, 0.2, 2.0)
    families = (("support_stiffness", 1.0), ("added_mass", omega**-2))
    starts = [
        ((law, "viscous_damper"), np.log([f * scale * unit, 0.03 * f * scale / omega]))
        for law, unit in families
        for f in sizes
        if law == "support_stiffness" or joint.place.release is None
    ]
    few = problem.sparing(FEW_LINES)
    tries = few.fit(
        [joint.hypothesis(laws, m, np.full(2, 4.0)) for laws, m in starts], [(p, m) for _, m in starts], iterations=10
    )
    done = [t for t in tries if t is not None]
    return min(done, key=lambda t: t.cost) if done else None
