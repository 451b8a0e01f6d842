"""Fit of a modal model with laws to time records in the quantity that was measured, displacement included.

The diagnosis compares accelerations on spectral lines. Where a sensor measures displacement or velocity,
differentiation weighs the highest lines most, and what a nonlinear law sends beyond half the sampling rate comes back
into the band with the wrong weight. So the last fit, and the errors one quotes, are made here: output error in time.

It starts from a law and modes that are about right, as a diagnosis leaves them. From far off, a strongly nonlinear
motion has other minima; nothing is done here against that.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from femend import _core
from femend.diagnose.fitting.closed_loop import FINE, upsampled
from femend.errors import RecordingError
from femend.physics import FitCoordinates, Physics

__all__ = ["Modes", "OutputFit", "TimeRecord", "fit_output", "residual_of", "simulated"]

FloatArray = NDArray[np.float64]
Laws = Sequence[Sequence[tuple[Physics, Mapping[str, float]]]]
Histories = Sequence[tuple[FloatArray, FloatArray, FloatArray]]

QUANTITIES = ("displacement", "velocity", "acceleration")
# evaluations of a fit, and change of an unknown for its derivative
EVALUATIONS, DIFFERENCE = 15, 1e-5
# residual where a simulation failed
FAR = 1e6


@dataclass(frozen=True, eq=False)
class TimeRecord:
    """Forces `u` (n_in, n) in N and responses `y` (n_out, n) of a structure that starts from rest, steps of `dt` s."""

    u: FloatArray
    y: FloatArray
    dt: float

    def __post_init__(self) -> None:
        if self.u.ndim != 2 or self.y.ndim != 2 or self.u.shape[1] != self.y.shape[1]:
            raise RecordingError(f"forces {self.u.shape} and responses {self.y.shape} must be (n_ch, n), equally long")

    def fine(self) -> FloatArray:
        """Band-limited forces (n_in, n * FINE); the line between first and last sample is kept apart, so that a force
        that does not begin and end at zero does not ring."""
        n = self.u.shape[1]
        slope = (self.u[:, -1:] - self.u[:, :1]) / (n - 1)
        at = np.arange(n * FINE) / FINE
        return upsampled(self.u - self.u[:, :1] - slope * np.arange(n)) + self.u[:, :1] + slope * at


@dataclass(frozen=True, eq=False)
class Modes:
    """A modal model: `omega` (r,) rad/s, `zeta` (r,), mass-normalised `phi_in` (n_in, r), `phi_out` (n_out, r), and the
    coordinates `w` (n_w, r) that carry laws."""

    omega: FloatArray
    zeta: FloatArray
    phi_in: FloatArray
    phi_out: FloatArray
    w: FloatArray

    def moved(self, x: FloatArray) -> Modes:
        """The modes with ln frequency, ln damping and ln amplitude (half of -ln modal mass) changed by x (3 r,)."""
        frequency, damping, amplitude = np.exp(x.reshape(3, -1))
        return Modes(
            self.omega * frequency,
            self.zeta * damping,
            self.phi_in * amplitude,
            self.phi_out * amplitude,
            self.w * amplitude,
        )


@dataclass(frozen=True, eq=False)
class OutputFit:
    """A fitted model.

    Attributes:
        modes: modal model.
        laws: for each coordinate (row of `modes.w`) its laws with their parameters.
        zero: forces (n_in,) that act beside the recorded ones all the time: less the zero of the force channels.
        quantity: displacement, velocity or acceleration.
        n_parameters: numbers that were fitted.
        left: mean square left on the fitted samples, as a share of the responses' own.
    """

    modes: Modes
    laws: tuple[tuple[tuple[Physics, Mapping[str, float]], ...], ...]
    zero: FloatArray
    quantity: str
    n_parameters: int
    left: float

    def response(self, record: TimeRecord) -> FloatArray:
        """Response (n_out, n) to the forces of a record; NaN where the simulation failed."""
        return simulated([self], [record])[0][0][0]

    def rms_error(self, record: TimeRecord, skip: int = 0) -> FloatArray:
        """RMS (n_out,) of the error on a record after its first `skip` samples, in the unit of the response."""
        e = (self.response(record) - record.y)[:, skip:]
        return np.asarray(np.sqrt(np.mean(e**2, axis=1)))

    def share(self, records: Sequence[TimeRecord], skip: int = 0) -> float:
        """Mean square of the error as a share of the responses' own."""
        e = residual_of(simulated([self], records)[0], records, skip)
        return float(e @ e) / len(e)


