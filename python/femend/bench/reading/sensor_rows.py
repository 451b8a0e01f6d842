"""Sensors of a comparison as rows of the model's matrices."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np
from numpy.typing import NDArray

from femend.bench.reading.compared import Compared
from femend.model import Model

__all__ = ["model_rows", "sensor_rows"]


def model_rows(model: Model) -> dict[tuple[int, int], int]:
    """The row of K and M of every independent DOF, by node and component."""
    fe = model.fe
    return {(int(n), int(k)): i for i, (n, k) in enumerate(zip(fe.dof_nodes, fe.dof_components, strict=True))}


def sensor_rows(c: Compared, model: Model, without: Collection[int] = ()) -> tuple[list[int], NDArray[Any]]:
    """Rows of K and M at which `c` has sensors, and the test's shapes (n_rows, n_test) there, along the model's axes.

    Sensors on rigid elements, between nodes, and all but one of those at one DOF, are left out: there are no rows for
    them; so are those in the rows `without` of the comparison.
    """
    row, match = model_rows(model), c.comparison.match
    at: dict[int, int] = {}  # row of the model: row of the comparison
    for i, j in enumerate(match.rows_b.tolist()):
        dof = c.modes.dofs[j]
        own = row.get((dof.node, dof.component))
        if own is not None and i not in without:
            at.setdefault(own, i)
    return list(at), np.asarray((match.sign[:, None] * c.comparison.phi_a)[list(at.values())])
