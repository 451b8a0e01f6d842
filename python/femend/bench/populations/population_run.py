"""A finished population."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from femend.bench.populations.population_result import population_text
from femend.bench.populations.population_structure import OneStructure
from femend.bench.reading.prepared import Prepared
from femend.estimate.updating import Population, UpdatedDeck
from femend.study.file.study import Study

__all__ = ["PopulationRun"]


@dataclass(frozen=True, eq=False, repr=False)
class PopulationRun:
    """A finished population: what was `prepared` and `found`, its `structures`, the `deck` with the mean values, and
    the `result` as it is written."""

    prepared: Prepared
    found: Population
    structures: tuple[OneStructure, ...]
    deck: UpdatedDeck
    result: dict[str, Any]

    @property
    def study(self) -> Study:
        """The study."""
        return self.prepared.study

    def __repr__(self) -> str:
        return population_text(self.result)
