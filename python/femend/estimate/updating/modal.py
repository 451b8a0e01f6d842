"""Large models: modes, FRFs and static displacements at the sensors by the sparse core."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend import _core
from femend.dof import Dof
from femend.errors import ArgumentError, UpdatingError
from femend.estimate.updating.damped import damping_of, damping_slopes_of
from femend.estimate.updating.dense import GAP, DenseSystem
from femend.estimate.updating.matrices import DeckMatrices, Matrices
from femend.estimate.updating.modal_damping import ratio_slopes, ratios
from femend.estimate.updating.morphed import MorphedMatrices
from femend.estimate.updating.requests import DAMPING, Frfs, Statics
from femend.estimate.updating.rigid import Inertia, inertia_of
from femend.estimate.updating.state import State, check_factors
from femend.model import Model

__all__ = ["ModalSystem", "deck_system", "modal_system"]

FloatArray = NDArray[np.float64]

# up to this size full matrices are the quicker way
DENSE = 100


@dataclass(eq=False)
class ModalSystem:
    """A sparse model seen through `sensors` (n_sensors, n): "freq", "phi" of the lowest `n_modes`, and what is asked.

    With `shapes` False no derivatives of shapes are made, which makes a step cheap where frequencies alone are met. The
    modes of one solution start the search for the next. With `frfs` or `damping`, which asks for the modes' damping
    ratios "zeta", the parameters "alpha", "beta", "eta" follow those of the matrices; a deck's own dashpots and loss
    factors are in its FRFs and ratios. With `rigid` "mass" (1,) and "centre" (3,) are given.
    """

    matrices: Matrices
    sensors: Any
    n_modes: int
    shapes: bool = True
    frfs: Frfs | None = None
    statics: Statics | None = None
    rigid: Inertia | None = None
    defaults: Mapping[str, float] = field(default_factory=dict)
    damping: bool = False
    _start: FloatArray | None = field(default=None, repr=False)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters, the damping's last."""
        return self.matrices.names + (DAMPING if self.frfs is not None or self.damping else ())

    @cached_property
    def _pattern(self) -> tuple[Any, Any]:
        return self.matrices.indptr, self.matrices.indices

    @cached_property
    def _symbolic(self) -> _core.Symbolic:
        return _core.Symbolic(*self._pattern)

    def solve(self, factors: FloatArray) -> State:
        """Results at `factors` (n_parameters,); raises UpdatingError for another number of them, and what `_core.modes`
        raises."""
        check_factors(self.names, factors)
        own = np.ascontiguousarray(factors[: len(self.matrices.names)], dtype=np.float64)
        K, M = self.matrices.at(own)
        values: dict[str, NDArray[Any]] = {}
        lam, phi = np.zeros(0), np.zeros((0, 0))
        if self.n_modes:
            freq, phi, _, _ = _core.modes(
                *self._pattern, K, M, n_modes=self.n_modes, start=self._start, symbolic=self._symbolic
            )
            self._start = phi
            lam = (2 * np.pi * freq) ** 2
            values |= {"freq": freq, "phi": np.asarray(self.sensors @ phi)}
            if self.damping:
                C, H = damping_of(self.matrices, K, M, factors)
                values["zeta"] = ratios(self._sparse(C), self._sparse(H), np.sqrt(lam), phi)
        if self.frfs is not None:
            values["frf"] = self._frf(K, M, factors)
        if self.statics is not None:
            values["static"] = self._rows(self.statics.outputs) @ self._factor(K).solve(self.statics.loads)
        if self.rigid is not None:
            values |= self.rigid.values(own)
        return State(values, lambda n: self._slopes(own, K, M, lam, phi, factors, n))

    def _slopes(
        self,
        own: FloatArray,
        K: FloatArray,
        M: FloatArray,
        lam: FloatArray,
        phi: FloatArray,
        factors: FloatArray,
        needed: int | None,
    ) -> dict[str, NDArray[Any]]:
        dK, dM = self.matrices.slopes(own)
        moving = dM if np.any(dM) else None
        out: dict[str, NDArray[Any]] = {}
        if lam.size:
            d, _ = _core.eigen_sensitivities(*self._pattern, dK, moving, lam, phi)
            omega = np.sqrt(np.maximum(lam, 0.0))
            # a mode of 0 Hz stays one; what rounding leaves of its derivative is nothing
            out["freq"] = np.where(omega > 0, d / np.where(omega > 0, 2 * omega, 1.0), 0.0) / (2 * np.pi)
            if self.shapes:
                out["phi"] = self._shape_slopes(K, M, dK, moving, lam, phi, needed)
        if self.statics is not None:
            out["static"] = self._static_slopes(K, dK)
        if self.rigid is not None:
            out |= self.rigid.slopes(own)
        extra = len(self.names) - len(own)
        out = {name: np.concatenate([v, np.zeros((extra, *v.shape[1:]))]) for name, v in out.items()}
        if self.frfs is not None:
            out["frf"] = self._frf_slopes(K, M, dK, dM, factors)
        if self.damping and lam.size:
            out["zeta"] = self._zeta_slopes(K, M, dK, dM, lam, phi, factors, out["freq"])
        return out

    def _zeta_slopes(
        self,
        K: FloatArray,
        M: FloatArray,
        dK: FloatArray,
        dM: FloatArray,
        lam: FloatArray,
        phi: FloatArray,
        factors: FloatArray,
        dfreq: FloatArray,
    ) -> FloatArray:
        """d zeta (n_parameters, n_modes), those of the damping's own parameters last."""
        moving = dM if np.any(dM) else None
        dphi = self._whole_shape_slopes(K, M, dK, moving, lam, phi)
        extra = np.zeros((len(DAMPING), *dphi.shape[1:]))
        C, H = map(self._sparse, damping_of(self.matrices, K, M, factors))
        dC, dH = (
            [self._sparse(one) for one in part] for part in damping_slopes_of(self.matrices, K, M, dK, dM, factors)
        )
        return ratio_slopes(C, H, dC, dH, np.sqrt(lam), 2 * np.pi * dfreq, phi, np.concatenate([dphi, extra]))

    def _shape_slopes(
        self,
        K: FloatArray,
        M: FloatArray,
        dK: FloatArray,
        dM: FloatArray | None,
        lam: FloatArray,
        phi: FloatArray,
        needed: int | None,
    ) -> FloatArray:
        """d phi at the sensors (n_parameters, n_sensors, n_modes), zero for modes that are not needed."""
        n = lam.size if needed is None else min(needed, lam.size)
        if n == 0:
            return np.zeros((len(dK), self.sensors.shape[0], lam.size))
        try:
            full = self._whole_shape_slopes(K, M, dK, dM, lam[:n], np.ascontiguousarray(phi[:, :n]))
        except (ValueError, ArithmeticError):
            if n == lam.size:
                raise
            return self._shape_slopes(K, M, dK, dM, lam, phi, None)  # the last needed mode is one of a cluster
        out = np.zeros((len(dK), self.sensors.shape[0], lam.size))
        for i, one in enumerate(full):
            out[i, :, :n] = self.sensors @ one
        return out

    def _whole_shape_slopes(
        self, K: FloatArray, M: FloatArray, dK: FloatArray, dM: FloatArray | None, lam: FloatArray, phi: FloatArray
    ) -> FloatArray:
        """d phi at all DOFs (n_parameters, n, n_modes); of a model with all of its modes by superposition of them."""
        if lam.size < phi.shape[0]:
            return _core.shape_sensitivities(*self._pattern, K, M, dK, dM, lam, phi, symbolic=self._symbolic)
        distance = lam[None, :] - lam[:, None]
        near = np.abs(distance) <= GAP * np.maximum(lam[None, :], 1e-300)
        out = []
        for i, one in enumerate(dK):
            b = np.zeros((lam.size, lam.size)) if dM is None else phi.T @ (self._sparse(dM[i]) @ phi)
            load = phi.T @ (self._sparse(one) @ phi) - lam[None, :] * b
            share = np.where(near, 0.0, load / np.where(near, 1.0, distance))
            np.fill_diagonal(share, -0.5 * np.diag(b))
            out.append(phi @ share)
        return np.array(out).reshape(len(dK), *phi.shape)

    def _rows(self, rows: Sequence[int]) -> FloatArray:
        picked = self.sensors[list(rows)]
        return np.ascontiguousarray(picked.toarray() if hasattr(picked, "toarray") else picked, dtype=np.float64)

    def _factor(self, K: FloatArray) -> _core.Factor:
        return _core.Factor(*self._pattern, K, symbolic=self._symbolic)

    def _static_slopes(self, K: FloatArray, dK: FloatArray) -> FloatArray:
        assert self.statics is not None
        factor = self._factor(K)
        u = factor.solve(self.statics.loads)
        adjoint = factor.solve(np.ascontiguousarray(self._rows(self.statics.outputs).T))
        return np.array([-adjoint.T @ (self._sparse(one) @ u) for one in dK])

    def _sparse(self, values: FloatArray) -> Any:
        from scipy.sparse import csc_array

        n = len(self._pattern[0]) - 1
        return csc_array((values, self._pattern[1], self._pattern[0]), shape=(n, n))

    def _ends(self) -> tuple[FloatArray, FloatArray]:
        assert self.frfs is not None
        return (
            np.ascontiguousarray(self._rows(self.frfs.outputs).T),
            np.ascontiguousarray(self._rows(self.frfs.inputs).T),
        )

    def _frf(self, K: FloatArray, M: FloatArray, factors: FloatArray) -> NDArray[np.complex128]:
        assert self.frfs is not None
        C, H = damping_of(self.matrices, K, M, factors)
        return _core.frf_direct(*self._pattern, K, M, *self._ends(), self.frfs.s, self.frfs.kind, c=C, h=H)

    def _frf_slopes(
        self, K: FloatArray, M: FloatArray, dK: FloatArray, dM: FloatArray, factors: FloatArray
    ) -> NDArray[np.complex128]:
        assert self.frfs is not None
        C, H = damping_of(self.matrices, K, M, factors)
        zero = np.zeros_like(K)
        dk = np.vstack([dK, zero, zero, zero])
        dm = np.vstack([dM, zero, zero, zero])
        dc, dh = damping_slopes_of(self.matrices, K, M, dK, dM, factors)
        return _core.frf_direct_sensitivities(
            *self._pattern, K, M, dk, dm, *self._ends(), self.frfs.s, self.frfs.kind, c=C, h=H, dc=dc, dh=dh
        )


