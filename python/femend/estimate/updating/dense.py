"""Small models in full matrices: chains, and large models in a basis."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.errors import ModelError
from femend.estimate.updating.requests import DAMPING, Frfs, Statics, damping_matrix
from femend.estimate.updating.state import State, check_factors

__all__ = ["DenseSystem"]

FloatArray = NDArray[np.float64]

# modes whose eigenvalues differ by less than this share have no derivatives of their own
GAP = 1e-8


@dataclass(frozen=True, eq=False)
class DenseSystem:
    """K = K0 + sum of factor x dK, M = M0 + sum of factor x dM, all (n, n), seen through `sensors` (n_sensors, n).

    `names` belong to `dK`, `dM` (n_parameters, n, n); with `frfs` three more follow: "alpha", "beta" (proportional
    damping, 1/s and s) and "eta" (loss factor of K). Gives "freq" and "phi" of the lowest `n_modes`, and "frf" and
    "static" where asked for. Raises ModelError where M is not positive definite.
    """

    parameters: tuple[str, ...]
    K0: FloatArray
    M0: FloatArray
    dK: FloatArray
    dM: FloatArray
    sensors: FloatArray
    n_modes: int
    frfs: Frfs | None = None
    statics: Statics | None = None
    defaults: Mapping[str, float] = field(default_factory=dict)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters, the damping's last."""
        return self.parameters + (DAMPING if self.frfs is not None else ())

    def solve(self, factors: FloatArray) -> State:
        """Results at `factors` (n_parameters,); raises UpdatingError for another number of them, ModelError for a mass
        that is not positive definite."""
        import scipy.linalg

        check_factors(self.names, factors)
        n = len(self.parameters)
        own = factors[:n]
        K = self.K0 + np.tensordot(own, self.dK, 1)
        M = self.M0 + np.tensordot(own, self.dM, 1)
        try:
            lam, phi = scipy.linalg.eigh(K, M)
        except np.linalg.LinAlgError as error:
            raise ModelError(
                f"the mass matrix is not positive definite at factors {np.round(own, 4).tolist()}"
            ) from error
        lam = np.maximum(lam, 0.0)
        freq = np.sqrt(lam[: self.n_modes]) / (2 * np.pi)
        values: dict[str, NDArray[Any]] = {"freq": freq, "phi": self.sensors @ phi[:, : self.n_modes]}
        Z: NDArray[Any] | None = None
        if self.frfs is not None:
            Z = self._dynamic(K, M, factors[n:])
            values["frf"] = self._frf(np.linalg.solve(Z, self.sensors[list(self.frfs.inputs)].T))
        if self.statics is not None:
            values["static"] = self.sensors[list(self.statics.outputs)] @ np.linalg.solve(K, self.statics.loads)
        return State(values, lambda _: self._slopes(K, M, lam, phi, Z, factors[n:]))

    def _slopes(
        self,
        K: FloatArray,
        M: FloatArray,
        lam: FloatArray,
        phi: FloatArray,
        Z: NDArray[Any] | None,
        damping: FloatArray,
    ) -> dict[str, NDArray[Any]]:
        m, n = self.n_modes, len(self.parameters)
        low = phi[:, :m]
        a = np.einsum("nr,pnj->prj", phi, self.dK @ low, optimize=True)
        b = np.einsum("nr,pnj->prj", phi, self.dM @ low, optimize=True) if np.any(self.dM) else np.zeros_like(a)
        load = a - lam[None, None, :m] * b
        own = np.arange(m)
        freq = np.sqrt(lam[:m])
        # a mode of 0 Hz stays one; what rounding leaves of its derivative is nothing
        dfreq = np.where(freq > 0, load[:, own, own] / np.where(freq > 0, 2.0 * freq, 1.0), 0.0) / (2 * np.pi)
        distance = lam[None, :m] - lam[:, None]
        near = np.abs(distance) <= GAP * np.maximum(lam[None, :m], 1e-300)
        share = np.where(near[None], 0.0, load / np.where(near, 1.0, distance)[None])
        share[:, own, own] = -0.5 * b[:, own, own]
        out: dict[str, NDArray[Any]] = {"freq": dfreq, "phi": (self.sensors @ phi) @ share}
        extra = len(self.names) - n
        if extra:
            out["freq"] = np.vstack([dfreq, np.zeros((extra, m))])
            out["phi"] = np.concatenate([out["phi"], np.zeros((extra, *out["phi"].shape[1:]))])
        if self.frfs is not None and Z is not None:
            out["frf"] = self._frf_slopes(K, M, Z, damping)
        if self.statics is not None:
            u = np.linalg.solve(K, self.statics.loads)
            adjoint = np.linalg.solve(K, self.sensors[list(self.statics.outputs)].T)
            static = -(adjoint.T @ (self.dK @ u))
            out["static"] = np.concatenate([static, np.zeros((extra, *static.shape[1:]))])
        return out

    def _dynamic(self, K: FloatArray, M: FloatArray, damping: FloatArray) -> NDArray[np.complex128]:
        assert self.frfs is not None
        s = self.frfs.s[:, None, None]
        C, H = damping_matrix(K, M, damping)
        return np.asarray(K + 1j * H + s * C + s**2 * M)

    def _frf(self, X: NDArray[Any]) -> NDArray[Any]:
        assert self.frfs is not None
        return np.asarray(self.frfs.scale[:, None, None] * (self.sensors[list(self.frfs.outputs)] @ X))

    def _frf_slopes(self, K: FloatArray, M: FloatArray, Z: NDArray[Any], damping: FloatArray) -> NDArray[Any]:
        assert self.frfs is not None
        x_in = np.linalg.solve(Z, self.sensors[list(self.frfs.inputs)].T)
        x_out = np.linalg.solve(Z, self.sensors[list(self.frfs.outputs)].T)
        s = self.frfs.s[:, None, None]
        alpha, beta, eta = damping

        def slope(dK: FloatArray, dM: FloatArray, dC: FloatArray, dH: FloatArray) -> NDArray[Any]:
            part = dK @ x_in + 1j * (dH @ x_in) + s * (dC @ x_in) + s**2 * (dM @ x_in)
            return -self.frfs.scale[:, None, None] * (x_out.transpose(0, 2, 1) @ part)  # type: ignore[union-attr]

        zero = np.zeros_like(K)
        rows = [slope(a, b, alpha * b + beta * a, eta * a) for a, b in zip(self.dK, self.dM, strict=True)]
        rows += [slope(zero, zero, M, zero), slope(zero, zero, K, zero), slope(zero, zero, zero, K)]
        return np.array(rows)
