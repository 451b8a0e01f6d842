"""Mass and centre of gravity of a deck, from its rigid-body motions."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from femend.errors import UpdatingError
from femend.model import Model

FloatArray = NDArray[np.float64]


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


def mass_and_centre(products: FloatArray, slope: FloatArray | None = None) -> dict[str, FloatArray]:
    """Mass and centre of gravity, or their derivatives, from R^T M R of rigid motions about the origin."""
    mass = products[0, 0]
    first = np.array([products[1, 5], products[2, 3], products[0, 4]])
    if slope is None:
        return {"mass": np.array([mass]), "centre": first / mass}
    d = np.array([slope[1, 5], slope[2, 3], slope[0, 4]])
    return {"mass": np.array([slope[0, 0]]), "centre": d / mass - first / mass**2 * slope[0, 0]}
