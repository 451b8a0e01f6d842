"""One law fitted to the force of a measured element, beside a spring, a dashpot and the zero of the force channel."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import approx_fprime, least_squares, lsq_linear

from femend import _core
from femend.diagnose.evidence import deviance
from femend.errors import LawParameterError
from femend.physics import FitCoordinates, Physics, shapes, simpler, with_companion

__all__ = ["ElementLaw", "Loop", "fit_law", "fit_linear_element", "refitted"]

FloatArray = NDArray[np.float64]

# starts of a law that are followed, evaluations for each, and change of a coordinate for its derivative
STARTS, EVALUATIONS, DIFFERENCE = 3, 25, 1e-4
# a coordinate may leave its start by this (ln units for sizes): beyond, numbers lose their meaning
REACH = 9.0
# a force of which spring, dashpot and zero leave less than this is theirs
ALIKE = 1e-9
# largest parameter a law is tried with, and residual where it has no finite force
LARGEST, FAR = 1e60, 1e30


@dataclass(frozen=True, eq=False)
class Loop:
    """A record of an element: displacement `d`, velocity `v` and force `f` (n,) at steps of `dt` s."""

    d: FloatArray
    v: FloatArray
    f: FloatArray
    dt: float

    @property
    def n(self) -> int:
        """Number of samples."""
        return len(self.d)


@dataclass(frozen=True, eq=False)
class ElementLaw:
    """A law fitted to an element: f = law(d, v) + k d + c v + f0, f0 the zero of the force channel.

    Attributes:
        physics: catalogue entry, None for the spring and dashpot alone.
        name: name of the law, that of the simpler one where it has become one.
        values: parameters in the units of the records, `sd` their standard deviations (NaN where not free).
        fitted, chosen: share of the force's power left on the part fitted and on the part kept back.
        n_parameters: numbers that were fitted, companion and zero included.
        score: tempered log likelihood plus price, lower is better.
    """

    physics: Physics | None
    name: str
    values: Mapping[str, float]
    k: float
    c: float
    f0: float
    fitted: float
    chosen: float
    n_parameters: int
    sd: Mapping[str, float] = field(default_factory=dict)
    score: float = np.nan

    @property
    def tried(self) -> str:
        """Name of the law as it was tried."""
        return self.name if self.physics is None else self.physics.name

    def force(self, d: FloatArray, v: FloatArray, dt: float) -> FloatArray:
        """Force (n,) along displacement `d` and velocity `v` (n,) at steps of `dt` s, from rest."""
        out = self.k * d + self.c * v + self.f0
        return out if self.physics is None else out + law_force(self.physics, self.values, d, v, dt)

    def nrmse(self, d: FloatArray, v: FloatArray, f: FloatArray, dt: float) -> float:
        """RMS error of the force predicted along `d`, `v` (n,), as a share of the RMS of the recorded one `f` (n,)."""
        return float(np.linalg.norm(f - self.force(d, v, dt)) / np.linalg.norm(f))

    def scored(self, n_values: float, price: float) -> ElementLaw:
        """The law with its score for `n_values` independent values."""
        return replace(self, score=deviance(self.chosen, n_values) + price * self.n_parameters)


def law_force(physics: Physics, values: Mapping[str, float], d: FloatArray, v: FloatArray, dt: float) -> FloatArray:
    """Force of a law of the catalogue; its acceleration is the difference of `v`."""
    return _core.law_force(physics.law or physics.name, dict(values), d, v, np.gradient(v, dt), dt)


class _Regression:
    """Forces of the fitted parts stacked, and what is linear in them (spring, dashpot, zero) projected out."""

    def __init__(self, loops: Sequence[Loop], seen: Sequence[int]) -> None:
        self.loops, self.seen = loops, seen
        self.b = np.concatenate([loop.f[:n] for loop, n in zip(loops, seen, strict=True)])
        self.A = np.concatenate(
            [np.stack([x.d[:n], x.v[:n], np.ones(n)], axis=1) for x, n in zip(loops, seen, strict=True)]
        )
        self.Q, self.R = np.linalg.qr(self.A)

    def rest(self, y: FloatArray) -> FloatArray:
        """What spring, dashpot and zero cannot follow of `y` (n,)."""
        return np.asarray(y - self.Q @ (self.Q.T @ y))

    def companion(self, y: FloatArray) -> tuple[float, float, float]:
        """k, c and zero that follow `y` best."""
        k, c, zero = np.linalg.solve(self.R, self.Q.T @ y)
        return float(k), float(c), float(zero)

    def force(self, physics: Physics, values: Mapping[str, float]) -> FloatArray:
        """Force of a law on the fitted parts (n,), NaN where it has none."""
        parts = [law_force(physics, values, x.d[:n], x.v[:n], x.dt) for x, n in zip(self.loops, self.seen, strict=True)]
        return np.concatenate(parts)

    def judged(self, law: ElementLaw) -> ElementLaw:
        """The law with what it leaves on the fitted parts and on those kept back."""
        left, power = np.zeros(2), np.zeros(2)
        for x, n in zip(self.loops, self.seen, strict=True):
            e = x.f - law.force(x.d, x.v, x.dt)
            for i, part in enumerate((slice(0, n), slice(n, None))):
                left[i] += e[part] @ e[part]
                power[i] += x.f[part] @ x.f[part]
        share = left / np.maximum(power, 1e-300)
        return replace(law, fitted=float(share[0]), chosen=float(share[1]))


def fit_linear_element(loops: Sequence[Loop], seen: Sequence[int]) -> ElementLaw:
    """A spring and a dashpot alone, fitted to the first `seen` samples of every loop."""
    data = _Regression(loops, seen)
    return data.judged(ElementLaw(None, "spring and dashpot", {}, *data.companion(data.b), np.nan, np.nan, 3))


def fit_law(physics: Physics, loops: Sequence[Loop], seen: Sequence[int]) -> ElementLaw | None:
    """The best fit of a law to the first `seen` samples of every loop; None where it has no force in time there."""
    data = _Regression(loops, seen)
    best: tuple[float, FitCoordinates, FloatArray, FloatArray] | None = None
    for values in _starts(physics, data):
        coordinates = FitCoordinates(physics, values)
        if not coordinates.free:
            continue
        cost, x, J = _descend(coordinates, lambda p: data.rest(data.b - data.force(physics, p)))
        if best is None or cost < best[0]:
            best = cost, coordinates, x, J
    if best is None:
        return None
    return data.judged(_law(physics, data, best[1], best[2], best[3]))


def refitted(law: ElementLaw, free: Sequence[str], loops: Sequence[Loop]) -> ElementLaw:
    """A law with the parameters `free` alone fitted to whole loops; raises LawParameterError for one it has not."""
    if law.physics is None or not free:
        raise LawParameterError(f"{law.name} has no parameter to fit anew; name one of a law's own", law=law.name)
    entry = law.physics
    fixed = [name for name in entry.parameter_names if name not in free]
    coordinates = FitCoordinates(entry, law.values, fixed)
    for name in free:
        if name not in coordinates.free:
            raise LawParameterError(
                f"{entry.name} has no free parameter {name!r}; it has {', '.join(entry.parameter_names)}",
                law=entry.name,
                parameter=name,
            )
    data = _Regression(loops, [loop.n for loop in loops])
    beside = data.A @ np.array([law.k, law.c, law.f0])
    _, x, _ = _descend(coordinates, lambda p: data.b - beside - data.force(entry, p))
    new = data.judged(replace(law, values=coordinates.parameters(x), sd={}, n_parameters=len(coordinates.free)))
    return replace(new, chosen=np.nan, score=np.nan)


def _descend(
    coordinates: FitCoordinates, residual: Callable[[dict[str, float]], FloatArray]
) -> tuple[float, FloatArray, FloatArray]:
    """Cost, coordinates and derivatives at the least squares of a residual of parameter values."""
    x0 = coordinates.start()
    n = len(residual(coordinates.values))

    # in changes from the start: steps and first trust region that go by logarithms themselves vanish near ln 1, and a
    # search stopped at the unit of what it looked for
    def finite(change: FloatArray) -> FloatArray:
        with np.errstate(over="ignore"):
            values = coordinates.parameters(x0 + change)
        if not all(np.isfinite(value) and abs(value) < LARGEST for value in values.values()):
            return np.full(n, FAR)
        e = residual(values)
        return e if np.isfinite(e).all() else np.full(n, FAR)

    def slopes(change: FloatArray) -> FloatArray:
        return np.asarray(approx_fprime(change, finite, DIFFERENCE), dtype=np.float64)

    done = least_squares(finite, np.zeros(len(x0)), slopes, bounds=(-REACH, REACH), max_nfev=EVALUATIONS)
    return float(done.cost), np.asarray(x0 + done.x), np.asarray(done.jac, dtype=np.float64)


def _law(physics: Physics, data: _Regression, coordinates: FitCoordinates, x: FloatArray, J: FloatArray) -> ElementLaw:
    values = coordinates.parameters(x)
    e = data.b - data.force(physics, values)
    companion = data.companion(e)
    e = data.rest(e)
    # neighbouring samples err alike: as many values count as their correlation leaves
    rho = max(float(e[1:] @ e[:-1]) / max(float(e @ e), 1e-300), 0.0)
    spread = float(e @ e) / len(e) * (1 + rho) / max(1 - rho, 1e-9)
    G = coordinates.jacobian(x)
    sd = np.sqrt(np.maximum(np.diag(G @ np.linalg.pinv(J.T @ J) @ G.T) * spread, 0.0))
    names = physics.parameter_names
    amplitude = float(np.abs(data.A[:, 0]).max())
    band = _band(data)
    nested = simpler(physics, with_companion(physics, values, companion[0]), amplitude=amplitude, band=band)
    name = physics.name if nested is None else nested[0]
    told = {n: float(s) if s > 0 else float("nan") for n, s in zip(names, sd, strict=True)}
    return ElementLaw(physics, name, values, *companion, np.nan, np.nan, len(coordinates.free) + 3, told)


def _band(data: _Regression) -> tuple[float, float]:
    """Circular frequencies (rad/s) that hold the middle 98 % of the motion's power."""
    low, high = [], []
    for x in data.loops:
        omega = 2 * np.pi * np.fft.rfftfreq(x.n, x.dt)[1:]
        power = np.abs(np.fft.rfft(x.d - x.d.mean())[1:]) ** 2
        share = np.cumsum(power) / power.sum()
        low.append(omega[np.searchsorted(share, 0.01)])
        high.append(omega[np.searchsorted(share, 0.99)])
    return float(min(low)), float(max(max(high), 1.001 * min(low)))


