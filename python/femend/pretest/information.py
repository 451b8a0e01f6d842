"""What a planned test would tell about the parameters: expected information, before anything is measured."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.errors import PretestError
from femend.estimate.updating import Collinear, System, Unknowns, collinear_groups, spans

__all__ = ["ParameterForecast", "PlannedTest", "planned_test"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

# the scale of a measured shape is not known: its logarithm has this 1-sigma
FREE = 10.0
# a parameter counts as determined when the data take away so much of its prior variance, as in `UpdateResult`
DETERMINED = 0.5


class ParameterForecast(NamedTuple):
    """A parameter's 1-sigma before and expected after the test, the share of its prior variance that the test takes
    away, and whether that makes it determined."""

    name: str
    prior_sd: float
    expected_sd: float
    learned: float
    determined: bool


@dataclass(frozen=True, eq=False)
class PlannedTest:
    """Sensitivities of a test's values, in deviations, to p of the unknowns, at every place a sensor could be.

    `prior` (n, n) is the precision of p, `size` (n,) a span of p (prior 1-sigma), `frequencies` (n_modes, n) what the
    frequencies say, whatever the sensors; `shapes` (n_places, n_modes, n) and `motion` (n_places, n_modes) the shapes'
    change with p and with their unknown scale.
    """

    names: tuple[str, ...]
    prior: FloatArray
    size: FloatArray
    freq: FloatArray
    frequencies: FloatArray
    shapes: FloatArray
    motion: FloatArray

    @property
    def n_places(self) -> int:
        """Number of places."""
        return int(self.shapes.shape[0])

    def blocks(self) -> FloatArray:
        """Information (n_places, n + n_modes, n + n_modes) that each place adds on p and the scales of the shapes."""
        n, m = len(self.names), self.motion.shape[1]
        J = np.zeros((self.n_places, m, n + m))
        J[:, :, :n] = self.shapes
        own = np.arange(m)
        J[:, own, n + own] = self.motion
        return np.asarray(J.transpose(0, 2, 1) @ J)

    def before_shapes(self) -> FloatArray:
        """Information (n + n_modes, n + n_modes) of priors and frequencies alone."""
        n, m = len(self.names), self.motion.shape[1]
        F = np.zeros((n + m, n + m))
        F[:n, :n] = self.prior + self.frequencies.T @ self.frequencies
        F[n:, n:] = np.eye(m) / FREE**2
        return F

    def information(self, rows: ArrayLike, *, prior: bool = True) -> FloatArray:
        """Expected information (n, n) on p of a test with sensors at `rows`, the scales of shapes being unknown.

        `prior` False leaves the prior's out. Raises PretestError for rows that are no places.
        """
        at = self._rows(rows)
        n = len(self.names)
        F = self.before_shapes() + self.blocks()[at].sum(axis=0)
        if not prior:
            F[:n, :n] -= self.prior
        return np.asarray(F[:n, :n] - F[:n, n:] @ np.linalg.solve(F[n:, n:], F[n:, :n]))

    def covariance(self, rows: ArrayLike) -> FloatArray:
        """Expected covariance (n, n) of p after a test with sensors at `rows`.

        Raises PretestError where neither data nor priors determine an unknown.
        """
        F = self.information(rows) * np.outer(self.size, self.size)
        lam, V = np.linalg.eigh(F)
        if lam[0] <= 1e-13 * max(lam[-1], 1.0):
            name = self.names[int(np.argmax(np.abs(V[:, 0])))]
            raise PretestError(f"the planned test does not determine {name!r} and it has no prior; give it one")
        return np.asarray((V / lam) @ V.T * np.outer(self.size, self.size))

    def variance_left(self, rows: ArrayLike) -> float:
        """Mean share of the unknowns' prior variance that is left after a test with sensors at `rows`."""
        return float(np.mean(np.diag(self.covariance(rows)) / self.size**2))

    def forecast(self, rows: ArrayLike) -> tuple[ParameterForecast, ...]:
        """What a test with sensors at `rows` would tell about every parameter."""
        after = np.sqrt(np.diag(self.covariance(rows)))
        out = []
        for name, before, sd in zip(self.names, self.size, after, strict=True):
            learned = float(1.0 - (sd / before) ** 2)
            out.append(ParameterForecast(name, float(before), float(sd), learned, learned > DETERMINED))
        return tuple(out)

    def collinear(self, rows: ArrayLike) -> tuple[Collinear, ...]:
        """Parameters that a test with sensors at `rows` could not tell apart (`femend.estimate.updating`)."""
        F = self.information(rows, prior=False) * np.outer(self.size, self.size)
        lam, V = np.linalg.eigh(F)
        return collinear_groups((V * np.sqrt(np.maximum(lam, 0.0))).T, self.names)

    def _rows(self, rows: ArrayLike) -> IntArray:
        at = np.asarray(rows, dtype=np.int64).ravel()
        if at.size and not (at.min() >= 0 and at.max() < self.n_places):
            raise PretestError(f"row {int(at.max())} is no place; the plan has places 0 to {self.n_places - 1}")
        return at


