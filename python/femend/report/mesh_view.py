"""The mesh as a static picture and as data for the viewer in the page.

Both start from the same view: a frame or plate in one plane is seen nearly face on, anything else from a corner.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.report.content import Marker, MeshPicture, ReportContent
from femend.report.svg import svg

__all__ = ["drawn_mesh", "start_view", "static_picture", "view_basis", "viewer_data"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_MAX_NODES = 5000
_AXES = {"X": (1.0, 0.0, 0.0), "Y": (0.0, 1.0, 0.0), "Z": (0.0, 0.0, 1.0)}


def direction_vector(text: str) -> tuple[tuple[float, float, float], bool] | None:
    """Vector of a direction text, and whether it is a rotation: "12:-Z", "Z", "RX"; None where it has no single one.

    >>> direction_vector("12:-Z")
    ((0.0, 0.0, -1.0), False)
    """
    part = text.rpartition(":")[2].strip().upper()
    sign = -1.0 if part.startswith("-") else 1.0
    part = part.lstrip("+-")
    rotation = part.startswith("R")
    axis = _AXES.get(part.removeprefix("R"))
    if axis is None:
        return None
    x, y, z = (sign * a + 0.0 for a in axis)
    return (x, y, z), rotation


def start_view(xyz: FloatArray) -> dict[str, Any]:
    """Up axis and angles (degrees) of the first view: {"up": "Z", "azimuth": .., "elevation": ..}."""
    if not len(xyz):
        return {"up": "Z", "azimuth": 35.0, "elevation": 22.0}
    extent = np.ptp(xyz, axis=0)
    flat = extent <= 1e-3 * max(float(extent.max()), 1e-30)
    if flat[2] and not flat[0] and not flat[1]:
        return {"up": "Y", "azimuth": 14.0, "elevation": 12.0}
    if flat[0] and not flat[1]:
        return {"up": "Z", "azimuth": -72.0, "elevation": 10.0}
    if flat[1]:
        return {"up": "Z", "azimuth": 18.0, "elevation": 10.0}
    return {"up": "Z", "azimuth": 35.0, "elevation": 22.0}


def viewer_data(content: ReportContent) -> dict[str, Any] | None:
    """What the viewer's script needs, small enough for a page; None without a mesh."""
    if content.mesh is None or not len(content.mesh.node_ids):
        return None
    more = {n for nodes, _ in content.further for n in nodes}
    keep = {*content.located, *content.ambiguous, *more, *(m.node for m in (*content.sensors, *content.shakers))}
    mesh, full = _simplified(content.mesh, keep), len(content.mesh.node_ids)
    index = {int(n): k for k, n in enumerate(mesh.node_ids)}
    supports = [index[n] for n in mesh.supports if n in index]
    return {
        "ids": [int(n) for n in mesh.node_ids],
        "xyz": [float(f"{v:.6g}") for v in np.asarray(mesh.xyz, float).ravel()],
        "lines": np.asarray(mesh.lines, int).ravel().tolist(),
        "faces": np.asarray(mesh.faces, int).ravel().tolist(),
        "supports": supports,
        "located": [index[n] for n in content.located if n in index],
        "ambiguous": [index[n] for n in content.ambiguous if n in index and n not in content.located],
        "direction": _direction(content.direction),
        "further": [
            {"nodes": [index[n] for n in nodes if n in index], "direction": _direction(text)}
            for nodes, text in content.further
        ],
        "sensors": _markers(content.sensors, index),
        "shakers": _markers(content.shakers, index),
        "view": start_view(np.asarray(mesh.xyz, float)),
        "unit": mesh.unit,
        "nodes_in_model": full,
    }


def _direction(text: str) -> dict[str, Any] | None:
    """A direction as the script needs it; None where a finding has none."""
    place = direction_vector(text) if text else None
    return None if place is None else {"vector": list(place[0]), "rotation": place[1]}


def static_picture(data: dict[str, Any], width: float = 640.0, height: float = 430.0) -> str:
    """The first view of `viewer_data` as SVG, for print and for readers without scripts."""
    parts = drawn_mesh(data, width, height)
    return svg(width, height, "".join(parts), "Mesh with sensors, shakers and the located place", "mesh")


