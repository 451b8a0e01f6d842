"""Gyroscopic matrices of spinning parts."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Literal

from femend.model import Model

if TYPE_CHECKING:
    from scipy.sparse import csc_array

__all__ = ["gyroscopic_matrices"]


def gyroscopic_matrices(
    model: Model,
    axis: Sequence[float],
    *,
    elements: Iterable[int] | None = None,
    axes: Literal["fixed", "rotating"] = "fixed",
    factors: Mapping[str, float] | None = None,
) -> tuple[csc_array, csc_array]:
    """(G, S), each (n_a, n_a), of a part that spins about the direction `axis` (right hand, basic system).

    At the speed W in rad/s the model obeys `M u'' + (C + W G) u' + (K + W^2 S) u = f`; G is antisymmetric. `elements`
    are the ids of the part (masses included), None means all; for parts of different speeds call once for each and
    add. In axes at rest ("fixed") the part must be symmetric about its axis: beams along it and concentrated masses
    count with their polar inertia, S is zero. In "rotating" axes every mass counts (Coriolis force and centrifugal
    softening; the stiffening by centrifugal preload is `stress_stiffness`). Genta, Dynamics of Rotating Systems, 2005.
    Raises ModelError for an element that cannot spin or is not there.

    A disc of polar inertia Jp on a shaft along X couples its tilts by `W Jp`: G[RY, RZ] = Jp = -G[RZ, RY].
    """
    from scipy.sparse import csc_array

    K, _ = model.matrices(factors)
    ids = None if elements is None else [int(e) for e in elements]
    G, S = model.fe.gyroscopic([float(a) for a in axis], ids, axes == "rotating", model.factors(factors))
    return tuple(csc_array((v, K.indices, K.indptr), shape=K.shape) for v in (G, S))  # type: ignore[return-value]
