"""The reduced matrices of a superelement with the DOFs they stand on."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.errors import ModelError
from femend.io.op4 import Op4Matrix, read_op4

__all__ = ["RigidCheck", "Superelement", "read_superelement"]

FloatArray = NDArray[np.float64]

# Names that Nastran gives the matrices of external superelements (EXTSEOUT, DMIGPCH) and analysts theirs, best first.
_USUAL = {
    "stiffness": ("KXX", "KAA", "KAAX", "KBB", "KCC", "K"),
    "mass": ("MXX", "MAA", "MAAX", "MBB", "MCC", "M"),
    "damping": ("BXX", "BXX1", "BAA", "BAAX", "BBB", "B"),
    "structural": ("K4XX", "K4XX1", "K4AA", "K4AAX", "K4"),
}
# Reduction leaves this much of the largest term between A and its transpose; the deck reader allows the same.
SYMMETRY = 1e-6


@dataclass(frozen=True, slots=True)
class RigidCheck:
    """What a superelement does in a rigid motion of its nodes.

    `energy` (6,): strain energy for unit motions X, Y, Z, RX, RY, RZ, of what the diagonal of K alone would store
    (dimensionless); of a part on one node of what its mass stores at its softest modal coordinate's frequency, NaN
    without one. Round-off for a free part whose DOFs are named rightly. `mass` (3,): mass along X, Y, Z in mass
    units of the matrices, NaN without a mass matrix.
    """

    energy: FloatArray
    mass: FloatArray


@dataclass(frozen=True, eq=False)
class Superelement:
    """Symmetric reduced matrices on the DOFs of a model, in the model's units.

    `dofs` are (node, component), component 1 to 6 in the node's displacement frame or 0 for a scalar point (a modal
    coordinate); `K`, `M`, `B` (viscous) and `K4` (structural damping, the imaginary part of K) are (n, n) or None.
    Raises ModelError for matrices that do not fit the DOFs, are not finite or not symmetric, and for none at all.
    """

    dofs: tuple[tuple[int, int], ...]
    K: FloatArray | None = None
    M: FloatArray | None = None
    B: FloatArray | None = None
    K4: FloatArray | None = None
    source: str = field(default="", compare=False)

    def __post_init__(self) -> None:
        if self.K is None and self.M is None:
            raise ModelError("a superelement without stiffness and mass; give at least one of K and M")
        for name in ("K", "M", "B", "K4"):
            matrix = getattr(self, name)
            if matrix is not None:
                object.__setattr__(self, name, _symmetric(name, matrix, len(self.dofs)))

    @property
    def scalar_points(self) -> tuple[int, ...]:
        """Ids of the DOFs that are scalar points."""
        return tuple(node for node, component in self.dofs if component == 0)

    @property
    def nodes(self) -> tuple[int, ...]:
        """Ids of the nodes in space, each once, in order of appearance."""
        return tuple(dict.fromkeys(node for node, component in self.dofs if component))

    def rigid_check(self, node_ids: ArrayLike, xyz: ArrayLike, frames: ArrayLike | None = None) -> RigidCheck:
        """Strain energy and mass in rigid motions of its nodes, scalar points at rest.

        `node_ids` (n,) at `xyz` (n, 3) with displacement frames `frames` (n, 3, 3), rows the local axes (basic where
        None), hold at least the superelement's nodes; raises ModelError where one is missing. The energy of a free
        superelement is nothing but round-off: anything else is a support inside it, or DOFs in another order.

        >>> K = np.array([[1.0, -1.0], [-1.0, 1.0]])
        >>> float(Superelement(((1, 1), (2, 1)), K).rigid_check([1, 2], np.eye(2, 3)).energy[0])
        0.0
        """
        at = {int(node): i for i, node in enumerate(np.asarray(node_ids).tolist())}
        missing = [node for node in self.nodes if node not in at]
        if missing:
            raise ModelError(
                f"the deck has no node {missing[0]}, on which the superelement has DOFs ({len(missing)} are missing); "
                "add its GRIDs or correct the map"
            )
        x = np.asarray(xyz, dtype=np.float64)
        axes = np.broadcast_to(np.eye(3), (len(x), 3, 3)) if frames is None else np.asarray(frames, dtype=np.float64)
        centre = np.mean([x[at[node]] for node in self.nodes], axis=0) if self.nodes else np.zeros(3)
        R = np.zeros((len(self.dofs), 6))
        for row, (node, component) in enumerate(self.dofs):
            if component:
                axis = axes[at[node], (component - 1) % 3]
                if component <= 3:
                    R[row, :3], R[row, 3:] = axis, np.cross(x[at[node]] - centre, axis)
                else:
                    R[row, 3:] = axis
        K = np.zeros((len(self.dofs),) * 2) if self.K is None else self.K
        most = self._energy_at_one_node(R) if len(self.nodes) == 1 else np.abs(np.diag(K)) @ R**2
        energy = np.abs(np.einsum("ik,ij,jk->k", R, K, R)) / np.where(most == 0, 1.0, most)
        mass = np.full(3, np.nan) if self.M is None else np.einsum("ik,ij,jk->k", R[:, :3], self.M, R[:, :3])
        return RigidCheck(energy, mass)

    def _energy_at_one_node(self, R: FloatArray) -> FloatArray:
        """What the energies of the motions `R` (n, 6) of a part on one node are beside: that of its own mass at the
        frequency of its softest modal coordinate, since the diagonal there holds nothing else than supports would; NaN
        without both."""
        modal = [i for i, (_, component) in enumerate(self.dofs) if component == 0]
        if self.K is None or self.M is None or not modal:
            return np.full(R.shape[1], np.nan)
        k, m = np.diag(self.K)[modal], np.diag(self.M)[modal]
        if not (m > 0).any():
            return np.full(R.shape[1], np.nan)
        softest = float(np.min(k[m > 0] / m[m > 0]))
        return softest * np.abs(np.einsum("ik,ij,jk->k", R, self.M, R))


def _symmetric(name: str, matrix: ArrayLike, n: int) -> FloatArray:
    A = np.asarray(matrix, dtype=np.float64)
    if A.shape != (n, n):
        size = " x ".join(str(s) for s in A.shape)
        raise ModelError(f"{name} is {size}, the map has {n} DOFs; give the map of these matrices, one DOF a row")
    if not np.isfinite(A).all():
        raise ModelError(f"{name} has terms that are not finite; reduce the part anew")
    largest = float(np.abs(A).max(initial=0.0))
    if np.count_nonzero(np.triu(A, 1)) == 0 or np.count_nonzero(np.tril(A, -1)) == 0:
        return A + A.T - np.diag(np.diag(A))  # one triangle stands for both
    gap = np.abs(A - A.T)
    if gap.max() > SYMMETRY * largest:
        i, j = np.unravel_index(int(gap.argmax()), gap.shape)
        raise ModelError(
            f"{name} is not symmetric: {A[i, j]:.6g} and {A[j, i]:.6g} in rows {i + 1} and {j + 1}; "
            "only symmetric matrices are supported"
        )
    return 0.5 * (A + A.T)


def read_superelement(
    path: str | os.PathLike[str],
    dofs: Sequence[tuple[int, int]],
    *,
    stiffness: str | None = None,
    mass: str | None = None,
    damping: str | None = None,
    structural: str | None = None,
) -> Superelement:
    """The reduced matrices in an OUTPUT4 file on the `dofs` that `read_dof_map` gives, one for each row.

    `stiffness`, `mass`, `damping` (viscous) and `structural` (K4) name the matrices; by default those with Nastran's
    names (KXX, MXX, BXX, K4XX; KAA ...) that hold anything are taken. The imaginary part of a complex stiffness counts
    as structural damping. Units are those of the file, which must be the deck's.

    Raises FormatError for a file or a name that cannot be read, ModelError for matrices that do not fit the DOFs.
    """
    file = os.fspath(path)
    given = {"stiffness": stiffness, "mass": mass, "damping": damping, "structural": structural}
    matrices = {m.name.upper(): m for m in read_op4(file)}
    chosen: dict[str, NDArray[np.complex128] | FloatArray] = {}
    names = []
    for kind, name in given.items():
        if name is not None and name.upper() not in matrices:
            read_op4(file, [name])  # raises with the names that are there
        usual = [n for n in _USUAL[kind] if n in matrices and matrices[n].data.nnz]
        picked = name.upper() if name is not None else (usual[0] if usual else None)
        if picked is not None:
            chosen[kind] = _dense(file, matrices[picked], len(dofs))
            names.append(picked)
    if not chosen.keys() & {"stiffness", "mass"}:
        held = ", ".join(matrices) or "none"
        raise ModelError(f"{file}: no matrix with a usual name ({held} are there); name the stiffness and the mass")
    K, K4 = chosen.get("stiffness"), chosen.get("structural")
    for kind in ("mass", "damping", "structural"):
        if kind in chosen and np.iscomplexobj(chosen[kind]):
            raise ModelError(f"{file}: the {kind} matrix is complex; only a complex stiffness has a meaning here")
    if K is not None and np.iscomplexobj(K):
        K, K4 = K.real, K.imag if K4 is None else K4 + K.imag
    return Superelement(
        tuple(dofs),
        None if K is None else K.real,
        _real(chosen.get("mass")),
        _real(chosen.get("damping")),
        _real(K4),
        f"{', '.join(names)} of {os.path.basename(file)}",
    )


def _real(matrix: NDArray[np.complex128] | FloatArray | None) -> FloatArray | None:
    return None if matrix is None else np.asarray(matrix.real, dtype=np.float64)


def _dense(file: str, matrix: Op4Matrix, n: int) -> NDArray[np.complex128] | FloatArray:
    """The whole matrix, once its size is known to be that of the map."""
    if matrix.shape != (n, n):
        rows, cols = matrix.shape
        raise ModelError(
            f"{file}: matrix {matrix.name} is {rows} x {cols}, the map has {n} DOFs; give the map of these matrices, "
            "one DOF a row (modal coordinates included)"
        )
    return matrix.toarray()
