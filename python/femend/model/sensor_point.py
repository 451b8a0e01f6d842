"""A sensor between nodes: what it shows of the model's degrees of freedom."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["SensorPoint"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class SensorPoint:
    """A point `xyz` (3,) by a number `id` that no node has, on the element between `nodes` (ids), `distance` from it.

    `node` is the nearest of the model, in whose displacement frame its motion along three axes is the sum of `weights`
    (3, m) times the DOFs in `rows` (m,) of the g-set.
    """

    id: int
    xyz: FloatArray
    node: int
    nodes: tuple[int, ...]
    distance: float
    rows: NDArray[np.int64]
    weights: FloatArray