def modal_system(
    matrices: Matrices,
    sensors: Any,
    n_modes: int,
    *,
    shapes: bool = True,
    frfs: Frfs | None = None,
    statics: Statics | None = None,
    damping: bool = False,
) -> ModalSystem | DenseSystem:
    """A model of `matrices` (affine sums, a deck) that gives its lowest `n_modes` at `sensors`: a matrix (n_sensors, n)
    or row numbers, from 0 (`deck_system` takes DOFs). Small affine models with a positive definite mass are solved in
    full matrices.

    `shapes`, `frfs`, `statics` and `damping` as of `ModalSystem`. Raises UpdatingError for rows that the model does not
    have, and ArgumentError for sensors that are no row numbers.

    >>> from femend.estimate.updating.matrices import affine_matrices
    >>> chain = modal_system(affine_matrices({"k": [[1.0]]}, [[1.0]]), [0], 1)
    >>> round(float(chain.solve(np.array([4.0])).value("freq")[0] * 2 * np.pi), 12)
    2.0
    """
    from scipy.sparse import csr_array, issparse

    n = len(matrices.indptr) - 1
    if not issparse(sensors) and np.ndim(sensors) == 1:
        rows = _row_numbers(sensors)
        outside = rows[(rows < 0) | (rows >= n)]
        if outside.size:
            raise UpdatingError(f"a sensor is at row {int(outside[0])}, the model has rows 0 to {n - 1}")
        sensors = csr_array((np.ones(rows.size), (np.arange(rows.size), rows)), shape=(rows.size, n))
    B = csr_array(sensors)
    if B.shape[1] != n:
        raise UpdatingError(f"the sensors see {B.shape[1]} DOFs, the model has {n}; `sensors` is (n_sensors, n)")
    system = ModalSystem(matrices, B, n_modes, shapes, frfs, statics, damping=damping)
    if damping or n > DENSE or not matrices.affine or (isinstance(matrices, DeckMatrices) and frfs is not None):
        return system
    at_one = np.ones(len(matrices.names))
    K, M = (system._sparse(v).toarray() for v in matrices.at(at_one))
    dK, dM = (np.array([system._sparse(v).toarray() for v in d]) for d in matrices.slopes(at_one))
    if np.linalg.eigvalsh(M)[0] <= 0:
        return system
    return DenseSystem(
        matrices.names, K - dK.sum(0), M - dM.sum(0), dK, dM, B.toarray(), min(n_modes, n), frfs, statics
    )


