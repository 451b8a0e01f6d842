"""Pressures on a surface as a few shape functions: polynomials over it, or the shapes of modes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.errors import ModelError
from femend.model.surfaces.faces import Surface, nodal_loads

__all__ = ["PressurePatterns", "modal_patterns", "polynomial_patterns"]

FloatArray = NDArray[np.float64]

# a pattern of which less than this is left beside the others adds nothing
INDEPENDENT = 1e-6


@dataclass(frozen=True, eq=False)
class PressurePatterns:
    """`values` (n_nodes, m) of m pressures `names` at the nodes of a `surface`, each with largest magnitude 1."""

    surface: Surface
    values: FloatArray
    names: tuple[str, ...]

    def loads(self) -> FloatArray:
        """Nodal forces (n_g, m) of one unit of each pattern."""
        return nodal_loads(self.surface, self.values)

    def select(self, patterns: list[int]) -> PressurePatterns:
        """Some of the `patterns`, by position."""
        return PressurePatterns(self.surface, self.values[:, patterns], tuple(self.names[i] for i in patterns))


def polynomial_patterns(surface: Surface, degree: int) -> PressurePatterns:
    """All products s^i t^j with i + j <= `degree` of the coordinates along the surface's two longest axes, -1 to 1.

    The axes are the principal ones of the nodes. Raises ModelError for a negative degree.
    """
    if degree < 0:
        raise ModelError(f"polynomials of degree {degree} on a surface: the least is 0, a uniform pressure")
    x = surface.model.xyz[surface.at]
    centred = x - x.mean(axis=0)
    axes = np.linalg.svd(centred, full_matrices=False)[2][:2]
    along = centred @ axes.T
    middle, half = 0.5 * (along.max(axis=0) + along.min(axis=0)), 0.5 * np.ptp(along, axis=0)
    s, t = ((along - middle) / np.where(half > 0, half, 1.0)).T
    powers = [(i, d - i) for d in range(degree + 1) for i in range(d, -1, -1)]
    values = np.column_stack([s**i * t**j for i, j in powers])
    return _independent(surface, values, ["uniform" if i + j == 0 else _text(i, j) for i, j in powers])


def _text(i: int, j: int) -> str:
    parts = [f"{name}^{n}" if n > 1 else name for name, n in (("s", i), ("t", j)) if n]
    return "pressure " + " ".join(parts)


def modal_patterns(surface: Surface, phi: FloatArray, names: tuple[str, ...] = ()) -> PressurePatterns:
    """Pressures in the shapes of modes: `phi` (n_g, m) along the surface's normal at its nodes, called `names`.

    Load patterns of this kind excite one mode more than the others, and few of them make any smooth pressure (the
    modal load patterns of Guggenberger, Model Updating using Operational Data, EASC 2009). Raises
    ModelError for shapes of another length.
    """
    n_g = 6 * len(surface.model.node_ids)
    if phi.ndim != 2 or len(phi) != n_g:
        raise ModelError(f"shapes of shape {phi.shape} for a model of {n_g} DOFs; they must be (n_g, n_modes)")
    frames = surface.model.frames[surface.at]
    moved = phi.reshape(-1, 6, phi.shape[1])[surface.at, :3]
    basic = np.einsum("nij,nim->njm", frames, moved)
    values = np.einsum("nj,njm->nm", surface.normals(), basic)
    return _independent(surface, values, list(names) or [f"pressure of mode {i + 1}" for i in range(phi.shape[1])])


def _independent(surface: Surface, values: FloatArray, names: list[str]) -> PressurePatterns:
    """Patterns of largest magnitude 1, without those that depend on the ones before."""
    kept: list[int] = []
    Q = np.zeros((len(values), 0))
    for i, column in enumerate(values.T):
        size = float(np.linalg.norm(column))
        if size <= 1e-300:
            continue
        v = column / size
        for _ in range(2):
            v = v - Q @ (Q.T @ v)
        left = float(np.linalg.norm(v))
        if left > INDEPENDENT:
            Q = np.hstack([Q, (v / left)[:, None]])
            kept.append(i)
    chosen = values[:, kept]
    return PressurePatterns(surface, chosen / np.abs(chosen).max(axis=0), tuple(names[i] for i in kept))
