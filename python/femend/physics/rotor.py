"""Laws that depend on the speed of rotation: gyroscopic coupling of two tilts, stiffness over speed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.errors import LawParameterError

__all__ = ["SpeedStiffness", "gyroscopic_matrix", "receptance_with_pair"]

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


def gyroscopic_matrix(ip: float, speed: float) -> Array:
    """G (2, 2) in N m s of a rotor with polar inertia `ip` (kg m^2) at `speed` (rad/s) on its two tilts.

    The moments G v resist the tilting velocities v = (theta_x', theta_y') and do no work, v' G v = 0 (Genta 2005). The
    derivative over `ip` is G / ip.

    >>> gyroscopic_matrix(0.04, 100.0).tolist()
    [[0.0, 4.0], [-4.0, 0.0]]
    """
    g = ip * speed
    return np.array([[0.0, g], [-g, 0.0]])


def receptance_with_pair(H: ComplexArray, w: Array, kappa: ComplexArray) -> ComplexArray:
    """Receptance (n_freq, n, n) of a structure with receptance `H` (n_freq, n, n) after a two-coordinate law is closed.

    `w` (2, n) are the directions of its coordinates, `kappa` (n_freq, 2, 2) its dynamic stiffness, i omega G for
    gyroscopic coupling (Sherman, Morrison and Woodbury). Raises LawParameterError for sizes that do not fit.

    >>> H, kappa = np.eye(2)[None] + 0j, np.array([[[0, 0.5j], [-0.5j, 0]]])
    >>> receptance_with_pair(H, np.eye(2), kappa)[0].round(3).tolist()
    [[(1.333+0j), -0.667j], [0.667j, (1.333+0j)]]
    """
    n_freq, n = H.shape[:2]
    if w.shape != (2, n) or kappa.shape != (n_freq, 2, 2):
        raise LawParameterError(
            f"w is {w.shape} and kappa {kappa.shape} beside a receptance of {H.shape}; they must be (2, {n}) and "
            f"({n_freq}, 2, 2)",
            law="gyroscopic",
        )
    loaded = H @ w.T
    own = w @ loaded
    return np.asarray(H - loaded @ np.linalg.solve(np.eye(2) + kappa @ own, kappa @ (w @ H)))


@dataclass(frozen=True, eq=False)
class SpeedStiffness:
    """A stiffness that is any smooth curve over speed: straight between the values `k` (n,) in N/m at `speeds` (n,) in
    rad/s, constant beyond them. At one speed it is a spring, `support_stiffness` with k(speed).

    Raises LawParameterError for speeds that do not rise or sizes that differ.

    >>> law = SpeedStiffness(np.array([0.0, 100.0, 200.0]), np.array([1e6, 2e6, 4e6]))
    >>> float(law.at(150.0)), law.weights(150.0).tolist()
    (3000000.0, [0.0, 0.5, 0.5])
    """

    speeds: Array
    k: Array

    def __post_init__(self) -> None:
        if len(self.speeds) != len(self.k) or len(self.k) < 2 or not (np.diff(self.speeds) > 0).all():
            raise LawParameterError(
                f"stiffness over speed needs two or more rising speeds and a stiffness for each; there are "
                f"{len(self.speeds)} speeds and {len(self.k)} stiffnesses",
                law="speed_stiffness",
            )

    def at(self, speed: ArrayLike) -> Array:
        """Stiffness in N/m at `speed` (rad/s)."""
        return np.asarray(np.interp(np.asarray(speed, dtype=float), self.speeds, self.k))

    def weights(self, speed: ArrayLike) -> Array:
        """dk(speed)/dk_i (..., n): the curve is linear in its values."""
        units, asked = np.eye(len(self.speeds)), np.asarray(speed, dtype=float)
        return np.stack([np.interp(asked, self.speeds, unit) for unit in units], axis=-1)

    def roughness(self) -> Array:
        """Matrix R (n, n) with k' R k the squared changes of slope over speed, scaled to the mean distance of speeds: a
        penalty that leaves straight lines alone."""
        n, step = len(self.speeds), np.diff(self.speeds)
        bend = np.zeros((max(n - 2, 0), n))
        for i in range(n - 2):
            bend[i, i] = 1 / step[i]
            bend[i, i + 1] = -1 / step[i] - 1 / step[i + 1]
            bend[i, i + 2] = 1 / step[i + 1]
        scaled = bend * step.mean()
        return np.asarray(scaled.T @ scaled)
