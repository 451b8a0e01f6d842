"""Geometry as a parameter: nodes that move together along a field of vectors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from femend.errors import ModelError

__all__ = ["Morph"]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Morph:
    """Nodes `nodes` (n,) at x + amplitude * `field`, `field` (n, 3) in basic axes; the amplitude is 0 in the deck.

    The field has lengths of the deck per unit of amplitude: with vectors of length one the amplitude is how far nodes
    move, with x - centre it is a relative growth. `prior_sd` is the amplitude's 1-sigma, `bounds` its limits, both in
    `unit`, a name to show ("" where the amplitude has none). Raises ModelError for a field that is not (n, 3), is not
    finite or moves nothing, nodes that stand twice, a `prior_sd` that is not above 0, and bounds without 0 in them.

    >>> Morph("arm", [7], [(0.0, 0.0, 1.0)], prior_sd=2e-3, unit="m").field.tolist()
    [[0.0, 0.0, 1.0]]
    """

    name: str
    nodes: NDArray[np.int64]
    field: FloatArray
    prior_sd: float
    bounds: tuple[float, float] | None = None
    unit: str = ""

    def __init__(
        self,
        name: str,
        nodes: ArrayLike,
        field: ArrayLike,
        prior_sd: float,
        bounds: tuple[float, float] | None = None,
        unit: str = "",
    ) -> None:
        ids = np.atleast_1d(np.asarray(nodes))
        vectors = _numbers(name, field)
        if ids.ndim != 1 or not np.issubdtype(ids.dtype, np.integer):
            raise ModelError(f"morph {name!r}: its nodes are {ids.dtype} {ids.shape}; give node ids (n,)")
        if vectors.shape != (ids.size, 3):
            raise ModelError(
                f"morph {name!r}: its field has shape {vectors.shape} for {ids.size} nodes; give ({ids.size}, 3), one "
                "vector in basic axes for each node"
            )
        bad = np.flatnonzero(~np.isfinite(vectors).all(axis=1))
        if bad.size:
            at = vectors[bad[0]].tolist()
            raise ModelError(f"morph {name!r}: the vector of node {ids[bad[0]]} is {at}; give finite numbers")
        unique, counts = np.unique(ids, return_counts=True)
        if np.any(counts > 1):
            raise ModelError(
                f"morph {name!r}: node {unique[counts > 1][0]} stands {counts.max()} times in it; once is meant"
            )
        if not np.any(vectors):
            raise ModelError(f"morph {name!r}: its field moves none of its {ids.size} nodes; give vectors other than 0")
        if not prior_sd > 0:
            raise ModelError(
                f"morph {name!r}: its prior has a standard deviation of {prior_sd:g}; it takes one above 0"
            )
        if bounds is not None and not (bounds[0] <= 0 <= bounds[1] and bounds[0] < bounds[1]):
            raise ModelError(
                f"morph {name!r}: its bounds are {bounds[0]:g} to {bounds[1]:g}; they have 0, the deck as it stands, "
                "between them"
            )
        moving = np.any(vectors, axis=1)
        for key, value in (
            ("name", str(name)),
            ("nodes", ids[moving].astype(np.int64)),
            ("field", np.ascontiguousarray(vectors[moving])),
            ("prior_sd", float(prior_sd)),
            ("bounds", None if bounds is None else (float(bounds[0]), float(bounds[1]))),
            ("unit", unit),
        ):
            object.__setattr__(self, key, value)

    @classmethod
    def of(
        cls,
        name: str,
        vectors: Mapping[int, ArrayLike],
        prior_sd: float,
        bounds: tuple[float, float] | None = None,
        unit: str = "",
    ) -> Morph:
        """The morph `name` of `vectors` (3,) by node id; `prior_sd`, `bounds` and `unit` as of the class.

        Raises ModelError as the class does, and for a vector that is not (3,).

        >>> Morph.of("arm", {7: (0.0, 0.0, 1.0)}, 2e-3).nodes.tolist()
        [7]
        """
        rows = [_numbers(name, v) for v in vectors.values()]
        for node, row in zip(vectors, rows, strict=True):
            if row.shape != (3,):
                raise ModelError(f"morph {name!r}: the vector of node {node} has shape {row.shape}; give (3,)")
        if not rows:
            raise ModelError(f"morph {name!r} has no node; give vectors (3,) by node id")
        return cls(name, np.array(list(vectors)), np.array(rows), prior_sd, bounds, unit)


def _numbers(name: str, values: ArrayLike) -> FloatArray:
    try:
        return np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ModelError(f"morph {name!r}: its field is no array of numbers ({error}); give (n, 3)") from error
