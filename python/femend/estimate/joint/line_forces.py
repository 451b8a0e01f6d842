"""Harmonic bearing forces line by line: operating shapes through the model's receptances, regularised by the data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.data.bands import within_band
from femend.estimate.joint.receptance import receptance
from femend.estimate.joint.rotor import Run, Unbalance
from femend.estimate.loads.regularise import regularised_lines
from femend.model.terms.configured import ConfiguredModel

__all__ = ["LineForces", "OdsFrf", "line_forces", "ods_frf"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# share of the operating shape that may stay unexplained, and relative deviation of the forces, where they are reliable
UNEXPLAINED, UNCERTAIN = 0.10, 0.10
# share of a window's lines up to which other orders have a slope each
SLOPED = 2.0 / 3.0


@dataclass(frozen=True, eq=False)
class OdsFrf:
    """Operating shapes over frequency per unit course Omega^2 cos(theta): `Y` (K, n_out) at `freq` (K,) Hz, with
    standard deviation `sd` (K, n_out) of every value."""

    freq: FloatArray
    Y: ComplexArray
    sd: FloatArray


def ods_frf(run: Run, y: FloatArray, freq: FloatArray, width: float, *, beside: Sequence[Run] = ()) -> OdsFrf:
    """Deconvolves accelerations y (n_out, n) of a run by its course, at lines `freq` (K,), each averaged over `width`
    Hz.

    The spectrum of the whole record over that of the course, sum Y conj(F) / sum |F|^2 in every window (H1; Bendat and
    Piersol, Random Data, 4th ed., eq. 6.37): since both are whole transforms, a sweep through a resonance at any pace
    gives the steady response there. What differs from line to line within a window is noise. `beside` are the courses
    of other orders in the same record: each passes a line at another time, so that its spectrum has another phase from
    line to line, and all that pass one are fitted together there.
    """
    padded = np.zeros((len(y), run.padded))
    padded[:, run.lead : run.lead + run.n] = y
    spectrum = np.fft.rfft(padded, axis=1).T
    F, passed = run.F[:, 0], [np.array([r.omega.min(), r.omega.max()]) / (2 * np.pi) for r in beside]
    shapes, deviation = [], []
    for f in freq:
        inside = np.flatnonzero(np.abs(run.freq - f) <= 0.5 * width)
        # a straight line in frequency, so that the slope of a resonance is not taken for noise
        x = (run.freq[inside] - f) / width
        others = [r.F[inside, 0] for r, (low, high) in zip(beside, passed, strict=True) if low <= f <= high]
        near = F[inside]
        columns = [near, near * x, *others]
        if 2 * (1 + len(others)) <= SLOPED * len(inside):
            columns += [other * x for other in others]
        A = np.column_stack(columns)
        fit, *_ = np.linalg.lstsq(A, spectrum[inside], rcond=None)
        left = spectrum[inside] - A @ fit
        power = float((np.abs(near) ** 2).sum())
        if others:
            power = 1.0 / max(float(np.linalg.pinv(A.conj().T @ A)[0, 0].real), 1e-300)
        shapes.append(fit[0])
        free = max(len(inside) - A.shape[1], 1)
        deviation.append(np.sqrt((np.abs(left) ** 2).sum(axis=0) / free / power))
    return OdsFrf(np.asarray(freq, dtype=np.float64), np.array(shapes), np.maximum(np.array(deviation), 1e-300))


@dataclass(frozen=True, eq=False)
class LineForces:
    """Forces on the bearings line by line.

    `force` (K, n_bearings, 2) complex amplitudes across the shaft along e_u and e_v, against cos(theta), in force
    units; `sd` the same shape; `condition` (K,) of the weighted receptance, `unexplained` (K,) share of the operating
    shape that the forces leave, `regularisation` (K,) as chosen (relative), `reliable` (K,).
    """

    freq: FloatArray
    force: ComplexArray
    sd: FloatArray
    condition: FloatArray
    unexplained: FloatArray
    regularisation: FloatArray
    reliable: NDArray[np.bool_]

    def unbalances(self, sense: int) -> ComplexArray:
        """U exp(i phi) (K, n_bearings) that the lines say: the part of the force that turns in the sense `sense`."""
        omega2 = (2 * np.pi * self.freq[:, None]) ** 2
        return np.asarray(0.5 * (self.force[:, :, 0] + 1j * sense * self.force[:, :, 1]) / omega2)

    def sense(self) -> int:
        """The sense of rotation, +1 or -1 about the shaft's axis, in which more of the reliable forces turn."""
        return 1 if self.turning(1) >= 0.5 else -1

    def turning(self, sense: int) -> float:
        """Share of the reliable forces, by the squares of their unbalance, that turns in the `sense` +1 or -1."""
        use = self.reliable if self.reliable.any() else np.ones(len(self.freq), dtype=bool)
        along, against = (float((np.abs(self.unbalances(s)[use]) ** 2).sum()) for s in (sense, -sense))
        return along / (along + against) if along else 0.0

    def exponent(self, sense: int, band: tuple[float, float]) -> tuple[float, float]:
        """n and its standard deviation in |F| ~ Omega^n over reliable lines in `band` (Hz), all bearings together.

        A straight line through ln|F| over ln(Omega) with a level of its own for every bearing; nan with fewer than
        three lines.
        """
        use = self.reliable & within_band(self.freq, band)
        if use.sum() < 3:
            return float("nan"), float("nan")
        x = np.log(self.freq[use])
        size = np.log(np.maximum(np.abs(self.unbalances(sense)[use]), 1e-300))
        slopes = (x - x.mean()) @ (size - size.mean(axis=0)) / ((x - x.mean()) ** 2).sum()
        left = size - size.mean(axis=0) - np.outer(x - x.mean(), slopes)
        n = float(slopes.mean())
        scatter = float(np.sqrt((left**2).sum() / (left.size - 2 * left.shape[1]) / ((x - x.mean()) ** 2).sum()))
        return 2.0 + n, max(scatter / np.sqrt(left.shape[1]), float(slopes.std()) / np.sqrt(len(slopes)))


