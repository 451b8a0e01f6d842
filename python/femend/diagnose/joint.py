"""What a place's coordinate did: displacement and force recovered from the recordings without any law."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femend import _core
from femend.estimate import Fit, Hypothesis, Problem
from femend.model import Place, ReducedModel, reduce_model

__all__ = ["Joint", "Recovered", "open_joint", "recover"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


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
        """The joint with linear laws, or with a free force."""
        return Hypothesis(self.reduced, self.w, laws, self.compliance, mean, sd)


def open_joint(place: Place, reduced: ReducedModel, f_max: float, g_rows: list[int]) -> Joint:
    """Opens a place in a basis that holds its own static response; `f_max` in Hz, `g_rows` as for `reduce_model`."""
    model = reduced.model
    T = model.transformation()
    if place.independent:
        loads = np.zeros((model.fe.n_a, place.n_w))
        for j, (rows, values) in enumerate(zip(place.g_rows, place.g_values, strict=True)):
            loads[rows, j] = values
    else:
        pattern = np.zeros((model.fe.n_g, place.n_w))
        for j, (rows, values) in enumerate(zip(place.g_rows, place.g_values, strict=True)):
            pattern[rows, j] = values
        loads = np.asarray(T.T @ pattern)
    own = reduce_model(model, f_max, g_rows, loads)
    B = place.w(own.V, own.V_a)
    if place.release is None:
        return Joint(place, own, B, np.zeros(place.n_w))
    # Cuts of one member end do not couple (axes of the section), so that S is diagonal and so is the compliance.
    inverse = 1 / np.diag(place.release)
    released = own.minus(B.T @ (inverse[:, None] * B), place.parameter)
    return Joint(place, released, inverse[:, None] * B, inverse)


@dataclass(frozen=True, eq=False)
class Recovered:
    """Coordinates (K, n_w) and forces against the motion (K, n_w) on the lines of every record, and in time (n_w, n)."""

    fit: Fit
    D: list[ComplexArray]
    F: list[ComplexArray]
    d: list[FloatArray]
    v: list[FloatArray]
    a: list[FloatArray]
    f: list[FloatArray]
    weight: list[FloatArray]


def recover(problem: Problem, joint: Joint, start: FloatArray) -> Recovered | None:
    """Fits the free force at an opened joint and reads off what its coordinate did."""
    (fit,) = problem.fit([joint.hypothesis(None)], [(start, np.zeros(0))], iterations=8)
    if fit is None:
        return None
    lines = problem.lines(joint.reduced)
    system = problem.system(joint.reduced)
    hypothesis = fit.hypothesis.core()
    fitted = _core.fitted_lines(system, hypothesis, [line.core for line in lines], fit.p, fit.x)
    omega, zeta, Q = _core_modal(system, fit.p)
    out = Recovered(fit, [], [], [], [], [], [], [])
    for line, (_, D, force) in zip(lines, fitted, strict=True):
        law = -force
        D = D - law * joint.compliance
        s = 2j * np.pi * line.freq
        rows = joint.reduced.rows(line.record.out_rows, line.record.out_signs) @ Q
        g = 1 / (omega**2 + s[:, None] ** 2 + 2 * (zeta * omega) * s[:, None])
        seen = np.einsum("kr,sr,wr->ksw", g * s[:, None] ** 2, rows, joint.w @ Q, optimize=True)
        out.D.append(D)
        out.F.append(law)
        out.weight.append((np.abs(seen) ** 2 * line.weight[:, :, None] ** 2).sum(axis=1))
        for to, X in ((out.d, D), (out.v, s[:, None] * D), (out.a, s[:, None] ** 2 * D), (out.f, law)):
            full = np.zeros((line.record.n // 2 + 1, X.shape[1]), dtype=complex)
            full[line.index] = X
            to.append(np.fft.irfft(full, n=line.record.n, axis=0).T)
    return out


def _core_modal(system: object, p: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    return system.modal(p)  # type: ignore[attr-defined,no-any-return]


def with_start(recovered: Recovered, fit: Fit) -> Recovered:
    """The same recovery with another fit's unknowns as the point to start from."""
    return replace(recovered, fit=fit)
