"""FRFs and orthogonality as responses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from femend.data.bands import within_band
from femend.errors import UpdatingError
from femend.estimate.updating.responses import Compared, Mates, deviation, needed
from femend.estimate.updating.state import State

__all__ = ["CrossOrthogonality", "FracDifferences", "FrfDifferences"]

FloatArray = NDArray[np.float64]
# below this share of its largest magnitude a measured FRF has no logarithm worth comparing
SILENT = 1e-12


@dataclass(frozen=True, eq=False)
class FrfDifferences:
    """Measured FRFs `H` (n_freq, n_out, n_in) on the lines the system was asked for.

    `of` "complex": H - H_measured over `sd` (same shape or one number, unit of H; real and imaginary part each).
    `of` "logarithm": ln |H| over `sd` as a relative deviation; it weighs antiresonances as much as resonances and has
    wide basins. `noise` and `floor`, as `sd` in shape and in the unit of H, keep what stands for nothing from being
    compared there: ln of sqrt(|H|^2 + noise^2 + floor^2), which is what a test with such noise would show in the mean
    square, with that of the measured magnitude, no less than its noise, over the same floor. A line that is far below
    both in the model has no slope, however far it is from the measured one. `bands` are (low, high) in Hz with `freq`
    (n_freq,) to look them up: other lines are left out. Raises UpdatingError where no line lies in a band.
    """

    H: NDArray[np.complex128]
    sd: FloatArray
    of: Literal["complex", "logarithm"] = "complex"
    freq: FloatArray | None = None
    bands: tuple[tuple[float, float], ...] = ()
    name: str = "FRFs"
    noise: FloatArray | float = 0.0
    floor: FloatArray | float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "H", np.asarray(self.H, dtype=np.complex128))
        object.__setattr__(self, "sd", deviation(self.sd, self.H.shape, self.name))
        if self.of not in ("complex", "logarithm"):
            raise UpdatingError(f"{self.name}: {self.of!r} cannot be compared; take complex or logarithm")
        for about in ("noise", "floor"):
            object.__setattr__(self, about, self._magnitude(about))
        if not self._lines().any():
            raise UpdatingError(f"{self.name}: no line lies in the bands {self.bands}")

    def _magnitude(self, about: str) -> FloatArray:
        """`noise` or `floor` at every value of H. Raises UpdatingError where it does not fit, or is negative."""
        given = np.asarray(getattr(self, about), dtype=np.float64)
        if given.ndim and given.shape != self.H.shape:
            raise UpdatingError(f"{self.name}: {about} of shape {given.shape} for values of shape {self.H.shape}")
        if not (np.isfinite(given).all() and (given >= 0).all()):
            raise UpdatingError(f"{self.name}: {about} has to be finite and not negative; it holds {given.min():g}")
        return np.broadcast_to(given, self.H.shape)

    def _lines(self) -> NDArray[np.bool_]:
        keep = np.ones(self.H.shape[0], dtype=np.bool_)
        if self.bands:
            if self.freq is None:
                raise UpdatingError(f"{self.name} have bands and no `freq` to look them up")
            keep = np.any([within_band(self.freq, band) for band in self.bands], axis=0)
        return keep

    def compare(self, state: State, mates: Mates | None, slopes: bool) -> Compared:
        """Residuals of the lines of `state` in the bands; `mates` play no part. Raises UpdatingError where the FRFs
        computed are others than those measured."""
        keep = self._lines()
        H, H0, sd = state.value("frf")[keep], self.H[keep], self.sd[keep]
        if H.shape != H0.shape:
            raise UpdatingError(f"{self.name}: {H0.shape} measured, {H.shape} computed")
        d = state.slope("frf")[:, keep] if slopes else None
        if self.of == "logarithm":
            loud = np.abs(H0) > SILENT * np.abs(H0).max()
            noise, floor = np.asarray(self.noise)[keep] ** 2, np.asarray(self.floor)[keep] ** 2
            measured = np.maximum(np.abs(H0) ** 2, noise) + floor
            # of the square, so that no value is 0 where neither noise nor floor is known
            computed = np.maximum(np.abs(H) ** 2 + noise + floor, np.finfo(float).tiny)
            r = 0.5 * np.log(computed / np.where(loud, measured, 1.0)) / sd
            dr = None if d is None else (d * H.conj()).real / computed / sd
            return Compared(r[loud], None if dr is None else dr[:, loud])
        r2 = ((H - H0) / sd).ravel()
        d2 = None if d is None else (d / sd).reshape(d.shape[0], -1)
        return Compared(
            np.concatenate([r2.real, r2.imag]), None if d2 is None else np.concatenate([d2.real, d2.imag], axis=1)
        )


@dataclass(frozen=True, eq=False)
class FracDifferences:
    """(1 - sqrt(c)) / `sd` with c the FRAC of every FRF (`along` "lines"; Heylen and Lammens 1996) or the CSAC of every
    line (`along` "places"; Dascotte and Strobbe 1999) of `H` (n_freq, n_out, n_in): shape alone, whatever the
    amplitude.
    """

    H: NDArray[np.complex128]
    sd: FloatArray
    along: Literal["lines", "places"] = "lines"
    name: str = "FRAC"

    def __post_init__(self) -> None:
        object.__setattr__(self, "H", np.asarray(self.H, dtype=np.complex128))
        count = self.H.shape[0] if self.along == "places" else self.H[0].size
        object.__setattr__(self, "sd", deviation(self.sd, (count,), self.name))

    def _signatures(self, H: NDArray[Any]) -> NDArray[Any]:
        """(..., n_signatures, n_entries)."""
        flat = H.reshape(*H.shape[:-2], -1)
        return flat if self.along == "places" else np.swapaxes(flat, -1, -2)

    def compare(self, state: State, mates: Mates | None, slopes: bool) -> Compared:
        """Residuals of the FRFs of `state`; `mates` play no part."""
        x, y = self._signatures(state.value("frf")), self._signatures(self.H)
        xx, yy = (np.abs(x) ** 2).sum(-1), (np.abs(y) ** 2).sum(-1)
        xy = (x.conj() * y).sum(-1)
        root = np.maximum(np.abs(xy) / np.sqrt(np.maximum(xx * yy, 1e-300)), 1e-9)
        residual = (1.0 - root) / self.sd
        if not slopes:
            return Compared(residual, None)
        dx = self._signatures(state.slope("frf"))
        top = (dx.conj() * y).sum(-1)
        share = (top * xy.conj()).real / np.maximum(np.abs(xy) ** 2, 1e-300) - (dx.conj() * x).sum(-1).real / xx
        return Compared(residual, -root * share / self.sd)


@dataclass(frozen=True, eq=False)
class CrossOrthogonality:
    """phi_test^T M phi of the paired modes, 0 off the diagonal where the model is right, over `sd`.

    `phi` (n_sensors, n_test) are real test shapes, `M` (n_sensors, n_sensors) a mass matrix reduced to the sensors;
    both shapes are scaled to 1 in it. Raises UpdatingError for an `M` of another size, shapes without positive modal
    mass and an `sd` that is not above 0.
    """

    phi: FloatArray
    M: FloatArray
    sd: float
    name: str = "orthogonality"

    def __post_init__(self) -> None:
        object.__setattr__(self, "phi", np.asarray(self.phi, dtype=np.float64))
        deviation(self.sd, (), self.name)
        if np.shape(self.M) != (self.phi.shape[0],) * 2:
            raise UpdatingError(
                f"a mass matrix of shape {np.shape(self.M)} for {self.phi.shape[0]} sensors; reduce it to the sensors"
            )
        mass = np.einsum("it,ij,jt->t", self.phi, self.M, self.phi)
        if not (mass > 0).all():
            mode = int(np.flatnonzero(~(mass > 0))[0])
            raise UpdatingError(
                f"test mode {mode + 1} has the modal mass {mass[mode]:g} over M; leave it out, or mend M"
            )

    def compare(self, state: State, mates: Mates | None, slopes: bool) -> Compared:
        """Residuals of the paired modes of `state`, row by row of `mates`, the diagonal left out."""
        pairs = needed(mates, self.name)
        t, m = pairs.test, pairs.mate[pairs.test]
        y, x = self.phi[:, t], state.value("phi")[:, m]
        y = y / np.sqrt(np.einsum("it,ij,jt->t", y, self.M, y))
        norm = np.sqrt(np.einsum("it,ij,jt->t", x, self.M, x))
        C = y.T @ self.M @ x / norm
        off = ~np.eye(t.size, dtype=np.bool_)
        if not slopes:
            return Compared(C[off] / self.sd, None)
        dx = state.slope("phi")[:, :, m]
        dnorm = np.einsum("it,ij,pjt->pt", x, self.M, dx) / norm
        dC = (y.T @ self.M) @ dx / norm - C * (dnorm / norm)[:, None, :]
        return Compared(C[off] / self.sd, dC[:, off] / self.sd)
