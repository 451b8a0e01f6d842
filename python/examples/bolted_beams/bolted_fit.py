"""Fits of the bolted beams' joint to a measured backbone: contact stiffness, damping of all else, and laws."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from bolted_model import MICROSLIP, Backbone, Beams, ComplexArray, FloatArray, Table
from scipy.optimize import least_squares, lsq_linear

from femend.errors import LawParameterError
from femend.physics import FitCoordinates, Physics, Shape, shapes

# amplitudes that are taken from each block of the recording; in a standard deviation they count as one
EACH = 3
# starts that are fitted, out of shapes and shares of the law that first-order perturbation suggests
STARTS, SHARES = 2, (1.0, 0.4, 0.15)


@dataclass(frozen=True, eq=False)
class Term:
    """A law at all patches in one direction."""

    physics: Physics
    direction: str

    def __str__(self) -> str:
        return f"{self.physics.name}, {self.direction}"


@dataclass(frozen=True, eq=False)
class Fit:
    """A joint: normal stiffness k (Pa/m) of the contact, damping ratio zeta0 of all else, laws with values and sd."""

    terms: tuple[Term, ...]
    values: tuple[Mapping[str, float], ...]
    k: float
    zeta0: float
    left: float
    sd: tuple[Mapping[str, float], ...]
    k_sd: float

    @property
    def size(self) -> int:
        """Parameters of the laws."""
        return sum(p.domain != "choice" for term in self.terms for p in term.physics.parameters)

    def __str__(self) -> str:
        return " + ".join(str(term) for term in self.terms) or "linear"


def started(law: Physics, top: float, omega: float) -> list[Shape]:
    """Shapes of a law up to the amplitude `top`; microslip starts with reaches on both sides of it."""
    if law is not MICROSLIP:
        return shapes(law, amplitude=top, band=(omega / 1.1, omega * 1.1))
    grid = [{"k": 1.0, "reach": reach * top, "power": power} for reach in (0.5, 1.5, 5.0) for power in (1.3, 2.0)]
    return [Shape(law, (values,), (("k",),)) for values in grid]


class Study:
    """Fits of joints to a `measured` backbone, for amplitudes up to `reach` (kg^0.5 m)."""

    def __init__(self, beams: Beams, measured: Backbone, reach: float) -> None:
        self.beams, self.measured, self.reach = beams, measured, reach
        self.omega = float(measured.omega.mean())
        self.k, self.phi = self._linear()
        self.lam = self._bending(self.k)[0]

    def _linear(self) -> tuple[float, FloatArray]:
        """The contact stiffness at which a linear joint has the mean frequency, and the shape there.

        The mode is the lowest in which the faces open most, the first that bends both beams.
        """
        grid = np.geomspace(1e9, 1e12, 61)
        lowest = [self._bending(k)[0] for k in grid]
        k = float(np.exp(np.interp(self.omega, np.sqrt(lowest), np.log(grid))))
        for _ in range(3):
            lam, phi = self._bending(k)
            slope = self._slope(phi)
            k += (self.omega**2 - lam) / slope
        return k, self._bending(k)[1]

    def _bending(self, k: float) -> tuple[float, FloatArray]:
        lam, phi = self.beams.modes(k)
        return float(lam[0]), phi[:, 0]

    def _slope(self, phi: FloatArray) -> float:
        """Derivative of lambda over the contact stiffness."""
        return float(((self.beams.T.T @ phi) ** 2) @ (self.beams.area * self.beams.share))

    def top(self, term: Term) -> float:
        """Largest displacement amplitude (m) of a patch in the term's direction."""
        d = np.abs(self.phi @ self.beams.T[:, self.beams.columns(term.direction)])
        return float(self.reach * d.max())

    def starts(self, term: Term, fixed: ComplexArray) -> list[tuple[dict[str, float], float]]:
        """Values of the shapes that follow the backbone best by first-order perturbation, each with the contact
        stiffness beside it; `fixed` (n,) is what other laws add to lambda. Empty where the law has no say."""
        lam = self.measured.omega**2 * (1 + 2j * self.measured.zeta) - fixed
        unit = np.ones(len(lam))
        found: list[tuple[float, Shape, FloatArray, float]] = []
        for shape in started(term.physics, self.top(term), self.omega):
            parts = [self._first_order(term, values) for values in shape.terms]
            columns = np.array([unit + 0j, 1j * unit, *parts])
            A = np.hstack([columns.real, columns.imag]).T
            scale = np.linalg.norm(A, axis=0)
            if not (np.isfinite(scale).all() and (scale > 0).all()):
                continue
            low = [-np.inf, 0.0, *[-np.inf if term.physics.signed else 0.0] * len(parts)]
            solved = lsq_linear(A / scale, np.hstack([lam.real, lam.imag]), bounds=(low, np.inf), method="bvls")
            factors = np.maximum(solved.x[2:], low[2:]) / scale[2:]  # round-off may leave one below its bound
            if (factors != 0).any():
                found.append((solved.cost, shape, factors, solved.x[0] / scale[0] - self.lam))
        found.sort(key=lambda item: item[0])
        return [
            (
                shape.values((share * factors).tolist()),
                max(self.k + share * shift / self._slope(self.phi), 0.1 * self.k),
            )
            for _, shape, factors, shift in found[:STARTS]
            for share in SHARES
        ]

    def _first_order(self, term: Term, values: Mapping[str, float]) -> ComplexArray:
        """What a law adds to lambda (n,) while the shape stays."""
        d = np.abs(self.phi @ self.beams.T[:, self.beams.columns(term.direction)])
        table = Table(term.physics, values, 2 * self.top(term), self.omega)
        return (table(self.measured.Q[:, None] * d) * d**2).sum(axis=1)

    def predicted(
        self, terms: Sequence[Term], values: Sequence[Mapping[str, float]], k: float, Q: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """omega and zeta (each (n,)) of the joint at amplitudes Q, without the damping of all else."""
        laws = [
            (self.beams.columns(t.direction), Table(t.physics, v, 4 * self.top(t), self.omega))
            for t, v in zip(terms, values, strict=True)
        ]
        return self.beams.backbone(k, laws, Q, self.phi)

    def fit(self, terms: Sequence[Term], before: Fit | None = None, *, damping: bool = True) -> Fit | None:
        """The joint with these laws, the last of them new beside the fit `before`; None where it has no say.

        Without `damping` the frequency alone is fitted.
        """
        given: tuple[Mapping[str, float], ...] = () if before is None else before.values
        if len(terms) == len(given):
            begun = [(given, self.k)]
        else:
            fixed = np.zeros(len(self.measured.Q), dtype=complex)
            for term, values in zip(terms, given, strict=False):
                fixed += self._first_order(term, values)
            begun = [((*given, values), k) for values, k in self.starts(terms[-1], fixed)]
        tries = [Descent(self, terms, values, k, damping) for values, k in begun]
        tries.sort(key=lambda one: one.cost(one.x0))
        fits = [one.solved() for one in tries[:STARTS]]
        return min(fits, key=lambda fit: fit.left, default=None)

    def backbone(self, fit: Fit, Q: FloatArray) -> Backbone:
        """The fitted joint at amplitudes Q."""
        omega, zeta = self.predicted(fit.terms, fit.values, fit.k, Q)
        return Backbone(Q, omega, zeta + fit.zeta0)


class Descent:
    """Least squares from one start over the logarithm of the contact stiffness and the coordinates of the laws."""

    def __init__(
        self, study: Study, terms: Sequence[Term], values: Sequence[Mapping[str, float]], k: float, damping: bool
    ) -> None:
        self.study, self.terms, self.damping = study, tuple(terms), damping
        self.maps = [FitCoordinates(t.physics, v) for t, v in zip(terms, values, strict=True)]
        self.ends = np.cumsum([1, *[len(m.free) for m in self.maps]])
        self.x0 = np.concatenate([[np.log(k)], *[m.start() for m in self.maps]])

    def joint(self, x: FloatArray) -> tuple[float, tuple[dict[str, float], ...]]:
        """Contact stiffness and values of the laws."""
        parts = np.split(x, self.ends)[1:-1]
        return float(np.exp(x[0])), tuple(m.parameters(p) for m, p in zip(self.maps, parts, strict=True))

    def residual(self, x: FloatArray) -> FloatArray:
        """Relative errors of the poles, the damping of all else put at its best value."""
        k, values = self.joint(x)
        m = self.study.measured
        try:
            omega, zeta = self.study.predicted(self.terms, values, k, m.Q)
        except LawParameterError:  # a step to where the law is none
            return np.ones(len(m.Q) * (1 + self.damping))
        left = zeta - m.zeta + max(float(np.mean(m.zeta - zeta)), 0.0)
        out = np.concatenate([omega / m.omega - 1, left] if self.damping else [omega / m.omega - 1])
        return np.clip(np.nan_to_num(out, nan=1.0), -1.0, 1.0)

    def cost(self, x: FloatArray) -> float:
        """Sum of squares."""
        e = self.residual(x)
        return float(e @ e)

    def solved(self) -> Fit:
        """The fit this start leads to."""
        found = least_squares(self.residual, self.x0, bounds=(self.x0 - 4, self.x0 + 4), max_nfev=40, x_scale="jac")
        k, values = self.joint(found.x)
        m = self.study.measured
        zeta0 = max(float(np.mean(m.zeta - self.study.predicted(self.terms, values, k, m.Q)[1])), 0.0)
        k_sd, sd = self._sd(found)
        return Fit(self.terms, values, k, zeta0, float(np.sqrt(found.fun @ found.fun / len(m.Q))), sd, k_sd)

    def _sd(self, found: Any) -> tuple[float, tuple[dict[str, float], ...]]:
        """Standard deviations by linearisation; the amplitudes of a block count as one."""
        freedom = len(found.fun) - len(found.x)
        covariance = np.linalg.pinv(found.jac.T @ found.jac) * EACH * (found.fun @ found.fun) / freedom
        out = []
        for m, part, start in zip(self.maps, np.split(found.x, self.ends)[1:-1], self.ends, strict=False):
            at = slice(start, start + len(part))
            J = m.jacobian(part)
            variance = np.maximum(np.diag(J @ covariance[at, at] @ J.T), 0.0)
            out.append(dict(zip(m.physics.parameter_names, np.sqrt(variance).tolist(), strict=True)))
        return float(np.exp(found.x[0]) * np.sqrt(covariance[0, 0])), tuple(out)
