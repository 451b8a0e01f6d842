"""Residuals of identified modes: frequencies, damping ratios and complex shapes."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from femend.errors import RecordingError
from femend.model.terms.configured import ConfiguredModel
from femend.numerals import plain

__all__ = ["ModesBlock", "modal_assurance"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# modes farther apart than this in ln(frequency) are not the same, however alike their shapes
REACH = 0.35
# squares per value beyond which a mode counts less and less: it may be none of the structure's (a pole that came twice)
SUSPECT = 10.0


def modal_assurance(a: ComplexArray, b: ComplexArray) -> FloatArray:
    """MAC (n_a, n_b) of complex shapes (n_dof, n) as |a^H b|^2 / (a^H a b^H b) (Allemang and Brown, IMAC 1982)."""
    cross = np.abs(a.conj().T @ b) ** 2
    size = np.outer((np.abs(a) ** 2).sum(axis=0), (np.abs(b) ** 2).sum(axis=0))
    return np.asarray(cross / np.maximum(size, 1e-300))


@dataclass(frozen=True, eq=False)
class ModesBlock:
    """Identified poles `poles` (m,) rad/s and shapes (n_dof, m) with standard deviations.

    `freq_sd` (relative) and `zeta_sd` (relative) (m,), `shape_sd` (n_dof, m) of shapes scaled to a largest component
    of 1; `rows` (n_dof, r) of the basis at the shapes' DOFs. Each identified mode is paired with one of the model's by
    likeness of shape and frequency, anew at every evaluation; the shape's complex factor is projected out.

    The squares q of a mode enter as c q / (c + q), so that a mode that is none cannot decide anything (Geman and
    McClure, Bull. ISI 52 (1987) 5-21); the derivatives are those of this sum.
    """

    name: str
    model: ConfiguredModel
    poles: ComplexArray
    shapes: ComplexArray
    freq_sd: FloatArray
    zeta_sd: FloatArray
    shape_sd: FloatArray
    rows: FloatArray
    weight: float = 1.0
    _scaled: ComplexArray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        largest = np.abs(self.shapes).max(axis=0)
        object.__setattr__(self, "_scaled", self.shapes / np.where(largest > 0, largest, 1.0))

    @property
    def n_values(self) -> float:
        """Independent real values."""
        return self.weight * len(self.poles) * (2.0 + 2.0 * (self.shapes.shape[0] - 1))

    def pairs(self, p: FloatArray) -> tuple[ComplexArray, ComplexArray, FloatArray]:
        """Poles (m,) and shapes (n_dof, m) of the model's paired modes at `p` (n,), and the MAC (m,) of every pair."""
        lam, psi = self.model.damped_modes(p)
        at = self._pairing(lam, psi)
        found = self.rows @ psi[:, at]
        return lam[at], found, np.diag(modal_assurance(self._scaled, found))

    def nearest(self, p: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Frequencies (m,) in Hz of the model's modes that are most like the identified ones at `p` (n,), and their MAC
        (m,); two poles of one mode are both like it, unlike in `pairs`."""
        lam, psi = self.model.damped_modes(p)
        mac, unlike = self._likeness(lam, psi)
        at = np.argmin(unlike, axis=1)
        return np.abs(lam[at]) / (2 * np.pi), mac[np.arange(len(at)), at]

    def _likeness(self, lam: ComplexArray, psi: ComplexArray) -> tuple[FloatArray, FloatArray]:
        """MAC (m, r) of identified modes with the model's, and how unlike they are in shape and frequency; raises
        RecordingError for a model without modes."""
        if not len(lam):
            measured = np.abs(self.poles) / (2 * np.pi)
            raise RecordingError(
                f"recording {self.name!r}: its {len(measured)} modes are at {plain(measured.min())} to "
                f"{plain(measured.max())} Hz, and the model has none that swings up to there; check the time axis (a "
                "column that counts milliseconds is called 'time [ms]'), and stiffness, mass and units of the deck",
                recording=self.name,
            )
        mac = modal_assurance(self._scaled, self.rows @ psi)
        apart = np.log(np.abs(lam)[None] / np.abs(self.poles)[:, None])
        return mac, (1.0 - mac) + (apart / REACH) ** 2

    def _pairing(self, lam: ComplexArray, psi: ComplexArray) -> NDArray[np.int64]:
        unlike = self._likeness(lam, psi)[1]
        if unlike.shape[1] < unlike.shape[0]:
            return np.argmin(unlike, axis=1)
        return np.asarray(linear_sum_assignment(unlike)[1])

    def gauss_newton(self, p: FloatArray, derivatives: bool) -> tuple[float, FloatArray, FloatArray]:
        """Sum of squares, J'r (n,) and J'J (n, n) at `p` (n,); zeros in place of the last two without `derivatives`."""
        n = len(p)
        lam, psi = self.model.damped_modes(p)
        at = self._pairing(lam, psi)
        _, M, C = self.model.matrices(p)
        index, dK, dM, dC = self.model.derivatives(p)
        total, gradient, A = 0.0, np.zeros(n), np.zeros((n, n))
        basis = _normalised(lam, psi, M, C) if derivatives else psi
        for i, j in enumerate(at):
            r, J = self._mode(i, int(j), lam, basis, (dK, dM, dC) if derivatives else None)
            squares = float((np.abs(r) ** 2).sum())
            slope = 1.0 / (1.0 + squares / (SUSPECT * 2.0 * len(r)))
            total += self.weight * slope * squares
            if derivatives:
                gradient[index] += self.weight * slope**2 * (J.conj() @ r).real
                A[np.ix_(index, index)] += self.weight * slope**2 * (J.conj() @ J.T).real
        return total, gradient, A

    def _mode(
        self,
        i: int,
        j: int,
        lam: ComplexArray,
        psi: ComplexArray,
        changes: tuple[FloatArray, FloatArray, FloatArray] | None,
    ) -> tuple[ComplexArray, ComplexArray]:
        """Residuals (2 + n_dof,) of identified mode i against the model's j, and derivatives (m, 2 + n_dof)."""
        pole, own = self.poles[i], lam[j]
        w = 1.0 / self.shape_sd[:, i]
        target, v = w * self._scaled[:, i], w * (self.rows @ psi[:, j])
        scale = (v.conj() @ target) / (v.conj() @ v)
        r = np.concatenate(
            [
                [np.log(np.abs(own) / np.abs(pole)) / self.freq_sd[i]],
                [np.log(max(-own.real / np.abs(own), 1e-9) / (-pole.real / np.abs(pole))) / self.zeta_sd[i]],
                scale * v - target,
            ]
        )
        if changes is None:
            return r, np.zeros((0, len(r)), dtype=complex)
        dlam, dpsi = _mode_changes(j, lam, psi, *changes)
        ratio = dlam / own  # d ln |lam| and of the angle
        d_ln_zeta = dlam.real / own.real - ratio.real
        dv = (dpsi @ self.rows.T) * w
        # variable projection with Kaufman's approximation: the part of the change that no factor could undo
        moved = scale * dv
        moved = moved - np.outer((moved @ v.conj()) / (v.conj() @ v), v)
        J = np.column_stack([ratio.real / self.freq_sd[i], d_ln_zeta / self.zeta_sd[i], moved])
        return r, J


def _normalised(lam: ComplexArray, psi: ComplexArray, M: FloatArray, C: FloatArray) -> ComplexArray:
    """Shapes scaled to psi' (2 lam M + C) psi = 1 (modal A = 1; Balmès, State-space... normal modes, 1997, eq. 6)."""
    a = np.einsum("ij,ij->j", psi, (M @ psi) * (2 * lam) + C @ psi)
    return np.asarray(psi / np.sqrt(a))


def _mode_changes(
    j: int, lam: ComplexArray, psi: ComplexArray, dK: FloatArray, dM: FloatArray, dC: FloatArray
) -> tuple[ComplexArray, ComplexArray]:
    """d lam_j (m,) and d psi_j (m, r) for modes with modal A = 1 (Adhikari, J. Eng. Mech. 125 (1999) 1372-1377).

    The shape's change is expanded in all modes and their conjugates; along itself it is left out, a change of factor.
    """
    own, v = lam[j], psi[:, j]
    g = dK @ v + own * (dC @ v) + own**2 * (dM @ v)  # (m, r)
    dlam = -(g @ v)
    others = np.flatnonzero(np.arange(len(lam)) != j)
    all_lam = np.concatenate([lam[others], lam.conj()])
    all_psi = np.hstack([psi[:, others], psi.conj()])
    gap = own - all_lam
    least = 1e-6 * np.abs(own)
    gap = np.where(np.abs(gap) < least, least, gap)
    return dlam, -((g @ all_psi) / gap) @ all_psi.T
