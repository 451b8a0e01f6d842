"""Steady response of a model with nonlinear laws at one place over frequency and level, and where sweeps of it jump."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend import _core
from femend.analysis.frf import shapes_at
from femend.data.mode_set import ModeSet
from femend.dof import Dof

__all__ = ["Jump", "NonlinearBranch", "branches_of_modes", "nonlinear_frf"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Direction = Literal["up", "down"]
# name and parameters of a law
LawSpec = tuple[str, Mapping[str, float]]


@dataclass(frozen=True, slots=True)
class Jump:
    """A turning point of a branch: frequency (Hz) at which a sweep in `direction` jumps, amplitude (m) of the laws'
    coordinate at its fundamental just before, and its point on the branch."""

    direction: Direction
    freq: float
    amplitude: float
    point: int


@dataclass(frozen=True, slots=True, eq=False)
class NonlinearBranch:
    """Periodic motions at one level of the force, in the order of the branch, which turns back between jumps.

    Harmonics are complex amplitudes of exp(+2 pi i n f t), n = 0 (the mean, real) to the highest one.

    Attributes:
        level: factor on the force.
        freq: frequencies (n,) in Hz.
        d, f: motion (n, n_h) in m of the laws' coordinate and force (n, n_h) in N of the laws against it.
        y: displacement (n, n_out, n_h) in m at the outputs.
        jumps: turning points in the order of the branch.
        ended: "upper" or "lower" end of the band, "max_points", "max_folds" (after `max_jumps`), or "stuck" where it
            could not be followed further.
    """

    level: float
    freq: FloatArray
    d: ComplexArray
    f: ComplexArray
    y: ComplexArray
    jumps: tuple[Jump, ...]
    ended: str

    @property
    def amplitude(self) -> FloatArray:
        """Amplitude (n,) in m of the laws' coordinate at the fundamental."""
        return np.abs(self.d[:, 1])

    def jump(self, direction: Direction = "up") -> Jump | None:
        """Where a slow sweep over the whole band in `direction` jumps first; None where it does not.

        The turning points found are those of the branch that begins at the lower end of the band.
        """
        found = [j for j in self.jumps if j.direction == direction]
        return None if not found else found[0] if direction == "up" else max(found, key=lambda j: j.freq)

    def parts(self) -> list[slice]:
        """Points between jumps: those of the even parts are of rising frequency, of the others falling (these are
        the unstable ones, as far as turning points tell)."""
        at = [0, *(j.point for j in self.jumps), len(self.freq) - 1]
        return [slice(a, b + 1) for a, b in pairwise(at)]

    def sweep(self, freq: ArrayLike, direction: Direction = "up") -> ComplexArray:
        """Harmonics (n_freq, n_h) in m of the laws' coordinate along a slow sweep at `freq` (n_freq,) in Hz, any order.

        A sweep stays on a part of rising frequency until its end and goes on from there on the next one that has the
        frequency. Between points of the branch d is interpolated linearly; NaN outside the branch.
        """
        f = np.asarray(freq, dtype=np.float64)
        rising = self.parts()[::2]
        out = np.full((len(f), self.d.shape[1]), np.nan, dtype=np.complex128)
        for part in rising if direction == "down" else rising[::-1]:
            x, d = self.freq[part], self.d[part]
            inside = (f >= x[0]) & (f <= x[-1])
            for n in range(d.shape[1]):
                out[inside, n] = np.interp(f[inside], x, d[:, n])
        return out

    def __repr__(self) -> str:
        told = ", ".join(f"{j.direction} {j.freq:.5g} Hz" for j in self.jumps) or "none"
        span = f"{self.freq.min():.5g} to {self.freq.max():.5g} Hz"
        return f"NonlinearBranch(level {self.level:g}, {len(self.freq)} points, {span}; jumps: {told})"


