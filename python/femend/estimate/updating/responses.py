"""What is compared: measured against computed, over the measurement's deviation, with derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.errors import UpdatingError
from femend.estimate.updating.close_modes import CloseMode, close_modes, mixed
from femend.estimate.updating.state import State

__all__ = [
    "Compared",
    "Frequencies",
    "MacDifferences",
    "Mates",
    "Response",
    "ShapeDifferences",
    "Values",
    "deviation",
    "needed",
]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Mates:
    """Model mode `mate` (n_test,) of each test mode, -1 for none; `mac` (n_test,) of the pair; `freq` (n_test,) of the
    test modes in Hz, None where they are not told and none of them count as close."""

    mate: NDArray[np.int64]
    mac: FloatArray
    freq: FloatArray | None = None

    @property
    def test(self) -> NDArray[np.int64]:
        """Test modes that have a mate."""
        return np.flatnonzero(self.mate >= 0)

    def close(self, state: State, n_sensors: int) -> tuple[tuple[CloseMode, ...], ...]:
        """For each of `test` the modes of `state` that its shape at `n_sensors` may hold besides its mate's."""
        if self.freq is None:
            return ((),) * self.test.size
        return close_modes(self.mate, self.freq, state.value("freq"), n_sensors)


@dataclass(frozen=True, eq=False)
class Compared:
    """Residuals (m,) in deviations and their derivatives (n_parameters, m), None where not asked for; `taken` of the m
    values are met by amplitudes that were eliminated, whatever the parameters are."""

    residual: FloatArray
    slopes: FloatArray | None
    taken: int = 0


class Response(Protocol):
    """A measured quantity."""

    @property
    def name(self) -> str:
        """How it is called in tables."""

    def compare(self, state: State, mates: Mates | None, slopes: bool) -> Compared:
        """(computed - measured) / deviation."""


def deviation(sd: ArrayLike, shape: tuple[int, ...], what: str) -> FloatArray:
    """`sd` as an array of `shape`; raises UpdatingError naming `what` for one that does not fit or is not above 0."""
    try:
        out = np.array(np.broadcast_to(np.asarray(sd, dtype=np.float64), shape))
    except ValueError:
        raise UpdatingError(f"deviations of {what} have shape {np.shape(sd)}, the values {shape}") from None
    bad = ~(np.isfinite(out) & (out > 0))
    if bad.any():
        at = f" at [{', '.join(str(int(i)) for i in np.argwhere(bad)[0])}]" if shape else ""
        raise UpdatingError(
            f"the deviation of {what} is {out[bad][0]:g}{at}: a value without scatter would outweigh all others; "
            "give its standard deviation, or leave the value out"
        )
    return out


@dataclass(frozen=True, eq=False)
class Frequencies:
    """Natural frequencies `freq` (n_test,) in Hz with deviations `sd` (n_test,) in Hz.

    `of` "frequency" compares f, "eigenvalue" f^2 (deviation 2 f sd), "logarithm" ln f (deviation sd / f).
    """

    freq: FloatArray
    sd: FloatArray
    of: Literal["frequency", "eigenvalue", "logarithm"] = "frequency"
    name: str = "frequencies"

    def __post_init__(self) -> None:
        object.__setattr__(self, "freq", np.asarray(self.freq, dtype=np.float64))
        if self.of not in ("frequency", "eigenvalue", "logarithm"):
            raise UpdatingError(f"{self.name}: {self.of!r} cannot be compared; take frequency, eigenvalue or logarithm")
        object.__setattr__(self, "sd", deviation(self.sd, self.freq.shape, self.name))

    @property
    def n_modes(self) -> int:
        """Number of measured modes."""
        return self.freq.size

    def compare(self, state: State, mates: Mates | None, slopes: bool) -> Compared:
        """Residuals of the paired modes of `state`, in the order of the test modes of `mates`."""
        pairs = needed(mates, self.name)
        t, m = pairs.test, pairs.mate[pairs.test]
        f, f0, sd = state.value("freq")[m], self.freq[t], self.sd[t]
        if self.of == "eigenvalue":
            residual, chain = (f**2 - f0**2) / (2 * f0 * sd), f / (f0 * sd)
        elif self.of == "logarithm":
            safe = np.maximum(f, 1e-12 * f0)
            residual, chain = np.log(safe / f0) * f0 / sd, f0 / (safe * sd)
        else:
            residual, chain = (f - f0) / sd, 1.0 / sd
        return Compared(residual, state.slope("freq")[:, m] * chain if slopes else None)


