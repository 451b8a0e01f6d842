"""What the sensors' own mass does to the modes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.errors import PretestError
from femend.pretest.placement import target_shapes

__all__ = ["MassLoading", "mass_loading"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class MassLoading:
    """`freq` (n_modes,) Hz with the sensors on, `shift` (n_modes,) (f_with - f) / f, `mac` (n_modes,) of the shapes
    with those without, and `phi` (n_dof, n_modes) with them."""

    freq: FloatArray
    shift: FloatArray
    mac: FloatArray
    phi: FloatArray

    @property
    def worst(self) -> int:
        """The mode whose frequency moves most, from 0."""
        return int(np.argmax(np.abs(self.shift)))


def mass_loading(phi: ArrayLike, freq: ArrayLike, rows: ArrayLike, masses: ArrayLike) -> MassLoading:
    """Modes with point masses `masses` (n,) acting at DOFs `rows` (n,) of mass-normalised `phi` (n_dof, n_modes).

    The structure with its sensors is solved in the space of the modes given, at `freq` (n_modes,) Hz:
    (diag(omega^2) - lambda (I + phi_s^T m phi_s)) q = 0. With all modes that is exact; with some, frequencies are upper
    bounds (Rayleigh), good for masses that are small beside the modal ones; to first order df / f = - m phi_s^2 / 2. A
    mass that moves in three directions has three rows. Raises PretestError for sizes that do not fit and masses below
    0.

    >>> mass_loading([[1.0]], [1.0], [0], [3.0]).freq.round(9).tolist()  # 1 kg, and 3 more
    [0.5]
    """
    from scipy.linalg import eigh

    x, f = target_shapes(phi), np.asarray(freq, dtype=np.float64)
    at, m = np.asarray(rows, dtype=np.int64).ravel(), np.asarray(masses, dtype=np.float64)
    m = np.broadcast_to(m, at.shape)
    if f.shape != (x.shape[1],) or not (m >= 0).all():
        raise PretestError(f"{f.size} frequencies for {x.shape[1]} modes, smallest mass {m.min(initial=0):g}")
    if at.size and not (at.min() >= 0 and at.max() < x.shape[0]):
        raise PretestError(f"row {int(at.max())} is named, the shapes have rows 0 to {x.shape[0] - 1}")
    seen = x[at] * np.sqrt(m)[:, None]
    lam, Q = eigh(np.diag((2 * np.pi * f) ** 2), np.eye(f.size) + seen.T @ seen)
    with_mass = x @ Q
    new = np.sqrt(np.maximum(lam, 0.0)) / (2 * np.pi)
    shift = np.divide(new - f, f, out=np.zeros_like(f), where=f > 0)
    top = (x * with_mass).sum(axis=0) ** 2
    mac = np.clip(top / ((x**2).sum(axis=0) * (with_mass**2).sum(axis=0)), 0.0, 1.0)
    return MassLoading(new, shift, mac, with_mass)
