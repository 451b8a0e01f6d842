"""The reduced model of the bolted beams: frequency and damping of its mode over amplitude, with laws in the contact."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.io import loadmat
from scipy.linalg import eigh

from femend.physics import Parameter, Physics, physics
from femend.physics.harmonic import describing_function
from femend.physics.nested_extended import IWAN_GRID

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# tangential over normal stiffness of elastic bodies that touch, 2 (1 - nu) / (2 - nu) (Mindlin 1949), steel
MINDLIN = 2 * (1 - 0.3) / (2 - 0.3)
# directions of a patch in which a law may act, by their columns
DIRECTIONS: dict[str, tuple[int, ...]] = {"tangential": (0, 1), "normal": (2,)}
# amplitudes at which a describing function is tabled, and the decades it spans
TABLE, DECADES = 28, 2.8
# microslip as joints are known for: the catalogue's friction elements in parallel, their slip limits distributed by a
# power law up to `reach`, so that the loss of a cycle grows with the amplitude to the power 1 + `power` (Segalman 2005)
MICROSLIP = Physics(
    "power_law_microslip", "hysteretic", "microslip", "iwan", "nonlinear",
    (Parameter("k", (1, -1, 0)), Parameter("reach", (0, 1, 0), shape=True),
     Parameter("power", (0, 0, 0), "above_one", shape=True)),
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Backbone:
    """Modal amplitude Q (kg^0.5 m), circular frequency omega (rad/s) and damping ratio zeta, each (n,)."""

    Q: FloatArray
    omega: FloatArray
    zeta: FloatArray

    def error(self, other: Backbone) -> float:
        """RMS distance of the poles of `other` from these, relative to their size."""
        return float(np.sqrt(np.mean((other.omega / self.omega - 1) ** 2 + (other.zeta - self.zeta) ** 2)))


class Beams:
    """The reduced model: K, M, patches' mean relative motion T' x, and the mode that was measured."""

    def __init__(self, file: Path) -> None:
        content = loadmat(file)
        self.K, self.M = (np.ascontiguousarray(content[name], dtype=float) for name in "KM")
        patches, dofs = int(content["Npatches"].item()), int(content["dofred"].item())
        columns = [dofs * patch + axis for patch in range(patches) for axis in range(3)]
        self.T = np.ascontiguousarray(content["LamT"][:, columns], dtype=float)
        self.area = content["PatchAreas"].ravel().repeat(3)
        self.share = np.tile([MINDLIN, MINDLIN, 1.0], patches)

    def linear(self, k: float) -> FloatArray:
        """Stiffness matrix with the contact's springs."""
        return self.K + (self.T * (k * self.area * self.share)) @ self.T.T

    def modes(self, k: float) -> tuple[FloatArray, FloatArray]:
        """Squares of the circular frequencies (n,) and mass-normalised shapes (38, n), without damping."""
        lam, phi = eigh(self.linear(k), self.M)
        return lam, phi

    def columns(self, direction: str) -> NDArray[np.intp]:
        """Columns of T for a direction at all patches."""
        at = DIRECTIONS[direction]
        return np.array([i for i in range(self.T.shape[1]) if i % 3 in at])

    def backbone(
        self, k: float, laws: Sequence[tuple[NDArray[np.intp], Table]], Q: FloatArray, start: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """omega and zeta of the mode nearest to `start` (38,) at amplitudes Q: the motion repeats itself where damping
        proportional to mass takes back what the laws take (extended periodic motion), by its first harmonic.

        (K + T kappa(A) T' - lambda M) phi = 0 with A = Q |T' phi|, by inverse iteration with Rayleigh quotients; the
        imaginary part of kappa enters in first order, to some 1e-6 of the complex eigenvalue.
        """
        base = self.linear(k)
        phi = np.tile(start, (len(Q), 1))
        lam = np.full(len(Q), np.nan)
        for _ in range(40):
            stiffness = np.tile(base, (len(Q), 1, 1))
            loss = np.zeros(len(Q))
            for at, table in laws:
                d = phi @ self.T[:, at]
                kappa = table(Q[:, None] * np.abs(d))
                stiffness += (self.T[:, at] * kappa.real[:, None, :]) @ self.T[:, at].T
                loss += (kappa.imag * d**2).sum(axis=1)
            new = np.einsum("qi,qij,qj->q", phi, stiffness, phi)
            if np.all(np.abs(new - lam) < 1e-11 * np.abs(new)):
                break
            lam = new
            shifted = stiffness - (lam * (1 - 1e-9))[:, None, None] * self.M
            phi = np.linalg.solve(shifted, (phi @ self.M)[:, :, None])[:, :, 0]
            phi /= np.sqrt(np.einsum("qi,ij,qj->q", phi, self.M, phi))[:, None]
        lam = np.maximum(lam, 1.0)
        return np.sqrt(lam), loss / (2 * lam)


class Table:
    """Describing function (N/m) of a law, interpolated over the logarithm of the amplitude up to `top` (m)."""

    def __init__(self, law: Physics, values: Mapping[str, float], top: float, omega: float) -> None:
        at = np.geomspace(top * 10**-DECADES, top, TABLE)
        if law is MICROSLIP:
            law, values = physics("iwan"), elements(values)
        self.at, self.kappa = np.log(at), describing_function(law, values, at, omega)

    def __call__(self, A: FloatArray) -> ComplexArray:
        x = np.log(np.maximum(A, 1e-30))
        return np.interp(x, self.at, self.kappa.real) + 1j * np.interp(x, self.at, self.kappa.imag)


def elements(values: Mapping[str, float]) -> dict[str, float]:
    """The catalogue's friction elements of a power-law microslip."""
    weights = [limit ** (values["power"] - 1) for limit in IWAN_GRID]
    slopes = {f"k{i}": values["k"] * weight / sum(weights) for i, weight in enumerate(weights, 1)}
    return {**slopes, "span": values["reach"]}
