"""Models condensed to their modes as a simulation takes them: modes that move, and modes that follow their force."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

__all__ = ["Condensed"]

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class Condensed:
    """One or several models with the same inputs.

    Attributes:
        modal: omega, zeta, phi_in, phi_out and w of the modes that move, one entry each a model.
        u: inputs (n_in, n) of every record as the simulation steps through them, at steps of `dt` s.
        residual: compliance (n_w, n_w) at the coordinates of the modes that follow statically, m/N.
        plain: inputs (n_in, n) of every record at the samples that are kept, at steps of `sample` s.
        from_u, from_f: displacements of the outputs through the modes that follow statically, for unit inputs and for
            unit forces at the coordinates, one matrix each a model.
    """

    modal: tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]
    u: list[FloatArray]
    dt: float
    residual: FloatArray
    plain: list[FloatArray]
    sample: float
    from_u: list[FloatArray]
    from_f: list[FloatArray]

    def inside(self, record: int, history: FloatArray) -> FloatArray:
        """The samples (..., n) of a history that a record has; the simulation goes on beyond its end."""
        return history[..., : self.plain[record].shape[1]]

    def static(self, model: int, f: FloatArray, record: int, inputs: bool = True) -> FloatArray:
        """Accelerations (n_out, n) through the modes of a model that follow statically, under law forces `f` (n_w, n or
        more) in a record and, with `inputs`, its own: second derivatives of the forces."""
        f = self.inside(record, f)
        from_u, from_f, n = self.from_u[model], self.from_f[model], f.shape[1]
        if not (from_u.any() or from_f.any()):
            return np.zeros((len(from_f), n))
        omega = 2 * np.pi * np.fft.rfftfreq(n, self.sample)
        drive = -from_f @ np.fft.rfft(f, axis=1)
        if inputs:
            drive += from_u @ self._driven[record]
        return np.asarray(np.fft.irfft(-(omega**2) * drive, n, axis=1))

    @cached_property
    def _driven(self) -> list[ComplexArray]:
        """Spectra (n_in, K) of every record's inputs: the same for all models."""
        return [np.fft.rfft(u, axis=1) for u in self.plain]
