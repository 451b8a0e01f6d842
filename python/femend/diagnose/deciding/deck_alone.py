"""How near the updated deck comes by itself: modes may have a frequency of their own that no parameter makes.

A model that is fitted to recordings is also given what mesh and idealisation are known to be off by: a factor on each
mode's frequency, and what members and lumps scatter by. They are held near one, and a deck has no place for them. Where
parameters are held back or missing, they take over what these should do: the fit and its predictions are good, and the
deck that is written is not.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from femend.diagnose.deciding.outcome import Diagnosis
from femend.diagnose.deciding.plain_error import whole_errors
from femend.diagnose.deciding.tuned_modes import by_cards, put_off, tuned
from femend.numerals import plain

__all__ = ["DeckAlone", "deck_alone"]

# multiple of the error of the fitted model from which the deck's own is told; share of what the deck leaves as given
# from which its parameters explain little, where modes or members were given more than so many standard deviations of
# what mesh and idealisation are off by anyway: 0.1 % of a frequency is a tenth of a resonance of 1 % damping
TOLD, LITTLE, BEYOND = 1.5, 0.5, 1.0


@dataclass(frozen=True, slots=True)
class DeckAlone:
    """Errors on the fit recordings as a whole, as shares of what was recorded: of the deck as `given`, with its
    parameters updated and nothing else (`alone`), and as it was `fitted`; the mode whose frequency `freq` (Hz) differs
    most between the last two, and by which `shift`, relative; what modes and members were given is at most so many
    standard deviations (`deviations`) of what mesh and idealisation are known to be off by."""

    given: float
    alone: float
    fitted: float
    freq: float
    shift: float
    deviations: float

    @property
    def told(self) -> bool:
        """Whether the deck by itself is clearly further off."""
        return self.alone > TOLD * self.fitted

    @property
    def little(self) -> bool:
        """Whether what no card holds explains most of it, and the parameters little."""
        return self.told and self.alone > LITTLE * self.given and self.deviations > BEYOND

    @property
    def text(self) -> str:
        """What is said of it."""
        little = "the parameters of the study explain little: " if self.little else ""
        name = " Name parameters that move these modes, or widen prior_sd where one is held too near"
        return (
            f"{little}the updated deck by itself leaves {plain(100 * self.alone, 2)} % of the fitted recordings, "
            f"{plain(100 * self.fitted, 2)} % with what modes and members were given of their own (up to "
            f"{100 * self.shift:+.1f} % of a frequency, at {plain(self.freq, 3)} Hz), which predictions have and no "
            f"card of a deck can hold.{name if self.little else ''}"
        )


def deck_alone(found: Diagnosis) -> DeckAlone | None:
    """How near the deck comes with its parameters alone, where nothing is added to it; None where something is, or a
    force was not recorded. Damping ratios are as they were found: a deck has none of single modes either, but
    every solver takes them."""
    null, reduced = found.null, found.null.hypothesis.reduced
    if found.best is not None or found.further is not None or found.load is not None or found.problem.load is not None:
        return None
    own = slice(len(reduced.model.parameters), tuned(found.problem, reduced).stop)
    deviations = np.abs(null.p[own]) / found.problem.prior(reduced)[1][own]
    p = by_cards(found.problem, reduced, null.p)
    _, fitted = whole_errors(found)
    _, alone = whole_errors(replace(found, null=replace(null, p=p)))
    hypothesis, nominal = found.nominal
    _, given = whole_errors(replace(found, null=replace(null, hypothesis=hypothesis, p=nominal)))
    freq, shift = put_off(found.problem, reduced, null.p, p)
    worst = int(np.argmax(np.abs(shift)))
    return DeckAlone(given, alone, fitted, float(freq[worst]), float(shift[worst]), float(deviations.max(initial=0.0)))
