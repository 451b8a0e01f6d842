"""A field of values, one for each element, on the mesh."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from femend.model import Model
from femend.report.content import MeshPicture
from femend.report.mesh_view import start_view, view_basis
from femend.report.plots.style import INK, PALE

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["draw_field"]


def draw_field(
    ax: Axes,
    mesh: MeshPicture,
    model: Model,
    values: Mapping[int, float],
    *,
    label: str = "",
    view: Mapping[str, Any] | None = None,
) -> None:
    """Draws `mesh` of `model`, its elements in the colour of their `values` by number; others are pale.

    Faces and lines whose nodes belong to several of these elements have the mean. `view` is as of `draw_shape`. Raises
    ValueError where no element of the mesh has a value.
    """
    from matplotlib.cm import ScalarMappable
    from matplotlib.collections import LineCollection, PolyCollection
    from matplotlib.colors import Normalize

    if not values:
        raise ValueError("there is no value to draw; give one for an element of the mesh")
    low, high = min(values.values()), max(values.values())
    look: dict[str, Any] = {"cmap": "viridis", "norm": Normalize(low, high if high > low else low + 1e-12)}
    xyz = np.asarray(mesh.xyz, dtype=np.float64)
    eye = xyz @ view_basis(dict(view) if view is not None else start_view(xyz)).T
    faces, lines = np.asarray(mesh.faces, dtype=np.int64), np.asarray(mesh.lines, dtype=np.int64)
    face_value, line_value = (_of_sides(mesh, model, values, part) for part in (faces, lines))
    if not (np.isfinite(face_value).any() or np.isfinite(line_value).any()):
        raise ValueError(f"none of the {len(values)} elements with a value is drawn in the mesh")
    for part, value, kind in ((faces, face_value, PolyCollection), (lines, line_value, LineCollection)):
        if not len(part):
            continue
        order = np.argsort(eye[part, 2].mean(axis=1))  # from the back
        inside = np.isfinite(value[order])
        flat = eye[part[order]][:, :, :2]
        line = kind is LineCollection
        bare: dict[str, Any] = {"colors": PALE} if line else {"facecolors": "none", "edgecolors": PALE}
        ax.add_collection(kind(list(flat[~inside]), linewidths=0.8 if line else 0.4, **bare))
        edges: dict[str, Any] = {} if line else {"edgecolors": INK}
        drawn = kind(list(flat[inside]), linewidths=2.4 if line else 0.25, **edges, **look)
        drawn.set_array(value[order][inside])
        ax.add_collection(drawn)
    margin = 0.03 * float(np.linalg.norm(np.ptp(xyz, axis=0))) or 1.0
    ax.set_xlim(eye[:, 0].min() - margin, eye[:, 0].max() + margin)
    ax.set_ylim(eye[:, 1].min() - margin, eye[:, 1].max() + margin)
    ax.set_aspect("equal")
    ax.set_axis_off()
    ax.figure.colorbar(ScalarMappable(**look), ax=ax, label=label, shrink=0.8)


def _of_sides(mesh: MeshPicture, model: Model, values: Mapping[int, float], sides: np.ndarray) -> np.ndarray:
    """Values (n_sides,) of faces or lines by node positions (n_sides, n): the mean of the elements that have all their
    nodes; NaN where none has."""
    at = {int(n): i for i, n in enumerate(mesh.node_ids)}
    of_node: dict[int, set[int]] = {}
    for eid, _, nodes in model.fe.elements():
        if eid in values:
            for node in nodes:
                of_node.setdefault(at.get(int(node), -1), set()).add(eid)
    out = np.full(len(sides), np.nan)
    for i, side in enumerate(sides.tolist()):
        own = set.intersection(*(of_node.get(k, set()) for k in set(side)))
        if own:
            out[i] = float(np.mean([values[e] for e in own]))
    return out