def fit_output(
    modes: Modes,
    laws: Laws,
    records: Sequence[TimeRecord],
    *,
    quantity: str = "displacement",
    zero: bool = False,
    skip: int = 0,
) -> OutputFit:
    """Least squares in time over frequency, damping and mass of every mode, the laws' parameters and, with `zero`, a
    constant force beside every recorded one.

    `modes` and `laws` (one list for each row of `modes.w`) are where it starts; `records` begin at rest, the first
    `skip` samples do not count. Each response counts in units of its own root mean square. Raises RecordingError for a
    quantity that is none, records of different steps and a start that cannot be simulated.

    Output-error method: Ljung, System Identification, 2nd ed., section 4.3; Gauss-Newton steps in a trust region.
    """
    if quantity not in QUANTITIES:
        raise RecordingError(f"quantity {quantity!r} is none of {', '.join(QUANTITIES)}")
    if not records or len({record.dt for record in records}) > 1:
        raise RecordingError("give at least one record, all of one time step")
    begun = OutputFit(modes, tuple(tuple(own) for own in laws), np.zeros(len(modes.phi_in)), quantity, 0, np.nan)
    unknowns = _Unknowns(begun, zero, np.array([record.u.std() for record in records]).mean())
    z0 = np.zeros(unknowns.n)
    start = residual_of(simulated([begun], records)[0], records, skip)
    if not np.isfinite(start).all():
        raise RecordingError("the start of the fit cannot be simulated; give softer laws or a shorter time step")

    def residual(z: FloatArray) -> FloatArray:
        e = residual_of(simulated([unknowns.at(z)], records)[0], records, skip)
        return e if np.isfinite(e).all() else np.full(len(e), FAR)

    def jacobian(z: FloatArray) -> FloatArray:
        points = [unknowns.at(z), *(unknowns.at(z + DIFFERENCE * row) for row in np.eye(len(z)))]
        here, *moved = (residual_of(h, records, skip) for h in simulated(points, records))
        J = np.stack([(e - here) / DIFFERENCE for e in moved], axis=1)
        return np.where(np.isfinite(J), J, 0.0)

    done = least_squares(residual, z0, jac=jacobian, x_scale="jac", max_nfev=EVALUATIONS)
    return replace(unknowns.at(done.x), left=float(2 * done.cost) / len(start), n_parameters=unknowns.n)


class _Unknowns:
    """Numbers that are fitted, all zero at the start: modes, coordinates of the laws, zeros of the forces."""

    def __init__(self, start: OutputFit, zero: bool, size: float) -> None:
        self.start, self.zero, self.size = start, zero, size
        self.maps = [[FitCoordinates(physics, values) for physics, values in own] for own in start.laws]
        self.x0 = [[m.start() for m in own] for own in self.maps]
        laws = sum(len(x) for own in self.x0 for x in own)
        self.n = 3 * len(start.modes.omega) + laws + (len(start.zero) if zero else 0)

    def at(self, z: FloatArray) -> OutputFit:
        """The model at unknowns z (n,)."""
        n = 3 * len(self.start.modes.omega)
        modes, rest = self.start.modes.moved(z[:n]), z[n:]
        laws = []
        for maps, begun in zip(self.maps, self.x0, strict=True):
            own = []
            for m, x0 in zip(maps, begun, strict=True):
                own.append((m.physics, m.parameters(x0 + rest[: len(x0)])))
                rest = rest[len(x0) :]
            laws.append(tuple(own))
        zero = self.start.zero + self.size * rest if self.zero else self.start.zero
        return replace(self.start, modes=modes, laws=tuple(laws), zero=zero)


def simulated(fits: Sequence[OutputFit], records: Sequence[TimeRecord]) -> list[Histories]:
    """Response, coordinate and its velocity of every fit and record."""
    modes = [fit.modes for fit in fits]
    inputs = [np.vstack([m.phi_in, fit.zero @ m.phi_in]) for m, fit in zip(modes, fits, strict=True)]
    fine = [record.fine() for record in records]
    done = _core.simulate_batch(
        np.array([m.omega for m in modes]),
        np.array([m.zeta for m in modes]),
        np.array(inputs),
        np.array([m.phi_out for m in modes]),
        np.array([m.w for m in modes]),
        [[[(p.law or p.name, dict(values)) for p, values in own] for own in fit.laws] for fit in fits],
        [np.vstack([u, np.ones(u.shape[1])]) for u in fine],
        records[0].dt / FINE,
        stride=FINE,
        output=fits[0].quantity,
    )
    return [[(y, d, v) for y, d, v, _, _ in own] for own in done]


def residual_of(histories: Histories, records: Sequence[TimeRecord], skip: int) -> FloatArray:
    """Errors of responses after the first `skip` samples, in units of each response's own root mean square."""
    size = np.sqrt(np.mean([(record.y**2).mean(axis=1) for record in records], axis=0))[:, None]
    return np.concatenate([((h[0] - r.y)[:, skip:] / size).ravel() for h, r in zip(histories, records, strict=True)])
