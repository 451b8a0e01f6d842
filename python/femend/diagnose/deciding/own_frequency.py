"""The mode whose frequency the updated model had to put furthest from its own.

Every mode may differ from the deck's by what mesh and idealisation are known to be off by. A model that explains the
recordings with far more than that is not the one that was given: something is missing that no parameter of the study
does, a preload that softens the lowest mode or a member that was not named.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femend.diagnose.deciding.outcome import Diagnosis
from femend.diagnose.deciding.tuned_modes import deviations, put_off, tuned
from femend.numerals import plain

__all__ = ["OwnFrequency", "own_frequency"]


@dataclass(frozen=True, slots=True)
class OwnFrequency:
    """A mode at `freq` (Hz) that was put off by `shift` (relative), so many standard deviations (`deviations`) of what
    mesh and idealisation are known to be off by."""

    freq: float
    shift: float
    deviations: float

    @property
    def text(self) -> str:
        """What is said of it where it is far."""
        return (
            f"the updated model explains the recordings with the mode at {plain(self.freq, 3)} Hz "
            f"{100 * self.shift:+.1f} % off the frequency that its parameters give it, {plain(self.deviations, 2)} "
            "standard deviations of what mesh and idealisation are off by: name parameters that move this mode, or "
            "look for what was not modelled (preload, supports, masses)"
        )


def own_frequency(found: Diagnosis) -> OwnFrequency | None:
    """The mode that was put off by most standard deviations; None of a model whose modes are not tuned, and where the
    force was not recorded."""
    problem, null, reduced = found.problem, found.null, found.null.hypothesis.reduced
    if problem.n_tuned == 0 or problem.load is not None:
        return None
    off, without, own = deviations(problem, reduced, null.p), null.p.copy(), tuned(problem, reduced)
    without[own] = problem.prior(reduced)[0][own]
    freq, shift = put_off(problem, reduced, null.p, without)
    worst = int(np.argmax(off))
    return OwnFrequency(float(freq[worst]), float(shift[worst]), float(off[worst]))
