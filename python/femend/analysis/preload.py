"""Stiffness of a structure under load: small vibration about the preloaded state."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from femend.dof import Dof
from femend.errors import SingularModelError
from femend.model import Model
from femend.numerals import plain

if TYPE_CHECKING:
    from scipy.sparse import csc_array

__all__ = ["static_displacement", "stress_stiffness"]

RESIDUAL = 1e-6  # of the load: a solution that misses it is none


def static_displacement(
    model: Model, forces: Mapping[Dof, float], *, factors: Mapping[str, float] | None = None
) -> NDArray[np.float64]:
    """Displacements (n_a,) of the model under constant forces (force units; moments at RX, RY, RZ).

    Forces act in the direction of the node's own system, reversed where the DOF has a sign; those at held DOFs go into
    the support. Raises PairingError for a node that is none, SingularModelError for a model that is not supported.

    >>> static_displacement(model, {Dof.parse("11:Z"): -200.0}).shape  # doctest: +SKIP
    (60,)
    """
    from scipy.sparse.linalg import splu

    K, _ = model.matrices(factors)
    load = np.zeros(model.fe.n_g)
    for dof, force in forces.items():
        load[model.row(dof)] += dof.sign * force
    f = model.transformation().T @ load
    try:
        u: NDArray[np.float64] = splu(K.tocsc()).solve(f)
        miss = float(np.linalg.norm(K @ u - f))
    except RuntimeError:
        miss = np.inf
    if not miss <= RESIDUAL * max(float(np.linalg.norm(f)), np.finfo(float).tiny):
        raise SingularModelError(
            f"the static solution misses the load by {plain(miss, 3)}: the model moves without resistance; "
            "add supports or springs"
        )
    return u


def stress_stiffness(
    model: Model, forces: Mapping[Dof, float], *, factors: Mapping[str, float] | None = None
) -> csc_array:
    """K_sigma (n_a, n_a) of a preload: small vibration under these forces has the stiffness K + K_sigma.

    Beams and rods count with their axial force, shells with their membrane forces, solids with all stresses; the
    forces keep their direction. Linear in the forces, so one load case serves all its multiples; K + K_sigma turns
    singular at the buckling load. Cook et al., Concepts and Applications of FEA, 4th ed. 2002, ch. 18. Raises what
    `static_displacement` raises.

    A hinged beam of length L under tension P has the frequency `q^2 (E I q^2 + P) / mu` with `q = pi / L`:

    >>> K, M = model.matrices()  # doctest: +SKIP
    >>> K_loaded = K + stress_stiffness(model, {Dof.parse("11:X"): 1e4})  # doctest: +SKIP
    """
    from scipy.sparse import csc_array

    u = static_displacement(model, forces, factors=factors)
    K, _ = model.matrices(factors)
    values = model.fe.stress_stiffness(u, model.factors(factors))
    return csc_array((values, K.indices, K.indptr), shape=K.shape)
