"""Residual energy of elements on the mesh."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from femend.report.plots.shape_view import draw_shape

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from femend.diagnose.residual.residual_energy import ResidualEnergy
    from femend.model import Model
    from femend.report.content import MeshPicture

__all__ = ["draw_residual"]


def draw_residual(
    ax: Axes, mesh: MeshPicture, model: Model, energy: ResidualEnergy, *, view: Mapping[str, Any] | None = None
) -> None:
    """Draws `mesh` of `model` coloured by the residual `energy` per node: the mean of the shares of its elements.

    Nodes stay where they are; `view` as of `draw_shape`. Raises ValueError where no node has energy.
    """
    share = {int(e): float(s) for e, s in zip(energy.elements, energy.element, strict=True)}
    size, count = np.zeros(len(mesh.node_ids)), np.zeros(len(mesh.node_ids))
    row = {int(n): i for i, n in enumerate(mesh.node_ids)}
    for eid, _, nodes in model.fe.elements():
        for node in nodes:
            if eid in share and int(node) in row:
                size[row[int(node)]] += share[eid]
                count[row[int(node)]] += 1
    mean: ArrayLike = size / np.maximum(count, 1)
    draw_shape(
        ax,
        mesh,
        np.asarray(mean)[:, None] * np.array([[0.0, 0.0, 1.0]]),
        scale=1e-9,
        view=view,
        title="residual energy",
    )