def drawn_mesh(data: dict[str, Any], width: float, height: float, levels: IntArray | None = None) -> list[str]:
    """The SVG elements of the first view of `viewer_data`; `levels` (n,) of the nodes give faces and wires the classes
    m0, m1 ... of the style sheet."""
    xyz = np.asarray(data["xyz"], float).reshape(-1, 3)
    eye, depth, scale = _project(xyz, data["view"], width, height)
    arrow = 0.055 * math.hypot(width, height) / scale
    parts = _surface(data, eye, depth, levels) + _wires(data, eye, levels)
    for k in data["supports"]:
        parts.append(f'<path class="support" d="M{eye[k, 0]:.1f} {eye[k, 1]:.1f}l5 9h-10z"/>')
    for css, markers in (("sensor", data["sensors"]), ("shaker", data["shakers"])):
        for m in markers:
            node = xyz[m["node"]] + np.asarray(m.get("beside", (0.0, 0.0, 0.0)))
            along = arrow * np.asarray(m["vector"], float)
            # A force is drawn with its tip at the node, a sensor's direction starting from it.
            start, tip = (node - 1.6 * along, node - 0.2 * along) if css == "shaker" else (node, node + along)
            parts.append(_arrow(_place(start, xyz, data, width, height), _place(tip, xyz, data, width, height), css))
    for k in data["ambiguous"]:
        parts.append(f'<circle class="alike" cx="{eye[k, 0]:.1f}" cy="{eye[k, 1]:.1f}" r="8"/>')
    for located in (data["located"], *(place["nodes"] for place in data["further"])):
        if len(located) == 2:
            (x1, y1), (x2, y2) = eye[located[0]], eye[located[1]]
            parts.append(f'<path class="link" d="M{x1:.1f} {y1:.1f}L{x2:.1f} {y2:.1f}"/>')
        for k in located:
            x, y = float(eye[k, 0]), float(eye[k, 1])
            parts.append(f'<circle class="located" cx="{x:.1f}" cy="{y:.1f}" r="9"/>')
            if len(located) < 4:
                parts.append(f'<text class="located" x="{x + 13:.1f}" y="{y - 9:.1f}">node {data["ids"][k]}</text>')
    return parts


def _markers(markers: tuple[Marker, ...], index: dict[int, int]) -> list[dict[str, Any]]:
    found = []
    for m in markers:
        direction = direction_vector(m.dof)
        vector = m.vector if m.vector is not None else None if direction is None else direction[0]
        if m.node in index and vector is not None:
            rotation = direction is not None and direction[1]
            label = m.dof if not m.label or m.label == m.dof else f"{m.dof} ({m.label})"
            found.append({"node": index[m.node], "vector": list(vector), "rotation": rotation, "label": label})
            if any(m.beside):
                found[-1]["beside"] = list(m.beside)
    return found


def view_basis(view: dict[str, Any]) -> FloatArray:
    """Rows: right, up and towards the viewer, in model coordinates."""
    a, e = math.radians(view["azimuth"]), math.radians(view["elevation"])
    right = [math.cos(a), -math.sin(a), 0.0]
    toward = [-math.sin(a) * math.cos(e), -math.cos(a) * math.cos(e), math.sin(e)]
    rows = np.array([right, np.cross(toward, right), toward])
    if view["up"] == "Y":  # drawn as if Z were up: (x, -z, y) takes the place of (x, y, z)
        rows = rows @ np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    return rows


def _frame(xyz: FloatArray, view: dict[str, Any], width: float, height: float) -> tuple[FloatArray, FloatArray, float]:
    """Basis, middle and scale that fit the mesh into the picture with room for arrows."""
    basis = view_basis(view)
    flat = xyz @ basis.T
    low, high = flat.min(axis=0), flat.max(axis=0)
    size = np.maximum(high - low, 1e-30)
    margin = 70.0
    scale = min((width - 2 * margin) / size[0], (height - 2 * margin) / size[1])
    if not math.isfinite(scale) or scale > 1e25:
        scale = 1.0
    return basis, 0.5 * (low + high), float(scale)


def _project(
    xyz: FloatArray, view: dict[str, Any], width: float, height: float
) -> tuple[FloatArray, FloatArray, float]:
    basis, middle, scale = _frame(xyz, view, width, height)
    flat = xyz @ basis.T - middle
    return np.column_stack([width / 2 + scale * flat[:, 0], height / 2 - scale * flat[:, 1]]), flat[:, 2], scale


def _place(point: FloatArray, xyz: FloatArray, data: dict[str, Any], width: float, height: float) -> FloatArray:
    basis, middle, scale = _frame(xyz, data["view"], width, height)
    flat = basis @ point - middle
    return np.array([width / 2 + scale * flat[0], height / 2 - scale * flat[1]])


