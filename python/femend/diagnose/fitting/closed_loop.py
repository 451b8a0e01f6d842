"""A nonlinear law at a joint: the whole model simulated from rest with the law closed around its coordinate.

The model is condensed to its modes; the measured force is interpolated within its band. A free linear stiffness and
damping stand beside the law, since the local stiffness of the model is not known better than the law itself.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from femend import _core
from femend.diagnose.fitting.candidates import Start
from femend.diagnose.fitting.condensed import Condensed
from femend.diagnose.locating.joint import Joint
from femend.diagnose.locating.recovered import Recovered
from femend.errors import ModelError
from femend.estimate import Problem
from femend.physics import FitCoordinates, Surrogate
from femend.threads import go_on

__all__ = [
    "COARSE",
    "FINE",
    "ClosedLoop",
    "History",
    "LawSpec",
    "Loop",
    "Modal",
    "companion_prior",
    "linear_spec",
    "loop_of",
    "squares",
    "upsampled",
]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
# omega (r,) in rad/s, zeta (r,), modes (r, r) in the basis, the model's own dashpots over the modes (n_d, r)
Modal = tuple[FloatArray, FloatArray, FloatArray, FloatArray]
# name and parameters of a law
LawSpec = tuple[str, dict[str, float]]

# steps of a sample in which the force is linear, while laws are sorted out and for what is kept; the loss of amplitude
# in the band is made good beforehand
COARSE, FINE = 4, 8
# samples that are filtered to one of a recording's, as its recorder did it: laws excite modes far above the band
RECORDER = 4
# samples by which a simulation goes on beyond a recording's end, where the filter's reach is no more than these
BEYOND = 12
# modes faster than this times a substep, or (while laws are sorted out) this times the band, follow their force
# statically: their compliance stays, their inertia does not
STATIC, STATIC_COARSE = 2.4, 3.0
# prior standard deviations: fit coordinates of a law (ln units), companion in units of the recovered force and motion
LAW_SD, COMPANION_SD = 3.0, 3.0
# a window exp(-sigma t) has ended where sigma t is this
WINDOW_END = 8.0
SHORTEST = 64


def upsampled(u: FloatArray, factor: int = FINE, beyond: int = 0) -> FloatArray:
    """Band-limited force `u` (n_in, n) at `factor` times the samples (n_in, (n + beyond)*factor), the last of which are
    how it dies away.

    It is raised by what linear interpolation between the new samples takes away.

    >>> upsampled(np.ones((1, 8))).shape
    (1, 64)
    """
    n = u.shape[1]
    U = np.fft.rfft(u, 2 * n, axis=1)
    f = np.arange(U.shape[1]) / (2 * n * factor)
    fine = np.fft.irfft(U / np.sinc(f) ** 2, 2 * n * factor, axis=1) * factor
    return np.ascontiguousarray(fine[:, : (n + min(beyond, n)) * factor])


@dataclass(frozen=True, eq=False)
class History:
    """A simulated record: accelerations y (n_out, n), coordinate d, its velocity v and the laws' force f (n_w, n)."""

    y: FloatArray
    d: FloatArray
    v: FloatArray
    f: FloatArray
    status: Any


