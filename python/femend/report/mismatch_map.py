"""The mesh coloured by what a free force at each node leaves of the misfit, as SVG."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.numerals import plain
from femend.report.content import MismatchMap
from femend.report.mesh_view import drawn_mesh
from femend.report.svg import svg

__all__ = ["N_LEVELS", "lowest", "mismatch_figure", "on_mesh"]

# colours of the style sheet, the first for all that updating leaves, the last for the least
N_LEVELS = 8
_WIDTH, _HEIGHT, _KEY = 960.0, 430.0, 52.0


def on_mesh(found: MismatchMap, xyz: NDArray[np.float64], ids: NDArray[np.int64]) -> NDArray[np.float64]:
    """Shares (n,) at the mesh's nodes `ids` (n,), `xyz` (n, 3): a node that was not tried has that of the nearest one.

    NaN at all nodes where none of the map is in the mesh.
    """
    share = dict(zip(found.nodes.tolist(), found.share.tolist(), strict=True))
    values = np.array([share.get(int(n), np.nan) for n in ids])
    known = np.flatnonzero(np.isfinite(values))
    for k in np.flatnonzero(~np.isfinite(values)) if known.size else ():
        values[k] = values[known[np.argmin(((xyz[known] - xyz[k]) ** 2).sum(axis=1))]]
    return values


def lowest(share: NDArray[np.float64]) -> float:
    """The lower end of the colours' scale, whose upper end is 1: a third of a decade at least."""
    return float(min(max(float(np.nanmin(share)), 1e-6), 0.5))


def mismatch_figure(data: dict[str, Any], found: MismatchMap) -> str:
    """The first view of the mesh `data` (of `viewer_data`) in the colours of the map, with its key; "" for a map of
    other nodes."""
    xyz = np.asarray(data["xyz"], float).reshape(-1, 3)
    values = on_mesh(found, xyz, np.asarray(data["ids"], dtype=np.int64))
    if not np.isfinite(values).all():
        return ""
    low = lowest(found.share)
    levels = np.clip((N_LEVELS * np.log(values) / math.log(low)).astype(int), 0, N_LEVELS - 1)
    parts = drawn_mesh(data, _WIDTH, _HEIGHT, levels)
    label = "Mesh coloured by the share of the misfit that a free force at each node leaves"
    return svg(_WIDTH, _HEIGHT + _KEY, "".join(parts) + _key(low), label, "mesh map")


def _key(low: float) -> str:
    """The colours with the shares at their borders."""
    width, left = 44.0, 0.5 * (_WIDTH - 44.0 * N_LEVELS)
    parts = []
    for level in range(N_LEVELS):
        parts.append(
            f'<rect class="key m{level}" x="{left + width * level:g}" y="{_HEIGHT:g}" width="{width:g}" height="12"/>'
        )
    for border in range(0, N_LEVELS + 1, 2):
        text = f"{plain(100 * low ** (border / N_LEVELS), 2)} %"
        parts.append(f'<text x="{left + width * border:g}" y="{_HEIGHT + 28:g}" text-anchor="middle">{text}</text>')
    parts.append(
        f'<text class="name" x="{0.5 * _WIDTH:g}" y="{_HEIGHT + 44:g}" text-anchor="middle">share of the misfit that a '
        "free force there leaves</text>"
    )
    return "".join(parts)
