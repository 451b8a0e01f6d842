"""A test's geometry in another unit than the model's, whose sensors lie between the model's nodes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from femend.correlate import Alignment
from femend.correlate.alignment import AXES_NEAR, posed, unit_scales
from femend.model.sensor_point import SensorPoint

__all__ = ["in_unit_alone"]

FloatArray = NDArray[np.float64]


def in_unit_alone(
    found: Alignment,
    nodes: Sequence[int],
    places: Mapping[int, FloatArray],
    xyz: FloatArray,
    on: float,
    points_at: Callable[[Mapping[int, FloatArray]], Mapping[int, SensorPoint]],
) -> Alignment | None:
    """The geometry in the one unit in which all test `nodes` at their `places` lie within `on` of elements of the model
    or its nodes at `xyz` (n, 3), without a turn or with the one `found`, and without a shift. None where there is no
    such unit, or all lie on nodes as found.

    Alignment knows nodes alone: brought onto them, sensors between would be scaled by some per cent and moved by up to
    the mesh's pitch. `points_at` gives the points between nodes of test nodes at their places.
    """
    if found.distance.max() <= on:
        return None
    test = np.array([places[n] for n in nodes])
    none, turn = np.eye(3), np.rint(found.R)
    along_axes = np.allclose(found.R, turn, atol=AXES_NEAR)
    for R in [none, turn] if along_axes and (turn != none).any() else [none]:
        fits = []
        for scale in unit_scales(test, xyz):
            at = scale * test @ R.T
            points = points_at(dict(zip(nodes, at, strict=True)))
            rest = [i for i, n in enumerate(nodes) if n not in points]
            at_nodes = all(float(np.linalg.norm(xyz - at[i], axis=1).min()) <= on for i in rest)
            if points and at_nodes and all(p.distance <= on for p in points.values()):
                fits.append(posed(test, xyz, R, scale))
        if len(fits) == 1:
            return fits[0]
    return None