def branches_of_modes(
    omega: ArrayLike,
    zeta: ArrayLike,
    phi_in: ArrayLike,
    phi_out: ArrayLike,
    w: ArrayLike,
    laws: Sequence[Sequence[LawSpec]],
    force: ArrayLike,
    levels: Sequence[float],
    band: tuple[float, float],
    *,
    harmonics: int = 7,
    samples: int = 128,
    max_step: float = 0.1,
    max_jumps: int | None = None,
    residual_compliance: float = 0.0,
) -> list[list[NonlinearBranch]]:
    """Branches result[set][level] of many sets of laws on one coordinate of a modal model, on all cores.

    Parameters: `omega` (r,) in rad/s, `zeta` (r,), mass-normalised shapes at the inputs `phi_in` (n_in, r), the outputs
    `phi_out` (n_out, r) and the laws' coordinate `w` (r,); `laws` one list of (name, parameters) for each set, which
    add up; `force` (n_in,) complex amplitudes in N at level 1; `band` in Hz. Otherwise as `nonlinear_frf`.

    >>> (cubic,), = branches_of_modes([1], [0.01], [[1]], [[1]], [1], [[("cubic_stiffness", {"k3": 0.8})]], [1], [0.05],
    ...                               (0.1, 0.4))
    >>> [(j.direction, round(j.freq, 3)) for j in cubic.jumps]
    [('up', 0.252), ('down', 0.175)]
    """
    found = _core.harmonic_branches(
        np.asarray(omega, dtype=np.float64),
        np.asarray(zeta, dtype=np.float64),
        np.asarray(phi_in, dtype=np.float64),
        np.asarray(phi_out, dtype=np.float64),
        np.asarray(w, dtype=np.float64),
        [[(name, dict(values)) for name, values in composite] for composite in laws],
        np.asarray(force, dtype=np.complex128),
        [float(level) for level in levels],
        (2 * np.pi * float(band[0]), 2 * np.pi * float(band[1])),
        harmonics=harmonics,
        samples=samples,
        max_step=max_step,
        max_folds=max_jumps,
        residual_compliance=residual_compliance,
    )
    return [[_branch(level, *told) for level, told in zip(levels, of_set, strict=True)] for of_set in found]


def _branch(
    level: float,
    omega: FloatArray,
    d: ComplexArray,
    f: ComplexArray,
    y: ComplexArray,
    folds: Sequence[tuple[int, bool]],
    ended: str,
    _iterations: int,
) -> NonlinearBranch:
    freq = omega / (2 * np.pi)
    jumps = [Jump("up" if up else "down", float(freq[i]), float(abs(d[i, 1])), i) for i, up in folds]
    return NonlinearBranch(float(level), freq, d, f, y, tuple(jumps), ended)


def nonlinear_frf(
    modes: ModeSet,
    place: Mapping[Dof, float],
    laws: Sequence[LawSpec],
    force: Mapping[Dof, complex],
    levels: Sequence[float],
    band: tuple[float, float],
    *,
    outputs: Sequence[Dof] = (),
    harmonics: int = 7,
    samples: int = 128,
    max_step: float = 0.1,
    max_jumps: int | None = None,
    residual_compliance: float = 0.0,
) -> list[NonlinearBranch]:
    """Branch of periodic motions at each of `levels` over `band` (Hz) of modes with laws at one place.

    Parameters: mass-normalised `modes`; `place` the coordinate d = sum factor * u of the laws (one DOF to ground, or +1
    and -1 of a pair); `laws` (name, parameters) of the catalogue, whose forces add up; `force` complex amplitudes in N
    at level 1 by DOF, of exp(+2 pi i f t) (the inertia of a base acceleration a is -M r a at every DOF); `outputs` the
    DOFs of `y`. `harmonics` are balanced with the mean, by `samples` of a period; `max_step` is the share of amplitude
    and band that changes from point to point; the branch ends after `max_jumps` turning points; `residual_compliance`
    (m/N) is that of the modes left out, at the place.

    Linear laws act by their dynamic stiffness, the others by alternating frequency/time (Cameron and Griffin 1989);
    the branch follows pseudo-arclength (Keller 1977). It begins at the lower end of the band, which has to lie where
    there is one motion only; branches that do not hang together with it are not found, nor is stability computed.

    Raises ValueError for modes that are not real and mass-normalised, a DOF the modes do not have, or settings that
    make no sense, LawParameterError for a law, ConvergenceError where no motion is found at the lower end of the band.

    >>> modes = ModeSet([10.0], [0.01], [[1.0]], (Dof(1, 3),))
    >>> at = {Dof(1, 3): 1.0}
    >>> hard, = nonlinear_frf(modes, at, [("cubic_stiffness", {"k3": 4e5})], at, [15.0], (5.0, 20.0))
    >>> round(hard.jump("up").freq, 2) > round(hard.jump("down").freq, 2) > 10.0
    True
    """
    if modes.scaling != "mass" or np.iscomplexobj(modes.phi):
        raise ValueError(
            f"modes are scaled {modes.scaling!r} and {modes.phi.dtype}; a steady state needs real mass-normalised ones"
        )
    w = np.array(list(place.values()), dtype=np.float64) @ shapes_at(modes, list(place))
    (found,) = branches_of_modes(
        2 * np.pi * modes.freq,
        modes.zeta,
        shapes_at(modes, list(force)),
        shapes_at(modes, list(outputs)),
        w,
        [laws],
        list(force.values()),
        levels,
        band,
        harmonics=harmonics,
        samples=samples,
        max_step=max_step,
        max_jumps=max_jumps,
        residual_compliance=residual_compliance,
    )
    return found
