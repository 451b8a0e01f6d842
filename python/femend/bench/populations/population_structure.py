"""One of the structures of a population."""

from __future__ import annotations

from dataclasses import dataclass

from femend.bench.reading.compared import Compared
from femend.estimate.updating import UpdateResult

__all__ = ["OneStructure"]


@dataclass(frozen=True, eq=False)
class OneStructure:
    """A structure by its `name`: its recordings compared `before` and `after`, and what was `found` of it inside the
    population."""

    name: str
    before: tuple[Compared, ...]
    after: tuple[Compared, ...]
    found: UpdateResult