def line_forces(
    model: ConfiguredModel,
    p: FloatArray,
    shapes: OdsFrf,
    unbalance: Unbalance,
    out: FloatArray,
    bearings: FloatArray,
    credible: NDArray[np.bool_] | tuple[float, float],
) -> LineForces:
    """Solves every line of `shapes` for the forces across the shaft at all `bearings`, each component free.

    The `model` is taken at the unknowns `p` (n,); `out` (n_out, r) and `bearings` (n_bearings, 3, r) are rows of its
    basis, of the latter in X, Y, Z.

    Tikhonov's regularisation with the parameter of least generalised cross validation (Golub, Heath and Wahba,
    Technometrics 21 (1979) 215-223). A line is reliable inside `credible`, a band in Hz or a mask (K,) of
    the lines where the model's modes have been checked, if the forces explain the shape and are well determined.
    """
    u, v = unbalance.plane
    rows = bearings[:, [u, v]].reshape(-1, bearings.shape[2])
    H = receptance(model, p, 2j * np.pi * shapes.freq, unbalance.speed(shapes.freq)).between(out, rows)
    floor = 0.01 * np.sqrt((np.abs(shapes.Y) ** 2).mean(axis=1))
    w = 1.0 / np.hypot(shapes.sd, floor[:, None])
    solved = regularised_lines(H * w[:, :, None], shapes.Y * w)
    left = shapes.Y - np.einsum("kmn,kn->km", H, solved.x)
    # what the forces leave above the noise makes their deviations larger
    free = max(H.shape[1] - H.shape[2], 1)
    scale = np.maximum(((np.abs(left) * w) ** 2).sum(axis=1) / free, 1.0)
    spread = np.sqrt(scale[:, None] * np.einsum("kii->ki", solved.C).real)
    unexplained = np.linalg.norm(left, axis=1) / np.maximum(np.linalg.norm(shapes.Y, axis=1), 1e-300)
    course = (2 * np.pi * shapes.freq[:, None]) ** 2
    force, deviation = np.asarray(solved.x * course), spread * course
    inside = within_band(shapes.freq, credible) if isinstance(credible, tuple) else credible.copy()
    size = np.sqrt((np.abs(force) ** 2).sum(axis=1))
    reliable = inside & (unexplained < UNEXPLAINED) & (np.sqrt((deviation**2).sum(axis=1)) < UNCERTAIN * size)
    shape = (len(shapes.freq), len(bearings), 2)
    return LineForces(
        shapes.freq,
        force.reshape(shape),
        deviation.reshape(shape),
        solved.condition,
        unexplained,
        solved.parameter,
        reliable,
    )
