"""Mass and centre of gravity of a deck, from its rigid-body motions."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femend.errors import UpdatingError
from femend.estimate.updating.matrices import DeckMatrices, Matrices
from femend.estimate.updating.morphed import MorphedMatrices
from femend.model import Model
from femend.numerals import plain

__all__ = ["Inertia", "inertia_of", "mass_and_centre", "motions", "telling_axes"]

FloatArray = NDArray[np.float64]

# share of the mass by which a motion may fall short and still move all of it
ALL = 1e-6


def motions(model: Model) -> FloatArray:
    """Rigid-body motions (n_a, 6) about the origin of the basic system; scalar points take no part."""
    fe = model.fe
    index = {int(n): i for i, n in enumerate(fe.node_ids)}
    at = np.array([index[int(n)] for n in fe.dof_nodes])
    R, scalar = np.zeros((fe.n_a, 6)), model.is_scalar
    for row, (i, c) in enumerate(zip(at, fe.dof_components - 1, strict=True)):
        if scalar[i]:
            continue
        axis, x = model.frames[i][c % 3], model.xyz[i]
        if c < 3:
            R[row, :3], R[row, 3:] = axis, np.cross(x, axis)
        else:
            R[row, 3:] = axis
    return R


def motion_slopes(model: Model) -> FloatArray:
    """Derivatives (n_morphs, n_a, 6) of `motions` with respect to the amplitudes."""
    fields, frames = model.fields, model.frames
    out = np.zeros((len(model.morphs), model.fe.n_a, 6))
    place = {int(n): i for i, n in enumerate(fields.nodes)}
    for row, (node, c) in enumerate(zip(model.fe.dof_nodes.tolist(), model.fe.dof_components - 1, strict=True)):
        if node not in place:
            continue
        frame = frames[model.index(node)]
        if not np.array_equal(frame, np.eye(3)):
            raise UpdatingError(
                f"mass and centre of gravity: node {node} has displacement axes of its own (CD), which may turn when "
                "it moves; give it the basic system"
            )
        if c < 3:
            out[:, row, 3:] = np.cross(fields.fields[:, place[node]], frame[c])
    return out


def mass_and_centre(
    products: FloatArray, slope: FloatArray | None = None, axes: tuple[int, int, int] = (1, 2, 0)
) -> dict[str, FloatArray]:
    """Mass and centre of gravity, or their derivatives, from `products` (6, 6), R^T M R of rigid motions about the
    origin, and the derivative `slope` (6, 6) of these.

    `axes` are the motions, 0 to 2 along X to Z, that tell where the centre is along X, Y and Z, as of `telling_axes`;
    where none does (-1) it is nan.
    """
    mass, first = _moments(products, axes)
    if slope is None:
        return {"mass": np.array([mass]), "centre": first / mass}
    d_mass, d = _moments(slope, axes)
    return {"mass": np.array([d_mass]), "centre": d / mass - first / mass**2 * d_mass}


def _moments(products: FloatArray, axes: tuple[int, int, int]) -> tuple[float, FloatArray]:
    """Mass and first moments (3,): a turn about k moves a place x along d by the sum of e_dkj x_j."""
    first = np.full(3, np.nan)
    for j, d in enumerate(axes):
        if d < 0:
            continue
        k = 3 - j - d
        sign = 1.0 if (d, k, j) in ((0, 1, 2), (1, 2, 0), (2, 0, 1)) else -1.0
        first[j] = sign * products[d, 3 + k]
    moving = next(d for d in axes if d >= 0)
    return float(products[moving, moving]), first


def telling_axes(products: FloatArray, total: float) -> tuple[int, int, int]:
    """Motions of `mass_and_centre` in `products` (6, 6) along which all of the mass `total` moves.

    GRIDs may hold others for good (PS), as those out of the plane of a plane structure, across which offsets of masses
    do not show.
    Raises UpdatingError where some of the mass does not move along any axis.
    """
    moved = np.diag(products)[:3]
    whole = moved.max() * (1.0 - ALL)
    if moved.max() < (1.0 - ALL) * total:
        raise UpdatingError(
            f"mass and centre of gravity: {plain(100 * (1 - moved.max() / total), 2)} % of the deck's mass is at DOFs "
            "that its GRIDs hold for good (field PS, or GRDSET), where no motion shows it; hold them by SPC cards"
        )

    def of(j: int) -> int:
        return next((d for d in ((j + 1) % 3, (j + 2) % 3) if moved[d] >= whole), -1)

    return of(0), of(1), of(2)


@dataclass(frozen=True, eq=False)
class Inertia:
    """Mass and centre of gravity of a deck without its supports: `matrices` of the free structure, its rigid motions
    `R` (n, 6), their derivatives with respect to the morphs, the last parameters, `turning` (n_morphs, n, 6), and the
    `axes` of `mass_and_centre`."""

    matrices: Matrices
    R: FloatArray
    turning: FloatArray | None
    axes: tuple[int, int, int]

    def values(self, own: FloatArray) -> dict[str, FloatArray]:
        """ "mass" (1,) and "centre" (3,) at the factors `own` (n_parameters,)."""
        return mass_and_centre(self._products(self.matrices.at(own)[1], self._motions(own)), axes=self.axes)

    def slopes(self, own: FloatArray) -> dict[str, FloatArray]:
        """Derivatives (n_parameters, ...) of `values` at the factors `own` (n_parameters,)."""
        M, R = self.matrices.at(own)[1], self._motions(own)
        products = [self._products(one, R) for one in self.matrices.slopes(own)[1]]
        turned = [] if self.turning is None else list(self.turning)
        for i, dR in enumerate(turned, start=len(own) - len(turned)):
            half = self._products(M, R, dR)
            products[i] = products[i] + half + half.T
        whole = self._products(M, R)
        parts = [mass_and_centre(whole, one, self.axes) for one in products]
        size = {"mass": 1, "centre": 3}
        return {name: np.array([part[name] for part in parts]).reshape(-1, n) for name, n in size.items()}

    def _motions(self, own: FloatArray) -> FloatArray:
        """Rigid-body motions (n, 6) with the nodes where they are."""
        if self.turning is None:
            return self.R
        return np.asarray(self.R + np.tensordot(own[len(own) - len(self.turning) :], self.turning, 1))

    def _products(self, M: FloatArray, R: FloatArray, left: FloatArray | None = None) -> FloatArray:
        """R^T M R (6, 6), or with another factor on the left."""
        from scipy.sparse import csc_array

        n = len(self.R)
        M_sparse = csc_array((M, self.matrices.indices, self.matrices.indptr), shape=(n, n))
        return np.asarray((R if left is None else left).T @ (M_sparse @ R))


def inertia_of(model: Model) -> Inertia:
    """What `model` weighs, held DOFs included; raises UpdatingError as of `telling_axes` and `motion_slopes`."""
    free = model.unsupported
    if model.morphs:
        free = free.with_morphs(model.morphs)
    matrices: Matrices = MorphedMatrices(free) if model.morphs else DeckMatrices(free)
    turning = motion_slopes(free) if model.morphs else None
    found = Inertia(matrices, motions(free), turning, (1, 2, 0))
    at = np.ones(len(matrices.names))
    at[len(free.parameters) :] = 0.0
    products = found._products(matrices.at(at)[1], found.R)
    return replace(found, axes=telling_axes(products, free.fe.total_mass()))
