"""What recordings are off by as a whole: forces or sensors that do not show what acted or moved, where and when it did.

Fits are of records without it; predictions are of what would be recorded with it.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any

from numpy.typing import NDArray

from femend.estimate import FitRecord

__all__ = ["RecordedOff"]


class RecordedOff(ABC):
    """Something that all recordings are off by."""

    def driving(self, record: FitRecord) -> FitRecord:
        """The record with its forces as they acted; as it is where these are right."""
        return record

    def heard(self, record: FitRecord, y: NDArray[Any]) -> NDArray[Any]:
        """Responses y (n_out, n) of a record's sensors as these show them; as they are where sensors are right."""
        return y

    def on(self, record: FitRecord) -> FitRecord:
        """The record without it, for fits."""
        return self.driving(record)

    @abstractmethod
    def text(self, names: Sequence[str], node_ids: Sequence[int], dt: float) -> str:
        """What is said of it: the recordings' `names`, the model's `node_ids` and the step `dt` (s) of the
        recordings."""
