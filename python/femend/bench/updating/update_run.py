"""A finished update."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from femend.bench.reading.compared import Compared
from femend.bench.reading.prepared import Prepared
from femend.bench.reading.run_compared import ComparedRun
from femend.bench.updating.counted import Counted
from femend.bench.updating.counted_runs import CountedRun
from femend.bench.updating.drawn import Drawn
from femend.bench.updating.starts import Starts
from femend.bench.updating.strength import Strength
from femend.bench.updating.surface_start import SurfaceStart
from femend.bench.updating.update_words import update_text
from femend.estimate.updating import Problem, Sensitivity, UpdatedDeck, UpdateResult
from femend.io.updated_files import updated_files
from femend.study.file.study import Study

__all__ = ["UpdateRun"]


@dataclass(frozen=True, eq=False, repr=False)
class UpdateRun:
    """A finished update: what was `prepared` and `counted`, the `problem` with what its data can tell
    (`sensitivity`), what was `found`, every fit and validate recording compared `before` and `after`, the changed
    `deck`, and the `result` as it is written; the searches from other `starts` and the `drawn` posterior where the
    study asks for them, the response `surface` that told where to begin, and the `strength` of the priors. Where
    the study asks for orders, the rotor's runs that count (`counted_runs`), and all of them compared before and
    after (`runs_before`, `runs_after`)."""

    prepared: Prepared
    counted: tuple[Counted, ...]
    problem: Problem
    sensitivity: Sensitivity
    found: UpdateResult
    before: tuple[Compared, ...]
    after: tuple[Compared, ...]
    deck: UpdatedDeck
    result: dict[str, Any]
    starts: Starts | None = None
    drawn: Drawn | None = None
    surface: SurfaceStart | None = None
    counted_runs: tuple[CountedRun, ...] = ()
    runs_before: tuple[ComparedRun, ...] = ()
    runs_after: tuple[ComparedRun, ...] = ()
    strength: Strength | None = None

    @property
    def study(self) -> Study:
        """The study."""
        return self.prepared.study

    @property
    def factors(self) -> dict[str, float]:
        """Factors of the deck's parameters by name, those of its fields last; of linked ones as they are in the deck as
        it is modelled; with a solver those of its values."""
        if self.prepared.solver is not None:
            return self.found.values
        found = self._of_the_deck
        return {p.name: found[p.name] for p in self.prepared.model.parameters}

    def updated_files(self) -> dict[str, bytes]:
        """The deck with what was found, or the input files of a solver, by the names they are written with."""
        if self.prepared.solver is not None:
            return {f"solver.updated.{path.name}": content for path, content in self.deck.files.items()}
        return updated_files(self.study.model_file, self.deck.files)

    @property
    def amplitudes(self) -> dict[str, float]:
        """Amplitudes of the study's morphs by name."""
        found = self._of_the_deck
        return {m.name: found[m.name] for m in self.study.updating.morph}

    @property
    def _of_the_deck(self) -> dict[str, float]:
        return self.prepared.of_the_deck(self.found.values)

    def __repr__(self) -> str:
        return update_text(self.result)