@dataclass(frozen=True, eq=False)
class ShapeDifferences:
    """Mode shapes `phi` (n_sensors, n_test), real, with deviations `sd` in the same scale, entry by entry or one
    number.

    The computed shape is scaled to the test shape: by weighted least squares (the modal scale factor), or, with
    `reference` (n_test,), so that both agree at that sensor (by row), which is then left out: the eigenvector
    difference of Dong, Wang and co-workers. NaN marks a sensor that was not there. Close modes (within 2 % in the test
    or the model) are compared as one space, since their shapes are any mixture (`close_modes`), but with `reference`,
    where shapes are single ones. Raises UpdatingError for complex shapes, sizes that do not fit and deviations that are
    not above 0.
    """

    phi: FloatArray
    sd: FloatArray
    reference: tuple[int, ...] | None = None
    name: str = "shapes"

    def __post_init__(self) -> None:
        if np.iscomplexobj(self.phi):
            raise UpdatingError(
                f"{self.name} are complex; turn them real (femend.correlate tells how complex they are)"
            )
        object.__setattr__(self, "phi", np.asarray(self.phi, dtype=np.float64))
        if self.phi.ndim != 2:
            raise UpdatingError(f"{self.name} have shape {self.phi.shape}; they are (n_sensors, n_modes)")
        sd = np.array(np.broadcast_to(np.asarray(self.sd, dtype=np.float64), self.phi.shape))
        if self.reference is not None:
            if len(self.reference) != self.phi.shape[1]:
                raise UpdatingError(f"{self.name}: {len(self.reference)} references for {self.phi.shape[1]} modes")
            sd[list(self.reference), np.arange(self.phi.shape[1])] = 1.0  # it has no part in the residual
        object.__setattr__(self, "sd", deviation(sd, self.phi.shape, self.name))

    @property
    def n_modes(self) -> int:
        """Number of measured modes."""
        return int(self.phi.shape[1])

    def compare(self, state: State, mates: Mates | None, slopes: bool) -> Compared:
        """Residuals of the paired shapes of `state`, mode after mode of `mates`."""
        pairs = needed(mates, self.name)
        phi = state.value("phi")
        d = state.slope("phi") if slopes else None
        parts = []
        for t, close in zip(pairs.test, pairs.close(state, phi.shape[0]), strict=True):
            mate = int(pairs.mate[t])
            if close and self.reference is None:
                parts.append(self._of_space(int(t), mate, close, state, slopes))
            else:
                parts.append(self._one(int(t), phi[:, mate], None if d is None else d[:, :, mate]))
        if not parts:
            return Compared(np.zeros(0), None if d is None else np.zeros((d.shape[0], 0)))
        return Compared(
            np.concatenate([p[0] for p in parts]),
            None if d is None else np.concatenate([p[1] for p in parts if p[1] is not None], axis=1),
        )

    def _one(self, t: int, x: FloatArray, dx: FloatArray | None) -> tuple[FloatArray, FloatArray | None]:
        y, sd = self.phi[:, t], self.sd[:, t]
        there, w = np.isfinite(y), 1.0 / sd
        if self.reference is not None:
            q = self.reference[t]
            pivot = x[q] if x[q] != 0 else np.finfo(float).tiny
            a = y[q] / pivot
            keep = there & (np.arange(y.size) != q)
            residual = ((a * x - y) * w)[keep]
            if dx is None:
                return residual, None
            return residual, ((a * dx - a / pivot * dx[:, [q]] * x) * w)[:, keep]
        y, x, w = y[there], x[there], w[there]
        dx = None if dx is None else dx[:, there]
        return _scaled(x * w, y * w, None if dx is None else dx * w, None)

    def _of_space(
        self, t: int, mate: int, close: tuple[CloseMode, ...], state: State, slopes: bool
    ) -> tuple[FloatArray, FloatArray | None]:
        there = np.isfinite(self.phi[:, t])
        return _beyond(self.phi[there, t], 1.0 / self.sd[there, t], there, mate, close, state, slopes)


def _beyond(
    y: FloatArray,
    w: FloatArray,
    there: NDArray[np.bool_],
    mate: int,
    close: tuple[CloseMode, ...],
    state: State,
    slopes: bool,
) -> tuple[FloatArray, FloatArray | None]:
    """What a measured shape `y` (n_there,) times `w` has beyond the mate's and what `close` modes may add to it, and
    its derivatives (n_parameters, n_there)."""
    modes = [mate, *(c.mode for c in close)]
    vectors = np.vstack([y * w, state.value("phi")[there][:, modes].T * w])
    if not slopes:
        (yw, xw), _ = mixed(vectors, None, None, close)
        return _scaled(xw, yw, None, None)
    d = state.slope("phi")[:, there][:, :, modes].transpose(0, 2, 1) * w
    df = state.slope("freq")
    gaps = np.stack([c.ahead * df[:, c.mode] + c.behind * df[:, mate] for c in close], axis=1)
    (yw, xw), both = mixed(vectors, np.concatenate([np.zeros_like(d[:, :1]), d], axis=1), gaps, close)
    assert both is not None
    return _scaled(xw, yw, both[:, 1], both[:, 0])


def _scaled(
    xw: FloatArray, yw: FloatArray, dxw: FloatArray | None, dyw: FloatArray | None
) -> tuple[FloatArray, FloatArray | None]:
    """a x - y with the factor a of least squares, and its derivatives; `dyw` is None for a y that does not change."""
    norm = max(float(xw @ xw), np.finfo(float).tiny)
    a = float(xw @ yw) / norm
    residual = a * xw - yw
    if dxw is None:
        return residual, None
    da = (dxw @ yw - 2 * a * (dxw @ xw)) / norm
    if dyw is None:
        return residual, a * dxw + da[:, None] * xw
    da = da + dyw @ xw / norm
    return residual, a * dxw + da[:, None] * xw - dyw


