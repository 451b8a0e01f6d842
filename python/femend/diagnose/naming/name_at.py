"""Naming at a place that is known: nothing has to be located, so that a single sensor is enough.

Places are told apart by what a free force at each leaves unexplained, and with one sensor a free force anywhere leaves
nothing; `locate` leaves such places out. A test rig with one mass, or a joint everybody suspects, still asks which law.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femend.diagnose.locating.dressed import hypothesis_of
from femend.diagnose.locating.locate import Located, squares_of
from femend.diagnose.locating.split import split_records
from femend.diagnose.naming.judge import Given, to_beat
from femend.diagnose.naming.name import name_physics
from femend.diagnose.naming.ranked import Ranked, told_simply
from femend.diagnose.settings import Settings
from femend.diagnose.updating.update import UpdatedModel
from femend.errors import RecordingError
from femend.estimate import Problem
from femend.model import Place
from femend.threads import one_blas_thread

__all__ = ["NamedAt", "name_at"]


@dataclass(frozen=True, eq=False)
class NamedAt:
    """Laws at a place in rising order of score; `null_score` and `null_misfit` are those of the model without one,
    `problem` holds the records."""

    problem: Problem
    place: Place
    ranked: tuple[Ranked, ...]
    null_score: float
    null_misfit: float
    settings: Settings

    @property
    def best(self) -> Ranked:
        """The law with the lowest score."""
        return self.ranked[0]

    @property
    def accepted(self) -> bool:
        """Whether the best law wins by as much as a diagnosis asks for, on a record it has not seen."""
        gain = self.null_score - self.best.score
        seen = float(np.log(self.null_misfit / max(self.best.candidate.chosen, 1e-12)))
        return gain > self.settings.gain_cost and seen > self.settings.gain_chosen

    @property
    def adequate(self) -> bool:
        """Whether the best law comes as near to the noise as a diagnosis asks for before it gives a name."""
        candidate = self.best.candidate
        reference = candidate.reference if np.isfinite(candidate.reference) else candidate.chosen
        return candidate.chosen <= self.settings.adequate * max(reference, 1.0)


@one_blas_thread
def name_at(found: UpdatedModel, place: Place, settings: Settings | None = None) -> NamedAt:
    """Fits the selected laws at `place` of an updated model and ranks them on the record kept for choosing.

    The same code names as in a diagnosis, without the search for the place. Raises RecordingError where the place does
    not move in the model or no law can be fitted there.
    """
    settings = settings or Settings()
    problem, reduced, null = found.problem, found.reduced, found.null
    hypothesis = hypothesis_of(place, reduced)
    (free,) = problem.fit([hypothesis], [(problem.prior(hypothesis.reduced)[0], np.zeros(0))])
    if free is None:
        raise RecordingError(f"a force {place.where} cannot be fitted; the place does not move in the model")
    located = Located(place, free, squares_of(problem, free, 0.0))
    given = Given(split_records(problem, null, [located]), reduced, found.g_rows, null.p, settings)
    ranked, sigma = name_physics(given, [located])
    if not ranked:
        raise RecordingError(f"no law could be fitted {place.where}; the recordings do not show it moving")
    alone = to_beat(given, null, sigma)
    return NamedAt(problem, place, tuple(told_simply(ranked, settings)), alone.score, alone.candidate.chosen, settings)
