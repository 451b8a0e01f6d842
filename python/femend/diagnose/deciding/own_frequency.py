"""The mode whose frequency the updated model had to put furthest from its own.

Every mode may differ from the deck's by what mesh and idealisation are known to be off by. A model that explains the
recordings with far more than that is not the one that was given: something is missing that no parameter of the study
does, a preload that softens the lowest mode or a member that was not named.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femend.diagnose.deciding.outcome import Diagnosis
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
    null, reduced, n_tuned = found.null, found.null.hypothesis.reduced, found.problem.n_tuned
    if n_tuned == 0 or found.problem.load is not None:
        return None
    tuned = slice(len(reduced.names), len(reduced.names) + n_tuned)
    mean, sd = found.problem.prior(reduced)
    deviations = np.abs(null.p[tuned] - mean[tuned]) / sd[tuned]
    worst = int(np.argmax(deviations))
    p = null.p.copy()
    p[tuned] = mean[tuned]
    freq, without = (found.problem.modes(reduced, at)[0][worst] / (2 * np.pi) for at in (null.p, p))
    return OwnFrequency(float(freq), float(freq / max(without, 1e-300) - 1), float(deviations[worst]))
