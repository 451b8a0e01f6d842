"""Which fields of which GRID change when nodes move."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from femend.io.deck import FieldChange
from femend.model.geometry.moved import amplitudes_of
from femend.model.model import Model

__all__ = ["grid_changes"]

# coordinates that differ by less than this share of the model's size differ by rounding
ROUNDING = 1e-13


def grid_changes(model: Model, amplitudes: Mapping[str, float]) -> list[FieldChange]:
    """Changed coordinate fields (X1, X2, X3: 4 to 6) of the nodes that morphs of `model` move, for `amplitudes` by
    name, in the system each GRID is given in; a coordinate that stays is left as it is written.

    Raises ModelError for a name that is no morph and DeckError for a GRID that cannot be read.
    """
    values = amplitudes_of(model, amplitudes)
    if not np.any(values):
        return []
    fields = model.fields
    nodes = fields.nodes.tolist()
    old = model.deck.grid_coordinates(nodes, fields.xyz)
    new = model.deck.grid_coordinates(nodes, fields.positions(values))
    size = float(np.linalg.norm(np.ptp(model.xyz, axis=0)))
    moved = np.abs(new - old) > ROUNDING * np.maximum(np.abs(old), size)
    return [FieldChange("GRID", nodes[i], 4 + int(c), float(new[i, c])) for i, c in np.argwhere(moved)]
