"""Modes that have frequencies of their own beside what was found: something else is off that no parameter moves.

Each mode of a fitted model may differ from the deck's by what mesh and idealisation are known to be off by. Where a
stiffness is off that is no parameter of the study, modes take that over far beyond it: recordings and predictions are
as good, but no card of the updated deck holds it, and the study's parameters have taken up a part of it too.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from femend.diagnose.deciding.outcome import Diagnosis
from femend.diagnose.deciding.plain_error import GROWN, whole_errors
from femend.diagnose.deciding.tuned_modes import by_cards, deviations, put_off
from femend.estimate import Problem
from femend.model import ReducedModel
from femend.numerals import listed, plain

__all__ = ["DeckWithLaw", "OwnMode", "deck_with_law", "strain_of_modes"]

FloatArray = NDArray[np.float64]

# standard deviations of what mesh and idealisation are off by, beyond which the frequency of a mode is no chance any
# more (of twenty modes one is, in one model of twenty); modes that are named
FAR, NAMED = 3.0, 4


@dataclass(frozen=True, slots=True)
class OwnMode:
    """Mode `number` (from 1) of the model without what was found, at `freq` (Hz), put off by `shift` (relative), so
    many standard deviations (`deviations`) of what mesh and idealisation are known to be off by."""

    number: int
    freq: float
    shift: float
    deviations: float

    @property
    def text(self) -> str:
        """The mode with its shift."""
        return f"mode {self.number} at {plain(self.freq, 3)} Hz by {plain(100 * self.shift, 2, signed=True)} %"


@dataclass(frozen=True, slots=True)
class DeckWithLaw:
    """Errors on the fit recordings as a whole, as shares of what was recorded: of the updated deck with what was found
    and nothing else (`alone`; infinite where its motion cannot be followed), and as it was `fitted`; the `modes` that
    were put far off, furthest first."""

    alone: float
    fitted: float
    modes: tuple[OwnMode, ...]

    @property
    def text(self) -> str:
        """What is said of it."""
        modes = listed((mode.text for mode in self.modes), NAMED)
        left = f"leaves {plain(100 * self.alone, 2)} %" if self.alone <= GROWN else "explains nothing"
        return (
            f"beside what was found, modes were given frequencies of their own, up to "
            f"{plain(self.modes[0].deviations, 2)} standard deviations of what mesh and idealisation are off by "
            f"({modes}, without what was found): the updated deck with what was found {left} of the fitted recordings, "
            f"{plain(100 * self.fitted, 2)} % with these frequencies, which predictions have and no card of a deck can "
            "hold. Something is off that no parameter of the study moves, and its parameters have taken up a part of "
            "it (their deviations are told wider for it): name parameters that move these modes, or widen prior_sd "
            "where one is held too near"
        )


def deck_with_law(found: Diagnosis) -> DeckWithLaw | None:
    """How near the updated deck with what was found comes by itself, where modes have frequencies of their own far
    beyond their prior; None where they have not, nothing was added to the model, or a force was not recorded."""
    added = found.best is not None or found.further is not None
    if not added or found.problem.load is not None:
        return None
    problem, reduced, p = _final(found)
    off = deviations(problem, reduced, p)
    if not off.max(initial=0.0) > FAR:
        return None
    _, fitted = whole_errors(found)
    without, alone = whole_errors(_by_cards(found))
    # what cannot be simulated is replaced by the model that has nothing added
    followed = alone if alone != without else np.inf
    freq, shift = put_off(problem, reduced, p, by_cards(problem, reduced, p))
    far = [int(i) for i in np.argsort(-off) if off[i] > FAR]
    modes = tuple(OwnMode(i + 1, float(freq[i]), float(shift[i]), float(off[i])) for i in far)
    return DeckWithLaw(followed, fitted, modes)


def strain_of_modes(found: Diagnosis) -> float:
    """Factor by which the final model's parameters are less certain than its fit tells, since modes are further off
    than their prior: root mean square of their deviations where one is far beyond it, at least 1.

    It is the ratio of Birge (Phys. Rev. 40, 1932) for the modes' frequencies.
    """
    off = deviations(*_final(found))
    if not off.max(initial=0.0) > FAR:
        return 1.0
    return max(1.0, float(np.sqrt(np.mean(off**2))))


def _final(found: Diagnosis) -> tuple[Problem, ReducedModel, FloatArray]:
    """The final model with its unknowns, and the problem that they are of."""
    if found.load is not None and found.by_load:
        return found.load.problem, found.load.fit.hypothesis.reduced, found.load.fit.p
    if found.further is not None:
        return found.problem, found.further.terms.joint.reduced, found.further.terms.p
    if found.best is None:
        return found.problem, found.null.hypothesis.reduced, found.null.p
    if found.best.joint is not None:
        return found.problem, found.best.joint.reduced, found.best.p
    hypothesis = found.null.hypothesis if found.place is None else found.place.fit.hypothesis
    return found.problem, hypothesis.reduced, found.best.p


def _by_cards(found: Diagnosis) -> Diagnosis:
    """The diagnosis with a final model that has nothing but what was updated and found."""
    problem, reduced, p = _final(found)
    alone, further = by_cards(problem, reduced, p), found.further
    best = None if found.best is None else replace(found.best, p=alone)
    return replace(
        found, best=best, further=None if further is None else replace(further, terms=replace(further.terms, p=alone))
    )
