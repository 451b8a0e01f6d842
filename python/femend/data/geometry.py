"""Where the sensors are, as the test's own files say."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from femend.data._arrays import frozen
from femend.errors import RecordingError

__all__ = ["Geometry", "stated"]


@dataclass(frozen=True, slots=True, eq=False)
class Geometry:
    """Test nodes: `ids` (n,) and coordinates `xyz` (n, 3) in the length unit of the recording's unit system.

    `systems` (n,) are the numbers of their displacement systems and `unit` the length unit in m, as far as the file
    states them. Raises RecordingError for shapes that do not fit or coordinates that are not finite.
    """

    ids: NDArray[np.int64]
    xyz: NDArray[np.float64]
    systems: NDArray[np.int64] | None = None
    unit: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "ids", frozen(self.ids, np.int64))
        object.__setattr__(self, "xyz", frozen(self.xyz, np.float64))
        if self.ids.ndim != 1 or self.xyz.shape != (self.ids.size, 3):
            raise RecordingError(f"geometry: ids {self.ids.shape} and xyz {self.xyz.shape} do not fit (n,) and (n, 3)")
        if self.systems is not None:
            object.__setattr__(self, "systems", frozen(self.systems, np.int64))
            if self.systems.shape != self.ids.shape:
                raise RecordingError(f"geometry: {self.systems.size} systems for {self.ids.size} nodes; one each")
        if not np.isfinite(self.xyz).all():
            node = int(self.ids[~np.isfinite(self.xyz).all(axis=1)][0])
            raise RecordingError(f"geometry: the coordinates of node {node} are not finite; correct the test geometry")

    def __repr__(self) -> str:
        return f"Geometry({self.ids.size} nodes)"


def stated(geometries: Iterable[Geometry | None]) -> tuple[dict[int, NDArray[np.float64]], dict[int, int]]:
    """Coordinates and displacement systems of all nodes of some `geometries`, by node; of several the last counts."""
    places: dict[int, NDArray[np.float64]] = {}
    systems: dict[int, int] = {}
    for one in geometries:
        if one is not None:
            places.update(zip(one.ids.tolist(), one.xyz, strict=True))
            if one.systems is not None:
                systems.update(zip(one.ids.tolist(), one.systems.tolist(), strict=True))
    return places, systems
