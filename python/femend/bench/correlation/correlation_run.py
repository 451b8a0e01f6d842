"""A finished correlation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from femend.analysis.tam import TamTable
from femend.bench.correlation.correlation_words import correlation_text
from femend.bench.correlation.where_wrong import WhereWrong
from femend.bench.reading.compared import Compared
from femend.bench.reading.prepared import Prepared
from femend.bench.reading.run_compared import ComparedRun
from femend.bench.reading.runs import in_order
from femend.study.file.study import Study

__all__ = ["CorrelationRun"]


@dataclass(frozen=True, eq=False, repr=False)
class CorrelationRun:
    """A finished correlation: what was `prepared`, each recording `compared`, the orthogonality of its shapes
    over reduced masses (`tams`, None where there is none), the rotor's `runs` compared, where the deck is `wrong` by
    each recording (None where that is not looked for), and the `result` as it is written."""

    prepared: Prepared
    compared: tuple[Compared, ...]
    tams: tuple[TamTable | None, ...]
    result: dict[str, Any]
    runs: tuple[ComparedRun, ...] = ()
    wrong: tuple[WhereWrong | None, ...] = ()

    @property
    def study(self) -> Study:
        """The study."""
        return self.prepared.study

    def __getitem__(self, recording: str) -> Compared:
        """The comparison of a recording by name; raises KeyError where it has none."""
        for one in self.compared:
            if one.measured.name == recording:
                return one
        raise KeyError(f"no recording {recording!r}; there are {', '.join(c.measured.name for c in self.compared)}")

    def run(self, recording: str, order: float = 1.0) -> ComparedRun:
        """The comparison of a rotor's run in an `order`, or of the held speeds that a recording is one of, by the
        recording's name; raises KeyError where there is none."""
        for one in self.runs:
            if one.measured.of(recording) and one.measured.order == order:
                return one
        there = ", ".join(f"{r.measured.name}{in_order(r.measured.order)}" for r in self.runs)
        raise KeyError(f"no run {recording!r}{in_order(order)}; there are {there or 'none'}")

    def __repr__(self) -> str:
        return correlation_text(self.result)
