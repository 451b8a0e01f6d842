"""A mode or operating shape on the deformed geometry, seen as the report's mesh is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.dof import Dof
from femend.model import Model
from femend.report.content import MeshPicture
from femend.report.mesh_view import start_view, view_basis
from femend.report.plots.style import INK, MARK, PALE

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["draw_shape", "motion_of_model", "motion_of_nodes"]


def motion_of_nodes(shape: ArrayLike, dofs: Sequence[Dof], node_ids: ArrayLike) -> NDArray[Any]:
    """Translations (n_nodes, 3) of `node_ids` (n_nodes,) from `shape` (n_dof,) at `dofs`; 0 where there is no DOF.

    The directions of the DOFs are taken as X, Y, Z of the mesh, with their signs; rotations are left out. Raises
    ValueError where the sizes differ or no DOF belongs to a node of the mesh.

    >>> motion_of_nodes([2.0, 3.0], [Dof(7, 3, -1), Dof(8, 1)], [8, 7]).tolist()
    [[3.0, 0.0, 0.0], [0.0, 0.0, -2.0]]
    """
    values = np.asarray(shape)
    if values.shape != (len(dofs),):
        raise ValueError(f"a shape of {values.shape} for {len(dofs)} DOFs; give one column of the mode shapes")
    at = {int(n): i for i, n in enumerate(np.asarray(node_ids, dtype=np.int64))}
    motion = np.zeros((len(at), 3), dtype=np.result_type(values, 1.0))
    n_found = 0
    for dof, value in zip(dofs, values, strict=True):
        if dof.node in at and not dof.is_rotation:
            motion[at[dof.node], dof.component - 1] = dof.sign * value
            n_found += 1
    if n_found == 0:
        raise ValueError(f"none of the {len(dofs)} DOFs is a translation of one of the {len(at)} nodes of the mesh")
    return motion


def motion_of_model(model: Model, shape: ArrayLike) -> NDArray[Any]:
    """Translations (n_nodes, 3) of all nodes of `model`, along X, Y, Z, from `shape` (n_a,) at its free DOFs.

    Nodes tied to others (rigid elements, multipoint constraints) and nodes with a coordinate system of their own
    move as the model says. Raises ValueError for a shape of another size.
    """
    values = np.asarray(shape)
    if values.shape != (model.fe.n_a,):
        raise ValueError(f"a shape of {values.shape} for a model of {model.fe.n_a} free DOFs; give one column")
    moved = np.asarray(model.transformation() @ values).reshape(-1, 6)[:, :3]
    return np.einsum("nij,ni->nj", model.frames, moved)  # row i of a frame is its axis i


def draw_shape(
    ax: Axes,
    mesh: MeshPicture,
    motion: ArrayLike,
    *,
    scale: float = 0.12,
    phase: float | None = None,
    view: Mapping[str, Any] | None = None,
    measured: Mapping[int, ArrayLike] | None = None,
    colorbar: bool = False,
    title: str = "",
) -> None:
    """Draws `mesh` deformed by `motion` (n_nodes, 3), real or complex, over the undeformed one in grey.

    The largest motion is drawn as `scale` of the mesh's diagonal; colour is the size of the motion relative to it.
    Nodes of no element are dots. Of a complex motion the real part of motion * exp(i `phase`) is drawn, `phase` in
    degrees; by default the one that makes it largest. `view` is as `start_view` gives it. `measured` maps node ids to
    vectors (3,) in the scale of `motion`, drawn as arrows from the undeformed nodes: the test over the model. Raises
    ValueError for shapes that do not fit, values that are not finite, or a motion that is zero.
    """
    xyz = np.asarray(mesh.xyz, dtype=np.float64)
    full = np.asarray(motion)
    if full.shape != xyz.shape or not np.isfinite(full).all():
        raise ValueError(f"a motion of shape {full.shape} for {len(xyz)} nodes; give finite (n_nodes, 3)")
    turn = _turn(full, phase)
    moved = np.real(full * turn)
    size = np.linalg.norm(moved, axis=1)
    if not size.max() > 0:
        raise ValueError("the motion is zero at all nodes; there is no shape to draw")
    diagonal = float(np.linalg.norm(np.ptp(xyz, axis=0))) or 1.0
    factor = scale * diagonal / float(size.max())
    basis = view_basis(dict(view) if view is not None else start_view(xyz))
    before, after = xyz @ basis.T, (xyz + factor * moved) @ basis.T
    colored = _elements(ax, mesh, before, after, size / size.max())
    if measured:
        _arrows(ax, mesh, measured, turn, factor, basis)
    ends = np.concatenate([before[:, :2], after[:, :2]])
    margin = 0.03 * diagonal
    ax.set_xlim(ends[:, 0].min() - margin, ends[:, 0].max() + margin)
    ax.set_ylim(ends[:, 1].min() - margin, ends[:, 1].max() + margin)
    ax.set_aspect("equal")
    ax.set_axis_off()
    if title:
        ax.set_title(title)
    if colorbar:
        ax.figure.colorbar(colored, ax=ax, label="motion / largest motion", shrink=0.8)


def _elements(
    ax: Axes,
    mesh: MeshPicture,
    before: NDArray[np.float64],
    after: NDArray[np.float64],
    share: NDArray[np.float64],
) -> Any:
    """Faces, lines and loose nodes, deformed ones coloured over grey ones; the colour scale comes back."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.collections import LineCollection, PolyCollection
    from matplotlib.colors import Normalize

    look: dict[str, Any] = {"cmap": "viridis", "norm": Normalize(0.0, 1.0)}
    lines, faces = np.asarray(mesh.lines, dtype=np.int64), np.asarray(mesh.faces, dtype=np.int64)
    if len(faces):
        faces = faces[np.argsort(after[faces, 2].mean(axis=1))]  # from the back
        flat = before[faces][:, :, :2]
        ax.add_collection(PolyCollection(list(flat), facecolors="none", edgecolors=PALE, linewidths=0.4))
        skin = PolyCollection(list(after[faces][:, :, :2]), edgecolors=INK, linewidths=0.25, alpha=0.92, **look)
        skin.set_array(share[faces].mean(axis=1))
        ax.add_collection(skin)
    if len(lines):
        ax.add_collection(LineCollection(list(before[lines][:, :, :2]), colors=PALE, linewidths=0.8))
        wires = LineCollection(list(after[lines][:, :, :2]), linewidths=1.8, capstyle="round", **look)
        wires.set_array(share[lines].mean(axis=1))
        ax.add_collection(wires)
    loose = np.setdiff1d(np.arange(len(before)), np.concatenate([lines.ravel(), faces.ravel()]))
    if loose.size:  # points of a rigid body, masses: dots with their paths
        paths = np.stack([before[loose, :2], after[loose, :2]], axis=1)
        ax.add_collection(LineCollection(list(paths), colors=PALE, linewidths=0.8))
        ax.scatter(after[loose, 0], after[loose, 1], c=share[loose], s=12, zorder=4, **look)
    return ScalarMappable(**look)