def _surface(data: dict[str, Any], eye: FloatArray, depth: FloatArray, levels: IntArray | None) -> list[str]:
    faces = np.asarray(data["faces"], int).reshape(-1, 4)
    if not len(faces):
        return []
    css = [""] * len(faces) if levels is None else [f" m{m}" for m in np.rint(levels[faces].mean(axis=1)).astype(int)]
    parts = []
    for i in np.argsort(depth[faces].mean(axis=1)):
        corners = dict.fromkeys(faces[i].tolist())
        path = "L".join(f"{eye[k, 0]:.1f} {eye[k, 1]:.1f}" for k in corners)
        parts.append(f'<path class="face{css[i]}" d="M{path}Z"/>')
    return parts


def _wires(data: dict[str, Any], eye: FloatArray, levels: IntArray | None) -> list[str]:
    lines = np.asarray(data["lines"], int).reshape(-1, 2)
    if not len(lines):
        return []
    at = np.zeros(len(lines), int) if levels is None else np.rint(levels[lines].mean(axis=1)).astype(int)
    parts = []
    for level in np.unique(at):
        path = "".join(
            f"M{eye[a, 0]:.1f} {eye[a, 1]:.1f}L{eye[b, 0]:.1f} {eye[b, 1]:.1f}" for a, b in lines[at == level]
        )
        parts.append(f'<path class="wire{"" if levels is None else f" m{level}"}" d="{path}"/>')
    ends = np.unique(lines)
    dots = "".join(f"M{x:.1f} {y:.1f}h0" for x, y in eye[ends]) if len(ends) <= 400 else ""
    return [*parts, f'<path class="nodes" d="{dots}"/>' if dots else ""]


def _arrow(start: FloatArray, tip: FloatArray, css: str) -> str:
    along = tip - start
    length = float(np.hypot(*along))
    if length < 2.0:  # points at the viewer
        return f'<circle class="{css}" cx="{start[0]:.1f}" cy="{start[1]:.1f}" r="5"/>'
    u = along / length
    n = np.array([-u[1], u[0]])
    a, b = tip - 8 * u + 4 * n, tip - 8 * u - 4 * n
    return (
        f'<path class="{css}" d="M{start[0]:.1f} {start[1]:.1f}L{tip[0]:.1f} {tip[1]:.1f}'
        f'M{a[0]:.1f} {a[1]:.1f}L{tip[0]:.1f} {tip[1]:.1f}L{b[0]:.1f} {b[1]:.1f}"/>'
    )


def _simplified(mesh: MeshPicture, keep: set[int]) -> MeshPicture:
    """A mesh of at most about 5000 nodes: nodes in one cell of a grid become one; nodes in `keep` stay themselves."""
    n = len(mesh.node_ids)
    if n <= _MAX_NODES:
        return mesh
    xyz = np.asarray(mesh.xyz, float)
    ids = np.asarray(mesh.node_ids, int)
    used = np.unique(np.concatenate([np.ravel(mesh.lines), np.ravel(mesh.faces)]).astype(int))
    kept = np.isin(ids, np.fromiter(keep, int, len(keep)))
    extent = np.maximum(np.ptp(xyz, axis=0), 1e-30)
    cells = 400
    while True:
        grid = np.floor((xyz - xyz.min(axis=0)) / extent.max() * cells).astype(np.int64)
        code = grid @ np.array([1, 4096, 4096 * 4096], dtype=np.int64)
        code[kept] = -1 - np.arange(int(kept.sum()))
        _, first, group = np.unique(code, return_index=True, return_inverse=True)
        shown = np.unique(np.concatenate([group[used], group[kept]]))
        if len(shown) <= _MAX_NODES or cells <= 4:
            break
        cells = int(cells * 0.8)
    compact = np.full(len(first), -1)
    compact[shown] = np.arange(len(shown))
    lines = np.unique(np.sort(compact[group[np.asarray(mesh.lines, int)]], axis=1), axis=0)
    faces = compact[group[np.asarray(mesh.faces, int)]].reshape(-1, 4)
    whole = np.array([len(set(f)) >= 3 for f in faces.tolist()], dtype=bool)
    faces = faces[whole]
    if len(faces):
        _, unique = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
        faces = faces[np.sort(unique)]
    lines = lines[lines[:, 0] != lines[:, 1]] if len(lines) else lines.reshape(0, 2)
    return MeshPicture(ids[first[shown]], xyz[first[shown]], lines, faces, mesh.supports, mesh.unit)