def _row_numbers(sensors: Sequence[Any]) -> NDArray[np.int64]:
    for one in sensors:
        if isinstance(one, bool | np.bool_) or not isinstance(one, int | np.integer):
            raise ArgumentError.given(
                "`modal_system` takes sensors as row numbers of its matrices, from 0 (`deck_system` takes DOFs)", one
            )
    return np.asarray(sensors, dtype=np.int64)


def deck_system(
    model: Model,
    sensors: Sequence[Dof | str],
    n_modes: int,
    *,
    shapes: bool = True,
    frfs: Frfs | None = None,
    inertia: bool = False,
    damping: bool = False,
) -> ModalSystem | DenseSystem:
    """A deck with parameters and morphs, seen at `sensors` in their signed directions (a `Dof` or its text, "3:-Z");
    `inertia` asks for mass and centre of gravity, of the whole deck as it stands on a balance, without its supports.

    `n_modes`, `shapes`, `frfs`, `damping` as of `ModalSystem`; a morph is a parameter that is 0 as the deck stands.
    Raises PairingError for a sensor at a node that the deck does not have, and UpdatingError for one on a rigid element
    that a morph moves, and for the inertia where a morph moves a node with displacement axes of its own or GRIDs hold
    mass for good (PS); ArgumentError for what is no sensor.
    """
    from scipy.sparse import csr_array

    T = csr_array(model.transformation())
    dofs = [Dof.parse(d) if isinstance(d, str) else d for d in sensors]
    for dof in dofs:
        if not isinstance(dof, Dof):
            raise ArgumentError.given("`deck_system` takes sensors as Dof(3, 3, -1), or texts like '3:-Z'", dof)
    B = model.seen(dofs) @ T
    if model.morphs:
        _check_morphs(model, dofs)
        still = {m.name: 0.0 for m in model.morphs}
        rigid = inertia_of(model) if inertia else None
        return ModalSystem(MorphedMatrices(model), csr_array(B), n_modes, shapes, frfs, None, rigid, still, damping)
    system = modal_system(DeckMatrices(model), B, n_modes, shapes=shapes, frfs=frfs, damping=damping)
    if not inertia:
        return system
    rigid = inertia_of(model)
    return ModalSystem(DeckMatrices(model), csr_array(B), n_modes, shapes, frfs, rigid=rigid, damping=damping)


def _check_morphs(model: Model, sensors: Sequence[Dof]) -> None:
    """Refuses sensors that would have to follow the nodes and do not."""
    rows = set(model.fe.moved(model.fields.nodes.tolist(), model.fields.probe).rows.tolist())
    seen = model.seen(sensors)
    for i, sensor in enumerate(sensors):
        if rows.intersection(seen[[i]].indices.tolist()):
            raise UpdatingError(
                f"sensor {sensor} hangs on a rigid element (or MPC) that a morph moves, and would see other DOFs with "
                "every amplitude; take the sensor at the element's independent node, or leave that node where it is"
            )
