"""Mismatch map on the mesh: where a free force explains what the updated model leaves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from femend.numerals import plain
from femend.report.content import Marker, MeshPicture, MismatchMap
from femend.report.mesh_view import start_view, view_basis
from femend.report.mismatch_map import lowest, on_mesh
from femend.report.plots.style import INK, MARK, PALE

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["draw_mismatch"]

# more contrast at the pale end than Blues has by itself
_COLOURS = ("#f3f6f9", "#d3e1ef", "#b2cee8", "#8ab7de", "#5c9bd1", "#357ebd", "#185f9f", "#083d73", "#05294f")


def draw_mismatch(
    ax: Axes,
    mesh: MeshPicture,
    found: MismatchMap,
    *,
    located: Sequence[int] = (),
    sensors: Sequence[Marker] = (),
    shakers: Sequence[Marker] = (),
    view: Mapping[str, Any] | None = None,
    colorbar: bool = True,
) -> None:
    """Draws `mesh` in the colours of the map `found`, on a logarithmic scale from all that updating leaves (pale) to
    the least that a free force leaves (dark).

    Bars, shells and the skin of solids alike, seen as `view` (of `start_view`) says. `located` are ids of the found
    place, `sensors` and `shakers` where was measured and driven. Raises ValueError where none of the map's nodes is in
    the mesh.
    """
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import LinearSegmentedColormap, LogNorm

    xyz = np.asarray(mesh.xyz, dtype=np.float64)
    values = on_mesh(found, xyz, np.asarray(mesh.node_ids, dtype=np.int64))
    if not np.isfinite(values).all():
        raise ValueError(f"none of the {len(found.nodes)} nodes of the map is among the {len(xyz)} of the mesh")
    colours = LinearSegmentedColormap.from_list("mismatch", _COLOURS[::-1])
    look: dict[str, Any] = {"cmap": colours, "norm": LogNorm(lowest(found.share), 1.0)}
    eye = xyz @ view_basis(dict(view) if view is not None else start_view(xyz)).T
    _elements(ax, mesh, eye, values, look)
    _markers(ax, mesh, eye, located, sensors, shakers)
    span = np.ptp(eye[:, :2], axis=0)
    margin = 0.08 * float(np.hypot(*span)) or 1.0
    low, high = eye[:, :2].min(axis=0) - margin, eye[:, :2].max(axis=0) + margin
    low[1] -= 0.1 * (high[1] - low[1]) if colorbar else 0.0
    high[1] += 0.04 * (high[1] - low[1])  # room for a legend
    ax.set_xlim(low[0], high[0])
    ax.set_ylim(low[1], high[1])
    ax.set_aspect("equal")
    ax.set_axis_off()
    if colorbar:
        _key(ax, ScalarMappable(**look))


def _key(ax: Axes, look: Any) -> None:
    """The colours' scale along the lower edge, in percent."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    inside = ax.inset_axes((0.06, 0.0, 0.88, 0.032))
    bar = ax.figure.colorbar(look, cax=inside, orientation="horizontal")
    bar.ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 3.0)))
    bar.ax.xaxis.set_minor_locator(NullLocator())
    bar.ax.xaxis.set_major_formatter(FuncFormatter(lambda share, _: f"{plain(100 * share, 2)} %"))
    bar.set_label("share of the misfit that a free force there leaves")


def _elements(ax: Axes, mesh: MeshPicture, eye: NDArray[np.float64], values: NDArray[np.float64], look: Any) -> None:
    """Faces from the back to the front, and wires with their nodes."""
    from matplotlib.collections import LineCollection, PolyCollection

    lines, faces = np.asarray(mesh.lines, dtype=np.int64), np.asarray(mesh.faces, dtype=np.int64)
    logs = np.log(values)
    if len(faces):
        faces = faces[np.argsort(eye[faces, 2].mean(axis=1))]
        skin = PolyCollection(list(eye[faces][:, :, :2]), edgecolors="white", linewidths=0.35, **look)
        skin.set_array(np.exp(logs[faces].mean(axis=1)))
        ax.add_collection(skin)
    if len(lines):
        ends = eye[lines][:, :, :2]
        ax.add_collection(LineCollection(list(ends), colors=PALE, linewidths=6.4, capstyle="round"))
        wires = LineCollection(list(ends), linewidths=5.2, capstyle="round", **look)
        wires.set_array(np.exp(logs[lines].mean(axis=1)))
        ax.add_collection(wires)


def _markers(
    ax: Axes,
    mesh: MeshPicture,
    eye: NDArray[np.float64],
    located: Sequence[int],
    sensors: Sequence[Marker],
    shakers: Sequence[Marker],
) -> None:
    """Supports, sensors, shakers, and the found place on top."""
    at = {int(n): k for k, n in enumerate(mesh.node_ids)}

    def points(nodes: Sequence[int], **how: Any) -> None:
        rows = [at[n] for n in dict.fromkeys(nodes) if n in at]
        if rows:
            ax.scatter(eye[rows, 0], eye[rows, 1], **how)

    points(mesh.supports, marker="s", s=26, facecolor="white", edgecolor=INK, linewidth=0.9, zorder=4, label="support")
    sensed = [m.node for m in sensors]
    points(sensed, marker="o", s=22, facecolor="white", edgecolor=INK, linewidth=0.9, zorder=5, label="sensor")
    points([m.node for m in shakers], marker="D", s=26, facecolor=INK, edgecolor="white", zorder=6, label="shaker")
    points(located, marker="o", s=150, facecolor="none", edgecolor=MARK, linewidth=2.2, zorder=7, label="found place")
