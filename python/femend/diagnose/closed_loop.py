"""Nonlinear laws at a joint: the whole model simulated from rest with the law closed around its coordinate.

The model is condensed to its modes; the measured force is interpolated within its band. A free linear stiffness and
damping stand beside the law, since the local stiffness of the model is not known better than the law itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend import _core
from femend.diagnose.candidates import Candidate, Start
from femend.diagnose.joint import Joint, Recovered
from femend.estimate import FitRecord, Problem
from femend.estimate.lines import TEMPERING
from femend.physics import FitCoordinates

__all__ = ["ClosedLoop", "fit_nonlinear", "judge_nonlinear", "refit_nonlinear"]

FloatArray = NDArray[np.float64]

# steps of a sample in which the force is linear; its loss of amplitude in the band is made good beforehand
UPSAMPLING = 8
# modes faster than this times a substep follow their force statically in the core and give no acceleration there
STATIC = 2.4
# prior standard deviations: fit coordinates of the law (ln units), companion in units of the recovered force and motion
LAW_SD, COMPANION_SD = 3.0, 3.0
DIFFERENCE = 1e-4
# steps of every start, starts that are followed, their further steps, and steps with all unknowns
FEW, FOLLOWED, FIRST, JOINT = 5, 4, 5, 8
# decays of the windows, in units of `Problem.scale`, before the whole records
WINDOWS = (10.0, 3.0, 1.0)


def upsampled(u: FloatArray, factor: int = UPSAMPLING) -> FloatArray:
    """Band-limited force (n_in, n*factor), raised by what linear interpolation between the new samples takes away.

    >>> upsampled(np.ones((1, 8))).shape
    (1, 64)
    """
    n = u.shape[1]
    U = np.fft.rfft(u, 2 * n, axis=1)
    f = np.arange(U.shape[1]) / (2 * n * factor)
    fine = np.fft.irfft(U / np.sinc(f) ** 2, 2 * n * factor, axis=1) * factor
    return np.ascontiguousarray(fine[:, : n * factor])


@dataclass(frozen=True, eq=False)
class ClosedLoop:
    """A law with its linear companion at a joint; `scale` (k, c) makes the companion's coordinates of the size one."""

    problem: Problem
    joint: Joint
    law: str
    coordinates: FitCoordinates
    scale: tuple[float, float]
    forces: list[FloatArray]
    plain: list[FloatArray]
    sigma: float = 0.0

    @property
    def n_x(self) -> int:
        """Number of fit coordinates: the law's free ones and the companion's two."""
        return len(self.coordinates.free) + 2

    def values(self, x: FloatArray) -> tuple[dict[str, float], float, float]:
        """Law parameters, companion k and c at fit coordinates x."""
        n = len(self.coordinates.free)
        return self.coordinates.parameters(x[:n]), float(x[n] * self.scale[0]), float(x[n + 1] * self.scale[1])

    def laws(self, x: FloatArray) -> list[list[tuple[str, dict[str, float]]]]:
        """Composite of every coordinate at fit coordinates `x`, as the core takes it."""
        values, k, c = self.values(x)
        linear = ("linear", {"k": k, "c": c, "m": 0.0})
        return [[(self.law, values), linear] for _ in range(len(self.joint.w))]

    def respond(self, points: Sequence[tuple[FloatArray, FloatArray]]) -> list[list[FloatArray]]:
        """Accelerations [point][record] (n_out, n) at `points` (p, x)."""
        return [[history[0] for history in records] for records in self.histories(points)]

    def histories(self, points: Sequence[tuple[FloatArray, FloatArray]]) -> list[list]:
        """What the simulation gives at each of `points` (p, x) and record: y, d, v, f, status."""
        system = self.problem.system(self.joint.reduced)
        first = self.problem.records[0]
        modal = {p.tobytes(): system.modal(p) for p, _ in points}
        sets = [modal[p.tobytes()] for p, _ in points]
        reduced = self.joint.reduced
        out_rows = reduced.rows(first.out_rows, first.out_signs)
        in_rows = reduced.rows(first.in_rows, first.in_signs)
        phi_out, phi_in = [out_rows @ m[2] for m in sets], [in_rows @ m[2] for m in sets]
        w = [self.joint.w @ m[2] for m in sets]
        done = _core.simulate_batch(
            np.array([m[0] for m in sets]),
            np.array([m[1] for m in sets]),
            np.array(phi_in),
            np.array(phi_out),
            np.array(w),
            [self.laws(x) for _, x in points],
            self.forces,
            first.dt / UPSAMPLING,
            stride=UPSAMPLING,
            residual_compliance=np.diag(self.joint.compliance),
        )
        out = []
        for i, (omega, _, _) in enumerate(sets):
            fast = omega * first.dt / UPSAMPLING > STATIC
            gain = phi_out[i][:, fast] / omega[fast] ** 2
            from_u, from_f = gain @ phi_in[i][:, fast].T, gain @ w[i][:, fast].T
            out.append(
                [self._with_static(h, u, from_u, from_f, first.dt) for h, u in zip(done[i], self.plain, strict=True)]
            )
        return out

    def _with_static(
        self, history: Sequence[Any], u: FloatArray, from_u: FloatArray, from_f: FloatArray, dt: float
    ) -> tuple:
        """Adds the accelerations of modes that follow their force statically: second derivatives of the forces."""
        y, d, v, f, status = history
        n = y.shape[1]
        omega = 2 * np.pi * np.fft.rfftfreq(n, dt)
        drive = from_u @ np.fft.rfft(u, axis=1) - from_f @ np.fft.rfft(f, axis=1)
        return y + np.fft.irfft(-(omega**2) * drive, n, axis=1), d, v, f, status

    def residuals(self, points: Sequence[tuple[FloatArray, FloatArray]]) -> list[FloatArray]:
        """Weighted residual of all records (real and imaginary parts) at each of `points`; NaN where a simulation
        failed."""
        lines = self.problem.lines(self.joint.reduced, self.sigma)
        possible = [i for i, (_, x) in enumerate(points) if self._exists(x)]
        out = [np.full(2 * self.size(), np.nan) for _ in points]
        responses_of = self.respond([points[i] for i in possible]) if possible else []
        for i, responses in zip(possible, responses_of, strict=True):
            parts = []
            for line, y in zip(lines, responses, strict=True):
                window = np.exp(-self.sigma * line.record.dt * np.arange(y.shape[1]))
                Y = np.fft.rfft(y * window, axis=1)[:, line.index].T
                e = ((line.Y - Y) * line.weight).ravel()
                parts += [e.real, e.imag]
            out[i] = np.concatenate(parts)
        return out

    def _exists(self, x: FloatArray) -> bool:
        """Whether the law has finite parameters there; a step may go beyond what numbers can hold."""
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            values, k, c = self.values(x)
        numbers = [*values.values(), k, c]
        return all(np.isfinite(v) and abs(v) < 1e60 for v in numbers)

    def size(self) -> int:
        """Number of complex values of the residual."""
        return int(sum(line.Y.size for line in self.problem.lines(self.joint.reduced, self.sigma)))


