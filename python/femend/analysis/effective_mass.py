"""How much of a structure's mass moves with each mode when the base moves along X, Y or Z."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["base_directions", "effective_mass"]

FloatArray = NDArray[np.float64]


def base_directions(
    dof_nodes: NDArray[np.int64], dof_components: NDArray[np.int64], node_ids: NDArray[np.int64], frames: FloatArray
) -> FloatArray:
    """Displacement of each DOF, (n_dof, 3), when the whole structure moves by one along X, Y, Z.

    `dof_nodes`, `dof_components` (n_dof,) name the DOFs; `node_ids` (n,), `frames` (n, 3, 3) give each node's own
    axes, one per row, in the basic system. Rotations stay zero.
    """
    row = {int(node): k for k, node in enumerate(node_ids)}
    R = np.zeros((len(dof_nodes), 3))
    for i, (node, component) in enumerate(zip(dof_nodes, dof_components, strict=True)):
        if component <= 3:
            R[i] = frames[row[int(node)], component - 1]
    return R


def effective_mass(M_phi: FloatArray, R: FloatArray) -> FloatArray:
    """Effective modal mass, (n_modes, 3): the square of the participation phi^T M R.

    `M_phi` is M phi (n_dof, n_modes) of mass-normalised modes, `R` (n_dof, 3) from `base_directions`. Summed over all
    modes it is the mass that can move. Source: Clough and Penzien, Dynamics of Structures, 3rd ed., section 26-2.

    >>> effective_mass(np.array([[1.0], [1.0]]), np.array([[1.0, 0, 0], [1.0, 0, 0]]))
    array([[4., 0., 0.]])
    """
    return np.asarray((M_phi.T @ R) ** 2)
