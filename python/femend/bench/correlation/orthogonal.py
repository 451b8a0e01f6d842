"""Orthogonality of a recording's shapes over the model's mass reduced to the sensors."""

from __future__ import annotations

from typing import Any

import numpy as np

from femend.analysis.tam import TamTable, tam_table
from femend.bench.reading.compared import Compared
from femend.bench.reading.sensor_rows import model_rows, sensor_rows
from femend.model import Model

__all__ = ["LARGEST", "orthogonality_of", "orthogonality_result"]

# a model of more DOFs is not reduced, since each reduction factors its stiffness
LARGEST = 20_000
METHODS = ("Guyan", "IRS", "SEREP", "hybrid")


def orthogonality_of(c: Compared, model: Model) -> TamTable | None:
    """Orthogonality and cross-orthogonality of the paired modes of `c` over the mass of `model` reduced to the sensors
    in several ways; None without two sensors at DOFs of their own, without a pair, or for a model that is too large.

    Sensors on rigid elements, and all but one of those at one DOF, are left out: the reduced mass has no row for them.
    """
    if model.fe.n_a > LARGEST or not c.n_pairs:
        return None
    rows, test = sensor_rows(c, model)
    if len(rows) < 2:
        return None
    a, b = c.comparison.pairing.a, c.comparison.pairing.b
    known = {(d.node, d.component): i for i, d in enumerate(c.modes.dofs)}
    where = [known.get(key, -1) for key in model_rows(model)]
    phi = np.where(np.array(where)[:, None] >= 0, c.modes.phi[np.maximum(where, 0)], 0.0)[:, b]
    K, M = model.matrices()
    return tam_table(K, M, rows, np.real(test[:, a]), phi, c.modes.freq[b], methods=METHODS)


def orthogonality_result(table: TamTable | None) -> list[dict[str, Any]] | None:
    """Plain values of a table; None for none."""
    if table is None:
        return None
    return [
        {
            "reduction": r.method,
            "status": r.status,
            "test": r.test.tolist(),
            "model": r.model.tolist(),
            "cross": r.cross.tolist(),
            "off_model": r.off_model,
            "off_test": r.off_test,
            "least_pair": r.least_pair,
            "off_cross": r.off_cross,
        }
        for r in table.rows
    ]