@dataclass(frozen=True, eq=False)
class MacDifferences:
    """(1 - sqrt(MAC)) / sqrt(MAC) of shapes `phi` (n_sensors, n_test) over `sd` (n_test,) (Moller and Friberg 1998).

    NaN marks a sensor that was not there, in all modes. Close modes are compared as one space, as shape differences
    are. Its derivative vanishes where the shapes agree, so it says little near the answer: shape differences say more.
    """

    phi: FloatArray
    sd: FloatArray
    name: str = "MAC"

    def __post_init__(self) -> None:
        object.__setattr__(self, "phi", np.asarray(self.phi, dtype=np.float64))
        object.__setattr__(self, "sd", deviation(self.sd, (self.phi.shape[1],), self.name))

    @property
    def n_modes(self) -> int:
        """Number of measured modes."""
        return int(self.phi.shape[1])

    def compare(self, state: State, mates: Mates | None, slopes: bool) -> Compared:
        """Residuals of the paired shapes of `state`, in the order of the test modes of `mates`."""
        pairs = needed(mates, self.name)
        t, m = pairs.test, pairs.mate[pairs.test]
        there = np.isfinite(self.phi).all(axis=1)
        y, x = self.phi[there][:, t], state.value("phi")[there][:, m]
        xx, yy, xy = (x * x).sum(0), (y * y).sum(0), (x * y).sum(0)
        root = np.maximum(np.abs(xy) / np.sqrt(np.maximum(xx * yy, 1e-300)), 1e-6)
        spaces = {k: c for k, c in enumerate(pairs.close(state, int(there.sum()))) if c}
        if not slopes:
            for k, close in spaces.items():
                root[k] = self._of_space(int(t[k]), int(m[k]), close, state, False)[0]
            return Compared((1.0 / root - 1.0) / self.sd[t], None)
        dx = state.slope("phi")[:, there][:, :, m]
        droot = root * ((dx * y).sum(1) / np.where(xy == 0, 1e-300, xy) - (dx * x).sum(1) / xx)
        for k, close in spaces.items():
            root[k], droot[:, k] = self._of_space(int(t[k]), int(m[k]), close, state, True)
        return Compared((1.0 / root - 1.0) / self.sd[t], -droot / root**2 / self.sd[t])

    def _of_space(
        self, t: int, mate: int, close: tuple[CloseMode, ...], state: State, slopes: bool
    ) -> tuple[float, FloatArray]:
        """Root of the share of a shape that its mate and what `close` modes may add explain, with its derivatives."""
        there = np.asarray(np.isfinite(self.phi).all(axis=1))
        y = self.phi[there, t]
        w = np.full(y.size, 1.0 / (self.sd[t] * np.abs(y).max()))
        beyond, d = _beyond(y, w, there, mate, close, state, slopes)
        whole = float((y * w) @ (y * w))
        root = np.sqrt(max(1.0 - float(beyond @ beyond) / whole, 1e-12))
        return root, np.zeros(0) if d is None else -(d @ beyond) / whole / root


@dataclass(frozen=True, eq=False)
class Values:
    """Any result of the model by its `key`, compared as it stands: mass, centre of gravity, static displacements,
    operating shapes, order amplitudes. `measured` and `sd` have the result's shape; complex values count real and
    imaginary part, each with `sd`."""

    key: str
    measured: NDArray[Any]
    sd: FloatArray
    name: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "measured", np.asarray(self.measured))
        object.__setattr__(self, "name", self.name or self.key)
        object.__setattr__(self, "sd", deviation(self.sd, self.measured.shape, self.name))

    def compare(self, state: State, mates: Mates | None, slopes: bool) -> Compared:
        """Residuals of the flattened result of `state`, real parts first; `mates` play no part. Raises UpdatingError
        where the result has another shape than what was measured."""
        value = state.value(self.key)
        if value.shape != self.measured.shape:
            raise UpdatingError(f"{self.name}: {self.measured.shape} measured, {value.shape} computed")
        residual = ((value - self.measured) / self.sd).ravel()
        d = (state.slope(self.key) / self.sd).reshape(-1, residual.size) if slopes else None
        if np.iscomplexobj(residual):
            residual = np.concatenate([residual.real, residual.imag])
            d = None if d is None else np.concatenate([d.real, d.imag], axis=1)
        return Compared(np.asarray(residual, dtype=np.float64), d)


def needed(mates: Mates | None, name: str) -> Mates:
    """The `mates` of a response called `name`; raises UpdatingError where the configuration has no test modes."""
    if mates is None:
        raise UpdatingError(f"{name} belong to modes, and the configuration has no test modes; give it `test`")
    return mates


def stacked(parts: Sequence[Compared]) -> Compared:
    """Several comparisons one after the other."""
    residual = np.concatenate([p.residual for p in parts]) if parts else np.zeros(0)
    if any(p.slopes is None for p in parts) or not parts:
        return Compared(residual, None)
    return Compared(residual, np.concatenate([p.slopes for p in parts if p.slopes is not None], axis=1))