def loop_of(problem: Problem, joint: Joint, start: Start, recovered: Recovered) -> tuple[ClosedLoop, FloatArray]:
    """The closed loop of a law with the fit coordinates of its start."""
    coordinates = FitCoordinates(start.physics, start.values)
    force = np.sqrt(np.mean([np.mean(f**2) for f in recovered.f]))
    motion = np.sqrt(np.mean([np.mean(d**2) for d in recovered.d]))
    speed = np.sqrt(np.mean([np.mean(v**2) for v in recovered.v]))
    scale = (float(force / motion), float(force / speed))
    loop = ClosedLoop(
        problem,
        joint,
        start.physics.law or start.physics.name,
        coordinates,
        scale,
        [upsampled(r.u) for r in problem.records],
        [r.u for r in problem.records],
    )
    x = np.concatenate([coordinates.start(), [start.k / scale[0], start.c / scale[1]]])
    return loop, x


@dataclass(eq=False)
class _Descent:
    """Levenberg-Marquardt over some of the unknowns (p, x) of a closed loop."""

    loop: ClosedLoop
    mean: FloatArray
    sd: FloatArray
    free: NDArray[np.int64]
    n_p: int

    def split(self, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        return z[: self.n_p], z[self.n_p :]

    def cost(self, z: FloatArray, e: FloatArray) -> float:
        prior = float((((z - self.mean) / self.sd) ** 2).sum())
        value = prior + TEMPERING * float(e @ e)
        return value if np.isfinite(value) else np.inf

    def run(self, z: FloatArray, iterations: int) -> tuple[FloatArray, FloatArray, FloatArray | None]:
        """Unknowns, residual, and Gauss-Newton matrix over the free unknowns at the end."""
        (e,) = self.loop.residuals([self.split(z)])
        cost, damping, H = self.cost(z, e), 1e-3, None
        if not np.isfinite(cost):
            return z, e, None
        for _ in range(iterations):
            J = self._jacobian(z, e)
            H = TEMPERING * (J.T @ J) + np.diag(1 / self.sd[self.free] ** 2)
            g = TEMPERING * (J.T @ e) + ((z - self.mean) / self.sd**2)[self.free]
            trials = []
            for factor in (1.0, 30.0, 1000.0):
                step = np.linalg.solve(H + damping * factor * np.diag(np.diag(H)), -g)
                trial = z.copy()
                trial[self.free] += np.clip(step, -0.7, 0.7)
                trials.append(trial)
            residuals = self.loop.residuals([self.split(t) for t in trials])
            costs = [self.cost(t, r) for t, r in zip(trials, residuals, strict=True)]
            best = int(np.argmin(costs))
            if not costs[best] < cost:
                damping *= 1e4
                if damping > 1e6:
                    break
                continue
            gained, z, e, cost = cost - costs[best], trials[best], residuals[best], costs[best]
            damping = max(damping * (0.1, 10.0, 300.0)[best], 1e-8)
            if gained < 1e-2 * (1 + 1e-2 * cost):
                break
        return z, e, H

    def _jacobian(self, z: FloatArray, e: FloatArray) -> FloatArray:
        points = []
        for i in self.free:
            moved = z.copy()
            moved[i] += DIFFERENCE
            points.append(self.split(moved))
        columns = self.loop.residuals(points)
        J = np.array([(c - e) / DIFFERENCE for c in columns]).T
        return np.where(np.isfinite(J), J, 0.0)


def _descent(loop: ClosedLoop, p: FloatArray, x: FloatArray, everything: bool) -> tuple[_Descent, FloatArray]:
    mean, sd = loop.problem.prior(loop.joint.reduced)
    z = np.concatenate([p, x])
    n = len(loop.coordinates.free)
    law_mean = x.copy()
    law_mean[n:] = 0.0
    law_sd = np.concatenate([np.full(n, LAW_SD), np.full(2, COMPANION_SD)])
    free = np.arange(len(z)) if everything else np.arange(len(p), len(z))
    return _Descent(loop, np.concatenate([mean, law_mean]), np.concatenate([sd, law_sd]), free, len(p)), z


def fit_nonlinear(
    problem: Problem, choosing: Problem, joint: Joint, recovered: Recovered, begun: Sequence[tuple[str, Start]]
) -> list[Candidate]:
    """The best fits of several laws and starts at a joint, judged on `choosing`, the model as the free force left it.

    All starts go a few steps on the beginnings of the records (an exponential window), where paths of motion that later
    part are still together; those that get on best are followed to the whole records. One candidate a law is kept.
    """
    early = [factor * problem.scale() for factor in WINDOWS]
    runs = []
    for name, start in begun:
        loop, x = loop_of(problem, joint, start, recovered)
        descent, z = _descent(replace(loop, sigma=early[0]), recovered.fit.p, x, False)
        z, e, H = descent.run(z, FEW)
        if H is not None:
            runs.append((descent.cost(z, e), name, start, descent, z))
    runs.sort(key=lambda r: r[0])
    best: dict[str, Candidate] = {}
    for _, name, start, descent, z in runs[:FOLLOWED]:
        for sigma in (*early[1:], 0.0):
            descent = replace(descent, loop=replace(descent.loop, sigma=sigma))
            z, e, H = descent.run(z, FIRST)
            if H is None:
                break
        if H is None:
            continue
        candidate = judge_nonlinear(choosing, _candidate(descent.loop, start, name, z, e, None))
        if np.isfinite(candidate.fitted) and (name not in best or candidate.fitted < best[name].fitted):
            best[name] = candidate
    return list(best.values())


def _candidate(
    loop: ClosedLoop, start: Start, name: str, z: FloatArray, e: FloatArray, covariance: FloatArray | None
) -> Candidate:
    n_p = len(loop.problem.prior(loop.joint.reduced)[0])
    p, x = z[:n_p], z[n_p:]
    values, k, c = loop.values(x)
    return Candidate(
        start.physics,
        name,
        loop.joint,
        values,
        p,
        x,
        loop.n_x,
        loop.problem.prior_cost(loop.joint.reduced, p),
        float(e @ e) / loop.size(),
        np.nan,
        k,
        c,
        np.inf,
        covariance,
        loop.coordinates,
        {"k_scale": loop.scale[0], "c_scale": loop.scale[1]},
    )


def _loop_again(problem: Problem, candidate: Candidate) -> ClosedLoop:
    assert candidate.joint is not None
    assert candidate.physics is not None
    assert candidate.coordinates is not None
    return ClosedLoop(
        problem,
        candidate.joint,
        candidate.physics.law or candidate.physics.name,
        candidate.coordinates,
        (candidate.extra["k_scale"], candidate.extra["c_scale"]),
        [upsampled(r.u) for r in problem.records],
        [r.u for r in problem.records],
    )


def judge_nonlinear(choosing: Problem, candidate: Candidate) -> Candidate:
    """The candidate with the misfit it leaves on records it has not seen."""
    loop = _loop_again(choosing, candidate)
    (e,) = loop.residuals([(candidate.p, candidate.x)])
    value = float(e @ e) / loop.size()
    return replace(candidate, chosen=value if np.isfinite(value) else np.inf)


def refit_nonlinear(problem: Problem, candidate: Candidate, iterations: int = JOINT) -> Candidate:
    """The candidate fitted to all records of the problem, all unknowns together."""
    loop = _loop_again(problem, candidate)
    descent, z = _descent(loop, candidate.p, candidate.x, True)
    z, e, H = descent.run(z, iterations)
    if H is None or candidate.physics is None:
        return candidate
    n_p = len(candidate.p)
    start = Start(candidate.physics, candidate.values, candidate.k, candidate.c, 0.0)
    covariance = np.asarray(np.linalg.pinv(H)[n_p:, n_p:], dtype=np.float64)
    return replace(
        _candidate(loop, start, candidate.name, z, e, covariance),
        chosen=candidate.chosen,
        reference=candidate.reference,
    )


def simulate_candidate(problem: Problem, candidate: Candidate, record: FitRecord) -> list:
    """Histories y, d, v, f of a nonlinear candidate for one record's forces (its responses are not looked at)."""
    loop = replace(_loop_again(problem, candidate), forces=[upsampled(record.u)], plain=[record.u])
    return loop.histories([(candidate.p, candidate.x)])[0][0]