def _starts(physics: Physics, data: _Regression) -> list[dict[str, float]]:
    """Parameter values of the shapes that follow the force best by regression, the best first."""
    amplitude, speed = (float(np.abs(data.A[:, i]).max()) for i in (0, 1))
    found = []
    rest = data.rest(data.b)
    for shape in shapes(physics, amplitude=amplitude, band=_band(data), speed=speed):
        try:
            forces = np.array([data.force(physics, term) for term in shape.terms])
        except LawParameterError:
            return []  # a law of lines alone, without a force in time
        columns = np.array([data.rest(force) for force in forces]).T
        size, whole = np.linalg.norm(columns, axis=0), np.linalg.norm(forces, axis=1)
        # a spring of the law's own is the one beside it, which stays the only one
        own = size > ALIKE * whole
        if not np.isfinite(size).all() or not own.any():
            continue
        low = np.array([-np.inf if _may_be_negative(physics, names) else 0.0 for names in shape.scaled])
        factors = np.zeros(len(low))
        high = np.full(int(own.sum()), np.inf)
        factors[own] = lsq_linear(columns[:, own] / size[own], rest, (low[own], high)).x / size[own]
        # a force scale of zero has no logarithm to go on from
        small = np.divide(1e-3 * np.linalg.norm(rest), size, out=np.zeros(len(low)), where=own)
        factors = np.where(own & (low == 0), np.maximum(factors, small), factors)
        e = rest - columns @ factors
        found.append((float(e @ e), shape.values(list(map(float, factors)))))
    found.sort(key=lambda item: item[0])
    return [values for _, values in found[:STARTS]]


def _may_be_negative(physics: Physics, names: Sequence[str]) -> bool:
    """Whether the parameters that a factor multiplies may change sign."""
    return all(p.domain in ("real", "signed") for p in physics.parameters if p.name in names)