def planned_test(
    system: System,
    unknowns: Unknowns,
    *,
    modes: Sequence[int] | None = None,
    freq_sd: ArrayLike = 0.002,
    shape_sd: ArrayLike = 0.02,
    p: ArrayLike | None = None,
) -> PlannedTest:
    """The plan of a modal test on `system`, which is seen at every place where a sensor could be.

    The system's parameters take the `unknowns` of their names at `p` (the prior mean); others stay at the system's
    defaults. `modes` are the modes that the test will find (numbers from 0; all by default), with frequencies to
    `freq_sd`, a fraction, and shapes to `shape_sd` of each mode's largest motion; `freq_sd` may be (n_modes,),
    `shape_sd` (n_places, n_modes) or (n_places, 1). The information is that of Gaussian errors about the model
    linearised at p (Papadimitriou, Beck and Au 2000, J. Vib. Control 6, 781-800). Raises PretestError for an unknown
    that the system does not have, modes beyond its own, or deviations that are not above 0.

    >>> from femend.estimate.updating import affine_matrices, factor, modal_system
    >>> chain = modal_system(affine_matrices({"k": [[1.0]]}, [[1.0]]), [0], 1)
    >>> plan = planned_test(chain, Unknowns.of([factor("k", 0.1)]), freq_sd=0.01)
    >>> round(plan.covariance([0])[0, 0] ** -1)  # 1 / 0.1^2 of the prior and (0.5 / 0.01)^2 of the frequency
    2600
    """
    at = np.asarray(unknowns.mean if p is None else p, dtype=np.float64)
    values = unknowns.values(at)
    missing = [n for n in unknowns.names if n not in system.names]
    if missing:
        raise PretestError(f"the system has no parameter {missing[0]!r}; it has {', '.join(system.names)}")
    defaults = dict(getattr(system, "defaults", {}))
    factors = np.array([defaults.get(n, 1.0) for n in system.names], dtype=np.float64)
    index = [system.names.index(n) for n in unknowns.names]
    factors[index] = values
    state = system.solve(factors)
    freq, phi = state.value("freq"), state.value("phi")
    chosen = np.arange(freq.size) if modes is None else np.asarray(modes, dtype=np.int64)
    if chosen.size == 0 or chosen.min() < 0 or chosen.max() >= freq.size:
        raise PretestError(f"mode {int(chosen.max(initial=0)) + 1} is wanted and the system gives {freq.size} modes")
    state.need(int(chosen.max()) + 1)
    slope = np.array([v if u.positive else u.scale for v, u in zip(values, unknowns.items, strict=True)])
    dfreq = state.slope("freq")[index][:, chosen] * slope[:, None]
    dphi = state.slope("phi")[index][:, :, chosen] * slope[:, None, None]
    freq, phi = freq[chosen], phi[:, chosen]
    sd_f = _above_0(freq_sd, freq.shape, "frequencies") * freq
    sd_phi = _above_0(shape_sd, phi.shape, "shapes") * np.maximum(np.abs(phi).max(axis=0), 1e-300)
    return PlannedTest(
        unknowns.names, np.asarray(unknowns.precision), spans(unknowns), freq, (dfreq / sd_f).T,
        np.asarray(dphi.transpose(1, 2, 0) / sd_phi[:, :, None]), phi / sd_phi,
    )  # fmt: skip


def _above_0(sd: ArrayLike, shape: tuple[int, ...], what: str) -> FloatArray:
    try:
        out = np.array(np.broadcast_to(np.asarray(sd, dtype=np.float64), shape))
    except ValueError:
        raise PretestError(f"deviations of {what} have shape {np.shape(sd)}, the values {shape}") from None
    if not (np.isfinite(out).all() and (out > 0).all()):
        raise PretestError(f"a deviation of {what} is not above 0; a value without scatter would outweigh all others")
    return out