@dataclass(frozen=True, eq=False)
class Loop(ABC):
    """Laws at an opened joint and the simulation with them.

    With `sigma` > 0 (1/s) records are windowed by exp(-sigma t) and simulated only as far as the window lets through.
    """

    problem: Problem
    joint: Joint
    substeps: int = field(default=FINE, kw_only=True)
    sigma: float = field(default=0.0, kw_only=True)

    @property
    @abstractmethod
    def n_x(self) -> int:
        """Number of fit coordinates."""

    @abstractmethod
    def laws(self, x: FloatArray) -> list[list[LawSpec]]:
        """Composite of every coordinate at fit coordinates `x`, as the core takes it."""

    @abstractmethod
    def prior(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Prior means and standard deviations of the fit coordinates for a fit that starts at `x`."""

    def stiffness(self, x: FloatArray, s: ComplexArray) -> ComplexArray:
        """Dynamic stiffness (K, n_w) at `s` (K,) of coordinates with nothing but linear laws at fit coordinates `x`
        (n_x,), NaN for the others."""
        return np.full((len(s), len(self.joint.w)), np.nan, dtype=np.complex128)

    def closing(self, x: FloatArray) -> list[list[LawSpec]]:
        """What is simulated at every coordinate, the joint's and then those of the model's own dashpots: its laws at
        fit coordinates `x` (n_x,), without the spring by which the model holds it, and the dashpots."""
        laws, held = self.laws(x), self.joint.held
        if held is not None:
            laws = [[*own, linear_spec(k=-float(k))] for own, k in zip(laws, held, strict=True)]
        return [*laws, *([linear_spec(c=1.0)] for _ in self.joint.reduced.dashpots.of)]

    def histories(self, points: Sequence[tuple[FloatArray, FloatArray]]) -> list[list[History]]:
        """What the simulation gives at each of `points` (p, x) and record."""
        system = self.problem.system(self.joint.reduced)
        modal = {p.tobytes(): system.modal(p) for p, _ in points}
        return self._simulated([modal[p.tobytes()] for p, _ in points], [x for _, x in points])

    def _simulated(self, sets: Sequence[Modal], laws_at: Sequence[FloatArray]) -> list[list[History]]:
        """Histories of models with the modes `sets`, each with the law at its fit coordinates."""
        go_on()
        made, held, n_w = self.condensed(sets), self.joint.held, len(self.joint.w)
        done = _core.simulate_batch(
            *made.modal, [self.closing(x) for x in laws_at], made.u, made.dt,
            stride=self.kept[0], decimate=self.kept[1], residual_compliance=made.residual,
        )  # fmt: skip
        return [
            [
                History(y + static, d, v, f if held is None else f + held[:, None] * d, status)
                for j, (*histories, status) in enumerate(records)
                for y, d, v, f in [[made.inside(j, x) for x in histories]]
                for static, d, v, f in [(made.static(i, f, j), d[:n_w], v[:n_w], f[:n_w])]
            ]
            for i, records in enumerate(done)
        ]

    @property
    def kept(self) -> tuple[int, int]:
        """Every how many substeps the core keeps one, and how many of these it filters to a sample."""
        filtered = RECORDER if self.problem.recorder.filters else 1
        return self.substeps // filtered, filtered

    def condensed(self, sets: Sequence[Modal]) -> Condensed:
        """The modes `sets` of as many models as a simulation takes them, those that move apart from those that follow
        statically."""
        first, reduced = self.problem.records[0], self.joint.reduced
        n = self._moving(sets[0][0])
        out_rows = reduced.rows(first.out_rows, first.out_signs)
        in_rows = reduced.rows(first.in_rows, first.in_signs)
        phi_in, phi_out = [[rows @ m[2] for m in sets] for rows in (in_rows, out_rows)]
        w = [np.vstack([self.joint.w @ m[2], m[3]]) for m in sets]
        behind = w[0][:, n:] / sets[0][0][n:]
        plain = [r.u[:, : self._samples(r.n, r.dt)] for r in self.problem.records]
        forces = [self._fine(i)[:, : (u.shape[1] + BEYOND) * self.substeps] for i, u in enumerate(plain)]
        step = first.dt / self.substeps

        def moving(rows: Sequence[FloatArray]) -> FloatArray:
            return np.array([x[..., :n] for x in rows])

        omega, zeta = moving([m[0] for m in sets]), moving([m[1] for m in sets])
        # A law's force is linear within a step, which takes (omega h)^2/12 of it away: g (1 + omega^2 h^2/12) - h^2/12
        # of each mode's receptance g is g but for the fourth power (as in the method of Fox and Goodwin 1949).
        # Accelerations come from the equations of motion: these hold what is lost of a law's force, and as much too
        # much of the measured one, which is raised beforehand (`upsampled`).
        made_good = np.sqrt(1 + (omega * step) ** 2 / 12)[:, None, :]
        lost = step**2 / 12
        gains = [y[:, n:] / m[0][n:] ** 2 for y, m in zip(phi_out, sets, strict=True)]
        return Condensed(
            (omega, zeta, moving(phi_in) / made_good, moving(phi_out) * made_good, moving(w) * made_good),
            [np.ascontiguousarray(f) for f in forces],
            step,
            np.diag(np.append(self.joint.compliance, np.zeros(len(behind) - len(self.joint.w))))
            + behind @ behind.T
            - lost * w[0][:, :n] @ w[0][:, :n].T,
            plain,
            first.dt,
            [g @ x[:, n:].T + lost * y[:, :n] @ x[:, :n].T for g, x, y in zip(gains, phi_in, phi_out, strict=True)],
            [g @ x[:, n:].T for g, x in zip(gains, w, strict=True)],
        )

    def _moving(self, omega: FloatArray) -> int:
        """How many modes (of rising omega) are stepped; the others follow statically."""
        limit = STATIC * self.substeps / self.problem.records[0].dt
        if self.substeps < FINE:
            limit = min(limit, STATIC_COARSE * 2 * np.pi * self.problem.band[1])
        return max(1, int((omega <= limit).sum()))

    def _fine(self, i: int) -> FloatArray:
        """Upsampled force of record i, made once."""
        record, factor = self.problem.records[i], self.substeps
        made: FloatArray = self.problem.kept(("upsampled", factor, i), lambda: upsampled(record.u, factor, BEYOND))
        return made

    def _samples(self, n: int, dt: float) -> int:
        """Samples of a record that the window lets through."""
        return n if self.sigma <= 0 else int(min(n, max(SHORTEST, np.ceil(WINDOW_END / (self.sigma * dt)))))

    def spectra(self, values: FloatArray, i: int) -> ComplexArray:
        """Windowed transform (K, rows) of a history's `values` (rows, n) on the lines of record i."""
        line = self.problem.lines(self.joint.reduced, self.sigma)[i]
        values = values[:, line.first :]
        window = np.exp(-self.sigma * line.record.dt * np.arange(values.shape[1]))
        return np.fft.rfft(values * window, line.n, axis=1)[:, line.index].T

    def residual_of(self, histories: Sequence[History]) -> FloatArray:
        """Weighted residual of all records, real and imaginary parts after each other."""
        parts = []
        for i, (line, history) in enumerate(
            zip(self.problem.lines(self.joint.reduced, self.sigma), histories, strict=True)
        ):
            e = line.left(line.Y - self.spectra(history.y, i)).ravel()
            parts += [e.real, e.imag]
        return np.concatenate(parts)

    def residuals(
        self, points: Sequence[tuple[FloatArray, FloatArray]]
    ) -> tuple[list[FloatArray], list[list[History]]]:
        """Weighted residual and histories at each of `points`; NaN and none where a simulation failed. Motion that goes
        beyond what numbers hold leaves a residual that is not finite, whose `squares` nobody takes."""
        modal = {p.tobytes(): self._modes(p) for p, _ in points}
        possible = [
            (i, x, modes)
            for i, (p, x) in enumerate(points)
            if (modes := modal[p.tobytes()]) is not None and self._exists(x)
        ]
        out = [np.full(2 * self.size(), np.nan) for _ in points]
        kept: list[list[History]] = [[] for _ in points]
        with np.errstate(over="ignore", invalid="ignore"):
            simulated = self._simulated([m for *_, m in possible], [x for _, x, _ in possible]) if possible else []
            for (i, *_), histories in zip(possible, simulated, strict=True):
                out[i], kept[i] = self.residual_of(histories), histories
        return out, kept

    def _exists(self, x: FloatArray) -> bool:
        """Whether the laws have finite parameters there; a step may go beyond what numbers can hold."""
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            laws = self.laws(x)
        numbers = [v for composite in laws for _, values in composite for v in values.values()]
        return all(v == 0 or (np.isfinite(v) and 1e-200 < abs(v) < 1e60) for v in numbers)

    def _modes(self, p: FloatArray) -> Modal | None:
        """Modes of the model at p; None where it has none: a step may go beyond what its members and masses can differ
        by."""
        try:
            modes: Modal = self.problem.system(self.joint.reduced).modal(p)
        except ModelError:
            return None
        return modes

    def size(self) -> int:
        """Number of complex values of the residual."""
        return int(sum(line.Y.size for line in self.problem.lines(self.joint.reduced, self.sigma)))

    def at(self, sigma: float) -> Self:
        """The same with another window."""
        return replace(self, sigma=sigma)


def squares(e: FloatArray) -> float:
    """Sum of squares of a residual `e` (n,); infinite where it, or its squares, are beyond what numbers hold.

    >>> squares(np.array([3.0, 4.0])), squares(np.array([1.0, np.nan])), squares(np.array([1e200]))
    (25.0, inf, inf)
    """
    with np.errstate(over="ignore", invalid="ignore"):
        value = float(e @ e)
    return value if np.isfinite(value) else np.inf


def linear_spec(k: float = 0.0, c: float = 0.0) -> LawSpec:
    """A spring and dashpot as the core takes them."""
    return "linear", {"k": k, "c": c, "m": 0.0}


@dataclass(frozen=True, eq=False)
class ClosedLoop(Loop):
    """A law with its linear companion at a joint; `scale` (k, c) makes the companion's coordinates of the size one."""

    law: str
    coordinates: FitCoordinates | Surrogate
    scale: tuple[float, float]

    @property
    def n_x(self) -> int:
        """Number of fit coordinates: the law's free ones and the companion's two."""
        return len(self.coordinates.free) + 2

    def values(self, x: FloatArray) -> tuple[dict[str, float], float, float]:
        """Law parameters, companion k and c at fit coordinates x."""
        n = len(self.coordinates.free)
        return self.coordinates.parameters(x[:n]), float(x[n] * self.scale[0]), float(x[n + 1] * self.scale[1])

    def laws(self, x: FloatArray) -> list[list[LawSpec]]:
        """Composite of every coordinate at fit coordinates `x`, as the core takes it."""
        values, k, c = self.values(x)
        return [[*self.coordinates.composite(values), linear_spec(k, c)] for _ in range(len(self.joint.w))]

    def prior(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Around `x` for the law, around nothing for the companion."""
        return companion_prior(x)


def companion_prior(x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Prior of a law's coordinates `x` (n_x,) with the two of a companion at their end."""
    n = len(x) - 2
    mean = np.concatenate([x[:n], np.zeros(2)])
    return mean, np.concatenate([np.full(n, LAW_SD), np.full(2, COMPANION_SD)])


def loop_of(problem: Problem, joint: Joint, start: Start, recovered: Recovered) -> tuple[ClosedLoop, FloatArray]:
    """The closed loop of a law with the fit coordinates of its start."""
    coordinates = FitCoordinates(start.physics, start.values)
    force = np.sqrt(np.mean([np.mean(f**2) for f in recovered.f]))
    motion = np.sqrt(np.mean([np.mean(d**2) for d in recovered.d]))
    speed = np.sqrt(np.mean([np.mean(v**2) for v in recovered.v]))
    scale = (float(force / motion), float(force / speed))
    loop = ClosedLoop(problem, joint, start.physics.law or start.physics.name, coordinates, scale)
    x = np.concatenate([coordinates.start(), [start.k / scale[0], start.c / scale[1]]])
    return loop, x