def _turn(motion: NDArray[Any], phase: float | None) -> complex:
    if phase is not None:
        return complex(np.exp(1j * np.radians(phase)))
    if not np.iscomplexobj(motion):
        return 1.0 + 0.0j
    return complex(np.exp(-0.5j * np.angle(np.sum(motion**2))))  # the largest sum of squares of the real part


def _arrows(
    ax: Axes,
    mesh: MeshPicture,
    measured: Mapping[int, ArrayLike],
    turn: complex,
    factor: float,
    basis: NDArray[np.float64],
) -> None:
    at = {int(n): i for i, n in enumerate(mesh.node_ids)}
    unknown = sorted(set(measured) - set(at))
    if unknown:
        raise ValueError(f"measured node {unknown[0]} is not among the {len(at)} nodes of the mesh")
    start = np.asarray(mesh.xyz, dtype=np.float64)[[at[n] for n in measured]]
    along = np.array([np.real(np.asarray(v) * turn) for v in measured.values()], dtype=np.float64)
    foot, tip = start @ basis.T, (start + factor * along) @ basis.T
    ax.quiver(
        foot[:, 0],
        foot[:, 1],
        *(tip - foot).T[:2],
        angles="xy",
        scale_units="xy",
        scale=1.0,
        color=MARK,
        width=0.006,
        zorder=5,
        label="measured",
    )
